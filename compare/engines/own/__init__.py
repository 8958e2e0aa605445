"""A user's equations as an engine, integrated by the same RK4 as tmt's."""

from collections.abc import Iterable, Mapping

import numpy as np

import tmt
from tmt import literal
from tmt.methods.stepping import stepped

from ...robots.case import Case
from .. import GRID, EngineRecord, Method, Motion, Prepared, Setting, rows_of_states
from .equations import OwnEquations
from .functions import ARGUMENTS, QUICK, OwnError, Problem, in_shape, is_function, numbers_of, state_in_words

__all__ = ["ARGUMENTS", "QUICK", "Own", "OwnDynamics", "OwnEquations", "OwnError", "Problem", "is_function"]
__all__ += ["in_shape", "numbers_of", "state_in_words"]

ENGINE = EngineRecord(order=50, label="yours", possessive="your", from_file=True)
RK4_SCHEMES = ("rk4", "rk4_mean_speed")  # the second where a ball makes MuJoCo's RK4 another scheme


class Own:
    """The engine of a user's equations. schemes: those of RK4_SCHEMES that this robot needs besides rk4."""

    name = "own"

    def __init__(self, equations: OwnEquations, schemes: Iterable[str] = ()):
        self.equations, self.schemes = equations, set(schemes) | {"rk4"}

    @property
    def methods(self) -> Mapping[str, Method]:
        names = [name for name in RK4_SCHEMES if name in self.schemes]
        return {name: Method(self.name, name, tmt.METHODS[name].order, name) for name in names}

    def methods_in(self, case: Case) -> Mapping[str, Method]:
        """None if a robot's own actuators act: the equations do not have them."""
        return {} if case.controller else self.methods

    def unavailable(self) -> str | None:
        return None

    def of(self, case: Case) -> "OwnDynamics":
        return OwnDynamics(self.equations, case)


class OwnDynamics:
    """A case in a user's equations.

    A case without gravity subtracts the gravity of the equations, or their bias at rest. Added damping acts as a torque. Locked
    joints have no rows and columns.
    """

    def __init__(self, equations: OwnEquations, case: Case):
        self.equations, self.case, self.coordinates = equations, case, case.coordinates
        self.tree = case.tree  # for its damping and springs only
        whole = case.robot.coordinates
        free = [place for name, place in zip(whole.names, whole.places.joints) if name in case.joints]
        self.free_q = [i for place in free for i in range(place.q.start, place.q.stop)]
        self.free_v = [i for place in free for i in range(place.qd.start, place.qd.stop)]
        self.still = np.array(case.posture if case.locked else np.zeros(whole.nq), float)
        self.nv = whole.nv

    def has(self, name: str) -> bool:
        return self.equations.has(name)

    def whole(self, q, *others) -> list[np.ndarray]:
        """Values for all joints: q (..., nq) with the positions of locked joints, others (..., nv) with zeros for them."""
        q = np.asarray(q, float)
        every = np.broadcast_to(self.still, (*q.shape[:-1], len(self.still))).copy()
        every[..., self.free_q] = q
        full_states = [every]
        for values in others:
            values = np.asarray(values, float)
            full = np.zeros((*values.shape[:-1], self.nv))
            full[..., self.free_v] = values
            full_states.append(full)
        return full_states

    def mass_matrix(self, q) -> np.ndarray:
        M = self.equations.mass_matrix(*self.whole(q))
        return M[..., self.free_v, :][..., self.free_v]

    def bias(self, q, v) -> np.ndarray:
        q, v = self.whole(q, v)
        h = self.equations.bias(q, v)
        return (h if self.case.scene.gravity else h - self.equations.gravity_balance(q))[..., self.free_v]

    def gravity_balance(self, q) -> np.ndarray:
        weight = self.equations.gravity_balance(*self.whole(q))
        return weight[..., self.free_v] * self.case.scene.gravity

    def acceleration(self, q, v, tau) -> np.ndarray:
        case, own = self.case, self.equations
        if not case.locked:
            lifted = 0.0 if case.scene.gravity else own.gravity_balance(q)
            return own.acceleration(q, v, np.asarray(tau) - case.added_damping * v + lifted)
        forces = tau - np.array(self.tree.damping) * v - self.bias(q, v)
        if self.tree.has_springs:
            forces = forces - literal.spring_torque(q, self.tree)
        return np.linalg.solve(self.mass_matrix(q), forces[..., None])[..., 0]

    def energy(self, q, v) -> np.ndarray:
        return self.equations.energy(*self.whole(q, v))

    def potential_energy(self, q) -> np.ndarray:
        """The energy at rest, J, (...), from the zero of the equations."""
        return self.energy(q, np.zeros(self.coordinates.nv))

    def com_positions(self, q) -> np.ndarray:
        return self.equations.com_positions(*self.whole(q))

    def jacobians(self, q) -> tuple[np.ndarray, np.ndarray]:
        T, B = self.equations.jacobians(*self.whole(q))
        return T[..., self.free_v], B[..., self.free_v]

    def run(self, q, v, tau, dt, steps, method="rk4", tolerance=None) -> Motion:
        """Motion under constant torque; NaN from where a run diverges."""
        if tolerance is not None:
            raise ValueError(f"method {method!r} has a fixed step and takes no tolerance")
        batch, (q, v, tau) = rows_of_states(q, v, tau)
        scheme, joints = tmt.METHODS[method], self.tree
        path_q, path_v = (np.full((len(part), steps + 1, part.shape[1]), np.nan) for part in (q, v))
        path_q[:, 0], path_v[:, 0] = q, v

        def slope(q: list, v: list) -> list:
            state = (np.stack([np.broadcast_to(a, len(tau)) for a in part], axis=-1) for part in (q, v))
            return list(np.moveaxis(self.acceleration(*state, tau), -1, 0))

        with np.errstate(all="ignore"):  # a run may diverge
            for k in range(steps):
                parts = ([path[:, k, i] for i in range(path.shape[2])] for path in (path_q, path_v))
                for path, after in zip((path_q, path_v), stepped(scheme, joints, slope, *parts, dt)):
                    path[:, k + 1] = np.stack(after, axis=-1)
                if not np.isfinite(path_v[:, k + 1]).any():
                    break
        return self.motion(batch, path_q, path_v, dt, 4 * steps * len(q))

    def motion(self, batch, path_q, path_v, dt, evaluations) -> Motion:
        """The paths of runs, (runs, steps + 1, ...), as a Motion."""
        steps = path_q.shape[1] - 1
        finite = np.isfinite(path_q).all(axis=2) & np.isfinite(path_v).all(axis=2)
        ended = np.full(len(path_q), None, dtype=object)
        for run in np.flatnonzero(~finite.all(axis=1)):
            first = int(np.argmin(finite[run]))
            path_q[run, first:] = path_v[run, first:] = np.nan
            ended[run] = f"at t = {dt * max(0, first - 1):g} s: a number is not finite"
        q, v = (path.reshape(*batch, *path.shape[1:]) for path in (path_q, path_v))
        return Motion(dt * np.arange(steps + 1), q, v, evaluations, ended.reshape(batch)[()], steps)

    def prepare(self, q, v, tau, setting: Setting, method) -> Prepared:
        every = setting.every

        def run() -> Motion:
            return self.run(
                q, v, tau, setting.duration / setting.steps, setting.steps, method, setting.tolerance
            )

        def read(motion: Motion) -> Motion:
            t = np.linspace(0.0, setting.duration, GRID + 1)
            return motion._replace(t=t, q=motion.q[::every].copy(), v=motion.v[::every].copy())

        return run, read
