"""Models that are not the stated arm: nothing raises, and every sentence follows that model's numbers."""

import pytest
from edited import XML, setup_of

from compare.experiments import acceleration, gravity, kinematics, mass, published

MODELS = {
    "the arm": ("", ""),
    "on the moon": ("0 0 -9.81", "0 0 -1.62"),
    "gravity off by its flag": ("<flag ", '<flag gravity="disable" '),
    "ten times the gravity": ("-9.81", "-98.1"),
    "damped by 5": ('axis="1 0 0"/>', 'axis="1 0 0" damping="5"/>'),
    "with a spring": ('axis="1 0 0"/>', 'axis="1 0 0" stiffness="30"/>'),
    "a muscle's activation": ("</mujoco>", '<actuator><position joint="beta" kp="3" timeconst="0.1"/></actuator></mujoco>'),
    "a feather": (
        'pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"', 'pos="1e-5 0 0" mass="1.5" diaginertia="1e-9 1e-9 1e-9"',
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", MODELS)
def test_the_static_experiments_say_what_they_find(name):
    setup = setup_of(XML.replace(*MODELS[name]) if name != "the arm" else XML)
    for module in (published, kinematics, mass, gravity, acceleration):
        result = module.rows(setup)
        texts = [*result.notes, *(figure()[2] for figure in module.figures(result, setup.robot))]
        assert all(text.endswith(".") and "nan" not in text for text in texts)
        if name == "the arm":
            assert all(check.passed for check in result.checks)
