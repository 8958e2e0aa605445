"""A fleet is run in the process of the test: rows, reports, what is computed again, and what becomes of files that break."""

import os
import pickle
from types import SimpleNamespace

import pytest

from compare.fleet.cache import Cache
from compare.fleet.command import with_reference
from compare.fleet.file_tasks import FileInfo, FleetOptions
from compare.fleet.models import found_models, place_of_report
from compare.fleet.run import AHEAD, AHEAD_PER_WORKER, Run
from compare.fleet.table import AGREE, BROKE, DIFFER, ITSELF, REFUSED
from compare.process.child import Outcome
from compare.process.crash import described

PENDULUM = ("<mujoco><worldbody><body name='b'><joint name='j' axis='0 1 0'/><inertial pos='0 0 {}' mass='1' "
            "diaginertia='1 1 1'/></body></worldbody></mujoco>")  # fmt: skip
ONE, TWO = {"a.xml": PENDULUM.format(0.1)}, {"a.xml": PENDULUM.format(0.1), "b.xml": PENDULUM.format(0.2)}
NONE = Outcome(error="none")


class Inside:
    """An executor in this process: tasks run one after the other, the lowest rank first."""

    count = 1

    def __init__(self, before=lambda task: None, times_alone=True, no_timing=None):
        self.before, self.times_alone, self.no_timing = before, times_alone, lambda: no_timing
        self.tasks, self.most, self.names, self.done = [], 0, [], []

    @property
    def under_way(self):
        return len(self.tasks)

    def submit(self, task):
        self.tasks.append(task)
        self.names.append(task.name)
        self.most = max(self.most, self.under_way)

    def next(self):
        task = min(self.tasks, key=lambda task: task.rank)
        self.tasks.remove(task)
        self.done.append(task.name)
        if outcome := self.before(task):
            return task, outcome
        try:
            value = task.function(*task.arguments, *([task.shared] if task.shared else []))
            return task, Outcome(pickle.dumps(value), seconds=1.0, wall=1.0, machine="here")
        except Exception as error:
            return task, Outcome(error=described(error))

    def workers(self):
        return 1


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """fleet(files, names of experiments): a fleet of files in a folder, run to its end."""
    monkeypatch.chdir(tmp_path)

    def run(files, names=("mass",), executor=None, found=None, is_quick=True, reference=None):
        for name, text in files.items():
            (tmp_path / "m" / name).parent.mkdir(parents=True, exist_ok=True)
            (tmp_path / "m" / name).write_text(text)
        cache, executor = Cache(tmp_path / "out"), executor or Inside()
        try:
            asked, sent = with_reference(FleetOptions(tuple(names), is_quick), reference)
            of = Run((found or found_models(["m"])).models, asked, executor, cache, tmp_path / "out", sent)
            of.carry_out(lambda: None)
        finally:
            cache.close()
        return SimpleNamespace(of=of, executor=executor, rows={os.path.basename(row["file"]): row for row in of.rows})

    return run


def report(tmp_path, name):
    return tmp_path / "out" / place_of_report(f"m/{name}")


def step_of(name):
    return name.rsplit(" of ", 1)[0]


def verdicts(found):
    return {name: row["verdict"] for name, row in found.rows.items()}


def test_files_agree_or_are_refused_with_the_reason_and_parts_are_left_out(fleet, tmp_path):
    found = fleet({
        "good.xml": PENDULUM.format(0.1), "broken.xml": "<mujoco><worldbody>", "none.xml": "<mujoco/>",
        "scene.xml": "<mujoco><include file='part.xml'/><include file='good.xml'/></mujoco>",
        "part.xml": "<mujoco><actuator><motor joint='j'/></actuator></mujoco>",
    }, ["parameters"])  # fmt: skip
    assert verdicts(found) == {"good.xml": ITSELF, "scene.xml": ITSELF, "broken.xml": REFUSED, "none.xml": REFUSED}
    ((part, why),) = found.of.parts
    assert part == "m/part.xml" and "m/scene.xml" in why and "joint" in found.rows["none.xml"]["reason"]
    assert found.rows["good.xml"]["joints"] == 1 and found.rows["good.xml"]["seconds"] > 2.0 and found.of.is_good
    assert (report(tmp_path, "good.xml") / "index.html").is_file() and not report(tmp_path, "none.xml").exists()
    assert fleet(ONE, ["published"]).rows["a.xml"]["verdict"] == REFUSED  # which serves the arm alone


