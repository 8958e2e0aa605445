"""The equations of motion linearised: small oscillations, modes of a held posture, and what one step of a method does to them."""

from dataclasses import dataclass
from functools import cached_property, lru_cache

import numpy as np
from scipy.linalg import eig, eigh

import tmt
from tmt import METHODS, composite, method
from tmt.dual import seeded
from tmt.implicit import ImplicitRungeKutta
from tmt.methods import RungeKutta, SemiImplicitEuler, amplification, by_speed, square

from ..case import SEED, Case, Coordinates

FEW = 6  # speeds, up to which the method is differentiated as it stands, and beyond which regrouped: the same but for rounding
LONGEST_STEP, SHORTEST_STEP = 1e3, 1e-4  # s: steps among which a limit is sought
SCANNED = 281  # steps between these, 40 for each power of ten
NEUTRAL = 1e-9  # growth per step that rounding can pretend
NEGLIGIBLE = 1e-6  # relative to the fastest mode: a rate below is zero
SLOWEST = 1e-6  # 1/s: and so is a rate below this, where no mode is fast
PUSHED_ALONG = (
    3  # directions at random among the movements without stiffness, in which it is seen whether they are flat
)
AT_ONE = (
    1e-7,
    1e-3,
)  # how far from 1 rounding and a rate of zero may put the growth of a mode without stiffness, with any step


def stiffness(tree: tmt.Tree, q: np.ndarray) -> np.ndarray:
    """d(torque that holds)/dq at q, of gravity and springs, N m/rad, (nv, nv), by movements: exact.

    Of hinges without springs V is a + b cos q_i + c sin q_i in each angle; else by dual numbers.
    """
    if set(tree.kind) == {"hinge"} and not tree.has_springs:
        quarter = np.pi / 2 * np.eye(len(q))
        return (tmt.gravity_balance(q + quarter, tree) - tmt.gravity_balance(q - quarter, tree)) / 2
    moved = moving(tree, q, np.eye(tree.coordinates.nv))
    return np.array(slopes(moved, holding(tree, moved)))


def moving(tree: tmt.Tree, q, directions) -> list:
    """The position q, (nq,) of any scalars, as dual numbers that move along directions, (nv,) of slopes: (nq,)."""
    start = [float(x) for x in q] if isinstance(q, np.ndarray) else q
    return seeded(start, tree.coordinates.component_rates(start, list(directions)))


def holding(tree: tmt.Tree, q) -> list:
    """The torque that holds a posture against gravity and springs, N m, (nv,), over any scalar."""
    torque = method.bias(method.bodies(tree, q), tree.gravity)
    return [a + b for a, b in zip(torque, method.spring_torque(tree, q))] if tree.has_springs else torque


def slopes(seeds, values) -> list:
    """The derivatives of values by what these seeds move along."""
    shape = np.shape(seeds[0].slope)
    found = [seeds[0].parts(value)[1] for value in values]
    return [np.broadcast_to(slope, shape) if np.ndim(slope) < len(shape) else slope for slope in found]


