"""Which pieces of a file are asked for, in which order, and what of an earlier run is used."""

import pickle

import pytest
from inside import PENDULUM, Inside, report, step_of

from compare.fleet.file_pieces import Known
from compare.fleet.piece import Outcome
from compare.fleet.row import AGREE


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
    again = fleet({"b/x.xml": first["a/x.xml"], "a/x.xml": PENDULUM.format(0.2)}, door=Inside(before=answered))
    assert [name for name in again.door.names if "/b/" in name] == [f"{step} of m/b/x.xml" for step in STEPS]
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
