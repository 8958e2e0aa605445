"""The equations of motion at rest under a robot's own servos: M x'' + D x' + K x = 0 for small deviations x."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

import tmt

from ..actuators import Drive
from ..case import Coordinates
from .derivative import stiffness

TURNED_BY = 1e-6  # rad or m, of central differences where a moment turns with the posture
SINGULAR = 1e-9  # of the largest stiffness, or damping: less is none
REST_STEPS = 60  # at most
REST_FORCE = 1e-9  # of the largest single force: what may be left at rest
REST_REACH = 0.3  # rad or m, of one step of it


class Along(NamedTuple):
    """Lengths of transmissions and tendons at a posture (k,), dl/dq (k, nv), and how that turns with q (k, nv, nv)."""

    lengths: np.ndarray
    moments: np.ndarray
    turns: np.ndarray


@dataclass(frozen=True)
class Driven:
    """A tree with its drive: forces at rest, and their derivatives.

    ask: lengths (k,) and moments (k, nv) at q of all actuators and then all tendons, of MuJoCo; used where a moment turns.
    weightless: without gravity.
    """

    tree: tmt.Tree
    drive: Drive
    ask: Callable | None = None
    weightless: bool = False

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.tree.hinge_names, self.tree.kind)

    @cached_property
    def weight(self) -> tmt.Tree:
        """The tree whose bias at rest is what gravity does beside the springs, after compensation; masses may not be below 0."""
        gravity = (0.0, 0.0, 0.0) if self.weightless else self.tree.gravity
        return replace(self.tree, gravity=gravity)

    @cached_property
    def compensated(self) -> tmt.Tree | None:
        """The tree of what is taken away from the weight; None: nothing."""
        parts = self.drive.compensation
        if self.weightless or not any(parts) or not any(self.tree.gravity):
            return None
        n, nv = len(self.tree.parent), self.coordinates.nv
        masses = tuple(mass * part for mass, part in zip(self.tree.mass, parts))
        # rotors so that nothing is too light to be a tree; at rest they do nothing
        return replace(self.tree, mass=masses, armature=(1.0,) * nv, stiffness=(0.0,) * n)

    def along(self, q: np.ndarray) -> Along:
        """The transmissions of the actuators, then the tendons, at a posture (nq,)."""
        places = self.coordinates.places
        single = np.zeros(places.nv)
        for kind, at, by in places.joints:
            if kind != "ball":
                single[by] = q[at]
        every = (*self.drive.actuators, *self.drive.tendons)
        n, turning = places.nv, [i for i, one in enumerate(every) if one.moment is None]
        moments = np.array([one.moment or (0.0,) * n for one in every]).reshape(-1, n)
        lengths, turns = moments @ single, np.zeros((len(every), n, n))
        if turning and self.ask:
            asked_lengths, asked = self.ask(q)
            lengths[turning], moments[turning] = asked_lengths[turning], asked[turning]
            for j, step in enumerate(TURNED_BY * np.eye(n)):
                ahead, behind = (self.ask(self.coordinates.move(q, sign * step))[1][turning] for sign in (1.0, -1.0))
                turns[turning, :, j] = (ahead - behind) / (2.0 * TURNED_BY)
        return Along(lengths, moments, turns)

    @property
    def differenced(self) -> tuple[str, ...]:
        """What turns with the posture, by name: its derivative is a difference of MuJoCo's."""
        every = [one for one in self.drive.actuators if one.acts] + list(self.drive.tendons)
        return tuple(one.name for one in every if one.moment is None)

    def pulls(self, along: Along, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Of each actuator and tendon force, -d force/dl and -d force/dldot at rest, (k,) each; nothing where a range cuts it."""
        forces, stiff, damped = [], [], []
        for one, control, length in zip(self.drive.actuators, u, along.lengths):
            force = one.force(control, length) if one.acts else 0.0
            is_free = one.acts and not one.is_cut(force)
            forces.append(force if is_free or not one.acts else float(np.clip(force, *one.force_range)))
            stiff.append(one.stiffness(control) * is_free)
            damped.append(one.damping(control) * is_free)
        for tendon, length in zip(self.drive.tendons, along.lengths[len(forces) :]):
            forces.append(tendon.force(length))
            stiff.append(tendon.stiffness * tendon.pulls(length))
            damped.append(tendon.damping)
        return np.array(forces), np.array(stiff), np.array(damped)

    def forces(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The sum of all forces at rest, (nv,) N m or N, and the size of the largest single one."""
        along = self.along(q)
        by_drive = along.moments * self.pulls(along, u)[0][:, None]
        actuated = by_drive[: len(self.drive.actuators)].sum(axis=0)
        for speed, (low, high) in self.drive.cut.items():
            actuated[speed] = np.clip(actuated[speed], low, high)
        own = [-tmt.gravity_balance(q, self.weight), -tmt.spring_torque(q, self.tree)]
        if self.compensated:
            own.append(tmt.gravity_balance(q, self.compensated))
        parts = [actuated, by_drive[len(self.drive.actuators) :].sum(axis=0), *own]
        return sum(parts), float(max([np.abs(by_drive).max(initial=0.0), *(np.abs(part).max() for part in parts)]))

    def stiffness_and_damping(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """K = -d force/dq and D = -d force/dqd at rest, (nv, nv), and of K what actuators and joints' springs do (nv, nv)."""
        along = self.along(q)
        forces, stiff, damped = self.pulls(along, u)
        count, J = len(self.drive.actuators), along.moments
        each = np.einsum("ki,k,kj->kij", J, stiff, J) - np.einsum("k,kij->kij", forces, along.turns)
        lost = np.einsum("ki,k,kj->kij", J, damped, J)
        acting, damping = each[:count].sum(axis=0), lost[:count].sum(axis=0)
        total = (J[:count] * forces[:count, None]).sum(axis=0)
        for speed, (low, high) in self.drive.cut.items():
            if not low < total[speed] < high:
                acting[speed], damping[speed] = 0.0, 0.0
        damping = damping + lost[count:].sum(axis=0) + np.diag(np.add(self.tree.damping, self.drive.damping or 0.0))
        K = stiffness(self.weight, q)  # with the springs of the joints
        springs = K - stiffness(replace(self.weight, stiffness=()), q) if self.tree.has_springs else 0.0 * K
        if self.compensated:
            K = K - stiffness(self.compensated, q)
        return K + acting + each[count:].sum(axis=0), damping, acting + springs

    def at_rest(self, q: np.ndarray, u: np.ndarray) -> tuple[np.ndarray, float]:
        """The nearest posture at rest, by Newton's method from q, and the size of the force that is left there; 0.0: none."""
        best, left, scale = q, np.inf, 0.0
        for _ in range(REST_STEPS):
            force, largest = self.forces(q, u)
            size, scale = float(np.abs(force).max()), max(scale, largest)
            if size < left:
                best, left = q, size
            if size <= 1e-4 * REST_FORCE * scale:
                break
            K = self.stiffness_and_damping(q, u)[0]
            step = np.linalg.lstsq(K, force, rcond=SINGULAR)[0]
            q = self.coordinates.move(q, step * min(1.0, REST_REACH / max(np.abs(step).max(), 1e-300)))
        return best, 0.0 if left <= REST_FORCE * scale else left
