"""Small deviations at rest, M x'' + D x' + K x = 0: modes, and the largest stable step of each of MuJoCo's integrators.

With D = D_impl + D_expl a step of Euler, implicitfast or implicit is (M + dt D_impl) (v+ - v) = -dt (K x + D v), x+ = x + dt v+.
In a step of discrete all of D and the springs S of joints and actuators are implicit: M + dt D + dt^2 S on the left.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from ..robots.actuators import Rows
from .linear import NEGLIGIBLE, NEUTRAL, SLOWEST

LIMIT_UP_TO = 5.0  # s: the longest step that is tried
LIMIT_FROM = 0.1  # of the time of the fastest mode: the shortest step that is tried
STEPS_A_DECADE = 8  # steps that are tried for each power of ten
REFINED = 1e-9  # of a limit: its relative accuracy
BEYOND_LIMIT = 1e-3  # of a limit: how far beyond it the unstable movement is computed
SPLIT = 1e-6  # the distance from 1 of a factor that counts as 1
SAME_SHAPE = 0.9  # of the largest overlap: modes of one shape
POLE, POLE_RK4 = 2.0, 2.7852935634052816  # largest stable dt over the time constant of a filter
DEPENDENT = 1e-8  # of the largest singular value of the Jacobian of constraints: less is zero
SYMMETRIC = 1e-7  # of the largest entry: less is zero, also in the difference of a matrix from its transpose
VANISHING = 1e-10  # of the largest stiffness or damping, in the units of M: zero
CREEPING = 1e-8  # 1/s2 and 1/s: zero


class Limit(NamedTuple):
    """The largest stable step.

    limit: finite; none, stable up to 5 s; saddle, the posture is unstable; drifts, a mode has neither stiffness nor damping.
    """

    limit: str
    dt: float | None = None  # s, of a finite one
    joint: str = ""  # the speed or actuator that limits, or that grows most
    rate: float | None = None  # 1/s, |lambda| of the mode; of a saddle its growth rate
    kind: str = ""  # swing, real


@dataclass(frozen=True)
class Small:
    """The equation of small deviations, and the steps of MuJoCo's integrators; matrices are (nv, nv).

    With equalities K includes their rotation; modes, growth and drift are those of rigid
    constraints. A step is MuJoCo's: the force of its soft constraints is computed without the implicit part of an integrator
    (discrete: with it).
    """

    names: tuple[str, ...]  # of the speeds
    M: np.ndarray
    K: np.ndarray
    D: np.ndarray  # implicit in implicitfast and implicit between speeds on one path
    damping: np.ndarray  # (nv,), joint damping, implicit in Euler; zeros where the file disables eulerdamp
    springs: np.ndarray  # the part of K that is implicit in discrete
    brakes: np.ndarray  # the part of D that is implicit in discrete
    on_path: np.ndarray  # whether two speeds are on one path to the root
    # filters: the actuator, its time constant in s, whether it is a filterexact
    poles: tuple[tuple[str, float, bool], ...] = ()
    base: tuple[int, ...] = ()  # the speeds of free bodies, which may drift
    # the Rows at a step size and an integrator, if there are constraints
    couple: Callable[[float, str], Rows] | None = None

    def free(self, base: list[int]) -> "Small":
        """With a free base, given by its speeds: those without stiffness and damping keep the momentum at zero."""
        nonzero = [
            np.abs(matrix) > SYMMETRIC * np.abs(matrix).max(initial=0.0) for matrix in (self.K, self.D)
        ]
        loose = [k for k in base if not any(matrix[k].any() or matrix[:, k].any() for matrix in nonzero)]
        kept, rest = self.locked(loose), [k for k in range(len(self.M)) if k not in loose]
        across = np.linalg.solve(self.M[np.ix_(loose, loose)], self.M[np.ix_(loose, rest)])
        M = kept.M - self.M[np.ix_(rest, loose)] @ across
        return replace(kept, M=0.5 * (M + M.T), base=tuple(i for i, k in enumerate(rest) if k in base))

    def locked(self, base: list[int]) -> "Small":
        """With these speeds locked."""
        rest = [k for k in range(len(self.M)) if k not in base]
        matrices = "M", "K", "D", "springs", "brakes", "on_path"
        square = {name: getattr(self, name)[np.ix_(rest, rest)] for name in matrices}
        return replace(self, names=tuple(self.names[k] for k in rest), damping=self.damping[rest], **square)

    def __getstate__(self) -> dict:
        return dict(self.__dict__)  # a copy: a thread may pickle it while more is computed of it

    # in the units of M, where it is the identity

    @cached_property
    def root(self) -> np.ndarray:
        """L of M = L L'."""
        return np.linalg.cholesky(self.M)

    @cached_property
    def unrooted(self) -> np.ndarray:
        """L^-1, computed once: for small matrices SciPy's triangular solver waits ms for its threads on a busy machine."""
        return np.linalg.inv(self.root)

    def scaled(self, matrix: np.ndarray) -> np.ndarray:
        """L^-1 matrix L'^-1."""
        return self.unrooted @ matrix @ self.unrooted.T

    @cached_property
    def stiff(self) -> np.ndarray:
        return self.scaled(self.K)

    @cached_property
    def damped(self) -> np.ndarray:
        return self.scaled(self.D)

    @cached_property
    def meeting(self) -> np.ndarray:
        """Movements that the constraints allow, x = N y, (nv, m)."""
        if not self.couple:
            return np.eye(len(self.M))
        _, sizes, directions = np.linalg.svd(self.couple(1e-3, "Euler").jacobian)
        return directions[int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum()) :].T

    @cached_property
    def rigid(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stiffness and damping of the movements that the constraints allow, (m, m), and their orthonormal basis, (nv, m)."""
        basis = np.linalg.qr(self.root.T @ self.meeting)[0]
        return basis.T @ self.stiff @ basis, basis.T @ self.damped @ basis, basis

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues of the equations of motion, 1/s, (2m,), and the movements of their modes in the units of M, (nv, 2m)."""
        stiff, damped, basis = self.rigid
        n = len(stiff)
        values, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-stiff, -damped]]))
        moves = (basis @ vectors[:n]).astype(complex)
        return values.astype(complex), moves / np.maximum(np.linalg.norm(moves, axis=0), 1e-300)

    @property
    def drifts(self) -> bool:
        """Whether a movement other than of a free base has neither stiffness nor damping."""
        stiff, damped, basis = self.rigid
        # a matrix of rounding errors counts as zero
        sizes = [max(np.abs(matrix).max(initial=0.0), CREEPING / VANISHING) for matrix in (stiff, damped)]
        both = np.vstack([stiff / sizes[0], damped / sizes[1]])
        of_base = basis.T @ self.root.T[:, list(self.base)]
        loose, loose_base = (
            int((np.linalg.svd(matrix, compute_uv=False) <= VANISHING).sum()) if matrix.size else 0
            for matrix in (both, both @ of_base)
        )
        return loose > loose_base

    @cached_property
    def growing(self) -> tuple[float, np.ndarray] | None:
        """The rate, 1/s, and the movement of the fastest growing mode of the equations of motion, or None."""
        values, moves = self.modes
        if not values.size:
            return None
        fastest = int(np.argmax(values.real))
        rate = float(values[fastest].real)
        return (rate, moves[:, fastest]) if rate > max(NEGLIGIBLE * np.abs(values).max(), SLOWEST) else None

    @cached_property
    def neutral(self) -> float:
        """The largest growth rate, 1/s, that counts as zero."""
        return 0.0 if self.growing else max(float(self.modes[0].real.max(initial=0.0)), 0.0)

    # steps

    def braking(self, integrator: str) -> np.ndarray:
        """The part of D that is implicit in an integrator, (nv, nv)."""
        if integrator == "Euler":
            return np.diag(self.damping)
        if integrator in ("implicitfast", "implicit"):
            return np.where(self.on_path, self.D, 0.0)
        return self.brakes if integrator == "discrete" else np.zeros_like(self.D)

    @cached_property
    def implicit(self) -> dict[str, np.ndarray]:
        """The part of D that is implicit in each integrator, in the units of M."""
        return {
            name: self.scaled(self.braking(name))
            for name in ("Euler", "implicitfast", "implicit", "discrete")
        }

    def step(self, integrator: str, dt: float) -> np.ndarray:
        """The matrix of a step of a small deviation (x, v), in the units of M, (2nv, 2nv)."""
        n = len(self.M)
        unit, none = np.eye(n), np.zeros((n, n))
        if integrator == "RK4":
            stiff, damped, _ = self.constrained(integrator, dt, self.stiff, self.damped, unit)
            Z = dt * np.block([[none, unit], [-stiff, -damped]])
            return np.eye(2 * n) + Z @ (
                np.eye(2 * n) + Z @ (np.eye(2 * n) / 2 + Z @ (np.eye(2 * n) / 6 + Z / 24))
            )
        held = dt * self.scaled(self.springs) if integrator == "discrete" else none
        matrix = unit + dt * (self.implicit[integrator] + held)
        stiff, damped, _ = self.constrained(integrator, dt, self.stiff, self.damped + held, matrix)
        speeds = np.hstack([none, unit]) - dt * np.linalg.solve(matrix, np.hstack([stiff, damped]))
        return np.vstack([np.hstack([unit, none]) + dt * speeds, speeds])

    def constrained(
        self, integrator: str, dt: float, stiff: np.ndarray, damped: np.ndarray, matrix: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stiffness, damping and the effect of other forces, in the units of M, with the forces of constraints.

        matrix: the left side of the step.
        """
        if not self.couple:
            return stiff, damped, np.eye(len(self.M))
        rows = self.couple(dt, integrator)
        J, metric = (
            rows.jacobian @ self.unrooted.T,
            matrix if integrator == "discrete" else np.eye(len(self.M)),
        )
        eased = np.linalg.solve(metric, J.T).T
        pull = np.linalg.solve(eased @ J.T + np.diag(rows.softness), J).T
        stiff = stiff - pull @ (eased @ stiff - rows.stiffness[:, None] * J)
        damped = damped - pull @ (eased @ damped - rows.damping[:, None] * J)
        return stiff, damped, np.eye(len(self.M)) - pull @ eased

    def equations(self, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Accelerations by the state (x, v) and by a unit force, with constraints as in a step of this size."""
        stiff, damped, share = self.constrained("Euler", dt, self.stiff, self.damped, np.eye(len(self.M)))
        L, back = self.root, self.unrooted
        return tuple(back.T @ each for each in (-stiff @ L.T, -damped @ L.T, share @ back))

    def growth(self, integrator: str, dt: float) -> float:
        """The spectral radius of a step: above 1 something grows."""
        factors = np.linalg.eigvals(self.step(integrator, dt))
        # a free movement has the factor 1 twice, which rounding splits
        return float(np.where(np.abs(factors - 1.0) <= SPLIT, 1.0, np.abs(factors)).max(initial=0.0))

    def is_stable(self, integrator: str, dt: float) -> bool:
        """Whether a step is stable, filters included."""
        return dt < self.pole_limit(integrator)[0] and self.stays(integrator, dt)

    def stays(self, integrator: str, dt: float) -> bool:
        """Whether nothing grows in a step beyond rounding."""
        return self.growth(integrator, dt) <= 1.0 + max(NEUTRAL, 2.0 * dt * self.neutral)

    def pole_limit(self, integrator: str) -> tuple[float, str]:
        """The largest stable step of the filters, s, and the actuator. RK4 integrates a filterexact like a filter."""
        by, exact = (POLE_RK4, False) if integrator == "RK4" else (POLE, True)
        limits = [
            (by * constant, name) for name, constant, is_exact in self.poles if not (exact and is_exact)
        ]
        return min(limits, default=(np.inf, ""))

    def limit(self, integrator: str) -> Limit:
        """The largest stable step of Euler, implicitfast, implicit, discrete or RK4."""
        if self.growing:
            rate, shape = self.growing
            return Limit("saddle", None, self.joint_of(shape), rate, "real")
        if self.drifts:
            return Limit("drifts")
        dt = self.first_unstable(integrator) if self.names else None
        slowest, name = self.pole_limit(integrator)
        if slowest < min(dt or np.inf, LIMIT_UP_TO):
            return Limit(
                "finite", slowest, name, (POLE_RK4 if integrator == "RK4" else POLE) / slowest, "real"
            )
        if dt is None:
            return Limit("none")
        values, vectors = np.linalg.eig(self.step(integrator, (1.0 + BEYOND_LIMIT) * dt))
        move = vectors[: len(self.M), np.argmax(np.abs(values))]
        return Limit("finite", dt, self.joint_of(move), *self.nearest(move / np.linalg.norm(move)))

    def first_unstable(self, integrator: str) -> float | None:
        """The first unstable step, s, by the eigenvalues of steps; None: stable up to 5 s."""
        low, fastest = 0.0, np.abs(self.modes[0]).max(initial=1e-300)
        first = min(LIMIT_FROM / fastest, 0.1 * LIMIT_UP_TO)
        for dt in np.geomspace(
            first, LIMIT_UP_TO, int(np.ceil(STEPS_A_DECADE * np.log10(LIMIT_UP_TO / first))) + 1
        ):
            if not self.stays(integrator, dt):
                return bisected(lambda dt: self.stays(integrator, dt), low, dt)
            low = dt
        return None

    def nearest(self, shape: np.ndarray) -> tuple[float, str]:
        """Rate, 1/s, and kind, swing or real, of the mode with the nearest movement, the fastest of several."""
        values, moves = self.modes
        if not len(values):  # only the soft constraints yield
            return 0.0, "real"
        overlap = np.abs(moves.conj().T @ shape)
        near = values[overlap >= SAME_SHAPE * overlap.max()]
        value = near[np.argmax(np.abs(near))]
        return float(np.abs(value)), "swing" if abs(value.imag) > 1e-6 * abs(value) else "real"

    def joint_of(self, shape: np.ndarray) -> str:
        """The speed with most of the kinetic energy of a movement."""
        x = self.unrooted.T @ shape
        return self.names[int(np.argmax(np.abs(x.conj() * (self.M @ x))))]


def bisected(holds: Callable, low: float, high: float, refined: float = REFINED) -> float:
    """The largest number at which a condition holds that holds at `low` and not at `high`."""
    while high - low > refined * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return float(low)
