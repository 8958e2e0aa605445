"""SciPy's solve_ivp with tmt's compiled equations."""

from collections.abc import Callable, Iterable, Mapping
from typing import Any

import numpy as np

from tmt.compiled import Evaluator

from ..robots.case import Case
from ..robots.coordinates import Coordinates
from . import Array, Course, Engine, Method, Motion, OneByOne, Prepared
from .tmt import TmtQuantities

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


class ScipyDynamics(TmtQuantities, OneByOne):
    """tmt's quantities; runs by SciPy."""

    def rate(self) -> Callable[[Array, Array], Array]:
        """rate(y, tau): dy/dt of y = (q, v), (nq + nv,)."""
        acceleration, tree, nq = Evaluator(self.tree, "acceleration").of_one, self.tree, self.coordinates.nq
        has_balls = bool(tree.coordinates.balls)

        def rate(y: Array, tau: Array) -> Array:
            q, v = y[:nq], y[nq:]
            if has_balls:  # between its steps a solver lets quaternions drift
                q = of_length_1(self.coordinates, q[None])[0]
            a = acceleration(q, v, tau)
            if a is None:  # the equations have no acceleration there
                a = np.full(len(v), np.nan)
            q_rates = tree.coordinates.component_rates(y[:nq], v) if has_balls else v
            return np.concatenate((q_rates, a))

        return rate

    def prepared(self, course: Course) -> Prepared:
        from scipy.integrate import solve_ivp

        rate, torque, t = self.rate(), np.array(course.tau, float), course.times
        tolerance = DEFAULT if course.tolerance is None else course.tolerance
        options = {"rtol": max(tolerance, LEAST_RELATIVE), "atol": tolerance}

        def slope(time: float, y: Array) -> Array:
            rates = rate(np.ascontiguousarray(y), torque)  # Radau gives columns of a matrix
            if not np.isfinite(rates).all():  # solve_ivp would try ever smaller steps without end
                raise FloatingPointError
            return rates

        def run() -> Any:  # SciPy's result; None of a motion that cannot be followed
            try:
                return solve_ivp(slope, (0.0, t[-1]), course.start, course.method, t_eval=t, **options)
            except FloatingPointError:
                return None

        def read(solution: Any) -> Motion:
            states, evaluations, why = course.start[None], 1, "its slope is not finite"
            if solution is not None:
                states, evaluations = solution.y.T, int(solution.nfev)
                why = why if solution.success else solution.message
            motion = course.motion(states, why)
            return motion._replace(q=of_length_1(self.coordinates, motion.q), evaluations=evaluations)

        return run, read


def of_length_1(coordinates: Coordinates, q: Array) -> Array:
    """Positions (times, nq) with quaternions divided by their length, which a coarse tolerance lets drift."""
    q = q.copy()
    for joint in coordinates.places.balls:
        q[:, joint.q] /= np.linalg.norm(q[:, joint.q], axis=1, keepdims=True)
    return q
