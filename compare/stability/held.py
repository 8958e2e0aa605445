"""The linearized equations of motion at a held posture: its modes, and the steps of a method there."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import Any, TypeGuard

import numpy as np
from scipy.linalg import eig

import tmt
from tmt import METHODS, literal
from tmt.derivation import composite, method
from tmt.derivation.dual import Dual, seeded
from tmt.methods import RungeKutta, amplification
from tmt.methods.implicit import ImplicitRungeKutta
from tmt.methods.stepping import Method, Tableau

from ..robots import Robot
from ..robots.case import SEED, Case
from ..robots.coordinates import floats

LONGEST_STEP, SHORTEST_STEP = 1e3, 1e-4  # s: the range in which a limit is searched
SCANNED = 281  # steps in this range, 40 for each power of ten
NEUTRAL = 1e-9  # growth per step that can be rounding
NEGLIGIBLE = 1e-6  # relative to the fastest mode: a rate below is zero
SLOWEST = 1e-6  # 1/s: a rate below is zero
AT_ONE = (1e-7, 1e-3)  # least and largest distance from 1 of the growth of a mode without stiffness


@dataclass(frozen=True)
class Held:
    """A posture under its holding torque, and the equations of motion linearized there."""

    case: Case  # held at a posture, at rest

    @property
    def name(self) -> str:
        return str(self.case.scene.posture)

    @property
    def damping(self) -> float:
        """Added to all joints, N m s/rad."""
        return float(np.max(self.case.scene.damping))

    @property
    def tree(self) -> tmt.Tree:
        return self.case.tree

    @property
    def q(self) -> np.ndarray:
        return self.case.q

    @property
    def nv(self) -> int:
        return len(self.tau)

    @property
    def tau(self) -> np.ndarray:
        return self.case.tau

    def moved(self, by: np.ndarray) -> np.ndarray:
        """The positions after movements from the posture, (..., nv) -> (..., nq)."""
        return self.case.coordinates.move(self.q, by)

    @property
    def sizes(self) -> np.ndarray:
        """The numbers whose last digit limits the accuracy of movements, (nv,): angles, lengths, and 1 for a quaternion."""
        if not self.tree.coordinates.balls:
            return self.q
        joints = self.tree.coordinates.joints
        return np.concatenate([np.ones(3) if kind == "ball" else self.q[q] for kind, q, _ in joints])

    @cached_property
    def mass_matrix(self) -> np.ndarray:
        return literal.mass_matrix(self.q, self.tree)

    @cached_property
    def matrix(self) -> np.ndarray:
        """d(qd, qdd)/d(q, qd), (2nv, 2nv), for movements of q: TMT's right-hand side differentiated by dual numbers."""
        nq, n, unit = len(self.q), self.nv, np.eye(2 * self.nv)
        start = [float(x) for x in self.q]
        state = seeded(
            [*start, *np.zeros(n)], [*self.tree.coordinates.component_rates(start, unit[:n]), *unit[n:]]
        )
        tau = [float(t) for t in self.tau]
        qdd = method.acceleration(self.tree, state[:nq], state[nq:], tau, composite.mass_matrix_and_bias)
        return np.vstack([unit[n:], slopes(state, qdd)])

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues, 1/s, of `matrix`, the largest real part first, and their eigenvectors in columns, q before qd."""
        values, vectors = np.linalg.eig(self.matrix)
        values, vectors = values.astype(complex), vectors.astype(complex)
        order = np.lexsort([-values.imag, -np.abs(values.imag), -values.real.round(9)])
        return values[order], vectors[:, order]

    @property
    def small(self) -> float:
        """Below this a rate is zero, 1/s."""
        return max(NEGLIGIBLE * np.abs(self.modes[0]).max(), SLOWEST)

    @property
    def without_stiffness(self) -> np.ndarray:
        """Which eigenvalues are zero, (2nv,)."""
        return np.abs(self.modes[0]) <= self.small

    @cached_property
    def measures(self) -> np.ndarray:
        """Left eigenvectors: measures @ deviation (2nv,) is the share of each mode with a rate, scaled as in `shapes`."""
        if not self.without_stiffness.any():
            return np.linalg.inv(self.shapes)
        # modes without a rate may have a common eigenvector, and have no measure
        values, left = eig(self.matrix, left=True, right=False)
        left = left[:, np.abs(values) > self.small].conj().T
        return np.linalg.solve(left @ self.shapes, left)

    @property
    def shapes(self) -> np.ndarray:
        """The modes with a rate, (2nv, modes), each with a largest angle of 1 rad."""
        vectors = self.modes[1][:, ~self.without_stiffness]
        return vectors / vectors[np.argmax(np.abs(vectors[: self.nv]), axis=0), np.arange(vectors.shape[1])]

    @property
    def kind(self) -> str:
        """saddle: a mode grows; marginal: a mode has the rate zero; centre: all modes swing or decay."""
        values, small = self.modes[0], self.small
        if values.real.max() > small:
            return "saddle"
        return "marginal" if np.abs(values).min() <= small else "centre"

    def curvature(self, direction: np.ndarray) -> np.ndarray:
        """The second derivative of the holding torque along a movement (nv,), N m, (nv,): by nested dual numbers."""
        inner = moving(self.tree, self.q, direction)
        outer = moving(self.tree, inner, direction)
        torque = holding(self.tree, outer)
        return np.array([float(inner[0].parts(outer[0].parts(component)[1])[1]) for component in torque])

    @cached_property
    def stays(self) -> bool:
        """Whether a small deviation stays small: no mode grows, and no torque acts along movements without stiffness."""
        if self.kind != "marginal":
            return self.kind == "centre"
        by_movement = self.matrix[self.nv :, : self.nv]
        _, sizes, rows = np.linalg.svd(by_movement)
        soft = rows[sizes <= max(NEGLIGIBLE**2 * sizes.max(), SLOWEST**2)].T
        push = self.curvature(soft @ np.random.default_rng(SEED).normal(size=soft.shape[1])) @ soft
        return bool(
            np.abs(push).max(initial=0.0) <= NEGLIGIBLE * np.abs(self.mass_matrix @ by_movement).max()
        )

    def step(self, name: str, dt: float) -> np.ndarray:
        """The amplification matrix of a step of a method of tmt, (2nv, 2nv)."""
        return amplification(METHODS[name], self.tree, self.q, np.zeros(self.nv), self.tau, dt)

    def growth(self, name: str, dt: np.ndarray | float) -> np.ndarray:
        """The spectral radius of `step`, (...) for dt (...). The growth of a mode without stiffness is 1."""
        stepping, dt = METHODS[name], np.asarray(dt, float)
        idle = self.without_stiffness
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            if is_runge_kutta(stepping):
                z = dt[..., None] * np.where(idle, 0.0, self.modes[0])
                return np.abs(growth_of(stepping, z)).max(axis=-1)
            each = np.atleast_1d(dt)[:, None, None]
            steps = amplification(stepping, self.tree, self.q, np.zeros(self.nv), self.tau, each)
            factors = np.linalg.eigvals(steps).reshape(*dt.shape, -1)
            if idle.any():
                near = np.clip(self.small * dt, *AT_ONE)[..., None]
                factors = np.where(np.abs(factors - 1.0) <= near, 1.0, factors)
            return np.abs(factors).max(axis=-1)

    def limit(self, name: str) -> tuple[str, float | None]:
        """("finite", dt in s), ("never_fails", None) or ("always_fails", None): the largest step at which no mode grows.

        The first unstable step of 40 for each power of ten, then refined.
        """
        low, high = min(SHORTEST_STEP, 1.0 / max(np.abs(self.modes[0]).max(), SLOWEST)), LONGEST_STEP
        for _ in range(4):
            steps = np.geomspace(low, high, SCANNED)
            fails = self.growth(name, steps) > 1.0 + NEUTRAL
            first = int(np.argmax(fails))
            if not fails.any() or first == 0:
                return ("always_fails" if fails.any() else "never_fails"), None
            low, high = steps[first - 1], steps[first]
        return "finite", float(low)

    def growing_rate(self, name: str, dt: float) -> float:
        """The rate |lambda|, 1/s, of the mode of the equations of motion nearest to the one that a step lets grow fastest."""
        factors, growing = np.linalg.eig(self.step(name, dt))
        shape = growing[: self.nv, np.argmax(np.abs(factors))]
        values, vectors = self.modes
        angles = vectors[: self.nv] / np.linalg.norm(vectors[: self.nv], axis=0)
        overlap = np.abs(angles.conj().T @ shape) / np.linalg.norm(shape)
        return float(np.abs(values[overlap > overlap.max() - 1e-6]).max())


def posture_names(robot: Robot) -> tuple[str, ...]:
    return (*robot.postures, *robot.positions)


@lru_cache(maxsize=64)
def held(robot: Robot, posture: str, damping: float = 0.0) -> Held:
    """A named posture under TMT's holding torque, with added joint damping, N m s/rad; without gravity if the robot floats."""
    gravity = not floats(robot.tree)
    return Held(
        robot.case(f"{posture}, held", posture=posture, torque="hold", damping=damping, gravity=gravity)
    )


