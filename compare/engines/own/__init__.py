"""A user's equations as an engine, integrated by the same RK4 as tmt's."""

from collections.abc import Iterable, Mapping
from functools import partial

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

import tmt
from tmt.methods.stepping import stepped

from ...robots.case import Case
from .. import GRID, EngineRecord, Method, Motion, Prepared, Setting, as_far_as_it_goes, rows_of_states
from .equations import OwnEquations, passive
from .functions import METHOD_NAMES, QUANTITIES, QUICK, OwnError, Problem

__all__ = ["METHOD_NAMES", "QUANTITIES", "QUICK", "Own", "OwnDynamics", "OwnEquations", "OwnError", "Problem"]

ENGINE = EngineRecord(order=50, label="yours", possessive="your", from_file=True)
RK4_SCHEMES = ("rk4", "rk4_mean_speed")  # the second where a ball makes MuJoCo's RK4 another scheme


class Own:
    """The engine of a user's equations. schemes: those of RK4_SCHEMES that this robot needs besides rk4."""

    name = "own"

    def __init__(self, equations: OwnEquations, schemes: Iterable[str] = ()):
        self.equations, needed = equations, {*schemes, "rk4"}
        names = [name for name in RK4_SCHEMES if name in needed]
        self.methods = {name: Method(self.name, name, tmt.METHODS[name].order, name) for name in names}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """None if a robot's own actuators act: the equations do not have them."""
        return {} if case.controller else self.methods

    def unavailable(self) -> str | None:
        return None

    def of(self, case: Case) -> "OwnDynamics":
        return OwnDynamics(self.equations, case)


class OwnDynamics:
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

    def potential_energy(self, q: ndarray) -> ndarray:
        """The energy at rest, J, (...), from the zero of the equations."""
        return self.energy(q, np.zeros(self.coordinates.nv))

    def com_positions(self, q: ndarray) -> ndarray:
        return self.equations.com_positions(self.all_q(q))

    def jacobians(self, q: ndarray) -> tuple[ndarray, ndarray]:
        T, B = self.equations.jacobians(self.all_q(q))
        return T[..., self.free], B[..., self.free]

    def run(
        self, q: ArrayLike, v: ArrayLike, tau: ArrayLike, dt: float, steps: int, method: str = "rk4",
        tolerance: float | None = None,
    ) -> Motion:  # fmt: skip
        """Motion under constant torque; NaN from where a run diverges."""
        if tolerance is not None:
            raise ValueError(f"method {method!r} has a fixed step and takes no tolerance")
        batch, (q, v, torque) = rows_of_states(q, v, tau)
        t, nq = dt * np.arange(steps + 1), q.shape[1]
        states = np.full((len(q), steps + 1, nq + v.shape[1]), np.nan)
        states[:, 0] = np.concatenate([q, v], axis=1)

        def slope(q: list[ndarray], v: list[ndarray]) -> list[ndarray]:
            q_rows, v_rows = (np.stack([np.broadcast_to(a, len(torque)) for a in x], axis=-1) for x in (q, v))
            return list(np.moveaxis(self.acceleration(q_rows, v_rows, torque), -1, 0))

        with np.errstate(all="ignore"):  # a run may diverge
            for k in range(steps):
                columns = list(states[:, k].T)
                after = stepped(tmt.METHODS[method], self.tree, slope, columns[:nq], columns[nq:], dt)
                states[:, k + 1] = np.stack([*after[0], *after[1]], axis=-1)
                if not np.isfinite(states[:, k + 1, nq:]).any():
                    break
        runs = [as_far_as_it_goes(t, path, path[0], "a number is not finite") for path in states]
        paths = np.array([path for path, _ in runs]).reshape(*batch, *states.shape[1:])
        ended = np.array([why for _, why in runs], dtype=object).reshape(batch)[()]
        return Motion(t, paths[..., :nq], paths[..., nq:], 4 * steps * len(q), ended, steps)

    def prepare(self, q: ndarray, v: ndarray, tau: ndarray, setting: Setting, method: str) -> Prepared:
        every, steps = setting.every, setting.every * GRID
        dt, t = setting.duration / steps, np.linspace(0.0, setting.duration, GRID + 1)

        def read(motion: Motion) -> Motion:
            return motion._replace(t=t, q=motion.q[::every].copy(), v=motion.v[::every].copy())

        return partial(self.run, q, v, tau, dt, steps, method, setting.tolerance), read
