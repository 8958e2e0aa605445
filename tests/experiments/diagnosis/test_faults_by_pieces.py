"""Made faults that go through a door: the same rows, and what is said of one that was not tried to its end."""

from dataclasses import replace

from edited import setup_of

from compare.experiments import diagnosis
from compare.experiments.diagnosis import fault_table
from compare.experiments.diagnosis.fault_table import made_faults, rows_by_pieces, rows_in_parts
from compare.fleet.calls import door_opened
from compare.judge.check import ENDS, Result

FAULTS = [fault for fault in made_faults() if fault.kind in ("sign", "force")][:4]


def without_seconds(table):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in table]


def test_the_rows_are_the_same_and_a_fault_that_cannot_be_tried_is_a_failed_check():
    broken = FAULTS[1]._replace(name="a fault of no kind", make=("unknown",))
    result, done = Result("diagnosis"), []
    with door_opened(None, 2) as door:
        table = rows_by_pieces(result, [FAULTS[0], broken, *FAULTS[1:]], door, done.append)
    right = rows_in_parts(FAULTS, map, done.append)
    assert without_seconds(table) == without_seconds(right) and len(table) == 4
    assert done == [1, 2, 3, 4, 5, 4]
    (check,) = result.checks
    assert (check.scene, check.quantity, check.passed) == (f"{broken.robot}, a fault of no kind", ENDS, False)


def test_the_experiment_asks_the_door_of_its_setup(monkeypatch):
    monkeypatch.setattr(fault_table, "made_faults", lambda: FAULTS)
    monkeypatch.setattr(fault_table, "SAMPLE", 8)

    def nowhere(*_):
        raise AssertionError("what goes through the door is not spread otherwise")

    with door_opened(None, 1) as door:
        result = diagnosis.rows(replace(setup_of(), faults=True, door=door, map=nowhere))
    assert len(result.tables["faults"]) == 2 and all(check.passed for check in result.checks)
