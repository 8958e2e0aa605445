"""A fleet is run: what is handed out and when, what is kept, and what becomes of files that change, break or are refused."""

import pickle

import pytest
from inside import PENDULUM, Inside, report

from compare.fleet.file_pieces import UNPACKED, unpacked_at
from compare.fleet.models import found_models
from compare.fleet.piece import Outcome
from compare.fleet.row import AGREE, BROKE, DIFFER, ITSELF, REFUSED
from compare.fleet.run import AHEAD_FOR_ALL, AHEAD_FOR_EACH


def test_files_agree_or_are_refused_with_the_reason_and_parts_are_left_out(fleet, tmp_path):
    found = fleet({
        "good.xml": PENDULUM.format(0.1), "broken.xml": "<mujoco><worldbody>", "none.xml": "<mujoco/>",
        "scene.xml": "<mujoco><include file='part.xml'/><include file='good.xml'/></mujoco>",
        "part.xml": "<mujoco><actuator><motor joint='j'/></actuator></mujoco>",
    })  # fmt: skip
    verdicts = {name: row["verdict"] for name, row in found.rows.items()}
    assert verdicts == {"good.xml": ITSELF, "scene.xml": ITSELF, "broken.xml": REFUSED, "none.xml": REFUSED}
    assert found.of.parts == [("m/part.xml", "no model of its own, and included by m/scene.xml")]
    assert found.rows["broken.xml"]["reason"].startswith("MuJoCo cannot compile it: ")
    assert found.rows["none.xml"]["reason"] == "it has no joint; at least one is expected"
    assert found.rows["good.xml"]["joints"] == 1 and found.rows["good.xml"]["seconds"] > 2.0
    assert found.of.is_good and found.of.files_done == len(found.of.tasks) == 5 and found.of.still() == []
    assert (report(tmp_path, "good.xml") / "index.html").is_file() and not report(tmp_path, "none.xml").exists()


def test_an_experiment_that_serves_no_file_of_its_kind_is_the_reason(fleet):
    row = fleet({"a.xml": PENDULUM.format(0.1)}, ["published"]).rows["a.xml"]
    assert row["verdict"] == REFUSED and row["reason"].startswith(
        "nothing can be compared: published: no printed numbers"
    )


def test_a_second_run_computes_nothing_and_a_changed_file_is_computed_anew(fleet, tmp_path):
    files = {"a.xml": PENDULUM.format(0.1), "b.xml": PENDULUM.format(0.2)}
    first, second = fleet(files), fleet(files)
    assert len(first.door.names) == 6 and second.door.names == [] and second.of.done_before == 2
    assert second.rows == first.rows
    third = fleet({"b.xml": PENDULUM.format(0.3)})
    assert third.door.names == ["read of m/b.xml", "mass of m/b.xml", "report of m/b.xml"]


def test_a_report_in_the_folder_that_was_made_of_other_experiments_is_made_again(fleet, tmp_path):
    files = {"a.xml": PENDULUM.format(0.1)}
    for names, steps in ((["mass"], "read mass report"), (["gravity"], "read gravity report"), (["mass"], "report")):
        assert fleet(files, names).door.names == [f"{step} of m/a.xml" for step in steps.split()]
        assert [path.stem for path in (report(tmp_path, "a.xml") / "tables").iterdir()] == names
    assert fleet(files).door.names == []


def test_a_file_that_changes_or_goes_while_the_fleet_runs_breaks_off_alone(fleet, tmp_path):
    files = {f"{name}.xml": PENDULUM.format(x) for name, x in zip("abc", (0.1, 0.3, 0.4))}

    def before(piece):
        if piece.name == "read of m/a.xml":
            (tmp_path / "m" / "b.xml").write_text(PENDULUM.format(0.2))
            (tmp_path / "m" / "c.xml").unlink()

    found = fleet(files, door=Inside(before=before))
    assert {name: row["verdict"] for name, row in found.rows.items()} == {
        "a.xml": ITSELF,
        "b.xml": BROKE,
        "c.xml": BROKE,
    }
    assert found.rows["b.xml"]["reason"] == "the file, or one that it needs, has changed since the fleet began"
    assert found.rows["c.xml"]["reason"] == "No such file or directory"
    assert fleet({}).rows["b.xml"]["verdict"] == ITSELF


def test_a_file_that_is_gone_before_it_is_read_is_refused(fleet, tmp_path):
    (tmp_path / "m" / "a.xml").write_text(PENDULUM.format(0.1))
    found = found_models(["m"])
    (tmp_path / "m" / "a.xml").unlink()
    row = fleet({}, found=found).rows["a.xml"]
    assert (row["verdict"], row["reason"], row["sha256"]) == (
        REFUSED,
        "it cannot be read: No such file or directory",
        "",
    )


def test_an_experiment_that_breaks_off_is_in_the_report_and_tried_again(fleet, tmp_path):
    files, killed = {"a.xml": PENDULUM.format(0.1)}, "ended by SIGKILL, 4 times"
    door = Inside(before=lambda piece: Outcome(ended=killed) if piece.name.startswith("mass") else None)
    found = fleet(files, ["mass", "gravity"], door)
    assert (found.rows["a.xml"]["verdict"], found.rows["a.xml"]["reason"]) == (BROKE, f"mass {killed}")
    assert not found.of.is_good and killed in (report(tmp_path, "a.xml") / "report.md").read_text()
    again = fleet(files, ["mass", "gravity"])
    assert again.door.names == ["mass of m/a.xml", "report of m/a.xml"] and again.of.is_good


