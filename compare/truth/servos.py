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

REST_STEPS = 60  # at most
REST_FORCE = 1e-9  # of the largest single force: what may be left at rest
REST_REACH = 0.3  # rad or m, of one step of it
TURNED_BY = 1e-6  # rad or m, of central differences where a moment turns with the posture
SINGULAR = 1e-9  # of the largest stiffness: less is zero


class Along(NamedTuple):
    """Transmissions and tendons at a posture: k of them.

    lengths (k,); slopes: dl/dq (k, nv); moments (k, nv), which multiply forces and with which ldot = moment qd; turns: how the
    moments change with q (k, nv, nv). MuJoCo's length of a site without a reference is 0, of a ball the vector of its turn: there
    slopes are not moments.
    """

    lengths: np.ndarray
    slopes: np.ndarray
    moments: np.ndarray
    turns: np.ndarray


class Pulls(NamedTuple):
    """What actuators, then tendons do at rest, (k,) each: force, -d force/dl and -d force/dldot; 0 of those that are cut."""

    forces: np.ndarray
    stiffness: np.ndarray
    damping: np.ndarray
    cut: np.ndarray  # whether a range cuts it


class Slopes(NamedTuple):
    """Derivatives of the forces at rest, (nv, nv) each: K = -d force/dq, D = -d force/dqd.

    uncut: D before the range of a speed's sum cuts it: that is what implicitfast and implicit know of. springs and brakes: what
    `discrete` has implicit: without how moments turn, of balls the same about each axis, and nothing that pushes or speeds up.
    """

    K: np.ndarray
    D: np.ndarray
    uncut: np.ndarray
    springs: np.ndarray
    brakes: np.ndarray


