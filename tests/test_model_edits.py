"""A wrong model fails wherever it matters: edits of the MJCF x experiments, each must be seen or cannot be, with the reason.

Every experiment in its smallest setting, in one process; that of parameters has its own tests of the same edits.
"""

from functools import partial

import pytest
from edited import setup_of
from model_edits import EDITS, edited

from compare.experiment import Setup
from compare.experiments import (
    acceleration,
    gravity,
    kinematics,
    mass,
    published,
    reduction,
    speed,
    stability,
    trajectory,
)
from compare.judge.check import Result
from compare.robots.arm import ARM

KNOWN = {}  # what TMT gives, the same for every edit
FOLLOWED = tuple(case for case in ARM.cases if case.name in ("bent, free", "bent, damped"))


def follow(setup) -> Result:
    result = Result("trajectory")
    for case in FOLLOWED:
        result.checks += trajectory.runs.follow(case, setup.engines, setup.finer, KNOWN).checks
    return result


def linearise(setup) -> Result:
    result = Result("stability")
    stability.check_equilibria(result, setup)
    return result


STATES = {
    module.__name__.split(".")[-1]: module.rows for module in (published, kinematics, mass, gravity, acceleration)
}
RUNS = {
    "trajectory": follow,
    "speed": partial(speed.rows, timed=False),
    "stability": linearise,
    "reduction": partial(reduction.rows, timed=False),
}


@pytest.mark.parametrize("experiments", [STATES, pytest.param(RUNS, marks=pytest.mark.slow)], ids=["states", "runs"])
@pytest.mark.parametrize("name", [None, *(name for name, (*_, unseen) in EDITS.items() if unseen is not None)])
def test_a_wrong_model_fails_wherever_it_matters(name, experiments):
    old, new, _, unseen = EDITS[name] if name else ("</mujoco>", "</mujoco>", [], " ".join(experiments))
    try:
        setup = setup_of(edited((old, new)), Setup, states=20, exact_states=1, finer=(1,), size="small")
    except ValueError:
        pytest.skip("this MuJoCo does not know what the edit asks for")
    failing = {each for each, rows in experiments.items() if not all(check.passed for check in rows(setup).checks)}
    assert failing == experiments.keys() - set(unseen.split())
