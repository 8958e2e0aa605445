"""Robots whose joints hold each other, under their own servos: limits of the step beside MuJoCo's own steps and runs."""

import mujoco
import numpy as np
import pytest
from coupled_models import FINGER, FOUR_BARS, GRIPPER, LOOSE
from servo_models import posture_of

from compare.engines.mujoco import read
from compare.engines.mujoco.acting import Acting
from compare.engines.mujoco.flags import INTEGRATORS
from compare.experiments.stability.servos.observed import grows_in_runs
from compare.experiments.stability.servos.predicted import acting_at, predicted_at
from compare.robots.file import robot_of
from compare.truth.constraints import constraint_forces, turning


def predicted(source, posture=None):
    reading = read(source)
    robot = robot_of(reading, "robot.xml")
    return predicted_at(robot, posture or next(iter(robot.positions)), reading), reading


def gripper(kv=40, polycoef="0 1 0 0 0", solref=0.02):
    return GRIPPER.format(kv=kv, polycoef=polycoef, solref=solref, integrator="Euler")


SOURCES = {
    "mimic": gripper(),
    "the other way and faster": gripper(polycoef="0 -2 0 0 0"),
    "bent": gripper(polycoef="0.01 1 20 0 0"),
    "a loop": FOUR_BARS.format(kv=1, solref=0.01, integrator="Euler"),
}


@pytest.mark.parametrize("source", SOURCES.values(), ids=SOURCES)
def test_the_limit_is_where_steps_and_runs_of_mujoco_with_its_equalities_begin_to_grow(source):
    one, reading = predicted(source)
    finite = 0
    for (base, integrator), limit in one.limits.items():
        if limit.limit == "finite":
            finite += 1
            at = one.there[base, integrator]
            acting = acting_at(reading, at, base)
            if integrator not in ("RK4", "discrete"):
                below, above = (
                    np.abs(np.linalg.eigvals(acting.transition(at.q, at.u, by * limit.dt, integrator))).max()
                    for by in (0.995, 1.005)
                )
                assert below < 1.0 < above
            assert not grows_in_runs(acting, at, integrator, 0.995 * limit.dt)
            assert grows_in_runs(acting, at, integrator, 1.005 * limit.dt)
    assert finite >= 2


def test_a_rigid_mimic_has_the_limit_of_both_masses():
    one, _ = predicted(gripper())
    small = one.at.small("fixed")
    # 4 (m1 + m2) + 2 dt (damping - kv) - dt^2 kp = 0
    m, d, k = 0.4, 2.0 - 40.0, 400.0
    assert small.rigid.limit("Euler").dt == pytest.approx((2 * d + np.sqrt(4 * d * d + 16 * m * k)) / (2 * k), rel=1e-9)
    # what a soft one changes: kv brakes one finger before the other is told
    assert small.limit("Euler").dt < 0.99 * small.rigid.limit("Euler").dt


def test_constraints_at_rest_carry_what_mujoco_says():
    source = SOURCES["a loop"]
    at, reading = posture_of(source)
    assert at.rest[1] == 0.0
    model, data = Acting(reading.model, at.robot.drive).at(at.q, at.u, reading.dt, "Euler")
    mujoco.mj_forward(model, data)
    assert np.abs(data.qacc).max() < 1e-6 * np.abs(data.qfrc_constraint).max() / 1e-4
    force, _ = constraint_forces(at.driven.rows, at.robot.coordinates, at.q)
    assert force == pytest.approx(data.qfrc_constraint, abs=1e-8)


def test_what_a_constraint_does_by_turning_is_stiffness():
    at, _ = posture_of(SOURCES["a loop"])
    rows, coordinates = at.driven.rows, at.robot.coordinates
    total, springs = constraint_forces(rows, coordinates, at.q)
    K, n = springs + turning(rows, coordinates, at.q), len(total)
    for j, step in enumerate(1e-7 * np.eye(n)):
        ahead, behind = (constraint_forces(rows, coordinates, coordinates.move(at.q, s * step))[0] for s in (1, -1))
        assert -(ahead - behind) / 2e-7 == pytest.approx(K[:, j], rel=1e-3, abs=1e-3 * np.abs(K).max())


def test_a_finger_rests_at_its_limit_and_not_far_away():
    one, reading = predicted(FINGER, "qpos0")
    assert one.is_known and one.at.moved < 0.1 and one.at.limits and one.at.beyond(0.0)
    # the file's own model with everything on comes to rest there
    data = mujoco.MjData(reading.model)
    data.ctrl[:] = one.at.u
    for _ in range(5000):
        mujoco.mj_step(reading.model, data)
    assert data.qpos == pytest.approx(one.at.q, abs=2e-3)


@pytest.mark.parametrize("floor", ["", '<geom type="plane" size="1 1 1" pos="0 0 -1"/>'])
def test_what_nothing_holds_is_set_aside_by_name_and_the_rest_is_answered(floor):
    source = LOOSE.format(floor=floor)
    one, _ = predicted(source, "qpos0")
    held, _ = predicted(source.replace('<joint name="finger" type="slide" axis="0 0 1"/>', ""), "qpos0")
    assert (
        one.is_known and [one.at.robot.coordinates.speeds[k] for k in one.at.aside] == ["finger"] and not held.at.aside
    )
    for name in INTEGRATORS:
        found, alone = one.limits["fixed", name], held.limits["fixed", name]
        assert found.limit == alone.limit and (found.dt is None or found.dt == pytest.approx(alone.dt, rel=1e-3))


def test_a_keyframe_without_a_name_is_a_posture_with_its_controls():
    one, _ = predicted(gripper(polycoef="0.01 1 0 0 0"))
    assert one.name == "key 0" and one.at.u == pytest.approx([0.01])
    assert one.rests and one.at.moved < 1e-6 and one.at.start == pytest.approx([0.01, 0.02])
