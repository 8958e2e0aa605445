"""The largest stable step of MuJoCo's integrators at rest under a robot's own servos, in closed form where there is one.

Of the equations M x'' + D x' + K x = 0, D = D_impl + D_expl, a step of Euler, implicitfast or implicit is
(M + dt D_impl) (v+ - v) = -dt (K x + D v), x+ = x + dt v+. With z = (1 + s) / (1 - s) for its eigenvalues it is
P s^2 + 2 dt D s + dt^2 K = 0, P = 4 M + 2 dt (D_impl - D_expl) - dt^2 K. If M, D and K are symmetric and D and K positive
semidefinite, the step is stable if and only if P is positive definite. In a step of discrete all of D and the springs S of joints
and actuators are implicit: P = 4 M + 2 dt D + dt^2 (2 S - K), with D + dt S instead of D; the condition is the same if S is
positive semidefinite. In all other cases the eigenvalues of the step decide.
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np

from tmt import METHODS

from .deviations import SYMMETRIC, VANISHING, Deviations
from .linear import NEUTRAL
from .steps import growth_of

LIMIT_UP_TO = 5.0  # s: the longest step that is tried
LIMIT_FROM = 0.01  # of the time of the fastest mode: the shortest step that is tried
STEPS_A_DECADE = 12  # steps that are tried for each power of ten, where there is no closed form
REFINED = 1e-10  # of a limit: its relative accuracy
BEYOND_LIMIT = 1e-3  # of a coarse limit: how far beyond it the unstable movement is computed
SPLIT = 1e-6  # the distance from 1 of a factor that counts as 1
SAME_SHAPE = 0.9  # of the largest overlap: modes of one shape
POLE = 2.0  # largest stable dt over the time constant of a filter
POLE_RK4 = 2.7852935634052816  # the same for RK4


class Limit(NamedTuple):
    """The largest stable step.

    limit: finite; none, stable up to 5 s; saddle, the posture is unstable; drifts, a mode has neither stiffness nor damping.
    """

    limit: str
    dt: float | None  # s, of a finite one
    joint: str  # the speed or actuator that limits, or that grows most; "": none
    rate: float | None  # 1/s, |lambda| of the mode; of a saddle its growth rate
    kind: str  # swing, real; "": no mode
    shape: np.ndarray | None = None  # (nv,) of the mode, M x scaled to length 1


class Small(Deviations):
    """Small deviations and the steps of MuJoCo's integrators."""

    is_coupled = False  # whether constraints couple speeds
    refined = REFINED

    @property
    def meeting(self) -> np.ndarray:
        """Movements that the constraints allow, x = N y, (nv, m): here all."""
        return np.eye(len(self.M))

    def braking(self, integrator: str) -> np.ndarray:
        """The part of D that is implicit in an integrator, (nv, nv)."""
        if integrator == "Euler":
            return np.diag(self.damping)
        if integrator in ("implicitfast", "implicit"):
            return np.where(self.on_path, self.uncut, 0.0)
        return self.brakes if integrator == "discrete" else np.zeros_like(self.D)

    @cached_property
    def held(self) -> dict[str, np.ndarray]:
        """The part of K that is implicit in each integrator, in the units of M."""
        return dict.fromkeys(self.implicit, np.zeros_like(self.M)) | {"discrete": self.scaled(self.springs)}

    @cached_property
    def implicit(self) -> dict[str, np.ndarray]:
        """The part of D that is implicit in each integrator, in the units of M."""
        return {name: self.scaled(self.braking(name)) for name in ("Euler", "implicitfast", "implicit", "discrete")}

    def step(self, integrator: str, dt: float) -> np.ndarray:
        """The matrix of a step of a small deviation (x, v), in the units of M, (2nv, 2nv)."""
        n = len(self.M)
        unit, none = np.eye(n), np.zeros((n, n))
        if integrator == "RK4":
            stiff, damped, _ = self.constrained(integrator, dt, self.stiff, self.damped, unit)
            Z = dt * np.block([[none, unit], [-stiff, -damped]])
            return np.eye(2 * n) + Z @ (np.eye(2 * n) + Z @ (np.eye(2 * n) / 2 + Z @ (np.eye(2 * n) / 6 + Z / 24)))
        held = dt * self.held[integrator]
        matrix = unit + dt * (self.implicit[integrator] + held)
        stiff, damped, _ = self.constrained(integrator, dt, self.stiff, self.damped + held, matrix)
        speeds = np.hstack([none, unit]) - dt * np.linalg.solve(matrix, np.hstack([stiff, damped]))
        return np.vstack([np.hstack([unit, none]) + dt * speeds, speeds])

    def constrained(
        self, integrator: str, dt: float, stiff: np.ndarray, damped: np.ndarray, matrix: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Stiffness, damping and the effect of other forces, in the units of M, with the forces of constraints: here none.

        matrix: the left side of the step.
        """
        return stiff, damped, np.eye(len(self.M))

    def equations(self, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Accelerations by the state (x, v) and by a unit force, with constraints as in a step of this size."""
        stiff, damped, share = self.constrained("Euler", dt, self.stiff, self.damped, np.eye(len(self.M)))
        L, back = self.root, self.unrooted
        return tuple(back.T @ each for each in (-stiff @ L.T, -damped @ L.T, share @ back))

    def growth(self, integrator: str, dt: float) -> float:
        """The spectral radius of a step: above 1 something grows."""
        if integrator == "RK4" and not self.is_coupled:
            factors = growth_of(METHODS["rk4"], dt * self.modes[0])
        else:
            factors = np.linalg.eigvals(self.step(integrator, dt))
        # a free movement has the factor 1 twice, which rounding splits
        return float(np.where(np.abs(factors - 1.0) <= SPLIT, 1.0, np.abs(factors)).max(initial=0.0))

    def is_stable(self, integrator: str, dt: float) -> bool:
        """Whether a step is stable, filters included."""
        slowest = min(self.pole_limits(integrator), default=(np.inf, ""))[0]
        return dt < slowest and self.stays(integrator, dt)

    def stays(self, integrator: str, dt: float) -> bool:
        """Whether nothing grows in a step beyond rounding."""
        return self.growth(integrator, dt) <= 1.0 + max(NEUTRAL, 2.0 * dt * self.neutral)

    def pole_limits(self, integrator: str) -> list[tuple[float, str]]:
        """The largest stable step, s, of each filter, and its actuator. RK4 integrates a filterexact like a filter."""
        if integrator == "RK4":
            return [(POLE_RK4 * constant, name) for name, constant, _ in self.poles]
        return [(POLE * constant, name) for name, constant, is_exact in self.poles if not is_exact]

    def P(self, integrator: str, dt: float) -> np.ndarray:
        """4 M + 2 dt (D_impl - D_expl) - dt^2 K, of discrete with 2 S dt^2, in the units of M."""
        P = (
            4.0 * np.eye(len(self.M))
            + 2.0 * dt * (2.0 * self.implicit[integrator] - self.damped)
            - dt * dt * (self.stiff - 2.0 * self.held[integrator])
        )
        return 0.5 * (P + P.T)

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
        dt = None
        if self.names:
            dt = self.closed_form(integrator) if self.has_closed_form(integrator) else self.scanned(integrator)
        slowest, name = min(self.pole_limits(integrator), default=(np.inf, ""))
        if slowest < min(dt or np.inf, LIMIT_UP_TO):
            constant = next(constant for actuator, constant, _ in self.poles if actuator == name)
            return Limit("finite", slowest, name, 1.0 / constant, "real")
        if dt is None:
            return Limit("none", None, "", None, "")
        shape = self.limiting(integrator, dt)
        rate, kind = self.nearest(shape)
        return Limit("finite", dt, self.joint_of(shape), rate, kind, shape)

    def has_closed_form(self, integrator: str) -> bool:
        return self.is_symmetric and integrator in self.implicit and (integrator != "discrete" or self.pulls_back)

    @cached_property
    def pulls_back(self) -> bool:
        """Whether the springs that are implicit in discrete are symmetric and positive semidefinite."""
        S = self.held["discrete"]
        size = max(np.abs(S).max(), np.abs(self.stiff).max())
        return np.abs(S - S.T).max() <= SYMMETRIC * size and np.linalg.eigvalsh(S).min() >= -VANISHING * size

    def closed_form(self, integrator: str) -> float | None:
        """The limit by P, s; None: stable up to 5 s. Along any movement P is a quadratic in dt with at most one positive root."""
        if self.holds(integrator, LIMIT_UP_TO):
            return None
        return bisected(lambda dt: self.holds(integrator, dt), 0.0, LIMIT_UP_TO)

    def scanned(self, integrator: str) -> float | None:
        """The limit by the eigenvalues of steps, s: the first unstable one; None: stable up to 5 s."""
        low = 0.0
        for dt in self.steps_tried(integrator):
            if not self.stays(integrator, dt):
                return bisected(lambda dt: self.stays(integrator, dt), low, dt, self.refined)
            low = dt
        return None

    def steps_tried(self, integrator: str) -> np.ndarray:
        """Steps from short to 5 s, s."""
        return upwards(min(LIMIT_FROM / max(np.abs(self.modes[0]).max(initial=0.0), 1e-300), 0.1 * LIMIT_UP_TO))

    def limiting(self, integrator: str, dt: float) -> np.ndarray:
        """The movement, in the units of M, (nv,), that becomes unstable at this step."""
        if self.has_closed_form(integrator):
            return np.linalg.eigh(self.P(integrator, dt))[1][:, 0]
        if integrator == "RK4" and not self.is_coupled:
            values, moves = self.modes
            return moves[:, np.argmax(np.abs(growth_of(METHODS["rk4"], dt * values)))]
        beyond = BEYOND_LIMIT * self.is_coupled  # there its factor is above 1, that of all others
        values, vectors = np.linalg.eig(self.step(integrator, (1.0 + beyond) * dt))
        move = vectors[: len(self.M), np.argmax(np.abs(values))]
        return move / np.linalg.norm(move)

    def nearest(self, shape: np.ndarray) -> tuple[float, str]:
        """Rate, 1/s, and kind, swing or real, of the mode with the nearest movement, the fastest of several."""
        values, moves = self.modes
        if not len(values):  # only the soft constraints yield
            return 0.0, "real"
        overlap = np.abs(moves.conj().T @ shape)
        near = np.flatnonzero(overlap >= SAME_SHAPE * overlap.max())
        value = values[near[np.argmax(np.abs(values[near]))]]
        return float(np.abs(value)), "swing" if abs(value.imag) > 1e-6 * abs(value) else "real"


def upwards(first: float) -> np.ndarray:
    """Steps from the first up to 5 s."""
    return np.geomspace(first, LIMIT_UP_TO, int(np.ceil(STEPS_A_DECADE * np.log10(LIMIT_UP_TO / first))) + 1)


def bisected(holds, low: float, high: float, refined: float = REFINED) -> float:
    """The largest step, s, at which a condition holds that holds at `low` and not at `high`."""
    while high - low > refined * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return float(low)
