"""Up to which step an integrator of MuJoCo keeps a posture at rest stable under a robot's own servos: in closed form.

Of the equations M x'' + D x' + K x = 0, D = D_impl + D_expl, a step of Euler, implicitfast or implicit is
(M + dt D_impl) (v+ - v) = -dt (K x + D v), x+ = x + dt v+. With z = (1 + s) / (1 - s) for its eigenvalues it is
P s^2 + 2 dt D s + dt^2 K = 0, P = 4 M + 2 dt (D_impl - D_expl) - dt^2 K: where M, D and K are symmetric and D and K not
negative it is stable if and only if P is positive definite. A step of discrete, which has all of D and the springs S of joints
and actuators implicit, gives P = 4 M + 2 dt D + dt^2 (2 S - K) and D + dt S in the place of D: the same holds where S is not
negative. Elsewhere the eigenvalues of the step decide.
"""

from collections.abc import Callable
from dataclasses import dataclass, fields
from functools import cached_property
from typing import NamedTuple

import numpy as np

from tmt import METHODS

from ..robots.actuators import Rows
from .deviations import SYMMETRIC, VANISHING, Deviations
from .linear import NEUTRAL
from .steps import growth_of

LIMIT_UP_TO = 5.0  # s: what is stable up to it has no limit here
LIMIT_FROM = 0.01  # of the time of the fastest mode: stable if anything is
STEPS_A_DECADE = 12  # steps for each power of ten, where no closed form tells the limit
REFINED = 1e-10  # of a limit
BEYOND_LIMIT = 1e-3  # of a limit that is found coarsely: where its movement is told
SPLIT = 1e-6  # of a factor 1
SAME_SHAPE = 0.9  # of the largest overlap: modes of one shape
POLE = 2.0  # dt over the time constant of a filter, up to which it is stable
POLE_RK4 = 2.7852935634052816  # and of RK4
NEARLY = 0.3  # of the limit of rigid constraints: from there on the limit of soft ones is sought step by step
COARSELY = 1e-6  # of a limit
DEPENDENT = 1e-8  # of the largest singular value of the Jacobian of constraints: less is none


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