def answered(task):
    """What a task returns, without computing it: an experiment the task's name."""
    name = task.name.encode()
    names = task.arguments[1].names if step_of(task.name) == "read" else ()
    values = {
        "speed, untimed": name,
        "read": FileInfo("", names, (("gravity", "no reason"),), 1, "Euler", 0.002),
        "report": ({"verdict": AGREE, "reason": "", "seconds": 1.0}, {"index.html": name}),
    }
    return Outcome(pickle.dumps(values.get(step_of(task.name), name)), seconds=1.0, wall=2.0, machine="far")


def answers(names=("mass", "speed"), **more):
    """What `fleet` is given, so that nothing is computed."""
    return {"names": names, "executor": Inside(before=answered)} | more


def test_what_has_changed_is_computed_anew_and_nothing_else(fleet, tmp_path):
    every = ["read", "mass", "speed, untimed", "speed", "report"]
    first, second = fleet(TWO, **answers()), fleet(TWO, **answers())
    assert len(first.executor.names) == 10 and second.executor.names == [] and second.of.files_cached == 2
    assert second.rows == first.rows
    third = fleet({"b.xml": PENDULUM.format(0.3), "b/a.xml": PENDULUM.format(0.4)}, **answers())
    assert set(third.executor.names) == {f"{step} of m/{name}" for name in ("b.xml", "b/a.xml") for step in every}
    for is_quick, names, computed in (
        (False, ("mass", "speed"), every),
        (True, ("mass", "speed"), ["report"]),
        (True, ("gravity",), ["read", "gravity", "report"]),
    ):
        found = fleet({}, found=found_models(["m/a.xml"]), is_quick=is_quick, **answers(names))
        assert [step_of(name) for name in found.executor.names] == computed
    for solution, computed in ((PENDULUM.format(0.1), 5), (PENDULUM.format(0.1), 0), (PENDULUM.format(0.2), 5)):
        (tmp_path / "solution.xml").write_text(solution)
        found = fleet({}, found=found_models(["m/a.xml"]), reference="solution.xml", **answers())
        assert len(found.executor.names) == computed


def test_each_file_is_timed_and_reported_with_what_was_found_of_itself(fleet):
    asked = {}

    def before(task):
        asked[task.name] = task
        return answered(task)

    fleet(TWO, **answers(executor=Inside(before=before)))
    for name in ("m/a.xml", "m/b.xml"):
        assert asked[f"speed of {name}"].arguments[:3] == ("speed", f"speed, untimed of {name}".encode(), name)
        have, left_out, seconds = asked[f"report of {name}"].arguments[:3]
        assert have == {step: f"{step} of {name}".encode() for step in ("mass", "speed")}
        assert (left_out, seconds) == ([("gravity", "no reason")], 4.0)
    assert {name for name, task in asked.items() if task.timed} == {"speed of m/a.xml", "speed of m/b.xml"}
    executor = Inside(before, no_timing="nobody may")
    fleet(ONE, **answers(executor=executor))
    name, why = asked["report of m/a.xml"].arguments[1][-1]
    assert name == "speed" and "nobody may" in why and "speed of m/a.xml" not in executor.names


@pytest.mark.parametrize("times_alone", [True, False])
def test_timed_tasks_of_a_pool_come_after_all_others_and_those_of_a_cluster_at_once(times_alone, fleet):
    outcomes = {"read": None, "speed, untimed": Outcome(pickle.dumps(b"work"))}
    executor = Inside(times_alone=times_alone, before=lambda task: outcomes.get(step_of(task.name), NONE))
    found = fleet(TWO, ["mass", "speed", "gravity"], executor)
    done = [step_of(name) for name in executor.done]
    assert done[:2] == ["read"] * 2 and all(row["verdict"] == BROKE for row in found.rows.values())
    if times_alone:
        assert done[-4:] == ["speed"] * 2 + ["report"] * 2
    else:  # each at once after what of it is no timing
        assert [done[k + 1] for k, step in enumerate(done) if step == "speed, untimed"] == ["speed"] * 2


def test_a_file_that_changes_or_goes_while_the_fleet_runs_breaks_off_alone(fleet, tmp_path):
    def before(task):
        if task.name == "read of m/a.xml":
            (tmp_path / "m" / "b.xml").write_text(PENDULUM.format(0.4))
            (tmp_path / "m" / "c.xml").unlink()
        return answered(task)

    found = fleet(TWO | {"c.xml": PENDULUM.format(0.3)}, executor=Inside(before=before))
    assert verdicts(found) == {"a.xml": AGREE, "b.xml": BROKE, "c.xml": BROKE} and not found.of.is_good


