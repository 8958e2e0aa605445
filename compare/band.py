"""How far rounding alone may drive two runs of the same method apart."""

import numpy as np

import tmt
from tmt import method
from tmt.dual import Dual

from .agreement import EPS, FACTOR, acceleration_scale, bias_scale

NARROW = 1e-3  # rad: while the band is below, a run is judged


def step_jacobians(stepping, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float) -> np.ndarray:
    """Exact Jacobians of the method's own step at states q, qd (steps, n): (steps, 2n, 2n).

    The step is taken on dual numbers, all states and all directions at once.
    """
    n = q.shape[1]
    directions = np.eye(2 * n)[:, :, None]  # component, direction, state
    state = [Dual(values, slope) for values, slope in zip([*q.T, *qd.T], directions)]

    def acceleration(q, qd):
        return method.acceleration(tmt.ARM, q, qd, tau)

    new_q, new_qd = stepping.step(acceleration, state[:n], state[n:], dt)
    slopes = [np.broadcast_to(component.slope, (2 * n, len(q))) for component in (*new_q, *new_qd)]
    return np.array(slopes).transpose(2, 0, 1)


def step_rounding(stepping, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float) -> np.ndarray:
    """Bound delta, to first order in dt, of the difference that rounding adds in one step, (steps, 2n).

    Rates: dt x the rounding of an acceleration, the largest over the stages of the step (64 eps x its scale, with the
    stage's own |qdd|), plus that of the sum qd + dt qdd. Angles: that of the sum q + dt qd, plus dt times that of the
    rates. The sums have at most 8 roundings on both sides together.
    """
    stages = []

    def acceleration(q, qd):
        q, qd = np.stack(q, axis=-1), np.stack(qd, axis=-1)
        qdd = tmt.acceleration(q, qd, tau)
        size = np.abs(qdd).max(axis=1)
        stages.append((size, acceleration_scale(q, bias_scale(q, qd) + np.abs(tau).max(), size)))
        return list(qdd.T)

    stepping.step(acceleration, list(q.T), list(qd.T), dt)
    qdd, scale = np.max(stages, axis=0)[..., None]
    rates = dt * FACTOR * EPS * scale + 8 * EPS * (np.abs(qd) + dt * qdd)
    angles = 8 * EPS * (np.abs(q) + dt * np.abs(qd)) + dt * rates
    return np.concatenate([angles, rates], axis=1)


def band(stepping, q: np.ndarray, qd: np.ndarray, tau: np.ndarray, dt: float) -> np.ndarray:
    """band(t_n) = sum over k of |J_n ... J_(k+1)| delta_k along a run of states (steps + 1, n): (steps + 1, 2n).

    Infinite from where the run has diverged, or the band is far too wide to judge by.
    """
    ran = int(np.cumsum(~np.isfinite([*q.T, *qd.T]).all(axis=0)).searchsorted(1))
    q, qd, steps = q[: ran - 1], qd[: ran - 1], len(q)
    jacobians = step_jacobians(stepping, q, qd, tau, dt)
    delta = step_rounding(stepping, q, qd, tau, dt)
    count, size = delta.shape
    widths = np.full((steps, size), np.inf)
    widths[0] = 0.0
    carried = np.empty((size, count, size))  # carried[:, k]: J_n ... J_(k+1), what has become of step k's rounding
    for n, J in enumerate(jacobians):
        carried[:, :n] = np.tensordot(J, carried[:, :n], axes=1)
        carried[:, n] = np.eye(size)
        widths[n + 1] = np.abs(carried[:, : n + 1]).reshape(size, -1) @ delta[: n + 1].ravel()
        if not widths[n + 1].max() < 1e6 * NARROW:
            break
    return widths
