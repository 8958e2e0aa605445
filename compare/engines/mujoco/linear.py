"""What MuJoCo says of its own steps: their derivatives, and what becomes of a run that it resets by itself."""

import mujoco
import numpy as np

from .dynamics import MujocoDynamics
from .flags import FLAGS

NUDGE = 1e-6  # of mjd_transitionFD and of the central differences, rad and rad/s


def transition(dynamics: MujocoDynamics, q: np.ndarray, tau: np.ndarray, dt: float, integrator: str) -> np.ndarray:
    """d(q, qd)+/d(q, qd) of one step of MuJoCo at rest, positions as movements, (2nv, 2nv).

    q: (nq,) rad, m; tau: (nv,) N m. By mjd_transitionFD, central differences of 1e-6; where it refuses (RK4, delays) steps are
    differenced here.
    """
    if integrator == "RK4":
        return differenced(dynamics, q, tau, dt, integrator)
    model, data = dynamics.own_copy(dt, integrator, q, 0.0, tau)
    size = 2 * model.nv + model.na  # activations come last
    A = np.zeros((size, size))
    try:
        mujoco.mjd_transitionFD(model, data, NUDGE, True, A, None, None, None)
    except mujoco.FatalError:
        return differenced(dynamics, q, tau, dt, integrator)
    order = np.concatenate([dynamics.dofs, model.nv + dynamics.dofs])
    return A[np.ix_(order, order)]


def differenced(dynamics: MujocoDynamics, q: np.ndarray, tau: np.ndarray, dt: float, integrator: str) -> np.ndarray:
    """The same by central differences of steps."""
    n, ends, coordinates = len(dynamics.dofs), [], dynamics.coordinates
    for sign in (1.0, -1.0):
        nudges = sign * NUDGE * np.eye(2 * n)
        motion = dynamics.run(coordinates.move(q, nudges[:, :n]), nudges[:, n:], tau, dt, 1, integrator)
        ends.append((motion.q[:, 1], motion.v[:, 1]))
    (q1, v1), (q0, v0) = ends
    return np.concatenate([coordinates.difference(q1, q0), v1 - v0], axis=1).T / (2.0 * NUDGE)


def left_to_itself(
    dynamics: MujocoDynamics, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float, steps: int, integrator: str
) -> dict:
    """A run with MuJoCo's defaults, automatic reset included, and what MuJoCo says of it.

    q: (steps + 1, nq); qd: (steps + 1, nv); time: (steps + 1,) s, of MuJoCo's own clock; warnings: their number at the end.
    """
    model, data = dynamics.own_copy(dt, integrator, q, qd, tau)
    model.opt.disableflags &= ~int(FLAGS["autoreset"])
    states = []
    for k in range(steps + 1):
        states.append([data.time, *data.qpos[dynamics.qpos], *data.qvel[dynamics.dofs]])
        if k < steps:
            mujoco.mj_step(model, data)
    time, q, qd = np.split(np.array(states), [1, 1 + len(dynamics.qpos)], axis=1)
    warnings = sum(int(warning.number) for warning in data.warning)
    return {"time": time[:, 0], "q": q, "qd": qd, "warnings": warnings}


def implicit_derivative(dynamics: MujocoDynamics, q: np.ndarray, qd: np.ndarray, dt: float = 1e-3) -> np.ndarray:
    """d(passive force - bias)/dqd that the implicit integrator uses, N m s/rad, (nv, nv): qDeriv."""
    model, data = dynamics.own_copy(dt, "implicit", q, qd)
    mujoco.mj_step(model, data)
    dense = np.zeros((model.nv, model.nv))
    for row, (start, count) in enumerate(zip(model.D_rowadr, model.D_rownnz)):
        dense[row, model.D_colind[start : start + count]] = data.qDeriv[start : start + count]
    return dense[np.ix_(dynamics.dofs, dynamics.dofs)]
