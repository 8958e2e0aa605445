"""Forces and their derivatives at rest under a robot's own servos: K and D of M x'' + D x' + K x = 0 for small deviations x."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal
from tmt.methods import by_speed

from ..robots.actuators import Drive
from ..robots.case import Coordinates
from .rest import Weight, spring_slope, weight
from .step_limits import SYMMETRIC, VANISHING

REST_STEPS = 60  # of Newton's method
REST_FORCE = 1e-9  # of the largest single force: the largest residual at rest
REST_REACH = 0.3  # rad or m: the longest step of Newton's method
ASIDE, MOST_SADDLES = 0.1, 10  # rad or m, along the unstable mode of a saddle; how many are left
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


class Slopes(NamedTuple):
    """Derivatives of the forces at rest, (nv, nv) each: K = -d force/dq, D = -d force/dqd.

    springs, brakes: the implicit part of discrete: without the derivatives of moments, and only what pulls back or brakes.
    """

    K: np.ndarray
    D: np.ndarray
    springs: np.ndarray
    brakes: np.ndarray


@dataclass(frozen=True)
class Driven:
    """A tree with its drive: forces at rest, and their derivatives.

    ask: MuJoCo's lengths (k,) and moments (k, nv) at q of all actuators, then all tendons; used where a moment depends on q.
    weightless: without gravity. rows: the Rows at q, None: no constraints.
    """

    tree: tmt.Tree
    drive: Drive
    ask: Callable | None = None
    weightless: bool = False
    rows: Callable | None = None

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.tree.joint_names, self.tree.kind)

    def weight(self, q: np.ndarray) -> Weight:
        """The weight at a posture, without what is compensated."""
        tree, parts = self.tree, self.drive.compensation or (0.0,) * len(self.tree.mass)
        masses = [mass * (1.0 - part) for mass, part in zip(tree.mass, parts)]
        return weight(tree, q, masses, (0.0, 0.0, 0.0) if self.weightless else tree.gravity)

    def along(self, q: np.ndarray, differenced: bool = False) -> Along:
        """The transmissions of the actuators, then the tendons, at a posture (nq,).

        differenced: with derivatives by finite differences, see Along; else slopes are moments, and turns 0.
        """
        places = self.coordinates.places
        single, n = np.zeros(places.nv), places.nv
        for joint in places.joints:
            if joint.kind != "ball":
                single[joint.qd] = q[joint.q]
        every = (*self.drive.actuators, *self.drive.tendons)
        turning = [i for i, item in enumerate(every) if item.moment is None] if self.ask else []
        moments = np.array([item.moment or (0.0,) * n for item in every]).reshape(-1, n)
        lengths, slopes, turns = moments @ single, moments.copy(), np.zeros((len(every), n, n))
        if turning:
            lengths[turning], moments[turning] = (values[turning] for values in self.ask(q))
        for j, step in enumerate(TURNED_BY * np.eye(n) if turning and differenced else ()):
            ahead, behind = (self.ask(self.coordinates.move(q, sign * step)) for sign in (1.0, -1.0))
            changes = [(after - before)[turning] / (2.0 * TURNED_BY) for after, before in zip(ahead, behind)]
            slopes[turning, j], turns[turning, :, j] = changes
        return Along(lengths, slopes, moments, turns)

    def pulls(self, along: Along, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
        """Of actuators, then tendons at rest, (k,): force, -d force/dl, -d force/dldot, and whether a range cuts the force."""
        laws = []
        for act, control, length in zip(self.drive.actuators, u, along.lengths):
            force = act.force(control, length)
            is_cut = act.is_cut(force)
            force = np.clip(force, *act.force_range) if is_cut else force
            laws.append(
                (force, act.stiffness(control), act.damping(control), is_cut) if act.acts else (0.0,) * 4
            )
        for tendon, length in zip(self.drive.tendons, along.lengths[len(laws) :]):
            laws.append(
                (tendon.force(length), tendon.stiffness * tendon.pulls(length), tendon.damping, False)
            )
        forces, stiff, damped, cut = np.array(laws, float).reshape(-1, 4).T
        return forces, np.where(cut, 0.0, stiff), np.where(cut, 0.0, damped), cut.astype(bool)

    def cut(self, q: np.ndarray, u: np.ndarray) -> dict[int, float]:
        """The forces that ranges cut at a posture, by the number of the actuator."""
        forces, _, _, cut = self.pulls(self.along(q), u)
        return {int(i): float(forces[i]) for i in np.flatnonzero(cut)}

    def forces(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The sum of all forces at rest, (nv,) N m or N, and its largest term."""
        along, count = self.along(q), len(self.drive.actuators)
        weigh = self.weight(q)
        sizes = [
            act.largest(x, length) * act.acts
            for act, x, length in zip(self.drive.actuators, u, along.lengths)
        ]
        sizes += [tendon.largest(length) for tendon, length in zip(self.drive.tendons, along.lengths[count:])]
        by_drive = (np.abs(along.moments) * np.array(sizes).reshape(-1, 1)).max(initial=0.0)
        by_springs = np.abs(by_speed(self.tree, self.tree.stiffness)).max() * max(1.0, np.abs(q).max())
        total = self.pulls(along, u)[0] @ along.moments - weigh.torque - literal.spring_torque(q, self.tree)
        return total, float(max(by_drive, by_springs, weigh.size))

    def slopes(self, q: np.ndarray, u: np.ndarray) -> Slopes:
        """Derivatives of the forces at rest at a posture, under the controls u."""
        along = self.along(q, differenced=True)
        J, (forces, stiffness, damping, _) = along.moments, self.pulls(along, u)
        each = np.einsum("ki,k,kj->kij", J, stiffness, along.slopes)
        each -= np.einsum("k,kij->kij", forces, along.turns)
        lost = np.einsum("ki,k,kj->kij", J, damping, J)
        D = lost.sum(axis=0) + np.diag(self.tree.damping)
        springs = np.diag(by_speed(self.tree, self.tree.stiffness)) + (J.T * np.maximum(stiffness, 0.0)) @ J
        K = each.sum(axis=0) + self.weight(q).slope + spring_slope(self.tree, q)
        return Slopes(K, D, springs, D - lost[damping < 0.0].sum(axis=0))

    def at_rest(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The nearest posture at rest, by Newton's method from q, and the residual force; 0.0: it rests.

        A force at the end of its range has no slope: then the search starts where the servos would rest without ranges.
        """
        rest, left = self.sought_rest(q, u)
        if left and self.cut(q, u):
            actuators = tuple(replace(actuator, force_range=None) for actuator in self.drive.actuators)
            unlimited = replace(self, drive=replace(self.drive, actuators=actuators))
            return self.sought_rest(unlimited.sought_rest(q, u)[0], u)
        return rest, left

    def sought_rest(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """See at_rest. Downhill if K is symmetric, so that it does not climb to a saddle."""
        best, left, scale = q, np.inf, 0.0
        for _ in range(REST_STEPS):
            force, largest = self.forces(q, u)
            held, springs, turning = constraint_terms(self.rows, self.coordinates, q)
            force = force + held
            size, scale = float(np.abs(force).max()), max(scale, largest, np.abs(held).max())
            if size < left:
                best, left = q, size
            if size <= 1e-4 * REST_FORCE * scale:
                break
            step = downhill(self.slopes(q, u).K + springs + turning, force)
            q = self.coordinates.move(q, step * min(1.0, REST_REACH / max(np.abs(step).max(), 1e-300)))
        return best, 0.0 if left <= REST_FORCE * scale else left


def at_rest(tree: tmt.Tree, q: np.ndarray) -> np.ndarray | None:
    """The stable posture (nq,), rad or m, at which it rests without torque, downhill from q. None: none was found."""
    driven = Driven(tree, Drive())
    for _ in range(MOST_SADDLES):
        q, left = driven.at_rest(q, ())
        if left:
            return None
        K = driven.slopes(q, ()).K
        sizes, modes = np.linalg.eigh(0.5 * (K + K.T))
        if sizes[0] >= -VANISHING * np.abs(sizes).max():
            return q
        q = driven.coordinates.move(q, ASIDE * modes[:, 0] / np.abs(modes[:, 0]).max())
    return None


def constraint_terms(
    ask: Callable | None, coordinates: Coordinates, q: np.ndarray
) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """J' f of constraints at rest, (nv,), their stiffness as springs, and by their rotation, (nv, nv). ask: the Rows at q.

    By rotation: -d(J' f)/dq with constant f.
    """
    n = coordinates.nv
    turning = np.zeros((n, n))
    if ask is None:
        return np.zeros(n), turning, turning
    rows = ask(q)
    for j, step in enumerate(TURNED_BY * np.eye(n) if rows.forces.any() else ()):
        ahead, behind = (ask(coordinates.move(q, sign * step)).jacobian for sign in (1.0, -1.0))
        if ahead.shape == behind.shape == rows.jacobian.shape:
            turning[:, j] = (behind - ahead).T @ rows.forces / (2.0 * TURNED_BY)
    springs = (rows.jacobian.T * (rows.stiffness / rows.softness)) @ rows.jacobian
    return rows.jacobian.T @ rows.forces, springs, turning


def downhill(K: np.ndarray, force: np.ndarray) -> np.ndarray:
    """The step of Newton's method, rad or m; if K is symmetric with absolute values of the stiffnesses, away from a saddle."""
    if np.abs(K - K.T).max(initial=0.0) > SYMMETRIC * np.abs(K).max(initial=0.0):
        return np.linalg.lstsq(K, force, rcond=SINGULAR)[0]
    sizes, modes = np.linalg.eigh(0.5 * (K + K.T))
    sizes = np.abs(sizes)
    held = sizes > SINGULAR * sizes.max(initial=0.0)
    return modes[:, held] @ (modes[:, held].T @ force / sizes[held])