def modes(tree: tmt.Tree, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies, rad/s, and modes (columns) of small oscillations about a posture that rests, lowest first.

    K u = frequency^2 Mbar u, modes with u' Mbar u = 1.
    """
    squares, shapes = eigh(stiffness(tree, q), tmt.mass_matrix(q, tree))
    return np.sqrt(squares), shapes


def small_oscillation(t: np.ndarray, tree: tmt.Tree, q: np.ndarray, away: np.ndarray) -> np.ndarray:
    """Positions, rad, (times, nq), of the linear modes about q, let go at rest so far `away`, (nv,) rad."""
    frequencies, shapes = modes(tree, q)
    parts = shapes.T @ tmt.mass_matrix(q, tree) @ away
    return Coordinates(tree.hinge_names, tree.kind).move(q, np.cos(np.outer(t, frequencies)) * parts @ shapes.T)


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
        """(nq,) rad"""
        return self.case.q

    @property
    def nv(self) -> int:
        return len(self.tau)

    @property
    def tau(self) -> np.ndarray:
        """(nv,) N m"""
        return self.case.tau

    def away(self, q: np.ndarray) -> np.ndarray:
        """Positions (..., nq) as movements from the posture, rad, (..., nv)."""
        return self.case.coordinates.difference(q, self.q)

    def moved(self, by: np.ndarray) -> np.ndarray:
        """The positions after movements from the posture, (..., nv) -> (..., nq)."""
        return self.case.coordinates.move(self.q, by)

    @property
    def sizes(self) -> np.ndarray:
        """The numbers in whose last place movements are rounded, (nv,): angles, lengths, and 1 of a quaternion."""
        if not self.tree.coordinates.balls:
            return self.q
        return np.concatenate(
            [self.q[q] if kind != "ball" else np.ones(3) for kind, q, _ in self.tree.coordinates.joints]
        )

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
        """Mbar, kg m2, (nv, nv)."""
        return tmt.mass_matrix(self.q, self.tree)

    @cached_property
    def matrix(self) -> np.ndarray:
        """d(qd, qdd)/d(q, qd), (2nv, 2nv), for movements of q: exact derivatives of TMT's right-hand side, by dual numbers."""
        nq, n, unit = len(self.q), self.nv, np.eye(2 * self.nv)
        start = [float(x) for x in self.q]
        state = seeded([*start, *np.zeros(n)], [*self.tree.coordinates.component_rates(start, unit[:n]), *unit[n:]])
        terms = method.mass_matrix_and_bias if n <= FEW else composite.mass_matrix_and_bias
        qdd = method.acceleration(self.tree, state[:nq], state[nq:], [float(t) for t in self.tau], terms)
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
        """Which of the eigenvalues are zero, (2nv,)."""
        return np.abs(self.modes[0]) <= self.small

    @cached_property
    def measures(self) -> np.ndarray:
        """What gives the share of each mode with a rate in a deviation (2nv,): (modes, 2nv), for angles scaled as in `shapes`."""
        if not self.without_stiffness.any():
            return np.linalg.inv(self.shapes)
        # modes that neither swing, grow nor decay may share one eigenvector with another, and have no measure
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
        """saddle: a mode grows; marginal: a mode neither swings, grows nor decays; centre: all swing or decay."""
        values, small = self.modes[0], self.small
        if values.real.max() > small:
            return "saddle"
        return "marginal" if np.abs(values).min() <= small else "centre"

    @cached_property
    def soft(self) -> np.ndarray:
        """Movements that change no force, (nv, k), each of length 1: modes without stiffness."""
        _, sizes, rows = np.linalg.svd(self.matrix[self.nv :, : self.nv])
        return rows[sizes <= max(NEGLIGIBLE**2 * sizes.max(), SLOWEST**2)].T

    def curvature(self, direction) -> np.ndarray:
        """The second derivative of the torque that holds along a movement (nv,), N m, (nv,): by nested dual numbers."""
        inner = moving(self.tree, self.q, direction)
        outer = moving(self.tree, inner, direction)
        torque = holding(self.tree, outer)
        return np.array([float(inner[0].parts(outer[0].parts(component)[1])[1]) for component in torque])

    @cached_property
    def stays(self) -> bool:
        """Whether a small deviation stays small: no mode grows, and nothing pushes along those without stiffness."""
        if self.kind != "marginal":
            return self.kind == "centre"
        rng, stiff = np.random.default_rng(SEED), self.mass_matrix @ self.matrix[self.nv :, : self.nv]
        pushes = [self.curvature(self.soft @ rng.normal(size=self.soft.shape[1])) for _ in range(PUSHED_ALONG)]
        return bool(np.abs(pushes @ self.soft).max(initial=0.0) <= NEGLIGIBLE * np.abs(stiff).max())

    def step(self, name, dt) -> np.ndarray:
        """What one step of a method of tmt does to a small deviation, (..., 2nv, 2nv) for dt of shape (...).

        A step of the linearised equations, which is the amplification of a step of the exact ones; of a method that is none of
        tmt's own this is computed itself.
        """
        if np.ndim(dt):
            return self.linear_step(METHODS[name], np.asarray(dt, float))
        if (METHODS[name], dt) not in self.steps:  # the same step is asked for many perturbations
            self.steps[METHODS[name], dt] = self.step(name, np.array([dt]))[0]
        return self.steps[METHODS[name], dt]

    def linear_step(self, stepping, dt) -> np.ndarray:
        """The same for dt (k,), computed."""
        unit, n, each = np.eye(2 * self.nv), self.nv, dt[:, None, None]
        if type(stepping) is SemiImplicitEuler:
            # at rest the bias has no derivative by the speeds, so it does not matter whether it is implicit
            stiff = np.diag(by_speed(self.tree, self.tree.stiffness)) * stepping.implicit_springs
            matrix = self.mass_matrix + each * np.diag(self.tree.damping) + each**2 * stiff
            force = self.mass_matrix @ self.matrix[n:] - each * np.hstack([0.0 * stiff, stiff])
            speeds = unit[n:] + each * np.linalg.solve(matrix, force)
            return np.concatenate([unit[:n] + each * speeds, speeds], axis=1)
        if type(stepping) is RungeKutta:
            stages, Z = [], each * self.matrix
            for row in stepping.A:
                stages.append(Z @ (unit + sum(a * stage for a, stage in zip(row, stages))))
            return unit + sum(b * stage for b, stage in zip(stepping.b, stages))
        if type(stepping) is ImplicitRungeKutta:
            s = len(stepping.b)
            coupled = np.eye(2 * n * s) - each * np.kron(stepping.A, self.matrix)
            stages = np.linalg.solve(coupled, each * np.tile(self.matrix, (s, 1))).reshape(-1, s, 2 * n, 2 * n)
            return unit + np.einsum("i,kiab->kab", stepping.b, stages)
        return amplification(stepping, self.tree, self.q, np.zeros(n), self.tau, dt)

    def growth(self, name, dt) -> np.ndarray:
        """Growth of the fastest-growing mode in one step, (...) for dt (...): the spectral radius of `step`.

        A mode without stiffness grows by nothing, but for rounding.
        """
        stepping, dt = METHODS[name], np.asarray(dt, float)
        idle = self.without_stiffness
        with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
            if type(stepping) in (RungeKutta, ImplicitRungeKutta):
                found = growth_of(stepping, dt[..., None] * np.where(idle, 0.0, self.modes[0]))
                return np.abs(found).max(axis=-1)
            found = np.linalg.eigvals(self.step(name, dt))
            if idle.any():
                near = np.clip(self.small * dt, *AT_ONE)[..., None]
                found = np.where(np.abs(found - 1.0) <= near, 1.0, found)
            return np.abs(found).max(axis=-1)

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
        low, high = min(SHORTEST_STEP, 1.0 / max(np.abs(self.modes[0]).max(), SLOWEST)), LONGEST_STEP
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
        values, left, vectors = eig(self.step(name, dt), left=True)
        k = int(np.argmax(np.abs(values)))
        vector = vectors[:, k]
        measure = left[:, k].conj() / (left[:, k].conj() @ vector)
        top = vector[np.argmax(np.abs(vector[: self.nv]))]
        return float(np.abs(values[k])), vector / top, measure * top

    def rate(self, shape) -> float:
        """The rate |lambda|, 1/s, of the mode of the equations of motion whose state is nearest to a given one (2n,)."""
        values, vectors = self.modes
        n = self.nv
        shape = shape[:n] / np.linalg.norm(shape[:n])
        angles = vectors[:n] / np.linalg.norm(vectors[:n], axis=0)
        overlap = np.abs(angles.conj().T @ shape)
        near = np.abs(values[overlap > overlap.max() - 1e-6])
        return float(near.max())


def growth_of(stepping, z: np.ndarray) -> np.ndarray:
    """What a step of a Runge-Kutta method makes of 1 where y' = lambda y, for z = lambda dt of any shape."""
    A = square(stepping.A) if type(stepping) is RungeKutta else np.array(stepping.A)
    stages = np.linalg.solve(np.eye(len(A)) - z[..., None, None] * A, np.ones((len(A), 1)))[..., 0]
    return 1.0 + z * (stages @ np.array(stepping.b))


def floats(tree: tmt.Tree) -> bool:
    """Whether a free body carries nothing or the rest: three slides and a ball from the world. Under gravity it has no rest."""
    kinds = tree.kind
    return any(
        tree.parent[i] == -1 and kinds[i : i + 4] == ("slide", "slide", "slide", "ball") for i in range(len(kinds) - 3)
    )


@lru_cache(maxsize=64)
def held(robot, posture: str, damping: float = 0.0) -> Held:
    """A named posture under TMT's own torque, with joint damping added, N m s/rad; without gravity if it floats."""
    gravity = not floats(robot.tree)
    return Held(robot.case(f"{posture}, held", posture=posture, torque="hold", damping=damping, gravity=gravity))


def named(robot) -> tuple[str, ...]:
    """The names of its postures."""
    return (*robot.postures, *robot.positions)


def all_that_stay(robot) -> tuple[str, ...]:
    """The postures at which a small deviation stays small, the one that stands for a centre first."""
    stay = [name for name in named(robot) if held(robot, name).stays]
    return tuple(sorted(stay, key=lambda name: name != robot.kinds.get("centre", stay[0])))


def kinds(robot) -> dict[str, str]:
    """What each named posture is when it is held, see `Held.kind`."""
    return {name: held(robot, name).kind for name in named(robot)}


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
