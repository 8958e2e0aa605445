"""Robots whose joints hold each other, under their own servos: limits of the step beside MuJoCo's own steps and runs."""

import mujoco
import numpy as np
import pytest
from servo_models import posture_of

from compare.engines.mujoco import read
from compare.engines.mujoco.acting import Acting
from compare.experiments.stability.servos.observed import grows_in_runs
from compare.experiments.stability.servos.predicted import acting_at, predicted_at
from compare.robots.file import robot_of
from compare.truth.servos import constraint_terms

# two fingers of unlike mass on slides, one servo: the other finger follows by an equality
GRIPPER = """<mujoco><worldbody>
  <body><joint name="left" type="slide" axis="0 1 0" damping="2"/><inertial pos="0 0 0" mass="0.1" diaginertia="1 1 1"/></body>
  <body><joint name="right" type="slide" axis="0 1 0"/><inertial pos="0 0 0" mass="0.3" diaginertia="1 1 1"/></body></worldbody>
  <equality><joint name="mimic" joint1="right" joint2="left" polycoef="{} 0 0"/></equality>
  <actuator><position name="grip" joint="left" kp="400" kv="40"/></actuator>
  <keyframe><key qpos="0.01 0.02" ctrl="0.01"/></keyframe></mujoco>"""
# a loop of four bars that a connect closes, with a servo on one
FOUR_BARS = """<mujoco><default><geom type="capsule" size="0.01" mass="0.1"/></default><worldbody>
  <body><joint name="crank" axis="0 1 0" damping="0.05"/><geom fromto="0 0 0 0 0 0.1"/>
    <body name="last" pos="0 0 0.1"><joint name="coupler" axis="0 1 0"/><geom fromto="0 0 0 0.2 0 0.05"/></body></body>
  <body name="rocker" pos="0.2 0 0"><joint name="rocker" axis="0 1 0"/><geom fromto="0 0 0 0 0 0.15"/></body></worldbody>
  <equality><connect body1="rocker" body2="last" anchor="0 0 0.15" solref="0.01 1"/></equality>
  <actuator><position name="crank" joint="crank" kp="20" kv="1"/></actuator></mujoco>"""
MIMIC, BENT = GRIPPER.format("0 1 0"), GRIPPER.format("0.01 1 20")


def predicted(source):
    reading = read(source)
    robot = robot_of(reading, "robot.xml")
    return predicted_at(robot, next(iter(robot.positions)), reading), reading


@pytest.mark.parametrize("source", [MIMIC, BENT, FOUR_BARS], ids=["mimic", "bent", "a loop"])
def test_the_limit_is_where_steps_and_runs_of_mujoco_with_its_equalities_begin_to_grow(source):
    one, reading = predicted(source)
    finite = 0
    for integrator, limit in one.limits.items():
        if limit.limit == "finite":
            finite += 1
            at, acting = one.there[integrator], acting_at(reading, one.there[integrator])
            if integrator not in ("RK4", "discrete"):
                steps = [acting.transition(at.q, at.u, by * limit.dt, integrator) for by in (0.995, 1.005)]
                below, above = np.abs(np.linalg.eigvals(steps)).max(axis=1)
                assert below < 1.0 < above
            elif source is not FOUR_BARS:  # whose runs take long
                assert not grows_in_runs(acting, at, integrator, 0.995 * limit.dt)
                assert grows_in_runs(acting, at, integrator, 1.005 * limit.dt)
    assert finite >= 2


def test_a_mimic_has_the_modes_of_both_masses_and_a_lower_limit_than_a_rigid_one():
    small = predicted(MIMIC)[0].at.small
    # 4 (m1 + m2) + 2 dt (damping - kv) - dt^2 kp = 0
    m, d, k = 0.4, 2.0 - 40.0, 400.0
    rigid = (2 * d + np.sqrt(4 * d * d + 16 * m * k)) / (2 * k)
    assert np.sort(small.modes[0].real) == pytest.approx(np.sort(np.roots([m, 42.0, k]).real), rel=1e-9)
    # what a soft one changes: kv brakes one finger before the other is told
    assert small.limit("Euler").dt < 0.99 * rigid


def test_a_floating_base_turns_with_the_constraints_that_it_carries():
    base = '<worldbody><body><freejoint/><geom fromto="0 0 0 0.2 0 0" mass="3"/>'
    servo = '<position joint="rocker" kp="20" kv="1"/></actuator>'
    loads = servo + '<keyframe><key ctrl="0.4 -0.4"/></keyframe>'  # the servos load the loop
    source = FOUR_BARS.replace("<worldbody>", base).replace("</worldbody>", "</body></worldbody>")
    source = source.replace("</actuator>", loads)
    one = predicted(source)[0]
    assert one.at.small.names == ("crank", "coupler", "rocker") and "discrete" not in one.known
    assert "Euler" in one.known and "discrete" in predicted(FOUR_BARS)[0].known


def test_constraints_at_rest_carry_what_mujoco_says_and_are_stiff_by_turning():
    at, reading = posture_of(FOUR_BARS)
    assert at.rest[1] == 0.0
    model, data = Acting(reading.model, at.robot.drive).at(at.q, at.u, reading.dt, "Euler")
    mujoco.mj_forward(model, data)
    rows, coordinates = at.driven.rows, at.robot.coordinates
    force, springs, turning = constraint_terms(rows, coordinates, at.q)
    assert force == pytest.approx(data.qfrc_constraint, abs=1e-8) and np.abs(force).max() > 0.01
    K = springs + turning
    for j, step in enumerate(1e-7 * np.eye(len(K))):
        ends = (coordinates.move(at.q, sign * step) for sign in (1, -1))
        ahead, behind = (constraint_terms(rows, coordinates, q)[0] for q in ends)
        assert -(ahead - behind) / 2e-7 == pytest.approx(K[:, j], rel=1e-3, abs=1e-3 * np.abs(K).max())
