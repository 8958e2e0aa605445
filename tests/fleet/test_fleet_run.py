"""A fleet is run: what is handed out and when, what is kept, and what becomes of files that change, break or are refused."""

import os
import pickle
from types import SimpleNamespace

import pytest

from compare.fleet.file_pieces import UNPACKED, Asked, Known, unpacked_at
from compare.fleet.kept import Kept
from compare.fleet.models import found_models, place_of_report
from compare.fleet.piece import Outcome
from compare.fleet.row import AGREE, BROKE, REFUSED
from compare.fleet.run import AHEAD_FOR_ALL, AHEAD_FOR_EACH, Run
from compare.process.crash import described

PENDULUM = ("<mujoco><worldbody><body name='b'><joint name='j' axis='0 1 0'/><inertial pos='0 0 {}' mass='1' "
            "diaginertia='1 1 1'/></body></worldbody></mujoco>")  # fmt: skip


class Inside:
    """A door to this process: pieces are carried out one after the other, those of the lowest rank first."""

    def __init__(self, workers=1, times_alone=True, before=lambda piece: None):
        self.count, self.times_alone, self.before = workers, times_alone, before
        self.pieces, self.most, self.names, self.done = [], 0, [], []

    @property
    def under_way(self):
        return len(self.pieces)

    def submit(self, piece):
        self.pieces.append(piece)
        self.names.append(piece.name)
        self.most = max(self.most, self.under_way)

    def next(self):
        piece = min(self.pieces, key=lambda piece: piece.rank)
        self.pieces.remove(piece)
        self.done.append(piece.name)
        if outcome := self.before(piece):
            return piece, outcome
        try:
            value = piece.function(*piece.arguments, *([piece.shared] if piece.shared else []))
            return piece, Outcome(pickle.dumps(value), seconds=1.0, wall=1.0, machine="here")
        except Exception as error:
            return piece, Outcome(error=described(error))

    def no_timing(self):
        return None

    def workers(self):
        return self.count

    def close(self):
        pass


@pytest.fixture
def fleet(tmp_path, monkeypatch):
    """fleet(files, names of experiments): a fleet of files in a folder, run to its end."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "m").mkdir()

    def run(files, names=("mass",), door=None, found=None, is_quick=True, take=lambda run: None):
        for name, text in files.items():
            (tmp_path / "m" / name).parent.mkdir(exist_ok=True)
            (tmp_path / "m" / name).write_text(text)
        kept, door = Kept(tmp_path / "out"), door or Inside()
        try:
            found = found or found_models(["m"])
            of = Run(found.models, Asked(tuple(names), is_quick), door, kept, tmp_path / "out")
            of.carry_out(lambda: take(of))
        finally:
            kept.close()
        return SimpleNamespace(of=of, door=door, rows={os.path.basename(row["file"]): row for row in of.rows})

    return run


def report(tmp_path, name):
    return tmp_path / "out" / place_of_report(f"m/{name}")


def test_files_agree_or_are_refused_with_the_reason_and_parts_are_left_out(fleet, tmp_path):
    found = fleet({
        "good.xml": PENDULUM.format(0.1), "broken.xml": "<mujoco><worldbody>", "none.xml": "<mujoco/>",
        "scene.xml": "<mujoco><include file='part.xml'/><include file='good.xml'/></mujoco>",
        "part.xml": "<mujoco><actuator><motor joint='j'/></actuator></mujoco>",
    })  # fmt: skip
    verdicts = {name: row["verdict"] for name, row in found.rows.items()}
    assert verdicts == {"good.xml": AGREE, "scene.xml": AGREE, "broken.xml": REFUSED, "none.xml": REFUSED}
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
    files = {f"{name}.xml": PENDULUM.format(0.1) for name in "abc"}

    def before(piece):
        if piece.name == "read of m/a.xml":
            (tmp_path / "m" / "b.xml").write_text(PENDULUM.format(0.2))
            (tmp_path / "m" / "c.xml").unlink()

    found = fleet(files, door=Inside(before=before))
    assert {name: row["verdict"] for name, row in found.rows.items()} == {
        "a.xml": AGREE,
        "b.xml": BROKE,
        "c.xml": BROKE,
    }
    assert found.rows["b.xml"]["reason"] == "the file, or one that it needs, has changed since the fleet began"
    assert found.rows["c.xml"]["reason"] == "No such file or directory"
    assert fleet({}).rows["b.xml"]["verdict"] == AGREE


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


def step_of(name):
    return name.rsplit(" of ", 1)[0]


@pytest.mark.parametrize("times_alone", [True, False])
def test_timed_pieces_of_a_pool_come_after_all_others_and_those_of_a_cluster_at_once(times_alone, fleet):
    work = Outcome(pickle.dumps(b"work"))
    outcomes = {"read": None, "speed, untimed": work}
    door = Inside(
        times_alone=times_alone, before=lambda piece: outcomes.get(step_of(piece.name), Outcome(error="none"))
    )
    found = fleet({"a.xml": PENDULUM.format(0.1), "b.xml": PENDULUM.format(0.2)}, ["mass", "speed", "gravity"], door)
    steps, computed = [step_of(name) for name in door.done], ["gravity", "mass", "speed, untimed"]
    assert steps[:2] == ["read"] * 2 and sorted(step for step in steps if step in computed) == sorted(computed * 2)
    if times_alone:
        assert steps[-4:] == ["speed"] * 2 + ["report"] * 2
    else:  # each at once after what of it is no timing
        assert [steps[k + 1] for k, step in enumerate(steps) if step == "speed, untimed"] == ["speed"] * 2
    assert [row["reason"] for row in found.rows.values()] == ["report: none"] * 2


def answered(piece):
    """What a piece returns, without computing it: an experiment the piece's name."""
    name = piece.name.encode()
    values = {
        "speed, untimed": name,
        "read": Known("", ("mass", "speed"), (("gravity", "no reason"),), 1, "Euler", 0.002),
        "report": ({"verdict": AGREE, "reason": "", "seconds": 1.0}, {"index.html": piece.name.encode()}),
    }
    return Outcome(pickle.dumps(values.get(step_of(piece.name), (name, ""))), seconds=1.0, wall=2.0, machine="far")


