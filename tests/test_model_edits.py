"""A wrong model fails wherever it matters: edits of the MJCF x experiments, each must be seen or cannot be, with the reason."""

import pytest
from model_edits import EDITS, EXPERIMENTS, failing


def test_the_stated_arm_fails_nowhere():
    assert failing("</mujoco>", "</mujoco>") == set()


@pytest.mark.parametrize("name", EDITS)
def test_a_wrong_model_fails_wherever_it_matters(name, beside):
    old, new, reasons = EDITS[name]
    hidden = {experiment for experiments in reasons.values() for experiment in experiments}
    found = beside.result(failing, old, new)
    if found is None:
        pytest.skip("this MuJoCo does not know what the edit asks for")
    assert set(EXPERIMENTS) - hidden - found == set(), "these must see it, and do not"
    assert found & hidden == set(), "these see it, in spite of the reason"
