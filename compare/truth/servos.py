"""Forces and their derivatives at rest under a robot's own servos: K and D of M x'' + D x' + K x = 0 for small deviations x."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal
from tmt.methods import by_speed

from ..robots.actuators import Cut, Drive
from ..robots.case import Coordinates
from .deviations import SYMMETRIC
from .rest import Weight, spring_slope, weight

REST_STEPS = 60  # of Newton's method
REST_FORCE = 1e-9  # of the largest single force: the largest residual at rest
REST_REACH = 0.3  # rad or m: the longest step of Newton's method
TURNED_BY = 1e-6  # rad or m, of central differences where a moment turns with the posture
SINGULAR = 1e-9  # of the largest stiffness: less is zero


class Along(NamedTuple):
    """Transmissions and tendons at a posture: k of them.

    lengths (k,); slopes dl/dq (k, nv); moments (k, nv), with ldot = moment qd and torque = moment' force; turns (k, nv, nv),
    d moments/dq. MuJoCo's length of a site without a reference is 0, of a ball its rotation vector: there slopes are not moments.
    """

    lengths: np.ndarray
    slopes: np.ndarray
    moments: np.ndarray
    turns: np.ndarray


class Pulls(NamedTuple):
    """Actuators, then tendons at rest, (k,) each: force, -d force/dl and -d force/dldot; the derivatives are 0 at a range."""

    forces: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    cut: np.ndarray  # whether a range cuts the force


class Slopes(NamedTuple):
    """Derivatives of the forces at rest, (nv, nv) each: K = -d force/dq, D = -d force/dqd.

    uncut: D before the range of a speed's sum cuts it, as implicitfast and implicit use it. springs, brakes: the implicit part
    of discrete: without the derivatives of moments, and only what pulls back or brakes.
    """

    K: np.ndarray
    D: np.ndarray
    uncut: np.ndarray
    springs: np.ndarray
    brakes: np.ndarray


@dataclass(frozen=True)
class Driven:
    """A tree with its drive: forces at rest, and their derivatives.

    ask: MuJoCo's lengths (k,) and moments (k, nv) at q of all actuators, then all tendons; used where a moment depends on q.
    weightless: without gravity. rows: the Rows at q, None: no constraints. locked: speeds that do not move.
    """

    tree: tmt.Tree
    drive: Drive
    ask: Callable | None = None
    weightless: bool = False
    rows: Callable | None = None
    locked: tuple[int, ...] = ()

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.tree.hinge_names, self.tree.kind)

    def weights(self, q: np.ndarray) -> tuple[Weight, Weight]:
        """The weight at a posture, and the part of it that is compensated."""
        tree, parts = self.tree, self.drive.compensation or (0.0,) * len(self.tree.mass)
        gravity = (0.0, 0.0, 0.0) if self.weightless else tree.gravity
        lighter = [mass * part for mass, part in zip(tree.mass, parts)]
        return weight(tree, q, tree.mass, gravity), weight(tree, q, lighter, gravity)

    def along(self, q: np.ndarray, differenced: bool = False) -> Along:
        """The transmissions of the actuators, then the tendons, at a posture (nq,).

        differenced: with derivatives by finite differences, see Along; else slopes are moments, and turns 0.
        """
        places = self.coordinates.places
        single = np.zeros(places.nv)
        for kind, at, by in places.joints:
            if kind != "ball":
                single[by] = q[at]
        every = (*self.drive.actuators, *self.drive.tendons)
        n, turning = places.nv, [i for i, item in enumerate(every) if item.moment is None]
        moments = np.array([item.moment or (0.0,) * n for item in every]).reshape(-1, n)
        lengths, slopes, turns = moments @ single, moments.copy(), np.zeros((len(every), n, n))
        if turning and self.ask:
            lengths[turning], moments[turning] = (values[turning] for values in self.ask(q))
        if turning and self.ask and differenced:
            for j, step in enumerate(TURNED_BY * np.eye(n)):
                ahead, behind = (self.ask(self.coordinates.move(q, sign * step)) for sign in (1.0, -1.0))
                slopes[turning, j], turns[turning, :, j] = (
                    (after[turning] - before[turning]) / (2.0 * TURNED_BY) for after, before in zip(ahead, behind)
                )
        return Along(lengths, slopes, moments, turns)

    @property
    def differenced(self) -> tuple[str, ...]:
        """The names of the actuators and tendons whose derivatives are finite differences of MuJoCo's."""
        every = [act for act in self.drive.actuators if act.acts] + list(self.drive.tendons)
        return tuple(item.name for item in every if item.moment is None)

    def pulls(self, along: Along, u: np.ndarray) -> Pulls:
        """The forces of actuators and tendons at rest at a posture, under the controls u."""
        forces, stiff, damped, cut = [], [], [], []
        for act, control, length in zip(self.drive.actuators, u, along.lengths):
            force = act.force(control, length) if act.acts else 0.0
            cut.append(act.acts and act.is_cut(force))
            forces.append(float(np.clip(force, *act.force_range)) if cut[-1] else force)
            stiff.append(act.stiffness(control) * act.acts)
            damped.append(act.damping(control) * act.acts)
        for number, (low, high) in self.drive.tendon_ranges.items():
            pulling = [i for i, act in enumerate(self.drive.actuators) if act.tendon == number and act.acts]
            total = sum(forces[i] for i in pulling)
            if not low < total < high:
                for i in pulling:
                    forces[i], cut[i] = forces[i] * np.clip(total, low, high) / total if total else 0.0, True
        for tendon, length in zip(self.drive.tendons, along.lengths[len(forces) :]):
            forces.append(tendon.force(length))
            stiff.append(tendon.stiffness * tendon.pulls(length))
            damped.append(tendon.damping)
            cut.append(False)
        cut = np.array(cut, bool)
        return Pulls(np.array(forces), np.where(cut, 0.0, stiff), np.where(cut, 0.0, damped), cut)

    def actuated(self, q: np.ndarray, along: Along, pulls: Pulls) -> np.ndarray:
        """The sum of the actuators' forces at each speed, (nv,), before its range cuts it."""
        count = len(self.drive.actuators)
        total, lifted = pulls.forces[:count] @ along.moments[:count], list(self.drive.lifted)
        if lifted:
            total[lifted] += self.weights(q)[1].torque[lifted]
        return total

    def sums(self, total: np.ndarray) -> dict[int, float]:
        """The actuators' sum at each speed where its range cuts it, by the number of the speed."""
        return {
            speed: float(np.clip(total[speed], low, high))
            for speed, (low, high) in self.drive.ranges.items()
            if not low < total[speed] < high
        }

    def cut(self, q: np.ndarray, u: np.ndarray) -> Cut:
        """The forces that ranges cut at a posture. An actuator that acts only where the sum is cut is cut too."""
        along = self.along(q)
        pulls = self.pulls(along, u)
        sums, count = self.sums(self.actuated(q, along, pulls)), len(self.drive.actuators)
        cut = pulls.cut | self.silenced(along, sums)
        return Cut({int(i): float(pulls.forces[i]) for i in np.flatnonzero(cut[:count])}, sums)

    def silenced(self, along: Along, sums: Mapping[int, float]) -> np.ndarray:
        """Which of the actuators and tendons act only at speeds whose sum is cut, (k,)."""
        elsewhere = np.delete(along.moments, list(sums), axis=1).any(axis=1)
        is_actuator = np.arange(len(elsewhere)) < len(self.drive.actuators)
        return is_actuator & along.moments.any(axis=1) & ~elsewhere

    def forces(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The sum of all forces at rest, (nv,) N m or N, and its largest term."""
        along, count = self.along(q), len(self.drive.actuators)
        pulls = self.pulls(along, u)
        actuated = self.actuated(q, along, pulls)
        for speed, total in self.sums(actuated).items():
            actuated[speed] = total
        of_tendons = pulls.forces[count:] @ along.moments[count:]
        whole, away = self.weights(q)
        away.torque[[*self.drive.lifted, *self.drive.unlifted]] = 0.0
        springs = literal.spring_torque(q, self.tree)
        sizes = [act.largest(x, length) for act, x, length in zip(self.drive.actuators, u, along.lengths) if act.acts]
        sizes += [tendon.largest(length) for tendon, length in zip(self.drive.tendons, along.lengths[count:])]
        levers = np.abs(along.moments[[act.acts for act in self.drive.actuators] + [True] * len(self.drive.tendons)])
        by_drive = (levers * np.array(sizes).reshape(-1, 1)).max(initial=0.0)
        by_springs = np.abs(by_speed(self.tree, self.tree.stiffness)).max() * max(1.0, np.abs(q).max())
        total = actuated + of_tendons - whole.torque + away.torque - springs
        return total, float(max(by_drive, by_springs, whole.size, away.size))

    def slopes(self, q: np.ndarray, u: np.ndarray) -> Slopes:
        """Derivatives of the forces at rest at a posture, under the controls u."""
        along, count = self.along(q, differenced=True), len(self.drive.actuators)
        pulls, J = self.pulls(along, u), along.moments
        sums = self.sums(self.actuated(q, along, pulls))
        heard = ~self.silenced(along, sums)
        each = np.einsum("ki,k,kj->kij", J, pulls.stiffness, along.slopes)
        each -= np.einsum("k,kij->kij", pulls.forces, along.turns)
        each[~heard] = 0.0
        lost = np.einsum("ki,k,kj->kij", J, pulls.damping * heard, J)
        always = lost[count:].sum(axis=0) + np.diag(np.add(self.tree.damping, self.drive.damping or 0.0))
        acting, braked = each[:count].sum(axis=0), lost[:count].sum(axis=0)
        springs = (
            np.diag(by_speed(self.tree, self.tree.stiffness)) + (J.T * np.maximum(pulls.stiffness * heard, 0.0)) @ J
        )
        speeding = lost[pulls.damping < 0.0].sum(axis=0)
        uncut = always + braked
        whole, away = self.weights(q)
        away.slope[list(self.drive.unlifted)] = 0.0
        acting[list(self.drive.lifted)] -= away.slope[list(self.drive.lifted)]
        away.slope[list(self.drive.lifted)] = 0.0
        K = whole.slope - away.slope + spring_slope(self.tree, q)
        acting[list(sums)], braked[list(sums)] = 0.0, 0.0
        return Slopes(K + acting + each[count:].sum(axis=0), always + braked, uncut, springs, uncut - speeding)

    def at_rest(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The nearest posture at rest, by Newton's method from q, and the residual force; 0.0: it rests.

        A force on its range has no derivative: without success the search starts again from the rest without ranges.
        """
        rest = self.descended(q, u)
        if rest[1] and (self.drive.ranges or self.drive.tendon_ranges or self.cut(q, u).forces):
            unlimited = replace(self, drive=self.drive.without_ranges).descended(q, u)
            again = rest if unlimited[1] else self.descended(unlimited[0], u)
            return rest if again[1] else again
        return rest

    def descended(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The same by Newton's method from q alone; downhill if K is symmetric, so that it does not climb to a saddle."""
        best, left, scale = q, np.inf, 0.0
        for _ in range(REST_STEPS):
            force, largest = self.forces(q, u)
            held, springs = constraint_forces(self.rows, self.coordinates, q)
            force = force + held
            force[list(self.locked)] = 0.0
            size, scale = float(np.abs(force).max()), max(scale, largest, np.abs(held).max())
            if size < left:
                best, left = q, size
            if size <= 1e-4 * REST_FORCE * scale:
                break
            K = self.slopes(q, u).K + springs + turning(self.rows, self.coordinates, q)
            step = np.zeros(len(force))
            rest = np.delete(np.arange(len(force)), self.locked)
            step[rest] = downhill(K[np.ix_(rest, rest)], force[rest])
            q = self.coordinates.move(q, step * min(1.0, REST_REACH / max(np.abs(step).max(), 1e-300)))
        return best, 0.0 if left <= REST_FORCE * scale else left


def constraint_forces(ask: Callable | None, coordinates: Coordinates, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J' f of constraints at rest, (nv,), and their stiffness as springs, (nv, nv). ask: the Rows at q."""
    n = coordinates.nv
    if ask is None:
        return np.zeros(n), np.zeros((n, n))
    rows = ask(q)
    return rows.jacobian.T @ rows.forces, rows.springs


def turning(ask: Callable | None, coordinates: Coordinates, q: np.ndarray) -> np.ndarray:
    """-d(J' f)/dq of constraints with constant f, (nv, nv): the effect of their rotation."""
    n = coordinates.nv
    stiffness, rows = np.zeros((n, n)), ask and ask(q)
    if rows and rows.forces.any():
        for j, step in enumerate(TURNED_BY * np.eye(n)):
            ahead, behind = (ask(coordinates.move(q, sign * step)).jacobian for sign in (1.0, -1.0))
            if ahead.shape == behind.shape == rows.jacobian.shape:
                stiffness[:, j] = (behind - ahead).T @ rows.forces / (2.0 * TURNED_BY)
    return stiffness


def downhill(K: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The step of Newton's method, rad or m; if K is symmetric with absolute values of the stiffnesses, away from a saddle."""
    if np.abs(K - K.T).max(initial=0.0) > SYMMETRIC * np.abs(K).max(initial=0.0):
        return np.linalg.lstsq(K, force, rcond=SINGULAR)[0]
    sizes, modes = np.linalg.eigh(0.5 * (K + K.T))
    sizes = np.abs(sizes)
    held = sizes > SINGULAR * sizes.max(initial=0.0)
    return modes[:, held] @ (modes[:, held].T @ force / sizes[held])
