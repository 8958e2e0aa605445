"""Actuators under constant controls as a linear controller: the law, moved targets, and the scenes that ask for it."""

import dataclasses

import numpy as np
import pytest
from models import PATHS

from compare.actuators import Actuator, Drive
from compare.case import Case, Scene, rates_at
from compare.controller import controller, reason
from compare.engines.mujoco import read
from compare.robots.file import robot_of

SERVO = Actuator("servo", "b", (0.0, 2.0), gain=(50.0, 0.0, 0.0), bias=(0.0, -50.0, -4.0))
TENDON = Actuator("tendon", "a", (0.5, -0.7), gain=(30.0, 0.0, 0.0), bias=(1.0, -20.0, 0.0))
Q = np.array([0.3, -0.4])


@pytest.fixture(scope="module")
def gripper():
    return robot_of(read(PATHS["gripper"]), "gripper.xml")


def test_gears_count_twice_and_tendons_couple():
    found = controller(Drive((SERVO, TENDON)), "none", Q)
    assert np.allclose(found.position_gain, [[0.25 * 20, -0.35 * 20], [-0.35 * 20, 0.49 * 20 + 4 * 50]])
    assert np.allclose(found.speed_gain, [[0, 0], [0, 16]]) and found.left_out == {}
    assert np.allclose(found.torque - found.position_gain @ Q, 0.0)  # targets that are the posture


@pytest.mark.parametrize("one", [SERVO, TENDON])
def test_a_moved_target_is_where_a_servo_is_without_force(one):
    moved = np.array([0.1, 0.02])
    still, far = (controller(Drive((one,)), "none", Q, by) for by in (0.0, moved))
    length = np.array(one.moment) @ Q + np.abs(one.moment) @ moved
    assert one.force(far.controls[0], length) == pytest.approx(0.0, abs=1e-12)
    assert np.array_equal(still.position_gain, far.position_gain)


def test_a_keyframe_states_the_controls():
    drive = Drive((SERVO, TENDON), controls={"home": (0.7, None)})
    assert controller(drive, "home", Q).controls[0] == 0.7 and controller(drive, (0.0, 1.0), Q).controls[0] == -0.8
    assert controller(drive, "home", Q).controls[1] == controller(drive, "none", Q).controls[1]


def test_a_motor_keeps_its_control_when_targets_move():
    motor = Actuator("motor", "a", (3.0, 0.0), gain=(2.0, 0.0, 0.0))
    drive = Drive((motor,), controls={"home": (0.5,)})
    for moved in (0.0, 1.0):
        found = controller(drive, "home", Q, moved)
        assert found.torque.tolist() == [3.0, 0.0] and not found.position_gain.any()


@pytest.mark.parametrize(
    "changes, says",
    [
        ({"off": "the file disables group 1"}, "the file disables group 1"),
        ({"refused": "a muscle"}, "a muscle"),
        ({"moment": None}, "its lever turns with the posture"),
        ({"moment": (0.0, 0.0)}, "it moves nothing"),
        ({"bias": (0.0, 50.0, -4.0)}, "it pushes away from its target"),
        ({}, ""),
    ],
)
def test_why_an_actuator_takes_no_part(changes, says):
    one = dataclasses.replace(SERVO, **changes)
    assert reason(one, 0.0) == says
    found = controller(Drive((one,)), "none", Q)
    assert found.left_out == ({"servo": says} if says else {}) and (found.controls == (None,)) == bool(says)
    assert bool(found.position_gain.any()) != bool(says)


@pytest.mark.parametrize(
    "changes, says",
    [
        (
            {"targets": 2.0},
            "targets is 2.0; 4 numbers, one per joint .shoulder, wrist, left, right., in deg, m, is expected",
        ),
        ({"targets": (2.0,)}, "4 numbers"),
        ({"targets": (2.0, np.nan, 0.0, 0.0)}, "a movement in deg"),
        ({"locked": ("wrist",)}, "locked is .'wrist',.; no locked joint where servos act is expected"),
    ],
)
def test_what_cannot_be_a_scene_of_servos_is_refused_in_one_line(gripper, changes, says):
    with pytest.raises(ValueError, match=says) as error:
        gripper.case("mine", posture="open", torque="servos", **changes)
    assert "\n" not in str(error.value)


def test_one_number_moves_all_joints_of_one_kind():
    robot = robot_of(read(PATHS["arm6"]), "arm6.xml")
    one, each = (robot.case("mine", posture="home", torque="servos", targets=by) for by in (2.0, (2.0,) * 6))
    assert np.array_equal(one.tau, each.tau) and one.tree == each.tree
    still = robot.case("mine", posture="home", torque="servos")
    assert np.allclose(one.tau - still.tau, np.array(one.tree.position_gain) @ np.radians(np.full(6, 2.0)))


def test_the_scenes_of_a_robot_with_servos(gripper):
    held, step = gripper.scenes[-2:]
    assert (held.name, step.name) == ("open, held by servos", "open, step of the servos")
    assert (
        held.torque == step.torque == "servos" and not np.any(held.targets) and step.targets == (6.0, 6.0, 0.02, 0.02)
    )
    assert (
        "full only" in held.tags and "full only" not in step.tags and "speed" in step.tags and "speed" not in held.tags
    )
    assert [case.scene.torque for case in gripper.cases_of_torque] == ["hold", "free", "free"]
    for case in gripper.cases[-2:]:  # no step is longer than 1 over the fastest rate, of the servos too
        slow, fast = (max(rates_at(tree, case.q)) for tree in (gripper.tree, case.tree))
        assert slow < fast <= 1.0 / case.scene.dt


@pytest.mark.parametrize("name", ["loop", "mixed", "free_body", "pendulum_ball"])
def test_a_robot_whose_actuators_have_no_target_has_no_such_scene(name):
    assert all(scene.torque != "servos" for scene in robot_of(read(PATHS[name]), name).scenes)


@pytest.mark.parametrize("name, gravity", [("humanoid29", True), ("humanoid29_free", False)])
def test_a_robot_that_floats_has_no_gravity_under_its_servos(name, gravity):
    robot = robot_of(read(PATHS[name]), name)
    step = Case(robot, robot.scenes[-1])
    assert step.scene.gravity == gravity and step.controller and isinstance(step.scene, Scene)
