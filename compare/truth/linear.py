"""The equations of motion linearised: small oscillations, modes of a held posture, and what one step of a method does to them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.linalg import eigh

import tmt
from tmt import METHODS, method
from tmt.dual import seeded
from tmt.methods import amplification

from ..case import Case

LONGEST_STEP, SHORTEST_STEP = 1e3, 1e-4  # s: steps among which a limit is sought
SCANNED = 281  # steps between these, 40 for each power of ten
NEUTRAL = 1e-9  # growth per step that rounding can pretend
NEGLIGIBLE = 1e-6  # relative to the fastest mode: a rate below is zero


def stiffness(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """d2V/dq2 at q, N m/rad, (n, n): exact, for V is a + b cos q_i + c sin q_i in each hinge angle."""
    quarter = np.pi / 2 * np.eye(len(q))
    return (tmt.gravity_balance(q + quarter, tree) - tmt.gravity_balance(q - quarter, tree)) / 2


def modes(tree: tmt.Tree, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, rad/s, and modes (columns) of small oscillations about a posture that rests, lowest first.

    K u = frequency^2 Mbar u, modes with u' Mbar u = 1.
    """
    squares, shapes = eigh(stiffness(tree, q), tmt.mass_matrix(q, tree))
    return np.sqrt(squares), shapes


