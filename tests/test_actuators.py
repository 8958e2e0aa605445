"""The law of an actuator, and what drives a robot, in plain numbers."""

import numpy as np
import pytest

from compare.actuators import Actuator, Drive, Tendon

SERVO = Actuator("s", "a", (1.0,), gain=(50.0, 0.0, 0.0), bias=(0.0, -50.0, -3.0))


def test_a_servo_is_without_force_at_its_target():
    assert SERVO.is_servo and SERVO.target(0.3) == pytest.approx(0.3)
    assert SERVO.force(SERVO.target(0.3), 0.3) == pytest.approx(0.0)
    assert SERVO.stiffness(0.3) == 50.0 and SERVO.damping(0.3) == 3.0


def test_a_gain_that_depends_on_length_and_speed_is_stiff_with_its_control():
    one = Actuator("g", "a", (1.0,), gain=(2.0, -4.0, -5.0), bias=(1.0, 0.0, 0.0))
    assert (one.stiffness(3.0), one.damping(3.0), one.force(3.0, 0.5)) == (12.0, 15.0, 1.0)
    assert one.is_servo and one.target(0.2) == 0.0


def test_a_motor_has_no_target():
    motor = Actuator("m", "a", (1.0,), gain=(5.0, 0.0, 0.0))
    assert not motor.is_servo and motor.target(0.7) == 0.0


def test_ranges_clamp_the_control_and_the_activation():
    one = Actuator("s", "a", (1.0,), control_range=(-1.0, 2.0), activation_range=(-0.5, 0.5))
    assert (one.clamped(3.0), one.clamped(-3.0), one.clamped(1.0)) == (2.0, -1.0, 1.0)
    held = Actuator("s", "a", (1.0,), dynamics="filter", control_range=(-1.0, 2.0), activation_range=(-0.5, 0.5))
    assert held.clamped(3.0) == 0.5


def test_a_force_is_cut_on_its_range_and_not_inside():
    one = Actuator("s", "a", (1.0,), force_range=(-2.0, 3.0))
    assert [one.is_cut(x) for x in (-2.001, -2.0, -1.999, 2.999, 3.0, 3.001)] == [True, True, False, False, True, True]
    assert not Actuator("s", "a", (1.0,)).is_cut(1e9)


def test_the_spring_of_a_tendon_is_without_force_in_its_dead_band():
    tendon = Tendon("t", 0, (1.0,), 10.0, 0.0, 0.2, 0.5)
    assert [tendon.force(x) for x in (0.1, 0.3, 0.7)] == pytest.approx([1.0, 0.0, -2.0])
    assert [tendon.pulls(x) for x in (0.199, 0.201, 0.499, 0.501)] == [True, False, False, True]
    assert [tendon.pulls(x) for x in (0.2 + 1e-12, 0.5 - 1e-12)] == [True, True]
    assert Tendon("t", 0, (1.0,), 10.0, 0.0, 0.2, 0.2).pulls(0.2)


def test_controls_are_what_a_keyframe_states_else_the_targets_that_are_the_posture():
    drive = Drive((SERVO, SERVO), controls={"home": (0.7, None)})
    assert drive.control("home", np.array([0.1, 0.2])) == pytest.approx([0.7, 0.2])
    assert drive.control("elsewhere", np.array([0.1, 0.2])) == pytest.approx([0.1, 0.2])


def test_what_exerts_nothing_is_no_servo():
    assert not Actuator("s", "a", (1.0,), bias=(0.0, -1.0, 0.0), off="the file disables group 2").is_servo
    assert Drive((Actuator("s", "a", (1.0,), refused="a delay"),), unknown={"joint a": "x"}).refused == {
        "s": "a delay",
        "joint a": "x",
    }
