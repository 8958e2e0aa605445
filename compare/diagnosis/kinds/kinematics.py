"""Slips in positions, angular velocities and tensors, and what becomes of them in M and h.

The position of a body's CoM is a sum of segments: offsets, slides, the CoM in its body. With J, the Jacobian
of that sum, B, that of the angular velocity in body axes, and I the body adds

    M = m J'J + B'IB,   gravity = -m J'g.

A slip changes J, B or I of one body. Into the velocity terms of h it goes in one of three ways:

    Lagrange       Mdot qd - d(qd' M qd / 2)/dq of the wrong M
    Newton, Euler  m J'(Jdot qd) + B'(I Bdot qd + omega x I omega) of the wrong J, B, I
    projection     m J'a + B'(I alpha + omega x I omega) with the right a, alpha and omega

Derivatives are those of imaginary changes of 1e-100, exact to rounding; a slip's effect is the sum over
bodies.
"""

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt.derivation import method

from ..model import TINY, Equations, vectors

SAME = 1e-12  # of the largest: two ways that give the same
ALTERNATES = {  # the angle of a hinge from its zero that is taken instead, and its derivative
    "": (lambda angle: angle, 1.0), "zero": (lambda angle: 0.0 * angle, 0.0),
    "opposite": (lambda angle: -angle, -1.0), "complement": (lambda angle: np.pi / 2.0 - angle, -1.0),
}  # fmt: skip


class Motion(NamedTuple):
    """Axes of all speeds (nv, rows, 3), origins (n, rows, 3) and turns (n, rows, 3, 3) of all joints."""

    axes: ndarray
    origins: ndarray
    turns: ndarray


class Segment(NamedTuple):
    """A part of the position of a CoM: what it is called, its Jacobian (nv, rows, 3), the hinges that turn it."""

    name: str
    jacobian: ndarray
    hinges: list[int]
    of_com: bool = False
    slides: bool = False


class Changed(NamedTuple):
    """A slip in one body: what is added to J and B (nv, rows, 3), and to its tensor (rows, 3, 3)."""

    place: str
    explains: str
    body: int
    J: ndarray | float = 0.0
    B: ndarray | float = 0.0
    inertia: ndarray | float = 0.0
    of_body: bool = True  # whether {} in its place is the body