def small_oscillation(t: np.ndarray, tree: tmt.Tree, q: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Angles, rad, (times, n), of the linear modes about q, let go at rest so far `away`, (n,) rad."""
    frequencies, shapes = modes(tree, q)
    parts = shapes.T @ tmt.mass_matrix(q, tree) @ away
    return q + np.cos(np.outer(t, frequencies)) * parts @ shapes.T


@dataclass(frozen=True)
class Held:
    """A posture under the torque that holds it, and the equations of motion linearised there."""

    case: Case  # held at a posture, at rest

    @property
    def name(self) -> str:
        """The posture's."""
        return self.case.scene.posture

    @property
    def tree(self) -> tmt.Tree:
        return self.case.tree

    @property
    def q(self) -> np.ndarray:
        """(n,) rad"""
        return self.case.q

    @property
    def tau(self) -> np.ndarray:
        """(n,) N m"""
        return self.case.tau

    @cached_property
    def steps(self) -> dict:
        """What `step` found, by method and dt."""
        return {}

    @cached_property
    def limits(self) -> dict:
        """What `limit` found, by method."""
        return {}

    @cached_property
    def mass_matrix(self) -> np.ndarray:
        """Mbar, kg m2, (n, n)."""
        return tmt.mass_matrix(self.q, self.tree)

    @cached_property
    def matrix(self) -> np.ndarray:
        """d(qd, qdd)/d(q, qd), (2n, 2n): exact derivatives of the right-hand side of TMT, by dual numbers."""
        n = len(self.q)
        state = seeded([*self.q, *np.zeros(n)], np.eye(2 * n))
        qdd = method.acceleration(self.tree, state[:n], state[n:], list(self.tau))
        return np.vstack([np.eye(2 * n)[n:], [component.slope for component in qdd]])

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues, 1/s, of `matrix`, the largest real part first, and their eigenvectors in columns, q before qd."""
        values, vectors = np.linalg.eig(self.matrix)
        values, vectors = values.astype(complex), vectors.astype(complex)
        order = np.lexsort([-values.imag, -np.abs(values.imag), -values.real.round(9)])
        return values[order], vectors[:, order]

    @property
    def kind(self) -> str:
        """saddle: a mode grows; marginal: a mode neither swings, grows nor decays; centre: all swing or decay."""
        values = self.modes[0]
        small = NEGLIGIBLE * np.abs(values).max()
        if values.real.max() > small:
            return "saddle"
        return "marginal" if np.abs(values).min() <= small else "centre"

    def step(self, name, dt) -> np.ndarray:
        """What one step of a method of tmt does to a small deviation, (..., 2n, 2n) for dt of shape (...)."""
        if np.ndim(dt):
            return amplification(METHODS[name], self.tree, self.q, np.zeros_like(self.q), self.tau, dt)
        if (METHODS[name], dt) not in self.steps:  # the same step is asked for many perturbations
            self.steps[METHODS[name], dt] = self.step(name, np.array([dt]))[0]
        return self.steps[METHODS[name], dt]

    def growth(self, name, dt) -> np.ndarray:
        """Growth of the fastest-growing mode in one step: the spectral radius of `step`."""
        with np.errstate(over="ignore", invalid="ignore"):
            return np.abs(np.linalg.eigvals(self.step(name, dt))).max(axis=-1)

    def limit(self, name) -> tuple[str, float | None]:
        """("finite", dt in s), ("never_fails", None) or ("always_fails", None): up to which step no mode grows.

        The first step at which one does, among 40 for each power of ten, then refined. Engines that share a method ask
        again, so it is kept.
        """
        if METHODS[name] not in self.limits:
            self.limits[METHODS[name]] = self.first_failing(name)
        return self.limits[METHODS[name]]

    def first_failing(self, name) -> tuple[str, float | None]:
        """What `limit` returns, computed."""
        low, high = SHORTEST_STEP, LONGEST_STEP
        for _ in range(4):
            steps = np.geomspace(low, high, SCANNED)
            fails = self.growth(name, steps) > 1.0 + NEUTRAL
            if not fails.any():
                return "never_fails", None
            first = int(np.argmax(fails))
            if first == 0:
                return "always_fails", None
            low, high = steps[first - 1], steps[first]
        return "finite", float(low)

    def fastest_growing(self, name, dt) -> tuple[float, np.ndarray, np.ndarray]:
        """The mode that a step of a method lets grow most: growth per step, its state (2n,), and its measure (2n,).

        The state is scaled to a largest angle of 1 rad; measure @ deviation is its share in a deviation.
        """
        values, vectors = np.linalg.eig(self.step(name, dt))
        k = int(np.argmax(np.abs(values)))
        measure = np.linalg.inv(vectors)[k]
        vector = vectors[:, k]
        top = vector[np.argmax(np.abs(vector[: len(self.q)]))]
        return float(np.abs(values[k])), vector / top, measure * top

    def rate(self, shape) -> float:
        """The rate |lambda|, 1/s, of the mode of the equations of motion whose state is nearest to a given one (2n,)."""
        values, vectors = self.modes
        n = len(self.q)
        shape = shape[:n] / np.linalg.norm(shape[:n])
        angles = vectors[:n] / np.linalg.norm(vectors[:n], axis=0)
        overlap = np.abs(angles.conj().T @ shape)
        near = np.abs(values[overlap > overlap.max() - 1e-6])
        return float(near.max())


def held(robot, posture: str, damping: float = 0.0) -> Held:
    """A named posture under TMT's own torque, with joint damping added, N m s/rad."""
    return Held(robot.case(f"{posture}, held", posture=posture, torque="hold", damping=damping))


def kinds(robot) -> dict[str, str]:
    """What each named posture is when it is held, see `Held.kind`."""
    return {name: held(robot, name).kind for name in robot.postures}


def of_kind(robot, kind: str) -> str | None:
    """The posture that stands for a kind: the robot's choice, else the first of that kind; None: there is none."""
    return robot.kinds.get(kind) or next((name for name, found in kinds(robot).items() if found == kind), None)


def all_of_kind(robot, kind: str) -> tuple[str, ...]:
    """The postures of a kind, the one that stands for it first."""
    first = of_kind(robot, kind)
    others = (name for name, found in kinds(robot).items() if found == kind and name != first)
    return () if first is None else (first, *others)


def region(name: str, z: np.ndarray) -> np.ndarray:
    """Growth in one step of a single hinge whose eigenvalues times dt are z and its conjugate, shape of z.

    The step is taken on qdd = -|z|^2 q + 2 Re(z) qd with dt = 1; so it exists for partitioned methods too, whose growth
    depends on the pair. At most 1: stable.
    """
    stepping = METHODS[name]
    size, rate = np.abs(z) ** 2, 2.0 * z.real
    inertia = 1.0 - rate if stepping.damps_implicitly else 1.0

    def slope(q, qd):
        return [(qd[0] * rate - q[0] * size) / inertia]

    state = seeded([np.zeros_like(size), np.zeros_like(size)], np.eye(2).reshape(2, 2, *(1 for _ in z.shape)))
    with np.errstate(all="ignore"):
        q, qd = stepping.step(slope, state[:1], state[1:], 1.0)
        J = np.array([np.broadcast_to(part[0].slope, (2, *z.shape)) for part in (q, qd)])
        half, determinant = 0.5 * (J[0, 0] + J[1, 1]), J[0, 0] * J[1, 1] - J[0, 1] * J[1, 0]
        root = np.sqrt(half**2 - determinant + 0j)
        return np.maximum(np.abs(half + root), np.abs(half - root))
