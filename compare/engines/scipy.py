"""SciPy's solve_ivp with tmt's compiled equations."""

from collections.abc import Callable, Iterable
from typing import ClassVar

import numpy as np

from tmt.compiled import evaluator

from ..robots.case import Case, Coordinates
from . import GRID, Engine, EngineRecord, Method, Motion, Prepared, Setting, as_far_as_it_goes, rows_of_states
from .tmt import TmtDynamics

ENGINE = EngineRecord(order=30, label="SciPy", colour="#009E73", marker="^")
DEFAULT = 1e-9  # tolerance
LEAST_RELATIVE = 2.3e-14  # that solve_ivp takes


class Scipy(Engine):
    name = "scipy"
    methods: ClassVar = {
        name: Method("scipy", name, None, name, adaptive=True)
        for name in ("RK45", "DOP853", "Radau", "LSODA")
    }

    def of(self, case: Case) -> "ScipyDynamics":
        return ScipyDynamics(case)


def engine(schemes: Iterable[str]) -> Scipy:
    return Scipy()


class ScipyDynamics(TmtDynamics):
    """tmt's quantities; runs by SciPy."""

    def rate(self) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """rate(y, tau): dy/dt of y = (q, v), (nq + nv,)."""
        acceleration, tree, nq = evaluator(self.tree, "acceleration").of_one, self.tree, self.coordinates.nq
        flat = not tree.coordinates.balls

        def rate(y, tau):
            q, v = y[:nq], y[nq:]
            # between its steps a solver lets quaternions drift
            a = acceleration(q if flat else of_length_1(self.coordinates, q[None])[0], v, tau)
            if a is None:  # the equations have no acceleration there
                a = np.full(len(v), np.nan)
            return np.concatenate((v if flat else tree.coordinates.component_rates(q, v), a))

        return rate

    def run(self, q, v, tau, dt, steps, method, tolerance=None) -> Motion:
        batch, states = rows_of_states(q, v, tau)
        t, motions = np.linspace(0.0, dt * steps, steps + 1), []
        for state in zip(*states):
            run, read = self.prepared(*state, t, method, tolerance)
            motions.append(read(run()))
        q, v = (
            np.array([getattr(m, name) for m in motions]).reshape(*batch, len(t), -1) for name in ("q", "v")
        )
        ended = np.array([m.ended for m in motions], dtype=object).reshape(batch)[()]
        counts = [m.evaluations for m in motions]
        return Motion(t, q, v, None if None in counts else sum(counts), ended)

    def prepare(self, q, v, tau, setting: Setting, method) -> Prepared:
        return self.prepared(
            q, v, tau, np.linspace(0.0, setting.duration, GRID + 1), method, setting.tolerance
        )

    def prepared(self, q, v, tau, t, method, tolerance) -> Prepared:
        from scipy.integrate import solve_ivp

        rate, tolerance = self.rate(), DEFAULT if tolerance is None else tolerance
        start, torque, nothing = np.concatenate([q, v]), np.array(tau, float), np.zeros(len(q) + len(v))
        options = {"rtol": max(tolerance, LEAST_RELATIVE), "atol": tolerance}

        def slope(time, y):
            result = rate(np.ascontiguousarray(y), torque)  # Radau gives columns of a matrix
            if result @ nothing != 0.0:  # solve_ivp would try ever smaller steps without end
                raise NotFinite(time)
            return result

        def run(times=t):
            try:
                return solve_ivp(slope, (0.0, times[-1]), start, method, t_eval=times, **options)
            except NotFinite as error:
                return error

        def read(solution):
            times = t
            while isinstance(solution, NotFinite) and len(times) > 2:  # once more, as far as it goes
                times = t[: max(2, min(len(times) - 1, np.searchsorted(t, solution.args[0]) + 1))]
                solution = run(times)
            states, evaluations, why = start[None], 1, "its slope is not finite"
            if not isinstance(solution, NotFinite):
                states, evaluations = solution.y.T, int(solution.nfev)
                why = why if solution.success else solution.message
            path, ended = as_far_as_it_goes(t, states, start, why)
            q, v = np.split(path, [self.coordinates.nq], axis=1)
            return Motion(t, of_length_1(self.coordinates, q), v, evaluations, ended)

        return run, read


class NotFinite(ArithmeticError):
    """A slope at a time, s, that is not finite."""


def of_length_1(coordinates: Coordinates, q: np.ndarray) -> np.ndarray:
    """Positions (times, nq) with each quaternion divided by its length, which a coarse tolerance lets drift."""
    q = q.copy()
    for joint in coordinates.places.balls:
        q[:, joint.q] /= np.linalg.norm(q[:, joint.q], axis=1, keepdims=True)
    return q