@pytest.mark.parametrize("step", ["read", "report"])
def test_a_file_of_which_nothing_comes_back_breaks_off_with_the_reason(step, fleet):
    door = Inside(
        before=lambda piece: (
            Outcome(ended="took longer than 1 s", is_late=True) if piece.name.startswith(step) else None
        )
    )
    assert fleet({"a.xml": PENDULUM.format(0.1)}).rows["a.xml"]["has_report"]
    row = fleet({"a.xml": PENDULUM.format(0.2)}, door=door).rows["a.xml"]
    assert (row["verdict"], row["reason"]) == (BROKE, f"{step}: took longer than 1 s")
    assert not row["has_report"]  # the one in the folder is an earlier one


def test_few_pieces_and_their_models_are_in_memory_at_a_time(fleet):
    door = Inside(before=lambda piece: Outcome(error="none"))
    files = {f"{k:02}.xml": PENDULUM.format(0.1 + k) for k in range(3 * AHEAD_FOR_ALL)}
    found = fleet(files, door=door)
    assert door.most == AHEAD_FOR_ALL + AHEAD_FOR_EACH and len(found.rows) == len(files)
    assert not any(task.packed for task in found.of.tasks)


def test_without_timed_pieces_the_report_of_a_file_does_not_wait_for_other_files(fleet):
    door = Inside(before=lambda piece: None if piece.name.startswith("read") else Outcome(error="none"))
    fleet({f"{k:02}.xml": PENDULUM.format(0.1 + k) for k in range(AHEAD_FOR_ALL)}, ["mass", "gravity"], door)
    steps = [name.split(" ")[0] for name in door.done]
    assert steps.index("report") < len(steps) - 1 - steps[::-1].index("mass")  # of the last file


def test_a_process_keeps_the_files_of_few_models(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    bundles = [pickle.dumps({"up0/m.xml": str(k).encode(), "mesh.obj": b""}) for k in range(UNPACKED + 2)]
    places = [unpacked_at(bundle) for bundle in bundles]
    assert unpacked_at(bundles[-1]) == places[-1] and places[-1].read_text() == str(UNPACKED + 1)
    assert len(list(tmp_path.iterdir())) == UNPACKED
    assert unpacked_at(bundles[0]).read_text() == "0"


SOLUTION = PENDULUM.format(0.1)
CLASS = {
    "heavy.xml": SOLUTION.replace("mass='1'", "mass='2'"), "heavy_too.xml": SOLUTION.replace("mass='1'", "mass='2'"),
    "renamed.xml": SOLUTION.replace("name='j' ", ""), "slide.xml": SOLUTION.replace("axis", "type='slide' axis"),
    "right.xml": SOLUTION,
}  # fmt: skip


def test_all_files_are_compared_with_a_solution_and_joints_of_other_names_are_matched(fleet, tmp_path):
    (tmp_path / "solution.xml").write_text(SOLUTION)
    rows = fleet(CLASS, ["parameters"], reference="solution.xml").rows
    assert {name: (row["verdict"], row["reason"]) for name, row in rows.items()} == {
        "heavy.xml": (DIFFER, "mass of b: stated 1 kg, compiled 2 kg"),
        "heavy_too.xml": (DIFFER, "the same as m/heavy.xml: mass of b: stated 1 kg, compiled 2 kg"),
        "renamed.xml": (AGREE, "joints matched: joint 0 as j"),
        "slide.xml": (DIFFER, "joint j is a slide, that of solution.xml a hinge"),
        "right.xml": (AGREE, ""),
    }
    assert [name for name, row in rows.items() if not row["has_report"]] == ["slide.xml"]
    text = (report(tmp_path, "renamed.xml") / "report.md").read_text()
    assert "joints matched: joint 0 as j" in text and "--only parameters --reference solution.xml" in text
    assert not report(tmp_path, "heavy_too.xml").exists() and rows["heavy_too.xml"]["report_of"] == "m/heavy.xml"


def test_another_solution_is_another_fleet_and_the_same_computes_nothing(fleet, tmp_path):
    def verdict(text, reference="solution.xml"):
        (tmp_path / "solution.xml").write_text(text)
        found = fleet({"a.xml": SOLUTION}, ["parameters"], reference=reference)
        return found.rows["a.xml"]["verdict"], len(found.door.names)

    assert verdict(SOLUTION) == (AGREE, 3) and verdict(SOLUTION) == (AGREE, 0)
    assert verdict(CLASS["heavy.xml"]) == (DIFFER, 3) and verdict(SOLUTION, None) == (ITSELF, 3)
    assert verdict(SOLUTION)[0] == AGREE


def test_files_of_one_content_are_computed_once_if_what_they_load_is_the_same(fleet, tmp_path):
    text = "<mujoco><include file='part.xml'/></mujoco>"
    parts = {f"{name}/part.xml": PENDULUM.format(x) for name, x in (("a", 0.1), ("b", 0.1), ("c", 0.2))}
    found = fleet(parts | {f"{name}/scene.xml": text for name in "abc"})
    scenes = {row["file"]: row for row in found.of.rows if "scene" in row["file"]}
    assert [scenes[f"m/{name}/scene.xml"]["reason"] for name in "abc"] == ["", "the same as m/a/scene.xml", ""]
    assert not any("m/b/scene.xml" in name for name in found.door.names)
    assert found.of.files_done == found.of.files == len(found.of.rows) == 6