class Kinematics:
    """J, B and turns of all bodies at the states of equations, and close by along each joint and the motion."""

    def __init__(self, equations: Equations):
        self.equations, self.tree, q = equations, equations.tree, equations.q.astype(complex)
        self.nv, self.states = equations.nv, len(q)
        places = self.tree.coordinates
        rates = np.array(places.component_rates(list(equations.q.T), list(equations.qd.T))).T
        self.has_slopes = not equations.coordinates.has_balls
        along = [q + 1j * TINY * unit for unit in np.eye(self.nv)] if self.has_slopes else []
        self.q = np.concatenate([q, *along, q + 1j * TINY * rates])
        self.motions: dict[tuple[int, str], Motion] = {}
        self.joint_of = [i for i, joint in enumerate(places.joints) for _ in self.tree.axis[joint.qd]]
        bodies = range(len(self.tree.mass))
        self.J = [np.sum([part.jacobian for part in self.segments(b)], axis=0) for b in bodies]
        self.B = [self.angular(b) for b in bodies]

    def motion(self, joint: int = -1, other: str = "") -> Motion:
        """The motion, with another angle of a hinge."""
        if (joint, other) not in self.motions:
            q = self.q.copy()
            if other:
                k, zero = self.tree.coordinates.joints[joint].q.start, self.tree.reference[joint]
                q[:, k] = zero + ALTERNATES[other][0](q[:, k] - zero)
            frames, rows = method.joint_frames(self.tree, list(q.T)), len(q)
            axes = vectors([[axis for frame in frames for axis in frame.axes]], rows)[0]
            origins = vectors([[frame.origin for frame in frames]], rows)[0]
            turns = np.array(
                [[[np.broadcast_to(x, rows) for x in row] for row in f.rotation] for f in frames]
            )
            self.motions[joint, other] = Motion(axes, origins, np.moveaxis(turns, 3, 1))
        return self.motions[joint, other]

    def turning(self, joint: int) -> list[int]:
        """The hinges and balls that turn what a joint carries."""
        return [i for i in self.tree.path(joint)[::-1] if self.tree.kind[i] != "slide"] if joint >= 0 else []

    def hinges(self, joint: int) -> list[int]:
        return [i for i in self.turning(joint) if self.tree.kind[i] == "hinge"]

    def segments(self, b: int, joint: int = -1, other: str = "") -> list[Segment]:
        """The segments of the CoM of a body; with another angle of a hinge."""
        tree, of_body, found = self.tree, self.tree.body_joint[b], list[Segment]()
        motion = self.motion(joint, other)
        for i in tree.path(of_body)[::-1] if of_body >= 0 else ():
            parent, at, name = tree.parent[i], tree.coordinates.joints[i], tree.joint_names[i]
            carrying = self.turning(parent)
            if parent >= 0 and np.any(tree.offset[i]):
                arm = motion.turns[parent] @ np.array(tree.offset[i])
                found.append(Segment(f"offset of {name}", self.swung(arm, carrying, joint, other), carrying))
            if at.kind == "slide":
                length = self.q[:, at.q.start, None] - tree.reference[i]
                jacobian = self.swung(motion.axes[at.qd.start] * length, carrying, joint, other)
                jacobian[at.qd.start] = motion.axes[at.qd.start]
                if found and tree.kind[parent] == "slide" and found[-1].slides:
                    before = found.pop()
                    name, jacobian = f"{before.name}, {name}", before.jacobian + jacobian
                found.append(Segment(name, jacobian, carrying, slides=True))
        arm, carrying = motion.turns[of_body] @ np.array(tree.com[b]), self.turning(of_body)
        jacobian = self.swung(arm, carrying, joint, other)
        return [*found, Segment(f"CoM of {tree.body_names[b]}", jacobian, carrying, True)]

    def swung(self, arm: ndarray, hinges: list[int], joint: int, other: str) -> ndarray:
        """The Jacobian of an arm that hinges turn."""
        jacobian, axes = np.zeros((self.nv, len(self.q), 3), complex), self.motion(joint, other).axes
        for v, i in enumerate(self.joint_of):
            if i in hinges:
                jacobian[v] = np.cross(axes[v], arm) * (ALTERNATES[other][1] if i == joint else 1.0)
        return jacobian

    def angular(self, b: int, joint: int = -1, other: str = "") -> ndarray:
        """B of a body, in its axes; with another angle of a hinge."""
        motion, turning = self.motion(joint, other), self.turning(self.tree.body_joint[b])
        is_turned = np.isin(self.joint_of, turning)[:, None, None]
        return is_turned * self.in_body(b, motion.axes, motion)

    def in_body(self, b: int, vectors: ndarray, motion: Motion | None = None) -> ndarray:
        turn = (motion or self.motion()).turns[self.tree.body_joint[b]]
        return np.einsum("sji,...sj->...si", turn, vectors)

    def effects(self, slips: Iterable[Changed]) -> list[list[ndarray]]:
        """What each slip adds to the values, (states, entries), in each of the ways."""
        slips, tree, n = list(slips), self.tree, self.states
        bodies = [item.body for item in slips]
        mass = np.array(tree.mass)[bodies]
        I = np.array(tree.inertia, complex)[:, None] + np.zeros((len(self.q), 1, 1))
        right = [np.stack([those[b] for b in bodies]) for those in (self.J, self.B, I)]
        wrong = [
            np.stack([now[k] + getattr(item, name) for k, item in enumerate(slips)])
            for name, now in zip(("J", "B", "inertia"), right)
        ]

        def inertia_of(J: ndarray, B: ndarray, I: ndarray) -> ndarray:
            of_mass = np.einsum("k,kvsc,kwsc->ksvw", mass, J, J, optimize=True)
            return of_mass + np.einsum("kvsc,kscd,kwsd->ksvw", B, I, B, optimize=True)

        M = inertia_of(*wrong) - inertia_of(*right)
        found, alone = [self.lagrange(M)] if self.has_slopes else [], self.forces(mass, right, right)
        found += [self.forces(mass, wrong, moving) - alone for moving in (wrong, right)]
        rest = -np.einsum("k,kvsc,c->ksv", mass, (wrong[0] - right[0])[:, :, :n].real, np.array(tree.gravity))
        pack = self.equations.layout.packed
        return [[pack(M[k, :n].real, of_h[k], rest[k]) for of_h in found] for k in range(len(slips))]

    def lagrange(self, M: ndarray) -> ndarray:
        """Mdot qd - d(qd' M qd / 2)/dq of parts of Mbar (slips, rows, nv, nv), at the states."""
        n, nv, qd = self.states, self.nv, self.equations.qd
        slopes = M[:, n : n * (nv + 1)].imag.reshape(len(M), nv, n, nv, nv) / TINY
        moved = np.einsum("kjsab,sj,sb->ksa", slopes, qd, qd)
        return moved - np.einsum("kjsab,sa,sb->ksj", slopes, qd, qd) / 2.0

    def forces(self, mass: ndarray, along: list[ndarray], moving: list[ndarray]) -> ndarray:
        """m J'a + B'(I alpha + omega x I omega), (slips, states, nv), of J, B and I, with the motion of others."""
        n, qd = self.states, self.equations.qd
        J, B, I = along[0][:, :, :n].real, along[1][:, :, :n].real, along[2][:, :n].real
        a, alpha = (np.einsum("kvsc,sv->ksc", part[:, :, -n:].imag / TINY, qd) for part in moving[:2])
        omega = np.einsum("kvsc,sv->ksc", moving[1][:, :, :n].real, qd)
        spun = np.cross(omega, np.einsum("kscd,ksd->ksc", I, omega))
        moment = np.einsum("kscd,ksd->ksc", I, alpha) + spun
        force = np.einsum("k,kvsc,ksc->ksv", mass, J, a, optimize=True)
        return force + np.einsum("kvsc,ksc->ksv", B, moment)
