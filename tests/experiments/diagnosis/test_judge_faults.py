"""Made faults: a sample of the list and of the generator, and what the judge makes of outcomes."""

from dataclasses import replace

import numpy as np
import pytest
from edited import setup_of
from models import PATHS

import tmt
from compare import diagnosis
from compare.diagnosis import fit
from compare.diagnosis.words import Cause
from compare.engines.mujoco import reading
from compare.experiments import diagnosis as experiment
from compare.experiments.diagnosis import derivation, fault_table, faults, generator, wrong_motion
from compare.fleet.calls import door_opened
from compare.judge.check import ENDS, Result
from compare.robots.arm import ARM
from compare.robots.six_hinges import SIX_HINGES

MADE = fault_table.made_faults()


def states_of(tree, count=2):
    return np.random.default_rng(7).uniform(-3.0, 3.0, (2, count, len(tree.axis)))


def rows_of(chosen):
    return [fault_table.row_of(fault) for fault in chosen]


def test_half_of_the_faults_are_of_the_generator():
    sources = [fault.source for fault in MADE]
    assert sources.count("list") == sources.count("generator") > 500
    kinds = "number term slip order sign unit pair force step coefficient composition"
    assert {fault.kind for fault in MADE} >= set(kinds.split())


def small(faults):
    """Those of trees of few joints, which take little time."""
    return [fault for fault in faults if len(fault.tree.axis) <= 3]


SAMPLES = {
    "arm": [fault for fault in MADE if fault.robot == "arm" and fault.source == "list"][::47],
    "generator": small([fault for fault in MADE if fault.source == "generator"][::37])[:5],
}
LONG_SAMPLES = {
    "six hinges": [fault for fault in MADE if fault.robot == "six hinges"][::61],
    "more of the arm": [fault for fault in MADE if fault.robot == "arm"][::23],
    "more of the generator": [fault for fault in MADE if fault.source == "generator"][::101],
}


@pytest.mark.parametrize(
    "sample", [*SAMPLES.values(), *(pytest.param(one, marks=pytest.mark.slow) for one in LONG_SAMPLES.values())],
    ids=[*SAMPLES, *LONG_SAMPLES],
)  # fmt: skip
def test_of_a_sample_no_fault_is_explained_by_something_else(sample):
    table = rows_of(sample)
    assert "wrong" not in {row["outcome"] for row in table} and len(table) >= 5
    found = [row["outcome"] in ("right", "tied") for row in table if row["visible"]]
    assert sum(found) >= 0.9 * len(found) > 0
    assert all(row["reason"] for row in table if row["outcome"] in ("tied", "none"))


def test_faults_of_motion_are_all_found():
    table = rows_of(list(wrong_motion.wrong_motions("arm", ARM.tree))[::3])
    assert {row["outcome"] for row in table} == {"right"}
    assert {row["seen_by"] for row in table} == {"acceleration", "trajectory"}


def test_the_second_derivation_is_right_where_nothing_is_wrong():
    for tree in (ARM.tree, SIX_HINGES, *(generator.random_tree(np.random.default_rng(k)) for k in range(3))):
        q, qd = states_of(tree)
        M, h = derivation.derived(tree, q, qd)
        assert np.abs(M - tmt.mass_matrix(q, tree)).max() < 1e-12 and np.abs(h - tmt.bias(q, qd, tree)).max() < 1e-10
    q, qd = states_of(SIX_HINGES)
    h = derivation.by_lagrange(SIX_HINGES, q, qd, 1.0, 1.0)[1]
    assert np.abs(h - tmt.bias(q, qd, SIX_HINGES)).max() < 1e-10


def test_the_six_hinges_are_those_of_the_model_rounded():
    model = reading.read(PATHS["arm6"]).tree
    for name in ("offset", "axis", "mass", "com", "armature", "damping"):
        assert np.allclose(getattr(SIX_HINGES, name), getattr(model, name), rtol=1e-4, atol=1e-6)
    assert np.allclose(SIX_HINGES.inertia, model.inertia, rtol=1e-3, atol=1e-7) and SIX_HINGES.parent == model.parent


# the judge

FAULT = faults.Fault("arm", tmt.ARM, "a mass", "number", "list", 0.1, ("mass of forearm",), (1.6,), ("tree", tmt.ARM))


def cause(place="mass of forearm", explains=1.6, rank=2):
    return Cause(rank, "number", place, 1.5, explains, "kg", 0.0, 0, place)


def test_outcomes():
    for causes, outcome in (
        ([cause()], "right"),
        ([cause(explains=1.6 * (1.0 + 0.9e-6))], "right"),
        ([cause(explains=1.6 * (1.0 + 1.1e-6))], "wrong"),
        ([cause(), cause("armature of gamma")], "tied"),
        ([cause("armature of gamma", rank=3)], "wrong"),
        ([], "none"),
    ):
        assert fault_table.judged_fault(FAULT, diagnosis.Diagnosis(True, tuple(causes)))[0] == outcome
    assert fault_table.judged_fault(FAULT, diagnosis.Diagnosis(False))[0] == "invisible"


def test_what_explains_only_the_states_of_the_search_is_wrong():
    """A cause of a lower rank that other states do not confirm."""
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


def test_an_error_in_the_search_is_noticed(monkeypatch):
    """A search that takes what explains half of the difference for the cause."""

    def careless(self, which, x, left):
        right = fit.Search.kept(self, which, x, left)
        return [one._replace(ratio=0.5) if one.left < 0.5 else one for one in right]

    monkeypatch.setattr(fit.Search, "kept", fit.Search.outcome, raising=False)
    monkeypatch.setattr(fit.Search, "outcome", careless)
    chosen = [fault for fault in MADE if fault.robot == "arm" and fault.kind == "pair"][:3]
    assert "wrong" in {row["outcome"] for row in rows_of(chosen)}


# the table

FEW = [fault for fault in MADE if fault.kind in ("sign", "force") and fault.robot == "arm"][:3]


def without_seconds(table):
    return [{name: value for name, value in row.items() if name != "seconds"} for row in table]


def test_through_a_door_the_rows_are_the_same_and_a_fault_that_cannot_be_tried_is_a_failed_check():
    broken = FEW[1]._replace(name="a fault of no kind", make=("unknown",))
    result, done = Result("diagnosis"), []
    with door_opened(None, 1) as door:
        table = fault_table.rows_by_pieces(result, [FEW[0], broken, *FEW[1:]], door, done.append)
    right = fault_table.rows_in_parts(FEW, map, done.append)
    assert without_seconds(table) == without_seconds(right) and len(table) == 3
    assert done == [1, 2, 3, 4, 3]
    (check,) = result.checks
    assert (check.scene, check.quantity, check.passed) == (f"{broken.robot}, a fault of no kind", ENDS, False)


def test_the_experiment_makes_the_table_and_asks_the_door_of_its_setup(monkeypatch):
    monkeypatch.setattr(fault_table, "made_faults", lambda: FEW)
    monkeypatch.setattr(fault_table, "SAMPLE", 8)

    def nowhere(*_):
        raise AssertionError("what goes through the door is not spread otherwise")

    with door_opened(None, 1) as door:
        result = experiment.rows(replace(setup_of(), faults=True, door=door, map=nowhere))
    names = "robot fault kind source size visible seen_by diagnosis outcome reason seconds"
    assert len(result.tables["faults"]) == 2 and list(result.tables["faults"][0]) == names.split()
    assert all(check.passed for check in result.checks)
    ((_, figure, caption),) = [draw() for draw in experiment.figures(result, None)]
    assert figure.axes[0].get_xlabel() and caption
