"""Made faults: a sample of the list and of the generator, and what the judge makes of outcomes."""

from dataclasses import replace

import numpy as np
import pytest
from diagnosis_states import two_states
from edited import setup_of
from models import PATHS

import tmt
from compare import diagnosis
from compare.diagnosis.words import Cause
from compare.engines.mujoco import parse, reading
from compare.experiments.diagnosis import derivation, fault_table, faults, generator, wrong_motion
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.robots.six_hinges import SIX_HINGES

MADE = fault_table.made_faults()
ARMS = {"arm": ARM.tree, "six hinges": SIX_HINGES}


def rows_of(chosen):
    return [fault_table.row_of(fault) for fault in chosen]


def test_half_of_the_faults_are_of_the_generator():
    sources = [fault.source for fault in MADE]
    assert sources.count("list") == sources.count("generator") > 500
    kinds = {fault.kind for fault in MADE}
    assert kinds >= {
        "number",
        "term",
        "slip",
        "order",
        "sign",
        "unit",
        "pair",
        "force",
        "step",
        "coefficient",
        "composition",
    }


@pytest.mark.parametrize("robot, step", [("arm", 23), ("six hinges", 61)])
def test_a_sample_of_the_list(robot, step):
    table = rows_of([fault for fault in MADE if fault.robot == robot][::step])
    assert {row["outcome"] for row in table if row["visible"]} <= {"right", "tied"}
    assert all(row["reason"] for row in table if row["outcome"] in ("tied", "none"))


def test_a_sample_of_the_generator():
    table = rows_of([fault for fault in MADE if fault.source == "generator"][::101])
    assert "wrong" not in {row["outcome"] for row in table}
    assert sum(row["outcome"] in ("right", "tied") for row in table if row["visible"]) >= 0.9 * sum(
        row["visible"] for row in table
    )


def test_faults_of_motion_are_all_found():
    table = rows_of(wrong_motion.wrong_motions("arm", ARM.tree))
    assert {row["outcome"] for row in table} == {"right"} and {row["seen_by"] for row in table} == {
        "acceleration",
        "trajectory",
    }


def test_the_second_derivation_is_right_where_nothing_is_wrong():
    for tree in (*ARMS.values(), *(generator.random_tree(np.random.default_rng(k)) for k in range(5))):
        q, qd = two_states(tree)
        M, h = derivation.derived(tree, q, qd)
        assert np.abs(M - tmt.mass_matrix(q, tree)).max() < 1e-12 and np.abs(h - tmt.bias(q, qd, tree)).max() < 1e-10
    h = derivation.by_lagrange(SIX_HINGES, *two_states(SIX_HINGES), 1.0, 1.0)[1]
    assert np.abs(h - tmt.bias(*two_states(SIX_HINGES), SIX_HINGES)).max() < 1e-10


def test_the_six_hinges_are_those_of_the_model_rounded():
    model = reading.read(PATHS["arm6"]).tree
    for name in ("offset", "axis", "mass", "com", "armature", "damping"):
        assert np.allclose(getattr(SIX_HINGES, name), getattr(model, name), rtol=1e-4, atol=1e-6)
    assert np.allclose(SIX_HINGES.inertia, model.inertia, rtol=1e-3, atol=1e-7) and SIX_HINGES.parent == model.parent


def test_mujoco_with_an_edited_number_is_named_too():
    edits = {
        "mass of forearm": ('mass="1.5"', 'mass="1.47"'),
        "CoM x of forearm": ('pos="0.15 0 0"', 'pos="0.157 0 0"'),
        "gravity z": ("0 0 -9.81", "0 0 -9.7"),
        "inertia yy of forearm": ("0.001 0.019 0.019", "0.001 0.0185 0.019"),
    }
    q, qd = two_states(ARM.tree, diagnosis.STATES_ASKED)
    for place, (old, new) in edits.items():
        text = ARM.mjcf.read_text(encoding="utf-8")
        assert text.count(old) == 1
        dynamics = parse(text.replace(old, new), ARM.tree).of(ARM.case())
        given = diagnosis.packed(dynamics.mass_matrix(q), dynamics.bias(q, qd), 3, len(q))
        tolerance = fault_table.tolerance_of_values(ARM.tree, q, qd)
        found = diagnosis.diagnose(ARM.tree, ARM.joints, q, qd, given, tolerance)
        assert place in {cause.place for cause in found.causes}


