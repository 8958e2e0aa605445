"""Mbar and h by the recursion of Newton and Euler with one slip: outward velocities and accelerations, inward forces.

It is the method of tmt.derivation over arrays (rows, 3), so that one step can be another at some joints or bodies.
Each slip is one record in SLIPS: its name, the step that it changes, and what stands there instead.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy import ndarray

import tmt
from tmt.derivation.mechanism import origin_in_parent, turn_in_parent

from .conventions import matrices
from .model import Equations
from .places import groups
from .variants import Variant, slip


class Frame(NamedTuple):
    """A joint's frame and its motion at qdd = 0, in the world's axes, (rows, 3) and (rows, 3, 3)."""

    turn: ndarray
    origin: ndarray
    axes: list[ndarray]
    omega: ndarray
    alpha: ndarray
    a: ndarray  # of the origin
    own: ndarray  # its turn in its parent's frame
    slides: bool = False
    passed: ndarray | None = None  # omega as its children take it, if that is another


def rotated(R: ndarray, r: ndarray) -> ndarray:
    return np.einsum("sij,sj->si", R, r)


def backward(R: ndarray) -> ndarray:
    return np.swapaxes(R, 1, 2)


def dot(a: ndarray, b: ndarray) -> ndarray:
    return np.einsum("si,si->s", a, b)


class Recursion:
    """Mbar and h with a slip at some joints or bodies. at: (joints or bodies, rows), where it is made."""

    def __init__(self, tree: tmt.Tree, q: ndarray, qd: ndarray, slip: str = "", at: ndarray | None = None):
        self.tree, self.q, self.qd, self.slip, self.at, self.rows = tree, q, qd, slip, at, len(q)
        zero, identity = np.zeros((self.rows, 3)), np.broadcast_to(np.eye(3), (self.rows, 3, 3))
        self.world = Frame(identity, zero, [], zero, zero, zero, identity)
        self.frames: list[Frame] = []
        for i in range(len(tree.parent)):
            self.frames.append(self.frame(i))

    def step(self, name: str, index: int, right: ndarray, wrong: Callable[[], ndarray]) -> ndarray:
        """A step's values: the wrong ones in the rows in which this slip is made at a joint or body."""
        if name != self.slip or self.at is None or not self.at[index].any():
            return right
        where = self.at[index].reshape(-1, *[1] * (right.ndim - 1))
        return np.where(where, wrong(), right)

    def before(self, i: int) -> Frame:
        return self.frames[self.tree.parent[i]] if self.tree.parent[i] >= 0 else self.world

    def frame(self, i: int) -> Frame:
        tree, joint, parent, columns = (
            self.tree,
            self.tree.coordinates.joints[i],
            self.before(i),
            list(self.q.T),
        )
        offset = np.stack(
            [np.broadcast_to(x, self.rows) for x in origin_in_parent(tree, i, columns)], axis=-1
        )
        r = rotated(parent.turn, offset)
        local = [np.broadcast_to(axis, (self.rows, 3)) for axis in np.array(tree.axis[joint.qd])]
        omega = parent.omega
        a = parent.a + np.cross(parent.alpha, r) + np.cross(omega, np.cross(omega, r))
        a = self.step("base", i, a, lambda: a - parent.a)
        passed = parent.omega if parent.passed is None else parent.passed
        if joint.kind == "slide":
            axis = self.step("axis", i, rotated(parent.turn, local[0]), lambda: local[0])
            coriolis = 2.0 * np.cross(omega, axis * self.qd[:, joint.qd])
            a = a + self.step("coriolis", i, coriolis, lambda: 0.0 * coriolis)
            return parent._replace(
                origin=parent.origin + r, axes=[axis], a=a, slides=True, own=self.world.own
            )
        own = matrices(turn_in_parent(tree, i, columns), self.rows)
        turned = self.step("transposed", i, own, lambda: backward(own))
        turn = self.step("order", i, parent.turn @ turned, lambda: own @ parent.turn)
        turn = self.step("absolute", i, turn, lambda: own)
        carrier = turn if joint.kind == "ball" else parent.turn
        axes = [self.step("axis", i, rotated(carrier, axis), partial(np.copy, axis)) for axis in local]
        spin = np.sum(
            [axis * self.qd[:, k : k + 1] for axis, k in zip(axes, range(joint.qd.start, joint.qd.stop))],
            axis=0,
        )
        carried = self.step("carried", i, passed, lambda: rotated(turn @ own @ backward(parent.turn), passed))
        crossed = np.cross(carried, spin)
        alpha = parent.alpha + self.step("alpha", i, crossed, lambda: 0.0 * crossed)
        total = carried + spin
        used = self.step("relative", i, total, lambda: spin)
        return Frame(turn, parent.origin + r, axes, used, alpha, a, own, False, total)

    def lever(self, i: int, x: ndarray) -> ndarray:
        """From the origin of joint i to a point."""
        return self.step("lever", i, x - self.frames[i].origin, lambda: x)

    def segment(self, b: int, right: ndarray, relative: Callable[[], ndarray]) -> ndarray:
        """What the segment from the joint of a body to its CoM adds to a velocity or acceleration, as differentiated.

        relative: as if the joint's own turn were all.
        """
        name, _, components = self.slip.partition(" of components ")
        where = ["xyz".index(k) for k in components]
        if not where:
            return right
        wrong = right.copy()
        if name == "sines":
            wrong[:, where] = right[:, where[::-1]]
        else:
            wrong[:, where] = -right[:, where] if name == "signs" else relative()[:, where]
        return self.step(self.slip, b, right, lambda: wrong)

    def values(self) -> tuple[ndarray, ndarray, ndarray]:
        """Mbar (rows, nv, nv), velocity terms of h and h at rest (rows, nv)."""
        tree, nv = self.tree, len(self.tree.axis)
        M, velocity_terms, rest = (
            np.zeros((self.rows, nv, nv)),
            np.zeros((self.rows, nv)),
            np.zeros((self.rows, nv)),
        )
        M += np.diag(tree.armature) if len(tree.armature) else 0.0
        of_speed = [
            (i, k)
            for i, joint in enumerate(tree.coordinates.joints)
            for k in range(joint.qd.stop - joint.qd.start)
        ]
        for b, at in enumerate(tree.body_joint):
            if at < 0:
                continue
            frame = self.frames[at]
            r = rotated(frame.turn, np.broadcast_to(tree.com[b], (self.rows, 3)))
            x, omega = frame.origin + r, frame.omega
            turning = np.cross(omega, np.cross(omega, r))
            alone = rotated(
                frame.own, np.broadcast_to(tree.com[b], (self.rows, 3))
            )  # as if nothing turned its joint
            axis_alone, joint = (
                np.array(tree.axis[tree.coordinates.joints[at].qd])[0],
                tree.coordinates.joints[at],
            )
            spin = axis_alone * self.qd[:, joint.qd][:, :1]
            turning = np.cross(frame.alpha, r) + self.step("centripetal", b, turning, lambda: 0.0 * turning)
            turning = self.segment(b, turning, lambda: np.cross(spin, np.cross(spin, alone)))
            a = self.step("base of body", b, frame.a + turning, lambda: turning)
            I = frame.turn @ np.array(tree.inertia[b]) @ backward(frame.turn)
            moment = rotated(I, frame.alpha) + np.cross(omega, rotated(I, omega))
            moves = [n for n, (i, _) in enumerate(of_speed) if tree.moves(b)[i]]
            T, B, levers = {}, {}, {}
            for n in moves:
                i, k = of_speed[n]
                axis, is_alone = self.frames[i].axes[k], i == at
                if self.frames[i].slides:
                    T[n], B[n], levers[n] = axis, 0.0 * axis, axis
                    continue
                by_itself = np.cross(axis_alone, alone) if is_alone else 0.0 * axis
                arm = self.segment(b, np.cross(axis, r), partial(np.copy, by_itself))
                T[n] = np.cross(axis, self.lever(i, frame.origin)) + arm
                B[n] = self.step("relative B", b, axis, partial(np.multiply, axis, float(is_alone)))
                levers[n] = self.projected(i, b, axis, x, T[n])
            force = -np.array(tree.gravity) * tree.mass[b]
            for n in moves:
                velocity_terms[:, n] += dot(levers[n], tree.mass[b] * a) + dot(B[n], moment)
                rest[:, n] += levers[n] @ force
                turned = rotated(backward(I), B[n])
                for m in moves:
                    M[:, n, m] += tree.mass[b] * dot(levers[n], T[m]) + dot(turned, B[m])
        return M, velocity_terms, rest

    def projected(self, i: int, b: int, axis: ndarray, x: ndarray, right: ndarray) -> ndarray:
        """The column by which a force on body b acts on joint i: as T, or with a slip of the inward recursion."""
        at = self.tree.body_joint[b]
        if self.slip == "moment of force":
            return self.step(
                "moment of force",
                b,
                right,
                lambda: np.cross(axis, self.frames[at].origin - self.frames[i].origin),
            )
        if self.slip in ("offset inward", "CoM for offset inward"):
            lever, joint = x - self.frames[i].origin, at
            while joint != i and joint >= 0:
                lever = lever + self.step(self.slip, joint, 0.0 * lever, partial(self.other_offset, joint))
                joint = self.tree.parent[joint]
            return np.cross(axis, lever)
        if self.slip == "force turned":
            return self.turned_force(i, b, axis, x)
        return right

    def other_offset(self, joint: int) -> ndarray:
        """What the lever of a joint is longer by, if it is left out or the CoM of the body before it."""
        parent, before = self.before(joint), self.tree.parent[joint]
        offset = self.frames[joint].origin - parent.origin
        if self.slip == "offset inward":
            return -offset
        body = next((b for b, at in enumerate(self.tree.body_joint) if at == before), None)
        com = (
            np.zeros((self.rows, 3)) if body is None else np.broadcast_to(self.tree.com[body], (self.rows, 3))
        )
        return rotated(parent.turn, com) - offset

    def turned_force(self, i: int, b: int, axis: ndarray, x: ndarray) -> ndarray:
        """The column of a force that is turned back where it is passed from joint to joint, its moment rightly."""
        joint, maps = self.tree.body_joint[b], np.broadcast_to(np.eye(3), (self.rows, 3, 3))
        lever = x - self.frames[joint].origin
        moment = np.cross(axis, lever)  # axis . (lever x F) = (axis x lever) . F
        while joint != i:
            parent, frame = self.before(joint), self.frames[joint]
            passed = parent.turn @ backward(frame.own) @ backward(frame.turn)
            identity = np.broadcast_to(np.eye(3), passed.shape)
            maps = self.step("force turned", joint, identity, lambda: passed) @ maps
            offset = frame.origin - parent.origin
            moment = moment + np.einsum("sij,si->sj", maps, np.cross(axis, offset))
            joint = self.tree.parent[joint]
        return moment