# the step of a method


def is_runge_kutta(stepping: Method) -> TypeGuard[Tableau]:
    """Whether a method is one of tmt's Runge-Kutta methods, explicit or implicit; a subclass may step otherwise."""
    return type(stepping) in (RungeKutta, ImplicitRungeKutta)


def growth_of(stepping: Tableau, z: np.ndarray) -> np.ndarray:
    """The stability function of a Runge-Kutta method, 1 + z b (1 - z A)^-1 1, at z = lambda dt, of any shape."""
    z, stages = np.asarray(z), list[np.ndarray]()
    if type(stepping) is RungeKutta:
        for row in stepping.A:
            stages.append(1.0 + z * sum((a * stage for a, stage in zip(row, stages)), 0.0 * z))
        return 1.0 + z * sum(b * stage for b, stage in zip(stepping.b, stages))
    size = len(stepping.b)
    coupled = np.eye(size) - z[..., None, None] * np.array(stepping.A)
    return 1.0 + z * (np.linalg.solve(coupled, np.ones((*z.shape, size, 1)))[..., 0] @ np.array(stepping.b))


# forces at rest over any scalar, and their derivatives


def moving(tree: tmt.Tree, q: np.ndarray | Sequence[Any], directions: np.ndarray) -> list[Dual]:
    """The position q, (nq,) of any scalars, as dual numbers with these slopes of movements, directions (nv,): (nq,)."""
    start = [float(x) for x in q] if isinstance(q, np.ndarray) else q
    return seeded(start, tree.coordinates.component_rates(start, list(directions)))


def holding(tree: tmt.Tree, q: np.ndarray | Sequence[Any]) -> list[Any]:
    """The holding torque against gravity, springs and a controller, N m, (nv,), over any scalar."""
    torque = method.bias(method.bodies(tree, q), tree.gravity)
    if tree.has_springs:
        torque = [a + b for a, b in zip(torque, method.spring_torque(tree, q))]
    return (
        [a + b for a, b in zip(torque, method.fed_back(tree, q, [0.0] * len(torque)))]
        if tree.has_gains
        else torque
    )


def slopes(seeds: Sequence[Dual], values: Sequence[Any]) -> list[np.ndarray]:
    """The derivatives of values along the directions of these dual numbers."""
    shape = np.shape(seeds[0].slope)
    derivatives = [seeds[0].parts(value)[1] for value in values]
    return [np.broadcast_to(slope, shape) if np.ndim(slope) < len(shape) else slope for slope in derivatives]