def test_a_file_that_differs_is_named_before_it_is_done(fleet):
    """The first check that does not hold, once."""
    early = []

    def before(piece):
        is_mass = step_of(piece.name) == "mass"
        return Outcome(pickle.dumps((b"", f"{piece.name} differs"))) if is_mass else answered(piece)

    found = fleet(
        {"a.xml": PENDULUM.format(0.1)},
        ["mass"],
        Inside(before=before),
        take=lambda run: early.extend(run.take_early()),
    )
    assert [task.differs for task in early] == ["mass of m/a.xml differs"] and found.rows["a.xml"]["verdict"] == AGREE


STEPS = ["read", "mass", "speed, untimed", "speed", "report"]


def test_nothing_of_a_quick_fleet_is_used_for_a_full_one(fleet):
    files, names = {"a.xml": PENDULUM.format(0.1)}, ["mass", "speed"]
    for is_quick, steps in ((True, STEPS), (True, []), (False, STEPS), (True, ["report"])):
        found = fleet(files, names, Inside(before=answered), is_quick=is_quick)
        assert [step_of(name) for name in found.door.names] == steps


def test_the_same_file_in_another_folder_has_what_was_said_of_it_and_not_of_the_first(fleet, tmp_path):
    first = {"a/x.xml": PENDULUM.format(0.1)}
    fleet(first, door=Inside(before=answered))
    again = fleet(first | {"b/x.xml": first["a/x.xml"]}, door=Inside(before=answered))
    assert again.door.names == [f"{step} of m/b/x.xml" for step in STEPS]
    for name in ("a/x.xml", "b/x.xml"):
        assert (report(tmp_path, name) / "index.html").read_text() == f"report of m/{name}"


def test_each_file_is_timed_and_reported_with_what_was_found_of_itself(fleet):
    asked = {}

    def before(piece):
        asked[piece.name] = piece
        return answered(piece)

    found = fleet({"a.xml": PENDULUM.format(0.1), "b.xml": PENDULUM.format(0.2)}, door=Inside(before=before))
    for name in ("m/a.xml", "m/b.xml"):
        assert asked[f"speed of {name}"].arguments[:3] == ("speed", f"speed, untimed of {name}".encode(), name)
        have, left_out, seconds = asked[f"report of {name}"].arguments[:3]
        assert have == {step: f"{step} of {name}".encode() for step in ("mass", "speed")}
        assert (left_out, seconds) == ([("gravity", "no reason")], 4.0)
    assert {name for name, piece in asked.items() if piece.timed} == {"speed of m/a.xml", "speed of m/b.xml"}
    assert len({piece.group for piece in asked.values()}) == 2 and "" not in {piece.group for piece in asked.values()}
    assert found.of.machines == {"far"} and set(found.of.took["mass"]) == {(1, 2.0)}


def test_where_nothing_can_be_timed_the_report_says_why_and_is_made_again_for_another_reason(fleet):
    files, said = {"a.xml": PENDULUM.format(0.1)}, []

    def before(piece):
        if step_of(piece.name) == "report":
            said.append(piece.arguments[1])
        return answered(piece)

    for why in ("nobody may", "nobody can"):
        door = Inside(before=before)
        door.no_timing = lambda why=why: why
        fleet(files, door=door)
        assert said[-1] == [("gravity", "no reason"), ("speed", f"it measures time: {why}")]
        assert not any(name.startswith("speed") for name in door.names)
    assert len(said) == 2


def test_what_was_computed_in_an_earlier_run_counts_as_time_of_the_file(fleet):
    took = []

    def before(piece):
        if step_of(piece.name) == "report":
            took.append(piece.arguments[2])
        return Outcome(error="none") if step_of(piece.name) == "speed" and not took else answered(piece)

    for _ in range(2):
        fleet({"a.xml": PENDULUM.format(0.1)}, door=Inside(before=before))
    assert took == [3.0, 3.0]  # read, mass and what is not timed; then mass, that, and what is


def test_a_timed_experiment_whose_untimed_part_breaks_off_has_that_reason_and_is_not_timed(fleet):
    said = []

    def before(piece):
        if step_of(piece.name) == "report":
            said.append(piece.arguments[0]["speed"])
        return Outcome(error="out of luck") if step_of(piece.name) == "speed, untimed" else answered(piece)

    door = Inside(before=before)
    fleet({"a.xml": PENDULUM.format(0.1)}, door=door)
    assert said == ["out of luck"] and "speed of m/a.xml" not in door.names


def test_what_was_kept_and_is_gone_before_the_report_is_said_in_it(fleet, tmp_path):
    said = []

    def before(piece):
        if step_of(piece.name) == "speed":
            for path in (tmp_path / "out" / "kept").glob("*/*"):
                path.unlink()  # by somebody, between two pieces
        if step_of(piece.name) == "report":
            said.append(piece.arguments[0])
        return answered(piece)

    fleet({"a.xml": PENDULUM.format(0.1)}, door=Inside(before=before))
    assert said == [{"mass": "what was kept of it is gone", "speed": b"speed of m/a.xml"}]


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
