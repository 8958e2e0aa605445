"""Runs of a model with its actuators, from near a posture at rest, and of the model as the file has it."""

import mujoco
import numpy as np
import pytest
from models import PATHS
from servo_models import FILTERED, acting_of, hinge, posture_of

from compare.engines.mujoco.whole import whole_run


def test_small_movements_of_every_kind_of_joint_are_measured(rng):
    at, reading = posture_of(PATHS["mixed"])
    acting = acting_of(at, reading)
    moved = 1e-6 * rng.normal(size=(4, acting.model.nv))
    positions = np.tile(at.start, (4, 1))
    for q, dx in zip(positions, moved):
        mujoco.mj_integratePos(acting.model, q, dx, 1.0)
    # a quaternion and its opposite are one turn
    for j in np.flatnonzero(acting.model.jnt_type == mujoco.mjtJoint.mjJNT_BALL):
        a = acting.model.jnt_qposadr[j]
        positions[1, a : a + 4] *= -1.0
    assert acting.movements(positions, at.start) == pytest.approx(moved, abs=1e-15)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_run_in_parts_is_the_run_that_steps_make(integrator):
    at, reading = posture_of(hinge(actuator=FILTERED.format(kind="filter", constant=0.01)))
    acting, u, jump = acting_of(at, reading), np.array([0.3]), np.array([0.1])
    parts = list(acting.deviations(at.q, u, 0.004, integrator, [3, 5], 1e-3, 2e-3, 0.05, jump))
    assert [part.shape for part in parts] == [(3, 2), (5, 2)]
    model, data = acting.at(at.q, u + jump, 0.004, integrator)
    assert data.ctrl[0] == data.act[0] == pytest.approx(0.4)
    data.qpos += 1e-3
    data.qvel[:] = 2e-3
    data.act += 0.05
    for found in np.concatenate(parts):
        mujoco.mj_step(model, data)
        assert found == pytest.approx([data.qpos[0] - at.q[0], data.act[0] - 0.4], rel=1e-12)


@pytest.mark.parametrize(
    "limit, dt, lasts, resets", [("", 0.002, 2.0, 0), ("", 0.06, 30.0, 2), ("-1 1", 0.06, 30.0, 0)]
)
def test_the_whole_model_is_run_as_the_file_has_it(limit, dt, lasts, resets, tmp_path, monkeypatch):
    """Where 2 kv dt is above 4 I it goes to and fro until MuJoCo puts it back, again and again; a range of the force keeps it."""
    monkeypatch.chdir(tmp_path)
    limited = f'forcerange="{limit}"' * bool(limit)
    at, reading = posture_of(hinge(actuator=f'<position name="s" joint="turn" kp="20" kv="2" {limited}/>'))
    run = whole_run(reading.model, at.robot.drive, at.start, np.array([0.1]), dt, "Euler", lasts, 0.5)
    assert run.warnings == run.resets and (run.resets >= resets if resets else run.resets == 0)
    assert run.rms_speed < 1e-6 if dt < 0.06 else resets or run.rms_speed > 0.1
    assert not list(tmp_path.iterdir())
