"""Mbar and h by the recursion of Newton and Euler with one slip: motion outward, forces and moments inward.

A slip is a record in SLIPS: the step that it changes, its place, what is wrong there, where it is made. A step's
wrong values are where `Recursion.step` is called with its name. Mbar are the forces of unit accelerations, h
those without acceleration. Arrays are (rows, 3), in the world's axes.
"""

from collections.abc import Callable, Iterator
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy import ndarray

import tmt
from tmt.derivation.mechanism import origin_in_parent, rotation_in_parent

from ..hypothesis import Hypothesis, slip
from ..model import Equations
from .conventions import matrices
from .numbers import sets_of_bodies, sets_of_joints


class Slip(NamedTuple):
    """One slip."""

    step: str
    place: str
    wrong: str
    at: str = "joint"


Wrong = Callable[[], ndarray]  # the wrong values of a step
AXES = "not turned to the axes of the body before"
SLIPS = (
    Slip("order", "rotation of {}", "before those of the joints that carry it"),
    Slip("transposed", "rotation of {}", "transposed, R' for R"),
    Slip("absolute", "rotation of {}", "not combined with those of the joints that carry it"),
    Slip("axis", "axis of {}", "not turned to the inertial frame"),
    Slip("axis before", "axis of {}", "not turned by the joint before"),
    Slip("com before", "CoM of {}", "not turned by its own joint", "body"),
    Slip("alpha", "convective angular acceleration omega x axis qd of {}", "left out"),
    Slip("minus alpha", "convective angular acceleration omega x axis qd of {}", "of the other sign"),
    Slip("offset", "centripetal acceleration omega x (omega x o) of the offset of {}", "left out"),
    Slip("centripetal", "centripetal acceleration omega x (omega x c) of the CoM of {}", "left out", "body"),
    Slip("own motion", "acceleration of the offset of {}", "with the motion of the body that it carries"),
    Slip("a", "acceleration passed on to {}", "not turned to its axes"),
    Slip("both back", "angular velocity and acceleration passed on to {}", "turned with R for R'"),
    Slip("offset for CoM", "acceleration of the CoM of {}", "with the offset of the next joint for its CoM", "body"),
    Slip("first omega", "omega x I omega of {}", "with the angular velocity of the first body", "body"),
    Slip("alpha for omega", "omega x I omega of {}", "omega x I alpha", "body"),
    Slip("CoM", "moment c x F of the force at the CoM of {}", "left out", "body"),
    Slip("minus CoM", "moment c x F of the force at the CoM of {}", "of the other sign", "body"),
    Slip("lever", "moment c x F of the force at the CoM of {}", "o x F, with the offset of its joint for its CoM", "body"),
    Slip("moment", "moment of the force passed on by {}", "left out"),
    Slip("minus moment", "moment of the force passed on by {}", "of the other sign"),
    Slip("n", "moment passed on by {}", "left out"),
    Slip("force turned back", "force passed on by {}", "turned with R' for R"),
    Slip("force", "force passed on by {}", AXES),
    Slip("next axis", "axis of {} in its torque", "that of the next joint"),
)  # fmt: skip


class Frame(NamedTuple):
    """A joint's frame and its motion."""

    turn: ndarray  # (rows, 3, 3)
    own: ndarray  # its turn in its parent's frame, (rows, 3, 3)
    arm: ndarray  # from the joint before, (rows, 3)
    axes: list[ndarray]
    omega: ndarray
    alpha: ndarray
    a: ndarray  # of the origin
    slides: bool = False


def rotated(R: ndarray, r: ndarray) -> ndarray:
    return np.einsum("sij,sj->si", R, r)


def backward(R: ndarray) -> ndarray:
    return np.swapaxes(R, 1, 2)


def centripetal(omega: ndarray, r: ndarray) -> ndarray:
    return np.cross(omega, np.cross(omega, r))