def test_an_experiment_that_breaks_off_is_in_the_report_and_tried_again(fleet, tmp_path):
    killed = Outcome(ended="ended by SIGKILL")
    executor = Inside(before=lambda task: killed if step_of(task.name) == "parameters" else None)
    found = fleet(ONE, ["parameters"], executor)
    reason = found.rows["a.xml"]["reason"]
    assert verdicts(found) == {"a.xml": BROKE} and "parameters" in reason and "SIGKILL" in reason
    assert "SIGKILL" in (report(tmp_path, "a.xml") / "report.md").read_text() and not found.of.is_good
    again = fleet(ONE, ["parameters"])
    assert (
        again.executor.names == ["parameters of m/a.xml", "report of m/a.xml"]
        and again.of.is_good
        and again.rows["a.xml"]["has_report"]
    )
    late = Outcome(ended="took longer than 1 s", is_late=True)
    executor = Inside(before=lambda task: late if step_of(task.name) == "report" else answered(task))
    row = fleet({"a.xml": PENDULUM.format(0.2)}, executor=executor).rows["a.xml"]
    assert row["verdict"] == BROKE and late.ended in row["reason"] and not row["has_report"]  # there is an earlier one


def test_few_tasks_and_their_models_are_in_memory_at_a_time_and_reports_do_not_wait_for_other_files(fleet):
    executor = Inside(before=lambda task: None if step_of(task.name) == "read" else NONE)
    found = fleet({f"{k}.xml": PENDULUM.format(0.1 + k) for k in range(2 * AHEAD)}, ["parameters", "mass"], executor)
    assert executor.most == AHEAD + AHEAD_PER_WORKER and not any(file.packed for file in found.of.files)
    done = [step_of(name) for name in executor.done]
    assert done.index("report") < len(done) - 1 - done[::-1].index("mass")  # of the last file


SOLUTION = PENDULUM.format(0.1)
HEAVY = SOLUTION.replace("mass='1'", "mass='2'")
CLASS = {
    "heavy.xml": HEAVY, "heavy_too.xml": HEAVY, "renamed.xml": SOLUTION.replace("name='j' ", ""),
    "slide.xml": SOLUTION.replace("axis", "type='slide' axis"), "right.xml": SOLUTION,
}  # fmt: skip


def test_all_files_are_compared_with_a_solution_and_joints_of_other_names_are_matched(fleet, tmp_path):
    (tmp_path / "solution.xml").write_text(SOLUTION)
    found = fleet(CLASS, ["parameters"], reference="solution.xml")
    named = {
        "heavy.xml": (DIFFER, "mass of b: stated 1 kg, compiled 2 kg"), "heavy_too.xml": (DIFFER, "m/heavy.xml"),
        "renamed.xml": (AGREE, "joint 0 as j"), "slide.xml": (DIFFER, "solution.xml"), "right.xml": (AGREE, ""),
    }  # fmt: skip
    assert verdicts(found) == {name: verdict for name, (verdict, _) in named.items()}
    assert all(word in found.rows[name]["reason"] for name, (_, word) in named.items())
    assert [name for name, row in found.rows.items() if not row["has_report"]] == ["slide.xml"]
    assert "--only parameters --reference solution.xml" in (report(tmp_path, "renamed.xml") / "report.md").read_text()
    assert not report(tmp_path, "heavy_too.xml").exists() and found.rows["heavy_too.xml"]["report_of"] == "m/heavy.xml"


def test_files_of_one_content_are_computed_once_if_what_they_load_is_the_same(fleet):
    text = "<mujoco><include file='part.xml'/></mujoco>"
    parts = {f"{name}/part.xml": PENDULUM.format(x) for name, x in (("a", 0.1), ("b", 0.1), ("c", 0.2))}
    found = fleet(parts | {f"{name}/scene.xml": text for name in "abc"}, **answers())
    scenes = {row["file"]: row["reason"] for row in found.of.rows if "scene" in row["file"]}
    assert [scenes[f"m/{name}/scene.xml"] != "" for name in "abc"] == [False, True, False]
    assert "m/a/scene.xml" in scenes["m/b/scene.xml"] and not any("m/b/scene" in name for name in found.executor.names)