class Slip(NamedTuple):
    """One slip: the step that it changes, its name, and whether it is made at joints or bodies."""

    step: str
    name: str
    at: str = "joint"


SLIPS = (
    Slip("order", "order of rotations at {}: its turn before those of the joints that carry it"),
    Slip("transposed", "rotation of {} transposed, R' for R"),
    Slip("absolute", "rotation of {} not combined with those of the joints that carry it"),
    Slip("axis", "axis of {} not turned to the inertial frame"),
    Slip("lever", "lever of {} measured from the origin of the world, not from the joint"),
    Slip("carried", "angular velocity passed on to {} with R for R'"),
    Slip("relative", "angular velocity of {} relative to the body before, not to the world"),
    Slip("alpha", "convective angular acceleration omega x axis qd of {} left out"),
    Slip("coriolis", "Coriolis acceleration 2 omega x axis qd of {} left out"),
    Slip("base", "acceleration of the joint before {} left out"),
    Slip("base of body", "acceleration of the joint left out in that of the CoM of {}", "body"),
    Slip("centripetal", "centripetal acceleration omega x (omega x c) of the CoM of {} left out", "body"),
    Slip("relative B", "angular velocity of {} relative to the body before, not to the world, in its rotation", "body"),
    Slip("moment of force", "moment c x F of the force at the CoM of {} left out", "body"),
    Slip("offset inward", "moment of the force passed on by {} left out"),
    Slip("CoM for offset inward", "lever of the force passed on by {}: the CoM of the body before instead of the offset"),
    Slip("force turned", "force passed on by {} turned with R' for R"),
    *(Slip(f"sines of components {pair}", f"sine and cosine exchanged in the position of the CoM of {{}} ({pair[0]} and {pair[1]})",
           "body") for pair in ("xy", "xz", "yz")),
    *(Slip(f"angle of components {k}", f"angle from the joint before for that from the world in {k} of the CoM of {{}}", "body")
      for k in "xyz"),
    *(Slip(f"signs of components {k}", f"sign of {k} of the CoM of {{}} from its joint", "body") for k in "xyz"),
)  # fmt: skip


def slips_of_recursion(equations: Equations) -> Iterator[Variant]:
    """The values with each slip at each joint or body, and at all of them."""
    tree, q, qd = equations.tree, equations.q, equations.qd
    joints = {name: [i] for i, name in enumerate(tree.joint_names)}
    joints |= {"every joint": list(range(len(joints)))} if len(joints) > 1 else {}
    for record in SLIPS:
        places = groups(tree) if record.at == "body" else joints
        count, total = len(q), len(tree.mass) if record.at == "body" else len(tree.parent)
        at = np.zeros((total, len(places) * count), bool)
        for k, those in enumerate(places.values()):
            at[those, k * count : (k + 1) * count] = True
        rows = np.tile(q, (len(places), 1)), np.tile(qd, (len(places), 1))
        values = equations.layout.packed(*Recursion(tree, *rows, record.step, at).values())
        for k, place in enumerate(places):
            yield slip(record.name.format(place), "", "", values[k * count : (k + 1) * count])