class Recursion:
    """Forces with a slip at some joints or bodies. at: (joints or bodies, rows), where it is made.

    q (rows, nq), qd, qdd (rows, nv), gravity (rows, 3).
    """

    def __init__(
        self, tree: tmt.Tree, q: ndarray, qd: ndarray, qdd: ndarray, gravity: ndarray, slip: str = "",
        at: ndarray | None = None,
    ):  # fmt: skip
        self.tree, self.q, self.qd, self.qdd = tree, q, qd, qdd
        self.slip, self.at, self.rows = slip, at, len(q)
        self.joints, zero = tree.coordinates.joints, np.zeros((len(q), 3))
        self.identity = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        self.world = Frame(self.identity, self.identity, zero, [], zero, zero, -gravity)
        self.frames: list[Frame] = []
        self.frames += map(self.frame, range(len(tree.parent)))

    def step(self, name: str, index: int, right: ndarray, wrong: Wrong | None = None) -> ndarray:
        """A step's values: wrong ones, by default zero, in the rows with this slip at a joint or body."""
        if name != self.slip or self.at is None or not self.at[index].any():
            return right
        where = self.at[index].reshape(-1, *[1] * (right.ndim - 1))
        return np.where(where, wrong() if wrong else 0.0, right)

    def before(self, i: int) -> Frame:
        return self.frames[self.tree.parent[i]] if self.tree.parent[i] >= 0 else self.world

    def frame(self, i: int) -> Frame:
        """The frame of a joint, outward."""
        step, joint, parent, columns = self.step, self.joints[i], self.before(i), list(self.q.T)
        offset = [np.broadcast_to(x, self.rows) for x in origin_in_parent(self.tree, i, columns)]
        arm = rotated(parent.turn, np.stack(offset, axis=-1))
        local = [np.broadcast_to(axis, arm.shape) for axis in np.array(self.tree.axis[joint.qd])]
        rates, forced = self.qd[:, joint.qd], self.qdd[:, joint.qd]
        if joint.kind == "slide":
            axis = step("axis", i, rotated(parent.turn, local[0]), lambda: local[0])
            a = parent.a + self.carried(i, arm, parent.omega, parent.alpha) + axis * forced
            a = a + 2.0 * np.cross(parent.omega, axis * rates)
            return parent._replace(own=self.identity, arm=arm, axes=[axis], a=a, slides=True)
        own = matrices(rotation_in_parent(self.tree, i, columns), self.rows)
        turn = parent.turn @ step("transposed", i, own, lambda: backward(own))
        turn = step("order", i, turn, lambda: own @ parent.turn)
        turn = step("absolute", i, turn, lambda: own)
        carrier = turn if joint.kind == "ball" else parent.turn
        axes = [step("axis", i, rotated(carrier, axis), axis.copy) for axis in local]
        skipped = parent.turn @ backward(parent.own)  # of the joint before that
        axes = [
            step("axis before", i, right, partial(rotated, skipped, axis)) for right, axis in zip(axes, local)
        ]
        spin = np.einsum("ksc,sk->sc", axes, rates)
        back = turn @ own @ backward(parent.turn)
        omega = step("both back", i, parent.omega, lambda: rotated(back, parent.omega))
        turning = step("both back", i, parent.alpha, lambda: rotated(back, parent.alpha))
        convective = step("alpha", i, np.cross(omega, spin))
        convective = step("minus alpha", i, convective, lambda: -convective)
        alpha = turning + convective + np.einsum("ksc,sk->sc", axes, forced)
        moved = self.carried(i, arm, parent.omega, parent.alpha)
        moved = step("own motion", i, moved, lambda: self.carried(i, arm, parent.omega + spin, alpha))
        a = moved + step("a", i, parent.a, lambda: rotated(turn @ backward(parent.turn), parent.a))
        return Frame(turn, own, arm, axes, omega + spin, alpha, a)

    def carried(self, i: int, arm: ndarray, omega: ndarray, alpha: ndarray) -> ndarray:
        """The acceleration of the end of an arm from that of its beginning."""
        return np.cross(alpha, arm) + self.step("offset", i, centripetal(omega, arm))

    def wrench(self, b: int) -> tuple[ndarray, ndarray]:
        """The force of a body, and its moment about the origin of its joint."""
        step, tree, joint = self.step, self.tree, self.tree.body_joint[b]
        frame, first, mass, I = self.frames[joint], self.frames[0], tree.mass[b], np.array(tree.inertia[b])
        com = np.broadcast_to(np.array(tree.com[b]), (self.rows, 3))
        c = rotated(frame.turn, com)
        c = step("com before", b, c, lambda: rotated(frame.turn @ backward(frame.own), com))
        I, omega, alpha = frame.turn @ I @ backward(frame.turn), frame.omega, frame.alpha
        following = [k for k, parent in enumerate(tree.parent) if parent == joint]
        arm = step("offset for CoM", b, c, lambda: self.frames[following[0]].arm if following else c)
        swung = step("centripetal", b, centripetal(omega, arm))
        F = mass * (frame.a + np.cross(alpha, arm) + swung)
        spun = rotated(I, omega)
        gyroscopic = np.cross(omega, spun)
        of_first = rotated(frame.turn @ backward(first.turn), first.omega)
        gyroscopic = step("first omega", b, gyroscopic, lambda: np.cross(omega, rotated(I, of_first)))
        gyroscopic = step("alpha for omega", b, gyroscopic, lambda: np.cross(omega, rotated(I, alpha)))
        own_axes = frame.turn @ backward(self.before(joint).turn)
        lever = step("lever", b, c, lambda: rotated(own_axes, frame.arm))
        moment = step("CoM", b, np.cross(lever, F))
        moment = step("minus CoM", b, moment, lambda: -moment)
        return F, rotated(I, alpha) + gyroscopic + moment

    def forces(self) -> ndarray:
        """Of the joints, (rows, nv), inward."""
        step, tree, tau = self.step, self.tree, np.zeros(self.qd.shape)
        F, N = np.zeros((2, len(tree.parent), self.rows, 3))
        for b, joint in enumerate(tree.body_joint):
            if joint >= 0:
                force, moment = self.wrench(b)
                F[joint] += force
                N[joint] += moment
        for i in range(len(tree.parent))[::-1]:
            frame, parent, joint = self.frames[i], self.before(i), tree.parent[i]
            acting = F[i] if frame.slides else N[i]
            following = next((k for k, before in enumerate(tree.parent) if before == i), i)
            for n, axis in enumerate(frame.axes, self.joints[i].qd.start):
                along = step("next axis", i, axis, self.frames[following].axes[0].copy)
                tau[:, n] = np.einsum("sc,sc->s", along, acting)
            if joint < 0:
                continue
            to_parent = parent.turn @ backward(frame.turn)
            force = step("force", i, F[i], partial(rotated, to_parent, F[i]))
            turned = parent.turn @ backward(frame.own) @ backward(frame.turn)
            force = step("force turned back", i, force, partial(rotated, turned, F[i]))
            lever = step("moment", i, np.cross(frame.arm, force))
            F[joint] += force
            N[joint] += step("n", i, N[i]) + step("minus moment", i, lever, partial(np.negative, lever))
        return tau + np.array(tree.armature or [0.0] * len(tree.axis)) * self.qdd


