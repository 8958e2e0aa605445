"""Up to which step an integrator of MuJoCo keeps a posture at rest stable under a robot's own servos: in closed form.

Of the equations M x'' + D x' + K x = 0, D = D_impl + D_expl, a step of Euler, implicitfast or implicit is
(M + dt D_impl) (v+ - v) = -dt (K x + D v), x+ = x + dt v+. With z = (1 + s) / (1 - s) for its eigenvalues it is
P s^2 + 2 dt D s + dt^2 K = 0, P = 4 M + 2 dt (D_impl - D_expl) - dt^2 K: where M, D and K are symmetric and D and K not
negative it is stable if and only if P is positive definite. A step of discrete, which has all of D and the springs S of joints
and actuators implicit, gives P = 4 M + 2 dt D + dt^2 (2 S - K) and D + dt S in the place of D: the same holds where S is not
negative. Elsewhere the eigenvalues of the step decide.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tmt import METHODS

from .linear import NEUTRAL
from .steps import growth_of

LIMIT_UP_TO = 5.0  # s: what is stable up to it has no limit here
LIMIT_FROM = 0.01  # of the time of the fastest mode: stable if anything is
STEPS_A_DECADE = 12  # steps for each power of ten, where no closed form tells the limit
REFINED = 1e-10  # of a limit
SYMMETRIC = 1e-9  # of the largest entry: what a matrix and its transpose may differ by, and what is nothing beside it
VANISHING = 1e-11  # of the largest stiffness or damping, in the units of M: zero
SAME_SHAPE = 0.9  # of the largest overlap: modes of one shape
POLES = {"RK4": 2.7852935634052816}  # dt over the time constant of a filter, up to which it is stable; of others 2


class Limit(NamedTuple):
    """How far a step may go.

    limit: finite; none, up to 5 s; saddle, a mode grows by itself; drifts, nothing holds a mode and nothing brakes it.
    """

    limit: str
    dt: float | None  # s, of a finite one
    joint: str  # the speed, or the actuator, that limits; or that grows most; "": none
    rate: float | None  # 1/s, of the mode of the equations of motion, |lambda|; of a saddle how fast it is left
    kind: str  # swing, real; "": no mode
    shape: np.ndarray | None = None  # (nv,) of the mode, M x scaled to length 1


@dataclass(frozen=True)
class Small:
    """Small deviations from a posture at rest, all (nv, nv) but where it says otherwise."""

    names: tuple[str, ...]  # of the speeds
    M: np.ndarray
    K: np.ndarray
    D: np.ndarray
    damping: np.ndarray  # of D what Euler has implicit, (nv,): of joints; zeros where the file switches eulerdamp off
    springs: np.ndarray  # of K what `discrete` has implicit
    brakes: np.ndarray  # of D what it has implicit; implicitfast and implicit: of that what is on one path
    on_path: np.ndarray  # whether two speeds are on one path to the root
    poles: tuple[tuple[str, float], ...] = ()  # of filters: the actuator's name, and its time constant, s

    def without(self, base: list[int]) -> "Small":
        """Without the speeds of free bodies that nothing holds: they move so that momentum stays zero. Locked: `locked`."""
        held = max(np.abs(self.K[base]).max(initial=0.0), np.abs(self.K[:, base]).max(initial=0.0))
        lost = max(np.abs(self.D[base]).max(initial=0.0), np.abs(self.D[:, base]).max(initial=0.0))
        if not base or held > SYMMETRIC * np.abs(self.K).max() or lost > SYMMETRIC * np.abs(self.D).max():
            return self
        rest = [k for k in range(len(self.M)) if k not in base]
        across = np.linalg.solve(self.M[np.ix_(base, base)], self.M[np.ix_(base, rest)])
        kept = self.locked(base)
        M = kept.M - self.M[np.ix_(rest, base)] @ across
        return Small(**kept.__dict__ | {"M": 0.5 * (M + M.T)})

    def locked(self, base: list[int]) -> "Small":
        """With these speeds locked."""
        rest = [k for k in range(len(self.M)) if k not in base]
        square = {
            name: getattr(self, name)[np.ix_(rest, rest)] for name in ("M", "K", "D", "springs", "brakes", "on_path")
        }
        return Small(tuple(self.names[k] for k in rest), damping=self.damping[rest], poles=self.poles, **square)

    # in the units of M, where it is the identity

    @cached_property
    def root(self) -> np.ndarray:
        """L of M = L L'."""
        return np.linalg.cholesky(self.M)

    @cached_property
    def unrooted(self) -> np.ndarray:
        """L^-1, once for all: for matrices so small SciPy's solution waits for its threads, for ms where cores are busy."""
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
    def held(self) -> dict[str, np.ndarray]:
        """Of K what each integrator has implicit, in the units of M."""
        return dict.fromkeys(self.implicit, np.zeros_like(self.M)) | {"discrete": self.scaled(self.springs)}

    @cached_property
    def implicit(self) -> dict[str, np.ndarray]:
        """Of D what each integrator has implicit, in the units of M."""
        on_path = self.scaled(np.where(self.on_path, self.brakes, 0.0))
        of_joints = self.scaled(np.diag(self.damping))
        return {"Euler": of_joints, "implicitfast": on_path, "implicit": on_path, "discrete": self.scaled(self.brakes)}

    @cached_property
    def is_symmetric(self) -> bool:
        """Whether the closed form holds: K and D are symmetric, and D takes energy away. K may have any sign: see `drifts`."""
        halves = [np.abs(matrix - matrix.T).max() <= SYMMETRIC * np.abs(matrix).max() for matrix in (self.K, self.D)]
        lowest = np.linalg.eigvalsh(self.damped).min(initial=0.0)
        return all(halves) and lowest >= -VANISHING * np.abs(self.damped).max()

    @cached_property
    def modes(self) -> tuple[np.ndarray, np.ndarray]:
        """Eigenvalues of the equations of motion, 1/s, (2nv,), and the movements of their modes in the units of M, (nv, 2nv)."""
        n = len(self.M)
        values, vectors = np.linalg.eig(np.block([[np.zeros((n, n)), np.eye(n)], [-self.stiff, -self.damped]]))
        moves = vectors[:n].astype(complex)
        return values.astype(complex), moves / np.maximum(np.linalg.norm(moves, axis=0), 1e-300)

    @property
    def drifts(self) -> bool:
        """Whether a movement meets neither stiffness nor damping."""
        both = [matrix / max(np.abs(matrix).max(), 1e-300) for matrix in (self.stiff, self.damped)]
        return bool(np.linalg.svd(np.vstack(both), compute_uv=False).min() <= VANISHING)

    @property
    def growing(self) -> tuple[float, np.ndarray] | None:
        """The rate, 1/s, and the movement of the mode that grows fastest by itself, or None."""
        values, moves = self.modes
        if self.is_symmetric:
            lowest, shapes = np.linalg.eigh(0.5 * (self.stiff + self.stiff.T))
            if lowest[0] >= -VANISHING * np.abs(lowest).max():
                return None
            fastest = max(values.real.max(), 0.0)
            return float(fastest), moves[:, np.argmax(values.real)] if fastest else shapes[:, 0]
        fastest = np.argmax(values.real)
        small = 1e-7 * np.abs(values).max()  # rounding of eigenvalues where K is not symmetric
        return (float(values[fastest].real), moves[:, fastest]) if values[fastest].real > small else None

    # steps

    def step(self, integrator: str, dt: float) -> np.ndarray:
        """What a step makes of a small deviation (x, v), in the units of M, (2nv, 2nv)."""
        n = len(self.M)
        unit, none = np.eye(n), np.zeros((n, n))
        if integrator == "RK4":
            Z = dt * np.block([[none, unit], [-self.stiff, -self.damped]])
            return np.eye(2 * n) + Z @ (np.eye(2 * n) + Z @ (np.eye(2 * n) / 2 + Z @ (np.eye(2 * n) / 6 + Z / 24)))
        held = dt * self.held[integrator]
        matrix = unit + dt * (self.implicit[integrator] + held)
        speeds = np.hstack([none, unit]) - dt * np.linalg.solve(matrix, np.hstack([self.stiff, self.damped + held]))
        return np.vstack([np.hstack([unit, none]) + dt * speeds, speeds])

    def growth(self, integrator: str, dt: float) -> float:
        """The spectral radius of a step: above 1 something grows."""
        if integrator == "RK4":
            return float(np.abs(growth_of(METHODS["rk4"], dt * self.modes[0])).max())
        return float(np.abs(np.linalg.eigvals(self.step(integrator, dt))).max())

    def is_stable(self, integrator: str, dt: float) -> bool:
        """Whether nothing grows in a step; nothing but what grows or drifts by itself is asked."""
        poles = all(dt < POLES.get(integrator, 2.0) * constant for _, constant in self.poles)
        return poles and self.growth(integrator, dt) <= 1.0 + NEUTRAL

    def P(self, integrator: str, dt: float) -> np.ndarray:
        """4 M + 2 dt (D_impl - D_expl) - dt^2 K, of discrete with 2 S dt^2, in the units of M."""
        found = (
            4.0 * np.eye(len(self.M))
            + 2.0 * dt * (2.0 * self.implicit[integrator] - self.damped)
            - dt * dt * (self.stiff - 2.0 * self.held[integrator])
        )
        return 0.5 * (found + found.T)

    def holds(self, integrator: str, dt: float) -> bool:
        """Whether P is positive definite."""
        return bool(np.linalg.eigvalsh(self.P(integrator, dt))[0] > 0.0)

    # limits

    def limit(self, integrator: str) -> Limit:
        """The largest stable step of Euler, implicitfast, implicit, discrete or RK4."""
        if (growing := self.growing) is not None:
            rate, shape = growing
            return Limit("saddle", None, self.joint_of(shape), rate, "real", shape)
        if self.drifts:
            return Limit("drifts", None, "", None, "")
        dt = self.closed_form(integrator) if self.has_closed_form(integrator) else self.scanned(integrator)
        poles = [(POLES.get(integrator, 2.0) * constant, name) for name, constant in self.poles]
        slowest, name = min(poles, default=(np.inf, ""))
        if slowest < min(dt or np.inf, LIMIT_UP_TO):
            return Limit("finite", slowest, name, POLES.get(integrator, 2.0) / slowest, "real")
        if dt is None:
            return Limit("none", None, "", None, "")
        shape = self.limiting(integrator, dt)
        rate, kind = self.nearest(shape)
        return Limit("finite", dt, self.joint_of(shape), rate, kind, shape)

    def has_closed_form(self, integrator: str) -> bool:
        return self.is_symmetric and integrator in self.implicit and (integrator != "discrete" or self.pulls_back)

    @cached_property
    def pulls_back(self) -> bool:
        """Whether the springs that discrete has implicit are symmetric, and none pushes away."""
        S = self.held["discrete"]
        size = max(np.abs(S).max(), np.abs(self.stiff).max())
        return np.abs(S - S.T).max() <= SYMMETRIC * size and np.linalg.eigvalsh(S).min() >= -VANISHING * size

    def closed_form(self, integrator: str) -> float | None:
        """The limit by P, s; None: up to 5 s. Along any movement P is a quadratic of dt that comes to zero once at most."""
        if self.holds(integrator, LIMIT_UP_TO):
            return None
        return bisected(lambda dt: self.holds(integrator, dt), 0.0, LIMIT_UP_TO)

    def scanned(self, integrator: str) -> float | None:
        """The limit by the eigenvalues of steps, s: the first that grows; None: none up to 5 s."""
        first = min(LIMIT_FROM / max(np.abs(self.modes[0]).max(), 1e-300), 0.1 * LIMIT_UP_TO)
        steps = np.geomspace(first, LIMIT_UP_TO, int(np.ceil(STEPS_A_DECADE * np.log10(LIMIT_UP_TO / first))) + 1)
        low = 0.0
        for dt in steps:
            if self.growth(integrator, dt) > 1.0 + NEUTRAL:
                return bisected(lambda dt: self.growth(integrator, dt) <= 1.0 + NEUTRAL, low, dt)
            low = dt
        return None

    def limiting(self, integrator: str, dt: float) -> np.ndarray:
        """The movement, in the units of M, (nv,), that a step of this size lets grow first."""
        if self.has_closed_form(integrator):
            return np.linalg.eigh(self.P(integrator, dt))[1][:, 0]
        if integrator == "RK4":
            values, moves = self.modes
            return moves[:, np.argmax(np.abs(growth_of(METHODS["rk4"], dt * values)))]
        values, vectors = np.linalg.eig(self.step(integrator, dt))
        move = vectors[: len(self.M), np.argmax(np.abs(values))]
        return move / np.linalg.norm(move)

    def nearest(self, shape: np.ndarray) -> tuple[float, str]:
        """Rate, 1/s, and kind, swing or real, of the mode whose movement is nearest, the fastest of several."""
        values, moves = self.modes
        overlap = np.abs(moves.conj().T @ shape)
        near = np.flatnonzero(overlap >= SAME_SHAPE * overlap.max())
        found = values[near[np.argmax(np.abs(values[near]))]]
        return float(np.abs(found)), "swing" if abs(found.imag) > 1e-6 * abs(found) else "real"

    def joint_of(self, shape: np.ndarray) -> str:
        """The speed that has most of the kinetic energy of a movement."""
        x = self.unrooted.T @ shape
        return self.names[int(np.argmax(np.abs(x.conj() * (self.M @ x))))]


def bisected(holds, low: float, high: float) -> float:
    """The largest step, s, at which something holds that holds at `low` and not at `high`."""
    while high - low > REFINED * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return low
