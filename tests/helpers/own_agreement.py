"""assert_agrees of a pendulum with right equations, and what it says of wrong ones: for tests of agreement."""

from functools import partial

import pytest
from helpers.own_equations import XML as PENDULUM
from helpers.own_equations import acceleration, bias, gravity, mass_matrix

import compare
from compare.engines.mujoco import read
from compare.robots.file import robot_of

READING = read(PENDULUM)
TREE, ROBOT = READING.tree, robot_of(READING, "a pendulum")
SIGN = "h[hip], coefficient of knee'^2: yours is -1 times"
RIGHT = {"mass_matrix": mass_matrix, "bias": bias, "gravity": gravity, "acceleration": acceleration}
agrees, differences = partial(compare.assert_agrees, PENDULUM), partial(compare.differences, PENDULUM)


def message_of(mjcf=PENDULUM, **brought):
    with pytest.raises(AssertionError) as error:
        compare.assert_agrees(mjcf, **brought)
    return str(error.value)
