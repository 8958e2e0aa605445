"""What MuJoCo says of its own steps: their derivatives, and what becomes of a run that it resets by itself."""

import mujoco
import numpy as np

from .dynamics import FLAGS, MujocoDynamics

NUDGE = 1e-6  # of mjd_transitionFD and of the central differences, rad and rad/s


def transition(dynamics: MujocoDynamics, q: np.ndarray, tau: np.ndarray, dt: float, integrator: str) -> np.ndarray:
    """d(q, qd)+/d(q, qd) of one step of MuJoCo at rest, (2n, 2n).

    q, tau: (n,) rad, N m. By mjd_transitionFD, central differences of 1e-6; where it refuses (RK4, delays) steps are
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
    n, ends = len(dynamics.dofs), []
    for sign in (1.0, -1.0):
        start = np.concatenate([q, np.zeros(n)]) + sign * NUDGE * np.eye(2 * n)
        ends.append(dynamics.run(start[:, :n], start[:, n:], tau, dt, 1, integrator).states[:, 1])
    return (ends[0] - ends[1]).T / (2.0 * NUDGE)


def left_to_itself(
    dynamics: MujocoDynamics, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float, steps: int, integrator: str
) -> dict:
    """A run with MuJoCo's defaults, automatic reset included, and what MuJoCo says of it.

    q, qd: (steps + 1, n); time: (steps + 1,) s, of MuJoCo's own clock; warnings: their number at the end.
    """
    model, data = dynamics.own_copy(dt, integrator, q, qd, tau)
    model.opt.disableflags &= ~int(FLAGS["autoreset"])
    states = []
    for k in range(steps + 1):
        states.append([data.time, *data.qpos[dynamics.qpos], *data.qvel[dynamics.dofs]])
        if k < steps:
            mujoco.mj_step(model, data)
    time, n = np.array(states), len(dynamics.dofs)
    warnings = sum(int(warning.number) for warning in data.warning)
    return {"time": time[:, 0], "q": time[:, 1 : 1 + n], "qd": time[:, 1 + n :], "warnings": warnings}


def implicit_derivative(dynamics: MujocoDynamics, q: np.ndarray, qd: np.ndarray, dt: float = 1e-3) -> np.ndarray:
    """d(passive force - bias)/dqd that the implicit integrator uses, N m s/rad, (n, n): qDeriv."""
    model, data = dynamics.own_copy(dt, "implicit", q, qd)
    mujoco.mj_step(model, data)
    dense = np.zeros((model.nv, model.nv))
    for row, (start, count) in enumerate(zip(model.D_rowadr, model.D_rownnz)):
        dense[row, model.D_colind[start : start + count]] = data.qDeriv[start : start + count]
    return dense[np.ix_(dynamics.dofs, dynamics.dofs)]