@dataclass(frozen=True)
class Driven:
    """A tree with its drive: forces at rest, and their derivatives.

    ask: lengths (k,) and moments (k, nv) at q of all actuators and then all tendons, of MuJoCo; used where a moment turns.
    weightless: without gravity. rows: the coupling.Rows at q, None: no constraints. locked: speeds that do not move.
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
        """What gravity does at a posture, and what of it is taken away."""
        tree, parts = self.tree, self.drive.compensation or (0.0,) * len(self.tree.mass)
        gravity = (0.0, 0.0, 0.0) if self.weightless else tree.gravity
        lighter = [mass * part for mass, part in zip(tree.mass, parts)]
        return weight(tree, q, tree.mass, gravity), weight(tree, q, lighter, gravity)

    def along(self, q: np.ndarray, differenced: bool = False) -> Along:
        """The transmissions of the actuators, then the tendons, at a posture (nq,).

        differenced: with what only differences tell, see Along; else slopes are moments, and turns 0.
        """
        places = self.coordinates.places
        single = np.zeros(places.nv)
        for kind, at, by in places.joints:
            if kind != "ball":
                single[by] = q[at]
        every = (*self.drive.actuators, *self.drive.tendons)
        n, turning = places.nv, [i for i, one in enumerate(every) if one.moment is None]
        moments = np.array([one.moment or (0.0,) * n for one in every]).reshape(-1, n)
        lengths, slopes, turns = moments @ single, moments.copy(), np.zeros((len(every), n, n))
        if turning and self.ask:
            lengths[turning], moments[turning] = (found[turning] for found in self.ask(q))
        if turning and self.ask and differenced:
            for j, step in enumerate(TURNED_BY * np.eye(n)):
                ahead, behind = (self.ask(self.coordinates.move(q, sign * step)) for sign in (1.0, -1.0))
                slopes[turning, j], turns[turning, :, j] = (
                    (one[turning] - other[turning]) / (2.0 * TURNED_BY) for one, other in zip(ahead, behind)
                )
        return Along(lengths, slopes, moments, turns)

    @property
    def differenced(self) -> tuple[str, ...]:
        """What turns with the posture, by name: its derivative is a difference of MuJoCo's."""
        every = [one for one in self.drive.actuators if one.acts] + list(self.drive.tendons)
        return tuple(one.name for one in every if one.moment is None)

    def pulls(self, along: Along, u: np.ndarray) -> Pulls:
        """What each actuator and tendon does at rest at a posture, under u of each actuator."""
        forces, stiff, damped, cut = [], [], [], []
        for one, control, length in zip(self.drive.actuators, u, along.lengths):
            force = one.force(control, length) if one.acts else 0.0
            cut.append(one.acts and one.is_cut(force))
            forces.append(float(np.clip(force, *one.force_range)) if cut[-1] else force)
            stiff.append(one.stiffness(control) * one.acts)
            damped.append(one.damping(control) * one.acts)
        for number, (low, high) in self.drive.tendon_ranges.items():
            pulling = [i for i, one in enumerate(self.drive.actuators) if one.tendon == number and one.acts]
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
        """By the number of a speed what its range leaves of the actuators' sum, (nv,), where it cuts it."""
        return {
            speed: float(np.clip(total[speed], low, high))
            for speed, (low, high) in self.drive.ranges.items()
            if not low < total[speed] < high
        }

    def cut(self, q: np.ndarray, u: np.ndarray) -> Cut:
        """What ranges cut at a posture. An actuator that acts only where the sum is cut has nothing to say: it is cut too."""
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
        """The sum of all forces at rest, (nv,) N m or N, and the largest of what they are summed from."""
        along, count = self.along(q), len(self.drive.actuators)
        pulls = self.pulls(along, u)
        actuated = self.actuated(q, along, pulls)
        for speed, left in self.sums(actuated).items():
            actuated[speed] = left
        of_tendons = pulls.forces[count:] @ along.moments[count:]
        whole, away = self.weights(q)
        away.torque[[*self.drive.lifted, *self.drive.unlifted]] = 0.0
        springs = literal.spring_torque(q, self.tree)
        sizes = [one.largest(x, length) for one, x, length in zip(self.drive.actuators, u, along.lengths) if one.acts]
        sizes += [one.largest(length) for one, length in zip(self.drive.tendons, along.lengths[count:])]
        levers = np.abs(along.moments[[one.acts for one in self.drive.actuators] + [True] * len(self.drive.tendons)])
        by_drive = (levers * np.array(sizes).reshape(-1, 1)).max(initial=0.0)
        by_springs = np.abs(by_speed(self.tree, self.tree.stiffness)).max() * max(1.0, np.abs(q).max())
        total = actuated + of_tendons - whole.torque + away.torque - springs
        return total, float(max(by_drive, by_springs, whole.size, away.size))

    def slopes(self, q: np.ndarray, u: np.ndarray) -> Slopes:
        """Derivatives of the forces at rest at a posture, under u of each actuator."""
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
        """The nearest posture at rest, by Newton's method from q, and the size of the force that is left there; 0.0: none.

        A force on its range tells no way back: if there is no rest that way, from where it would rest without ranges.
        """
        found = self.descended(q, u)
        if found[1] and (self.drive.ranges or self.drive.tendon_ranges or self.cut(q, u).forces):
            unlimited = replace(self, drive=self.drive.without_ranges).descended(q, u)
            again = found if unlimited[1] else self.descended(unlimited[0], u)
            return found if again[1] else again
        return found

    def descended(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The same by Newton's method from q alone; where K is symmetric downhill, so that it does not climb to a saddle."""
        best, left, scale = q, np.inf, 0.0
        for _ in range(REST_STEPS):
            force, largest = self.forces(q, u)
            held, springs = constraint_forces(self.rows, self.coordinates, q)
            force = self.of_moving(force + held)
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

    def of_moving(self, force: np.ndarray) -> np.ndarray:
        """A force (nv,) without that at locked speeds."""
        force[list(self.locked)] = 0.0
        return force


def constraint_forces(ask: Callable | None, coordinates: Coordinates, q: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """J' f of constraints at rest, (nv,), and the stiffness that they have as springs, (nv, nv). ask: the Rows at q."""
    n = coordinates.nv
    if ask is None:
        return np.zeros(n), np.zeros((n, n))
    rows = ask(q)
    return rows.jacobian.T @ rows.forces, rows.springs


def turning(ask: Callable | None, coordinates: Coordinates, q: np.ndarray) -> np.ndarray:
    """-d(J' f)/dq of constraints whose f stays, (nv, nv): what they do by turning with the posture."""
    n = coordinates.nv
    found, rows = np.zeros((n, n)), ask and ask(q)
    if rows and rows.forces.any():
        for j, step in enumerate(TURNED_BY * np.eye(n)):
            ahead, behind = (ask(coordinates.move(q, sign * step)).jacobian for sign in (1.0, -1.0))
            if ahead.shape == behind.shape == rows.jacobian.shape:
                found[:, j] = (behind - ahead).T @ rows.forces / (2.0 * TURNED_BY)
    return found


def downhill(K: np.ndarray, force: np.ndarray) -> np.ndarray:
    """Where Newton's method goes, rad or m, with the sizes of the stiffnesses if K is symmetric: away from a saddle."""
    if np.abs(K - K.T).max(initial=0.0) > SYMMETRIC * np.abs(K).max(initial=0.0):
        return np.linalg.lstsq(K, force, rcond=SINGULAR)[0]
    sizes, modes = np.linalg.eigh(0.5 * (K + K.T))
    sizes = np.abs(sizes)
    held = sizes > SINGULAR * sizes.max(initial=0.0)
    return modes[:, held] @ (modes[:, held].T @ force / sizes[held])
