"""A double pendulum with equations of one's own, right and wrong, for test_agreement_of_own."""

import types

import numpy as np
import pytest

import compare
from compare.engines.mujoco import engine, read
from compare.robots.file import robot_of

PENDULUM = """
<mujoco>
  <worldbody>
    <body name="upper">
      <joint name="hip" axis="0 1 0" damping="0.3"/>
      <inertial pos="0 0 -0.5" mass="1" diaginertia="0.1 0.1 0.02"/>
      <body name="lower" pos="0 0 -1">
        <joint name="knee" axis="0 1 0"/>
        <inertial pos="0 0 -0.5" mass="2" diaginertia="0.2 0.2 0.02"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
READING = read(PENDULUM)
TREE = READING.tree
NAMES = ("mass_matrix", "bias", "gravity", "acceleration")


def mass_matrix(q):
    """Of the pendulum, of one state."""
    c = np.cos(q[1])
    return np.array([[3.05 + 2 * c, 0.7 + c], [0.7 + c, 0.7]])


def bias(q, qd, of_square=1.0):
    s, g = np.sin(q[1]), 9.81
    lower = g * np.sin(q[0] + q[1])
    return np.array(
        [-s * (2 * qd[0] * qd[1] + of_square * qd[1] ** 2) + 2.5 * g * np.sin(q[0]) + lower, s * qd[0] ** 2 + lower]
    )


def gravity(q):
    return bias(q, np.zeros(2))


def acceleration(q, qd, tau):
    return np.linalg.solve(mass_matrix(q), tau - bias(q, qd) - np.array([0.3, 0.0]) * qd)


RIGHT = {"mass_matrix": mass_matrix, "bias": bias, "gravity": gravity, "acceleration": acceleration}


def wrong_bias(q, qd):
    return bias(q, qd, of_square=-1.0)


def message_of(**brought):
    with pytest.raises(AssertionError) as error:
        compare.assert_agrees(PENDULUM, **brought)
    return str(error.value)


@pytest.fixture(name="given")
def given_states(rng):
    """States, and MuJoCo's values of every quantity."""
    q, qd, tau = rng.uniform(-2.0, 2.0, (3, 12, 2))
    theirs = engine(READING).of(robot_of(READING, "a pendulum").case())
    values = {
        "mass_matrix": theirs.mass_matrix(q), "bias": theirs.bias(q, qd), "gravity": theirs.gravity_balance(q),
        "acceleration": theirs.acceleration(q, qd, tau),
    }  # fmt: skip
    return types.SimpleNamespace(states={"q": q, "qd": qd, "tau": tau}, values=values)