def slips_of_recursion(equations: Equations) -> Iterator[Hypothesis]:
    """The values with each slip at each joint or body, and at all of them."""
    tree = equations.tree
    places = {"joint": sets_of_joints(tree), "body": sets_of_bodies(tree)}
    for record in SLIPS:
        those = places[record.at]
        at = np.zeros((1 + max(max(numbers) for _, numbers in those), len(those)), bool)
        for k, (_, numbers) in enumerate(those):
            at[numbers, k] = True
        values = evaluated(equations, record.step, at)
        for (name, numbers), of_place in zip(those, values):
            yield slip(equations.right, record.place, record.wrong, of_place, owner=name, owners=len(numbers))


def evaluated(equations: Equations, slip: str, at: ndarray) -> ndarray:
    """The values with a slip at the joints or bodies of each column of `at`, (columns, states, entries)."""
    (states, nv), columns = equations.qd.shape, at.shape[1]
    zero, unit = np.zeros((states, nv)), np.broadcast_to(np.eye(nv)[:, None], (nv, states, nv))
    qd = np.concatenate([[equations.qd, zero], np.zeros_like(unit)])  # (2 + nv, states, nv)
    qdd, g = np.concatenate([[zero, zero], unit]), np.zeros((2 + nv, states, 3))
    g[1] = equations.tree.gravity
    rows = np.tile(at[:, :, None], (1, 1, (2 + nv) * states)).reshape(len(at), -1)
    q = np.tile(equations.q, (columns * (2 + nv), 1))
    qd, qdd, g = (np.tile(part.reshape(-1, part.shape[2]), (columns, 1)) for part in (qd, qdd, g))
    forces = Recursion(equations.tree, q, qd, qdd, g, slip, rows).forces()
    forces = forces.reshape(columns, 2 + nv, states, nv)
    M = np.moveaxis(forces[:, 2:], 1, 3)  # (columns, states, row, unit)
    return equations.layout.packed(M, forces[:, 0], forces[:, 1])
