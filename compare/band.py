"""How far rounding alone may drive two runs of the same method apart."""

import numpy as np

import tmt
from tmt import method

from .agreement import EPS, FACTOR, bias_scale

TINY = 1e-30  # complex step
NARROW = 1e-3  # rad: while the band is below, a run is judged


def step_jacobians(stepping, q, qd, tau, dt) -> np.ndarray:
    """Exact Jacobians of the method's own step at states q, qd (steps, n): (steps, 2n, 2n).

    By complex steps through the step itself, all states and directions at once.
    """
    n = q.shape[1]
    state = np.concatenate([q, qd], axis=1).T[:, None, :]  # (2n, 1, steps)
    nudged = list(state + 1j * TINY * np.eye(2 * n)[:, :, None])  # component, direction, state

    def acceleration(q, qd):
        return method.acceleration(tmt.ARM, q, qd, tau)

    new_q, new_qd = stepping.step(acceleration, nudged[:n], nudged[n:], dt)
    return np.imag(np.array([*new_q, *new_qd])).transpose(2, 0, 1) / TINY


def step_rounding(q, qd, tau, dt) -> np.ndarray:
    """Bound delta of the difference that one step adds by rounding, (steps, 2n), at the states it starts from.

    Rates: dt x the rounding of an acceleration, |Mbar^-1| (64 eps |Mbar| |qdd| + 64 eps S) with S the sum of the
    absolute terms of the force, plus the rounding of the sum qd + dt qdd. Angles: that of the sum q + dt qd, plus dt
    times that of the rates. The sums have at most 8 roundings on both sides together.
    """
    qdd = np.abs(tmt.acceleration(q, qd, tau)).max(axis=1)
    eigenvalues = np.linalg.eigvalsh(tmt.mass_matrix(q))
    force = bias_scale(q, qd) + np.abs(tau).max()
    per_second = FACTOR * EPS * (eigenvalues[:, -1] * qdd + force) / eigenvalues[:, 0]
    rates = dt * per_second[:, None] + 8 * EPS * (np.abs(qd) + dt * qdd[:, None])
    angles = 8 * EPS * (np.abs(q) + dt * np.abs(qd)) + dt * rates
    return np.concatenate([angles, rates], axis=1)


def band(stepping, q, qd, tau, dt) -> np.ndarray:
    """band(t_n) = sum over k of |J_n ... J_(k+1)| delta_k along a run of states (steps + 1, n): (steps + 1, 2n)."""
    jacobians = step_jacobians(stepping, q[:-1], qd[:-1], tau, dt)
    delta = step_rounding(q[:-1], qd[:-1], tau, dt)
    steps, size = delta.shape
    widths = np.zeros((steps + 1, size))
    carried = np.empty((size, steps, size))  # carried[:, k]: J_n ... J_(k+1), what has become of step k's rounding
    for n, J in enumerate(jacobians):
        carried[:, :n] = np.tensordot(J, carried[:, :n], axes=1)
        carried[:, n] = np.eye(size)
        widths[n + 1] = np.abs(carried[:, : n + 1]).reshape(size, -1) @ delta[: n + 1].ravel()
        if widths[n + 1].max() > 1e6 * NARROW:  # far beyond judging: the rest only grows
            widths[n + 2 :] = np.inf
            break
    return widths
