"""SciPy's solve_ivp with tmt's compiled equations."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from tmt.compiled import evaluator

from ..robots.case import Case
from ..robots.coordinates import Coordinates
from . import (
    GRID,
    Engine,
    EngineRecord,
    Method,
    Motion,
    Prepared,
    Setting,
    batch_of,
    motion_of_states,
    rows_of_states,
)
from .tmt import TmtDynamics

ENGINE = EngineRecord(order=30, label="SciPy", colour="#009E73", marker="^")
DEFAULT = 1e-9  # tolerance
LEAST_RELATIVE = 2.3e-14  # that solve_ivp takes
NAMES = "RK45", "DOP853", "Radau", "LSODA"


class Scipy(Engine):
    name = "scipy"
    methods: Mapping[str, Method] = {name: Method("scipy", name, None, name, adaptive=True) for name in NAMES}

    def of(self, case: Case) -> "ScipyDynamics":
        return ScipyDynamics(case)


def engine(schemes: Iterable[str]) -> Scipy:
    return Scipy()


class ScipyDynamics(TmtDynamics):
    """tmt's quantities; runs by SciPy."""

    def rate(self) -> Callable[[np.ndarray, np.ndarray], np.ndarray]:
        """rate(y, tau): dy/dt of y = (q, v), (nq + nv,)."""
        acceleration, tree, nq = evaluator(self.tree, "acceleration").of_one, self.tree, self.coordinates.nq
        has_balls = bool(tree.coordinates.balls)

        def rate(y: np.ndarray, tau: np.ndarray) -> np.ndarray:
            q, v = y[:nq], y[nq:]
            if has_balls:  # between its steps a solver lets quaternions drift
                q = of_length_1(self.coordinates, q[None])[0]
            a = acceleration(q, v, tau)
            if a is None:  # the equations have no acceleration there
                a = np.full(len(v), np.nan)
            q_rates = tree.coordinates.component_rates(y[:nq], v) if has_balls else v
            return np.concatenate((q_rates, a))

        return rate

    def run(
        self,
        q: np.ndarray,
        v: np.ndarray,
        tau: np.ndarray,
        dt: float,
        steps: int,
        method: str,
        tolerance: float | None = None,
    ) -> Motion:
        batch, states = rows_of_states(q, v, tau)
        t, motions = np.linspace(0.0, dt * steps, steps + 1), []
        for position, speed, torque in zip(*states):
            run, read = self.prepared(position, speed, torque, t, method, tolerance)
            motions.append(read(run()))
        return batch_of(motions, batch)

    def prepare(
        self, q: np.ndarray, v: np.ndarray, tau: np.ndarray, setting: Setting, method: str
    ) -> Prepared:
        t = np.linspace(0.0, setting.duration, GRID + 1)
        return self.prepared(q, v, tau, t, method, setting.tolerance)

    def prepared(
        self,
        q: np.ndarray,
        v: np.ndarray,
        tau: np.ndarray,
        t: np.ndarray,
        method: str,
        tolerance: float | None,
    ) -> Prepared:
        """As in `prepare`, read at the times t."""
        from scipy.integrate import solve_ivp

        rate, tolerance = self.rate(), DEFAULT if tolerance is None else tolerance
        start, torque = np.concatenate([q, v]), np.array(tau, float)
        options = {"rtol": max(tolerance, LEAST_RELATIVE), "atol": tolerance}

        def slope(time: float, y: np.ndarray) -> np.ndarray:
            rates = rate(np.ascontiguousarray(y), torque)  # Radau gives columns of a matrix
            if not np.isfinite(rates).all():  # solve_ivp would try ever smaller steps without end
                raise NotFinite(time)
            return rates

        def run(times: np.ndarray = t) -> Any:  # SciPy's result, or NotFinite
            try:
                return solve_ivp(slope, (0.0, times[-1]), start, method, t_eval=times, **options)
            except NotFinite as error:
                return error

        def read(solution: Any) -> Motion:
            times = t
            while isinstance(solution, NotFinite) and len(times) > 2:  # once more, as far as it goes
                count = int(np.searchsorted(t, solution.time)) + 1
                times = t[: max(2, min(len(times) - 1, count))]
                solution = run(times)
            states, evaluations, why = start[None], 1, "its slope is not finite"
            if not isinstance(solution, NotFinite):
                states, evaluations = solution.y.T, int(solution.nfev)
                why = why if solution.success else solution.message
            motion = motion_of_states(t, states, start, self.coordinates.nq, why)
            q = of_length_1(self.coordinates, motion.q)
            return motion._replace(q=q, evaluations=evaluations)

        return run, read


class NotFinite(ArithmeticError):
    """A slope that is not finite."""

    def __init__(self, time: float):
        self.time = time  # s


def of_length_1(coordinates: Coordinates, q: np.ndarray) -> np.ndarray:
    """Positions (times, nq) with each quaternion divided by its length, which a coarse tolerance lets drift."""
    q = q.copy()
    for joint in coordinates.places.balls:
        q[:, joint.q] /= np.linalg.norm(q[:, joint.q], axis=1, keepdims=True)
    return q
