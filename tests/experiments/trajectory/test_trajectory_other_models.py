"""Models that are not the stated arm: nothing raises, and what is kept and drawn of their runs has numbers."""

import edited
import numpy as np
import pytest
from trajectory_curves import CASES

import tmt
from compare import experiment
from compare.engines.mujoco import parse
from compare.experiments import trajectory
from compare.experiments.trajectory import drift, errors, sentences
from compare.judge.check import Result
from compare.robots.arm import ARM

MODELS = {name: edited.MODELS[name] for name in ("with a spring", "a feather")}
STEPS = {1: (16, 32, 64), 4: (16, 32, 64)}
FOLLOWED = [CASES[name] for name in ("ball catch, held", "bent, held", "ball catch, free", "bent, free")]


KNOWN = {}  # TMT's side, which is the same for all models


def said_of(name) -> tuple[Result, list]:
    """All that a report says of a model's runs, and the names and captions of some figures."""
    text = edited.XML.replace(*edited.MODELS[name])
    engines, result = experiment.engines(parse(text, tmt.ARM)), Result("trajectory", curves={"runs": {}})
    for case in FOLLOWED:
        part = trajectory.runs.follow(case, engines, (1,), KNOWN)
        result.rows += part.rows
        result.curves["runs"] |= part.curves
    drift.measure_drift(result, ARM, engines, STEPS)
    result.curves["errors"] = errors.errors_when_held(result, ARM) | errors.errors_when_free(result, ARM)
    result.notes = sentences.notes(result, ARM, engines, (1,)) + result.notes
    drawn = [figure() for figure in trajectory.figures(result, ARM)]
    result.curves["runs"] = {
        key: {part: run[part] for part in ("left", "ended")} for key, run in result.curves["runs"].items()
    }
    return result, [(name, caption) for name, _, caption in drawn]


@pytest.mark.parametrize("name", [*MODELS, *(
    pytest.param(name, marks=pytest.mark.slow) for name in edited.MODELS if name not in MODELS
)])  # fmt: skip
def test_a_model_that_is_another_arm_goes_through(name, shared):
    result, captions = shared(said_of, name)
    assert len(captions) > 3 and not any("nan" in caption for _, caption in captions)
    errors = np.array(list(result.curves["errors"].values()), dtype=float)
    assert errors.shape == (4, 2)
    bent = result.curves["runs"]["bent, held", "rk4", 64]["left"]
    assert bent["tmt"] is None and (bent["mujoco"] is None) is (name in ("the arm", "damped by 5"))