# the judge

FAULT = faults.Fault("arm", tmt.ARM, "a mass", "number", "list", 0.1, ("mass of forearm",), (1.6,), ("tree", tmt.ARM))


def cause(place="mass of forearm", explains=1.6, rank=2):
    return Cause(rank, "number", place, 1.5, explains, "kg", 0.0, 0, place)


def judged(*causes, differs=True):
    return fault_table.judged_fault(FAULT, diagnosis.Diagnosis(differs, causes))[0]


def test_outcomes():
    assert judged(cause()) == "right"
    assert judged(cause(), cause("armature of gamma")) == "tied"
    assert judged() == "none"
    assert judged(differs=False) == "invisible"
    assert judged(cause("armature of gamma", rank=3)) == "wrong"
    assert judged(cause(explains=1.61)) == "wrong"


@pytest.mark.parametrize("off, outcome", [(0.9e-6, "right"), (1.1e-6, "wrong")])
def test_a_value_is_right_within_a_millionth(off, outcome):
    assert judged(cause(explains=1.6 * (1.0 + off))) == outcome


def test_what_explains_only_the_states_of_the_search_is_wrong():
    """A cause of a lower rank that other states do not confirm."""
    edited = replace(tmt.ARM, mass=(1.9, 1.6))
    fault = FAULT._replace(make=("tree", edited), tree=tmt.ARM)
    found = diagnosis.Diagnosis(True, (cause("sense of alpha", "-", 1),))
    assert fault_table.judged_fault(fault, found)[0] == "wrong"


def row(outcome, source="list", visible=True):
    about = {"robot": "arm", "fault": "a", "kind": "number", "size": 0.1, "seen_by": "", "diagnosis": "", "reason": ""}
    return about | {"source": source, "visible": visible, "outcome": outcome, "seconds": 0.1}


@pytest.mark.parametrize("outcomes, passes", [(["right", "tied", "none"], True), (["right", "wrong"], False)])
@pytest.mark.parametrize("source", ["list", "generator"])
def test_one_wrong_outcome_fails(outcomes, passes, source):
    result = Result("diagnosis")
    fault_table.judge_faults(result, [row(outcome, source) for outcome in outcomes])
    assert all(check.passed for check in result.checks) is passes
    (note,) = [note for note in result.notes if source in note]
    assert "1 right" in note


def test_an_error_in_the_search_is_noticed(monkeypatch):
    """A search that takes what explains half of the difference for the cause."""
    from compare.diagnosis import fit

    def careless(self, which, x, left):
        right = fit.Search.kept(self, which, x, left)
        return [one._replace(ratio=0.5) if one.left < 0.5 else one for one in right]

    monkeypatch.setattr(fit.Search, "kept", fit.Search.outcome, raising=False)
    monkeypatch.setattr(fit.Search, "outcome", careless)
    chosen = [fault for fault in MADE if fault.robot == "arm" and fault.kind == "pair"][:6]
    assert "wrong" in {row["outcome"] for row in rows_of(chosen)}


def test_the_experiment_makes_the_table(monkeypatch):
    monkeypatch.setattr(fault_table, "SAMPLE", 24)
    setup = replace(setup_of(), faults=True)
    from compare.experiments import diagnosis as experiment

    result = experiment.rows(setup)
    names = "robot fault kind source size visible seen_by diagnosis outcome reason seconds"
    assert len(result.tables["faults"]) == 6 and list(result.tables["faults"][0]) == names.split()
    assert all(check.passed for check in result.checks)
    ((_, figure, caption),) = [draw() for draw in experiment.figures(result, None)]
    assert figure.axes[0].get_xlabel() and "Made faults by kind and outcome" in caption
