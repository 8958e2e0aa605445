"""Derivatives in MuJoCo, all of them finite differences: mjd_transitionFD, mjd_inverseFD, and differences of its own steps."""

from collections.abc import Callable

import mujoco
import numpy as np

from .dynamics import MujocoDynamics
from .names import element_name
from .step import Step

Array = np.ndarray

Call = Callable[[], Array]


def of_transition(
    dynamics: MujocoDynamics, q: Array, v: Array, tau: Array, dt: float, integrator: str, eps: float, centred: bool
) -> Call:  # fmt: skip
    """A call of mjd_transitionFD: A (2 nv, 2 nv) of a step from a state (movement, v) under constant torque.

    q: (nq,) rad, m; v, tau: (nv,). It does not take RK4, and its B is by controls.
    """
    model, data = dynamics.own_copy(dt, integrator, q, v, tau)
    A = np.zeros((2 * model.nv + model.na,) * 2)
    places = np.concatenate([dynamics.dofs, model.nv + dynamics.dofs])

    def call() -> Array:
        mujoco.mjd_transitionFD(model, data, eps, centred, A, None, None, None)
        return A[np.ix_(places, places)]

    return call


def of_inverse(dynamics: MujocoDynamics, q: Array, v: Array, a: Array, eps: float) -> Call:
    """A call of mjd_inverseFD, one-sided: dtau/dq and dtau/dv side by side, (nv, 2 nv), actuators taken off; a: (nv,)."""
    model, data = dynamics.own_copy(1.0, "Euler", q, v)
    data.qacc[dynamics.dofs] = a
    by = np.zeros((2, model.nv, model.nv))
    places = np.ix_(dynamics.dofs, dynamics.dofs)

    def call() -> Array:
        mujoco.mjd_inverseFD(model, data, eps, True, *by, None, None, None, None, None)
        return np.hstack([matrix.T[places] for matrix in by])  # MuJoCo's are transposed

    return call


def of_steps(
    dynamics: MujocoDynamics, q: Array, v: Array, tau: Array, dt: float, integrator: str, eps: float, centred: bool
) -> Call:  # fmt: skip
    """A call of mj_step from states nearby: [A B] (2 nv, 3 nv) of a step of any integrator, B by torque."""
    n, coordinates = len(dynamics.dofs), dynamics.coordinates

    def ends(size: float) -> tuple[Array, Array]:
        """The state after the step from each nudged state."""
        nudges = size * np.eye(3 * n)
        start = coordinates.move(q, nudges[:, :n])
        motion = dynamics.run(start, v + nudges[:, n : 2 * n], tau + nudges[:, 2 * n :], dt, 1, integrator)
        return motion.q[:, 1], motion.v[:, 1]

    def call() -> Array:
        (q1, v1), (q0, v0) = ends(eps), ends(-eps if centred else 0.0)
        return np.concatenate([coordinates.difference(q1, q0), v1 - v0], axis=1).T / ((1 + centred) * eps)

    return call


def touching(step: Step, state: Array, by: Array) -> set[str]:
    """The pairs of geoms whose contacts have forces at a state that is moved by a deviation, and how many contacts each has."""
    step.put(state, by)
    model, data = step.model, step.data
    mujoco.mj_forward(model, data)
    pairs: dict[str, int] = {}
    for contact in data.contact:
        if contact.efc_address >= 0:
            name = " and ".join(element_name(model, "geom", geom) for geom in contact.geom)
            pairs[name] = pairs.get(name, 0) + 1
    return {f"{name} ({count})" for name, count in pairs.items()}
