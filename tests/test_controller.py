"""The law of an actuator in plain numbers, and actuators under constant controls as a linear controller of scenes."""

import dataclasses

import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco import read
from compare.robots.actuators import Actuator, Drive, controller, reason
from compare.robots.file import robot_of

SERVO = Actuator("servo", "b", (0.0, 2.0), gain=(50.0, 0.0, 0.0), bias=(0.0, -50.0, -4.0))
TENDON = Actuator("tendon", "a", (0.5, -0.7), gain=(30.0, 0.0, 0.0), bias=(1.0, -20.0, 0.0))
MOTOR = Actuator("motor", "a", (3.0, 0.0), gain=(2.0, 0.0, 0.0))
Q = np.array([0.3, -0.4])


@pytest.fixture(scope="module")
def gripper():
    return robot_of(read(PATHS["gripper"]), "gripper.xml")


def test_controls_are_what_a_keyframe_states_else_the_targets_that_are_the_posture():
    drive = Drive((SERVO, TENDON), controls={"home": (0.7, None)})
    assert drive.control("home", (0.1, 0.2)) == pytest.approx([0.7, TENDON.target(0.2)])
    assert drive.control("elsewhere", (0.1, 0.2)) == pytest.approx([0.1, TENDON.target(0.2)])
    home, none = (controller(drive, posture, Q).controls for posture in ("home", (0.0, 1.0)))
    assert (home[0], none[0]) == (0.7, -0.8) and home[1] == none[1]


@pytest.mark.parametrize("one", [SERVO, TENDON, MOTOR])
def test_a_servo_is_without_force_at_its_moved_target(one):
    moved = np.array([0.1, 0.02])
    still, far = (controller(Drive((one,)), "none", Q, by) for by in (0.0, moved))
    length = np.array(one.moment) @ Q + np.abs(one.moment) @ moved
    assert one.force(far.controls[0], length) == pytest.approx(0.0, abs=1e-12)  # of a motor everywhere
    assert np.array_equal(still.position_gain, far.position_gain)


@pytest.mark.parametrize("changes, takes_part", [
    ({"off": "group 1"}, False), ({"refused": "a muscle"}, False), ({"moment": None}, False),
    ({"moment": (0.0, 0.0)}, False), ({"bias": (0.0, 50.0, -4.0)}, False), ({}, True),
])  # fmt: skip
def test_which_actuators_take_part(changes, takes_part):
    one = dataclasses.replace(SERVO, **changes)
    found = controller(Drive((one,)), "none", Q)
    assert (reason(one, 0.0) == "") is takes_part is bool(found.position_gain.any())
    assert set(found.left_out) == (set() if takes_part else {"servo"})
    assert (found.controls != (None,)) is takes_part
