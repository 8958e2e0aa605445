"""SciPy's solve_ivp with tmt's compiled equations."""

import numpy as np

from tmt import kernels

from . import GRID, Method, Motion, Setting
from .tmt import TmtDynamics

TOLERANCE = 1e-9
LEAST_RELATIVE = 2.3e-14  # that solve_ivp takes


class Scipy:
    """The engine of SciPy's methods, all of which choose their own steps."""

    name = "scipy"
    methods = {name: Method("scipy", name, None, name, adaptive=True) for name in ("RK45", "DOP853", "Radau", "LSODA")}

    def unavailable(self) -> str | None:
        return None

    def of(self, case) -> "ScipyDynamics":
        return ScipyDynamics(case)


class ScipyDynamics(TmtDynamics):
    """The compiled equations of a case: what SciPy integrates."""

    def acceleration(self, q, v, tau) -> np.ndarray:
        shape = np.broadcast_shapes(np.shape(q), np.shape(v), np.shape(tau))
        states = [np.array(np.broadcast_to(a, shape), float).reshape(-1, shape[-1]) for a in (q, v, tau)]
        result = np.empty_like(states[0])
        kernels.evaluator(self.tree, "forward_dynamics").each(*states, result)
        return result.reshape(shape)

    def run(self, q, v, tau, dt, steps, method, tolerance=None) -> Motion:
        return each(self.solved, q, v, tau, np.linspace(0.0, dt * steps, steps + 1), method, tolerance or TOLERANCE)

    def solved(self, q, v, tau, t, method, tolerance) -> Motion:
        run, read = self.prepared(q, v, tau, t, method, tolerance)
        return read(run())

    def prepare(self, q, v, tau, setting: Setting, method):
        return self.prepared(q, v, tau, np.linspace(0.0, setting.duration, GRID + 1), method, setting.tolerance)

    def prepared(self, q, v, tau, t, method, tolerance):
        from scipy.integrate import solve_ivp

        rate = kernels.evaluator(self.tree, "forward_dynamics").rate
        start, torque = np.concatenate([q, v]), np.ascontiguousarray(tau, float)
        options = {"t_eval": t, "rtol": max(tolerance, LEAST_RELATIVE), "atol": tolerance}

        def run():
            return solve_ivp(lambda t, y: rate(y, torque), (0.0, t[-1]), start, method, **options)

        def read(solution):
            path = np.full((len(t), start.size), np.nan)
            path[: solution.y.shape[1]] = solution.y.T
            return Motion(t, *np.split(path, 2, axis=1), int(solution.nfev), None if solution.success else solution.message)

        return run, read


def each(solved, q, v, tau, *more) -> Motion:
    """The motions of a batch, one run after the other: solved(q, v, tau, *more) is the motion of one."""
    shape = np.broadcast_shapes(np.shape(q), np.shape(v), np.shape(tau))
    states = (np.broadcast_to(a, shape).reshape(-1, shape[-1]) for a in (q, v, tau))
    motions = [solved(*state, *more) for state in zip(*states)]
    batch, times = shape[:-1], motions[0].t
    q, v = (np.array([getattr(m, name) for m in motions]).reshape(*batch, len(times), -1) for name in ("q", "v"))
    ended = np.array([m.ended for m in motions], dtype=object).reshape(batch)[()]
    counts = [m.evaluations for m in motions]
    return Motion(times, q, v, None if None in counts else sum(counts), ended)
