"""A user's equations as an engine, integrated by the same RK4 as tmt's."""

from collections.abc import Iterable, Mapping

import numpy as np
from numpy import ndarray

import tmt

from ...robots.case import Case
from .. import Course, Engine, Method, Motion, OneByOne, Prepared
from .equations import OwnEquations, passive
from .functions import METHOD_NAMES, QUANTITIES, QUICK, OwnError, Problem

__all__ = ["METHOD_NAMES", "QUANTITIES", "QUICK", "Own", "OwnDynamics", "OwnEquations", "OwnError", "Problem"]

RK4_SCHEMES = ("rk4", "rk4_mean_speed")  # the second where a ball makes MuJoCo's RK4 another scheme


class Own(Engine):
    """The engine of a user's equations. schemes: those of RK4_SCHEMES that this robot needs besides rk4."""

    name = "own"
    methods: Mapping[str, Method] = {}

    def __init__(self, equations: OwnEquations, schemes: Iterable[str] = ()):
        self.equations, needed = equations, {*schemes, "rk4"}
        names = [name for name in RK4_SCHEMES if name in needed]
        self.methods = {name: Method(self.name, name, tmt.METHODS[name].order, name) for name in names}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """None if a robot's own actuators act: the equations do not have them."""
        return {} if case.controller else self.methods

    def of(self, case: Case) -> "OwnDynamics":
        return OwnDynamics(self.equations, case)


class OwnDynamics(OneByOne):
    """A case in a user's equations.

    A case without gravity subtracts the gravity of the equations, or their bias at rest. Added damping acts
    as a torque. Locked joints have no rows and columns.
    """

    def __init__(self, equations: OwnEquations, case: Case):
        self.equations, self.case, self.coordinates = equations, case, case.coordinates
        self.tree = case.tree  # for its damping and springs only
        self.free, self.all_q = case.indices("qd"), case.positions_of_all

    def has(self, name: str) -> bool:
        return self.equations.has(name)

    def all_v(self, v: ndarray) -> ndarray:
        """The speeds of all joints, zero for the locked ones, (..., nv)."""
        speeds = np.zeros((*np.shape(v)[:-1], self.equations.coordinates.nv))
        speeds[..., self.free] = v
        return speeds

    def mass_matrix(self, q: ndarray) -> ndarray:
        return self.equations.mass_matrix(self.all_q(q))[..., self.free, :][..., self.free]

    def bias(self, q: ndarray, v: ndarray) -> ndarray:
        q, v = self.all_q(q), self.all_v(v)
        h = self.equations.bias(q, v)
        return (h if self.case.scene.gravity else h - self.equations.gravity_balance(q))[..., self.free]

    def gravity_balance(self, q: ndarray) -> ndarray:
        return self.equations.gravity_balance(self.all_q(q))[..., self.free] * self.case.scene.gravity

    def acceleration(self, q: ndarray, v: ndarray, tau: ndarray) -> ndarray:
        case, equations = self.case, self.equations
        if case.locked:
            forces = tau - passive(self.tree, q, v) - self.bias(q, v)
            return np.linalg.solve(self.mass_matrix(q), forces[..., None])[..., 0]
        lifted = 0.0 if case.scene.gravity else equations.gravity_balance(q)
        return equations.acceleration(q, v, np.asarray(tau) - case.added_damping * v + lifted)

    def energy(self, q: ndarray, v: ndarray) -> ndarray:
        return self.equations.energy(self.all_q(q), self.all_v(v))

    def com_positions(self, q: ndarray) -> ndarray:
        return self.equations.com_positions(self.all_q(q))

    def jacobians(self, q: ndarray) -> tuple[ndarray, ndarray]:
        T, B = self.equations.jacobians(self.all_q(q))
        return T[..., self.free], B[..., self.free]

    def prepared(self, course: Course) -> Prepared:
        if course.tolerance is not None:
            raise ValueError(f"method {course.method!r} has a fixed step and takes no tolerance")
        scheme, nq = tmt.METHODS[course.method], len(course.q)

        def slope(q: list[ndarray], v: list[ndarray]) -> list[ndarray]:
            return list(self.acceleration(np.array(q), np.array(v), course.tau))

        def run() -> ndarray:
            states = [course.start]
            with np.errstate(all="ignore"):  # a run may diverge
                while len(states) <= course.steps and np.isfinite(states[-1]).all():
                    q, v = list(states[-1][:nq]), list(states[-1][nq:])
                    q, v = scheme.step(slope, q, v, course.dt, self.tree.coordinates)
                    states.append(np.array([*q, *v]))
            return np.array(states)

        def read(states: ndarray) -> Motion:
            motion = course.motion(states[:: course.every], "a number is not finite")
            return motion._replace(evaluations=4 * course.steps, steps=course.steps)

        return run, read
