"""Made faults: a sample of the list and of the generator, and what the judge makes of outcomes."""

from dataclasses import replace

import numpy as np
import pytest
from edited import setup_of

import tmt
from compare import diagnosis
from compare.diagnosis.words import Cause
from compare.experiments import diagnosis as experiment
from compare.experiments.diagnosis import derivation, fault_table, faults, generator, wrong_motion
from compare.fleet.calls import door_opened
from compare.judge.check import ENDS, Result
from compare.robots.arm import ARM
from compare.robots.six_hinges import SIX_HINGES

OF_ARM = list(faults.fault_list("arm", ARM.tree, True))
OF_MOTION = list(wrong_motion.wrong_motions("arm", ARM.tree))
SMALL = [fault for fault in generator.generated(200) if len(fault.tree.axis) <= 2]  # which take little time


@pytest.mark.parametrize("sample", [[*OF_ARM[::61], *OF_MOTION[::8]], SMALL[::13]], ids=["arm", "generator"])
def test_of_a_sample_no_fault_is_explained_by_something_else(sample):
    table = fault_table.rows_of_part(sample)
    assert "wrong" not in {row["outcome"] for row in table} and len(table) >= 4
    assert sum(row["outcome"] in ("right", "tied") for row in table) >= 0.75 * len(table)
    assert all(row["reason"] for row in table if row["outcome"] in ("tied", "none"))


def test_the_second_derivation_is_right_where_nothing_is_wrong():
    for tree in (ARM.tree, SIX_HINGES, *(generator.random_tree(np.random.default_rng(k)) for k in range(3))):
        q, qd = np.random.default_rng(7).uniform(-3.0, 3.0, (2, 2, len(tree.axis)))
        M, h = derivation.derived(tree, q, qd)
        assert np.abs(M - tmt.mass_matrix(q, tree)).max() < 1e-12 and np.abs(h - tmt.bias(q, qd, tree)).max() < 1e-10
        if tree is SIX_HINGES:
            h = derivation.by_lagrange(tree, q, qd, 1.0, 1.0)[1]
            assert np.abs(h - tmt.bias(q, qd, tree)).max() < 1e-10


# the judge

FAULT = faults.Fault("arm", tmt.ARM, "a mass", "number", "list", 0.1, ("mass of forearm",), (1.6,), ("tree", tmt.ARM))


def cause(place="mass of forearm", explains=1.6, rank=2):
    return Cause(rank, "number", place, 1.5, explains, "kg", 0.0, 0, place)


def test_outcomes():
    for causes, outcome in (
        ([cause(explains=1.6 * (1.0 + 0.9e-6))], "right"),
        ([cause(explains=1.6 * (1.0 + 1.1e-6))], "wrong"),
        ([cause(), cause("armature of gamma")], "tied"),
        ([cause("armature of gamma", rank=3)], "wrong"),
        ([], "none"),
    ):
        assert fault_table.judged_fault(FAULT, diagnosis.Diagnosis(True, tuple(causes)))[0] == outcome
    assert fault_table.judged_fault(FAULT, diagnosis.Diagnosis(False))[0] == "invisible"
    # a cause of a lower rank that other states do not confirm
    fault = FAULT._replace(make=("tree", replace(tmt.ARM, mass=(1.9, 1.6))))
    found = diagnosis.Diagnosis(True, (cause("sense of alpha", "-", 1),))
    assert fault_table.judged_fault(fault, found)[0] == "wrong"


@pytest.mark.parametrize("source", ["list", "generator"])
def test_one_wrong_outcome_fails(source):
    about = {"robot": "arm", "fault": "a", "kind": "number", "size": 0.1, "seen_by": "", "diagnosis": "", "reason": ""}
    for outcomes, passes in ((["right", "tied", "none"], True), (["right", "wrong"], False)):
        result, of_each = Result("diagnosis"), about | {"source": source, "visible": True, "seconds": 0.1}
        fault_table.judge_faults(result, [of_each | {"outcome": outcome} for outcome in outcomes])
        assert all(check.passed for check in result.checks) is passes
        assert {row["outcome"]: row["faults"] for row in result.rows} == dict.fromkeys(outcomes, 1)


# the table


def test_through_a_door_the_rows_are_the_same_and_a_fault_that_cannot_be_tried_is_a_failed_check():
    few, result, done = OF_MOTION[:2], Result("diagnosis"), []
    broken = few[1]._replace(name="a fault of no kind", make=("unknown",))
    with door_opened(None, 1) as door:
        table = fault_table.rows_by_pieces(result, [few[0], broken, few[1]], door, done.append)
    right = fault_table.rows_in_parts(few, map, done.append)
    assert [row | {"seconds": 0} for row in table] == [row | {"seconds": 0} for row in right] and done == [1, 2, 3, 2]
    (check,) = result.checks
    assert (check.scene, check.quantity, check.passed) == (f"{broken.robot}, {broken.name}", ENDS, False)


def test_the_experiment_makes_the_table_and_asks_the_door_of_its_setup(monkeypatch):
    monkeypatch.setattr(fault_table, "made_faults", lambda: OF_MOTION[:3])
    monkeypatch.setattr(fault_table, "SAMPLE", 8)
    with door_opened(None, 1) as door:
        result = experiment.rows(replace(setup_of(), faults=True, door=door, map=None))  # nothing is spread otherwise
    names = "robot fault kind source size visible seen_by diagnosis outcome reason seconds"
    assert len(result.tables["faults"]) == 2 and list(result.tables["faults"][0]) == names.split()
    assert all(check.passed for check in result.checks)