class Small(Deviations):
    """Small deviations, and what steps make of them."""

    is_coupled = False  # whether constraints hold speeds together
    refined = REFINED

    @property
    def meeting(self) -> np.ndarray:
        """Movements that the constraints allow, x = N y, (nv, m): here all."""
        return np.eye(len(self.M))

    def braking(self, integrator: str) -> np.ndarray:
        """What of D an integrator has implicit, (nv, nv)."""
        if integrator == "Euler":
            return np.diag(self.damping)
        if integrator in ("implicitfast", "implicit"):
            return np.where(self.on_path, self.uncut, 0.0)
        return self.brakes if integrator == "discrete" else np.zeros_like(self.D)

    @cached_property
    def held(self) -> dict[str, np.ndarray]:
        """Of K what each integrator has implicit, in the units of M."""
        return dict.fromkeys(self.implicit, np.zeros_like(self.M)) | {"discrete": self.scaled(self.springs)}

    @cached_property
    def implicit(self) -> dict[str, np.ndarray]:
        """The same by the integrator's name, in the units of M."""
        return {name: self.scaled(self.braking(name)) for name in ("Euler", "implicitfast", "implicit", "discrete")}

    def step(self, integrator: str, dt: float) -> np.ndarray:
        """What a step makes of a small deviation (x, v), in the units of M, (2nv, 2nv)."""
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
        """Stiffness, damping and what becomes of other forces, in the units of M, with the forces of constraints: here of none.

        matrix: by which a step divides.
        """
        return stiff, damped, np.eye(len(self.M))

    def equations(self, dt: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Those of a step of this size without its error: from the state (x, v) the accelerations, and those of a unit force."""
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
        """Whether nothing grows in a step; nothing but what grows or drifts by itself is asked."""
        slowest = min(self.pole_limits(integrator), default=(np.inf, ""))[0]
        return dt < slowest and self.stays(integrator, dt)

    def stays(self, integrator: str, dt: float) -> bool:
        """Whether nothing grows in a step but by rounding."""
        return self.growth(integrator, dt) <= 1.0 + max(NEUTRAL, 2.0 * dt * self.neutral)

    def pole_limits(self, integrator: str) -> list[tuple[float, str]]:
        """Up to which step, s, each filter is stable, and its actuator. RK4 has a filterexact no more exact than a filter."""
        if integrator == "RK4":
            return [(POLE_RK4 * constant, name) for name, constant, _ in self.poles]
        return [(POLE * constant, name) for name, constant, is_exact in self.poles if not is_exact]

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
        low = 0.0
        for dt in self.steps_tried(integrator):
            if not self.stays(integrator, dt):
                return bisected(lambda dt: self.stays(integrator, dt), low, dt, self.refined)
            low = dt
        return None

    def steps_tried(self, integrator: str) -> np.ndarray:
        """Upwards to 5 s, s."""
        return upwards(min(LIMIT_FROM / max(np.abs(self.modes[0]).max(initial=0.0), 1e-300), 0.1 * LIMIT_UP_TO))

    def limiting(self, integrator: str, dt: float) -> np.ndarray:
        """The movement, in the units of M, (nv,), that a step of this size lets grow first."""
        if self.has_closed_form(integrator):
            return np.linalg.eigh(self.P(integrator, dt))[1][:, 0]
        if integrator == "RK4" and not self.is_coupled:
            values, moves = self.modes
            return moves[:, np.argmax(np.abs(growth_of(METHODS["rk4"], dt * values)))]
        beyond = BEYOND_LIMIT * self.is_coupled  # there it is larger than what stays, whose factor is 1
        values, vectors = np.linalg.eig(self.step(integrator, (1.0 + beyond) * dt))
        move = vectors[: len(self.M), np.argmax(np.abs(values))]
        return move / np.linalg.norm(move)

    def nearest(self, shape: np.ndarray) -> tuple[float, str]:
        """Rate, 1/s, and kind, swing or real, of the mode whose movement is nearest, the fastest of several."""
        values, moves = self.modes
        if not len(values):  # all that moves is what soft constraints give way
            return 0.0, "real"
        overlap = np.abs(moves.conj().T @ shape)
        near = np.flatnonzero(overlap >= SAME_SHAPE * overlap.max())
        found = values[near[np.argmax(np.abs(values[near]))]]
        return float(np.abs(found)), "swing" if abs(found.imag) > 1e-6 * abs(found) else "real"


def upwards(first: float) -> np.ndarray:
    """Steps from the first up to 5 s."""
    return np.geomspace(first, LIMIT_UP_TO, int(np.ceil(STEPS_A_DECADE * np.log10(LIMIT_UP_TO / first))) + 1)


def bisected(holds, low: float, high: float, refined: float = REFINED) -> float:
    """The largest step, s, at which something holds that holds at `low` and not at `high`."""
    while high - low > refined * high:
        middle = 0.5 * (low + high)
        low, high = (middle, high) if holds(middle) else (low, middle)
    return float(low)


# constraints


@dataclass(frozen=True)
class Rigid(Small):
    """Small deviations that meet constraints, in coordinates for these, as if the constraints were rigid."""

    soft: "Coupled | None" = None

    def braking(self, integrator):
        N = self.soft.meeting
        return N.T @ self.soft.braking(integrator) @ N


@dataclass(frozen=True)
class Coupled(Small):
    """Small deviations where constraints hold joints together; K has what these do by turning with the posture.

    What grows or drifts by itself and which modes there are is said of rigid constraints, in coordinates that meet them. A step
    is MuJoCo's: it finds the force of the soft constraints without what an integrator has implicit (discrete: with it), so that
    its limit is not that of rigid ones. couple: the Rows at a step size and an integrator, of all these speeds.
    """

    couple: Callable[[float, str], Rows] | None = None
    is_coupled = True
    refined = COARSELY

    @cached_property
    def meeting(self) -> np.ndarray:
        """Movements that the constraints allow, x = N y, (nv, m)."""
        jacobian = self.couple(1e-3, "Euler").jacobian
        _, sizes, directions = np.linalg.svd(jacobian)
        return directions[int((sizes > DEPENDENT * sizes.max(initial=0.0)).sum()) :].T

    @cached_property
    def rigid(self) -> "Rigid":
        """The same in these coordinates: N' M N y'' + N' D N y' + N' K N y = 0."""
        N = self.meeting
        square = {name: N.T @ getattr(self, name) @ N for name in ("M", "K", "D", "springs")}
        names, base = tuple(map(str, range(N.shape[1]))), tuple(np.flatnonzero(N[list(self.base)].any(axis=0)).tolist())
        return Rigid(**of_small(self) | square | {"names": names, "base": base}, soft=self)

    def of_all(self, moves: np.ndarray) -> np.ndarray:
        """Movements of `rigid` in the units of its M as those of all speeds in the units of M."""
        return self.root.T @ self.meeting @ self.rigid.unrooted.T @ moves

    @cached_property
    def modes(self):
        values, moves = self.rigid.modes
        return values, self.of_all(moves)

    @cached_property
    def growing(self):
        found = self.rigid.growing if self.meeting.size else None
        return found and (found[0], self.of_all(found[1]))

    @cached_property
    def drifts(self):
        return bool(self.meeting.size) and self.rigid.drifts

    def steps_tried(self, integrator):
        """A few up to well below the limit of rigid constraints, then as of others: each takes a forward pass and eigenvalues."""
        near = NEARLY * (self.rigid.limit(integrator).dt or LIMIT_UP_TO)
        return np.concatenate([np.geomspace(near / 100.0, near, 5)[:-1], upwards(near)])

    def has_closed_form(self, integrator):
        return False

    def constrained(self, integrator, dt, stiff, damped, matrix):
        rows = self.couple(dt, integrator)
        J, metric = rows.jacobian @ self.unrooted.T, matrix if integrator == "discrete" else np.eye(len(self.M))
        eased = np.linalg.solve(metric, J.T).T
        pull = np.linalg.solve(eased @ J.T + np.diag(rows.softness), J).T
        stiff = stiff - pull @ (eased @ stiff - rows.stiffness[:, None] * J)
        damped = damped - pull @ (eased @ damped - rows.damping[:, None] * J)
        return stiff, damped, np.eye(len(self.M)) - pull @ eased


def of_small(small: Small) -> dict:
    """What small deviations are made of, by name."""
    return {one.name: getattr(small, one.name) for one in fields(Deviations)}
