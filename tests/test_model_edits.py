"""A wrong model fails wherever it matters: edits of the MJCF x experiments, each must be seen or cannot be, with the reason."""

import pytest
from model_edits import EDITS, EXPERIMENTS, failing

STATIC = ("parameters", "published", "kinematics", "mass", "gravity", "acceleration")
IN_ALL = ("inertia 1 % larger",)  # whose runs are compared by default, too


def judge(found, names, reasons):
    """Compare the experiments of these names that fail with those that must."""
    if found is None:
        pytest.skip("this MuJoCo does not know what the edit asks for")
    hidden = {experiment for experiments in reasons.values() for experiment in experiments}
    assert found == {*names} - hidden


@pytest.mark.parametrize("names", [STATIC, pytest.param(tuple(EXPERIMENTS), marks=pytest.mark.slow)])
def test_the_stated_arm_fails_nowhere(names):
    assert failing("</mujoco>", "</mujoco>", names) == set()


@pytest.mark.parametrize("name", [name for name in EDITS if name not in IN_ALL])
def test_a_wrong_model_fails_in_single_states(name):
    old, new, reasons = EDITS[name]
    judge(failing(old, new, STATIC), STATIC, reasons)


@pytest.mark.parametrize(
    "name", [pytest.param(name, marks=[] if name in IN_ALL else pytest.mark.slow) for name in EDITS]
)
def test_a_wrong_model_fails_wherever_it_matters(name, shared):
    old, new, reasons = EDITS[name]
    judge(shared(failing, old, new), EXPERIMENTS, reasons)
