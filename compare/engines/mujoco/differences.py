"""Derivatives in MuJoCo by differences: mjd_transitionFD, mjd_inverseFD, and those of its own steps."""

from collections.abc import Callable
from typing import Any

import mujoco
import numpy as np

from .dynamics import Array, MujocoDynamics
from .names import bit

NUDGE = 1e-6  # of central differences, rad and rad/s
Call = Callable[[], np.ndarray]


def of_transition(
    dynamics: MujocoDynamics, q: Array, v: Array, tau: Array, dt: float, integrator: str, centred: bool,
    eps: float,
) -> Call:  # fmt: skip
    """A call of mjd_transitionFD: A (2 nv, 2 nv) of a step from a state (movement, v) under constant torque.

    q: (nq,) rad, m; v, tau: (nv,). It does not take RK4, and its B is by controls.
    """
    model, data = dynamics.own_copy(dt, integrator, q, v, tau)
    A = np.zeros((2 * model.nv + model.na,) * 2)
    places = np.concatenate([dynamics.dofs, model.nv + dynamics.dofs])

    def call() -> np.ndarray:
        mujoco.mjd_transitionFD(model, data, eps, centred, A, None, None, None)
        return A[np.ix_(places, places)]

    return call


def of_inverse(dynamics: MujocoDynamics, q: Array, v: Array, a: Array, eps: float) -> Call:
    """A call of mjd_inverseFD, one-sided: dtau/dq and dtau/dv side by side, (nv, 2 nv); a: (nv,)."""
    model, data = dynamics.own_copy(1.0, "Euler", q, v)
    data.qacc[dynamics.dofs] = a
    by = np.zeros((2, model.nv, model.nv))
    places = np.ix_(dynamics.dofs, dynamics.dofs)

    def call() -> np.ndarray:
        mujoco.mjd_inverseFD(model, data, eps, True, *by, None, None, None, None, None)
        return np.hstack([matrix.T[places] for matrix in by])  # MuJoCo's are transposed

    return call


def of_steps(
    dynamics: MujocoDynamics, q: Array, v: Array, tau: Array, dt: float, integrator: str, centred: bool,
    eps: float,
) -> Call:  # fmt: skip
    """A call of mj_step from states nearby: [A B] (2 nv, 3 nv) of a step of any integrator, B by torque."""
    n, coordinates = len(dynamics.dofs), dynamics.coordinates

    def ends(size: float) -> tuple[np.ndarray, np.ndarray]:
        """The state after the step from each nudged state."""
        nudges = size * np.eye(3 * n)
        start = coordinates.move(np.asarray(q), nudges[:, :n])
        motion = dynamics.run(start, v + nudges[:, n : 2 * n], tau + nudges[:, 2 * n :], dt, 1, integrator)
        return motion.q[:, 1], motion.v[:, 1]

    def call() -> np.ndarray:
        (q1, v1), (q0, v0) = ends(eps), ends(-eps if centred else 0.0)
        moved = np.concatenate([coordinates.difference(q1, q0), v1 - v0], axis=1)
        return moved.T / ((1 + centred) * eps)

    return call


def transition(dynamics: MujocoDynamics, q: Array, tau: Array, dt: float, integrator: str) -> np.ndarray:
    """d(movement, speed)+/d(movement, speed) of a step at rest, (2 nv, 2 nv); q: (nq,), tau: (nv,)."""
    n = len(dynamics.dofs)
    return of_steps(dynamics, q, np.zeros(n), tau, dt, integrator, True, NUDGE)()[:, : 2 * n]


def left_to_itself(
    dynamics: MujocoDynamics, q: Array, qd: Array, tau: Array, dt: float, steps: int, integrator: str
) -> dict[str, Any]:
    """A run with MuJoCo's automatic reset: its clock's time (steps + 1,) s, q, qd; number of warnings."""
    model, data = dynamics.own_copy(dt, integrator, q, qd, tau)
    model.opt.disableflags &= ~bit("AUTORESET")
    path = [(0.0, q, qd)]
    for _ in range(steps):
        mujoco.mj_step(model, data)
        path.append((data.time, data.qpos[dynamics.qpos], data.qvel[dynamics.dofs]))
    time, positions, speeds = map(np.array, zip(*path))
    return {"time": time, "q": positions, "qd": speeds, "warnings": int(data.warning.number.sum())}
