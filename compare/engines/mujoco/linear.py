"""MuJoCo's own steps: their derivatives, runs with its automatic reset, and runs of a file's model as it is."""

from typing import NamedTuple

import mujoco
import numpy as np

from ...robots.actuators import Drive
from .actuators import control_of
from .dynamics import MujocoDynamics
from .names import INTEGRATORS, bit

NUDGE = 1e-6  # of central differences, rad and rad/s


def transition(dynamics: MujocoDynamics, q: np.ndarray, tau: np.ndarray, dt: float, integrator: str) -> np.ndarray:
    """d(q, qd)+/d(q, qd) of one step of MuJoCo at rest, positions as movements, (2nv, 2nv), by central differences.

    q: (nq,) rad, m; tau: (nv,) N m.
    """
    n, ends, coordinates = len(dynamics.dofs), [], dynamics.coordinates
    for sign in (1.0, -1.0):
        nudges = sign * NUDGE * np.eye(2 * n)
        motion = dynamics.run(coordinates.move(q, nudges[:, :n]), nudges[:, n:], tau, dt, 1, integrator)
        ends.append((motion.q[:, 1], motion.v[:, 1]))
    (q1, v1), (q0, v0) = ends
    return np.concatenate([coordinates.difference(q1, q0), v1 - v0], axis=1).T / (2.0 * NUDGE)


def left_to_itself(dynamics: MujocoDynamics, q, qd, tau, dt: float, steps: int, integrator: str) -> dict:
    """A run with MuJoCo's automatic reset: time (steps + 1,) s, of its own clock, q, qd; warnings: their number at the end."""
    model, data = dynamics.own_copy(dt, integrator, q, qd, tau)
    model.opt.disableflags &= ~bit("AUTORESET")
    path = [(0.0, q, qd)]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        path.append((data.time, data.qpos[dynamics.qpos], data.qvel[dynamics.dofs]))
    return dict(zip(("time", "q", "qd"), map(np.array, zip(*path)))) | {"warnings": int(data.warning.number.sum())}


class WholeRun(NamedTuple):
    """A run of a file's model as it is."""

    rms_speed: float  # root mean square of all speeds in the last part, rad/s and m/s; NaN: it is not finite
    warnings: int  # of MuJoCo's own
    resets: int  # to the reference position, by MuJoCo itself


def whole_run(model: mujoco.MjModel, drive: Drive, q, u, dt, integrator: str, lasts, last, speed=0.0) -> WholeRun:
    """A run from q under constant u of each actuator, with contacts, limits, friction and force ranges.

    lasts: its duration, s; last: the duration of the part at its end that is judged, s. After a reset by MuJoCo the controls and
    the speed are set again.
    """
    m = mujoco.MjModel.__copy__(model)
    m.opt.timestep, m.opt.integrator = dt, INTEGRATORS[integrator]
    data, controls = mujoco.MjData(m), np.zeros(m.nu)
    data.qpos[:], data.qvel[:] = q, speed
    for i, (one, value) in enumerate(zip(drive.actuators, u)):
        place, inputs = control_of(m, i)
        if inputs == 1:
            controls[place] = 0.0 if one.dynamics == "integrator" else value
        if one.dynamics != "none":
            data.act[m.actuator_actadr[i]] = value
    steps, squares, warnings, resets, counted = max(1, round(lasts / dt)), [], 0, 0, 0
    judged = steps - max(1, round(last / dt))
    for step in range(steps):
        before = data.time
        data.ctrl[:] = controls
        mujoco.mj_step(m, data)
        number = int(data.warning.number.sum())
        if data.time <= before:  # it starts to count again
            resets, counted = resets + 1, 0
            data.qvel[:] = speed
        warnings, counted = warnings + number - counted, number
        if step >= judged:
            squares.append(data.qvel @ data.qvel / m.nv)
    return WholeRun(float(np.sqrt(np.mean(squares))), warnings, resets)
