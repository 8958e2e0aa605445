"""Mbar and h by the recursion of Newton and Euler with one slip: motion outward, forces and moments inward.

A slip is a record in SLIPS: the step that it changes, its place, what is wrong there, where it is made. A
step's wrong values are where `Recursion.step` or `signed` is called with its name. Mbar are the forces of
unit accelerations, h those without acceleration. Arrays are (rows, 3), in the world's axes.
"""

from collections.abc import Iterator
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
    """A joint's frame and its motion, (rows, ...)."""

    R: ndarray
    own: ndarray  # its rotation in its parent's frame
    arm: ndarray  # from the joint before
    axes: ndarray  # (rows, speeds, 3)
    omega: ndarray
    alpha: ndarray
    a: ndarray  # of the origin


def rotated(R: ndarray, r: ndarray) -> ndarray:
    return np.einsum("sij,s...j->s...i", R, r)


def backward(R: ndarray) -> ndarray:
    return np.swapaxes(R, 1, 2)


def centripetal(omega: ndarray, r: ndarray) -> ndarray:
    return np.cross(omega, np.cross(omega, r))


class Recursion:
    """Forces with a slip at some joints or bodies. at: (joints or bodies, rows), where it is made.

    q (rows, nq), qd, qdd (rows, nv), gravity (rows, 3).
    """

    def __init__(
        self, tree: tmt.Tree, slip: str, at: ndarray, q: ndarray, qd: ndarray, qdd: ndarray, gravity: ndarray
    ):
        self.tree, self.q, self.qd, self.qdd, self.slip, self.at = tree, q, qd, qdd, slip, at
        zero, identity = np.zeros((len(q), 3)), np.broadcast_to(np.eye(3), (len(q), 3, 3))
        self.world = Frame(identity, identity, zero, zero[:, None], zero, zero, -gravity)
        self.following = {parent: k for k, parent in reversed(list(enumerate(tree.parent)))}  # the first
        self.frames: list[Frame] = []
        self.frames += map(self.frame, range(len(tree.parent)))

    def step(self, name: str, index: int, right: ndarray, wrong: ndarray | float = 0.0) -> ndarray:
        """A step's values: wrong ones, by default zero, in the rows with this slip at a joint or body."""
        if name != self.slip:
            return right
        return np.where(self.at[index].reshape(-1, *[1] * (right.ndim - 1)), wrong, right)

    def signed(self, name: str, index: int, right: ndarray) -> ndarray:
        """A step's values, which may be left out or have the other sign."""
        return self.step(f"minus {name}", index, self.step(name, index, right), -right)

    def before(self, i: int) -> Frame:
        return self.frames[self.tree.parent[i]] if self.tree.parent[i] >= 0 else self.world

    def frame(self, i: int) -> Frame:
        """The frame of a joint, outward."""
        step, tree, parent, columns, rows = self.step, self.tree, self.before(i), list(self.q.T), len(self.q)
        joint, offset = tree.coordinates.joints[i], origin_in_parent(tree, i, columns)
        arm = rotated(parent.R, np.stack([np.broadcast_to(x, rows) for x in offset], axis=-1))
        slides, own = joint.kind == "slide", self.world.own
        if not slides:
            own = matrices(rotation_in_parent(tree, i, columns), rows)
        R = parent.R @ step("transposed", i, own, backward(own))
        R = step("order", i, R, own @ parent.R)
        R = R if slides else step("absolute", i, R, own)
        local = np.tile(tree.axis[joint.qd], (rows, 1, 1))
        axes = step("axis", i, rotated(R if joint.kind == "ball" else parent.R, local), local)
        if not slides:
            axes = step("axis before", i, axes, rotated(parent.R @ backward(parent.own), local))
        rates, forced = (np.einsum("skc,sk->sc", axes, x[:, joint.qd]) for x in (self.qd, self.qdd))
        a = step("a", i, parent.a, rotated(R @ backward(parent.R), parent.a))
        moved = self.carried(i, arm, parent.omega, parent.alpha)
        if slides:
            a = a + moved + forced + 2.0 * np.cross(parent.omega, rates)
            return parent._replace(own=own, arm=arm, axes=axes, a=a)
        back = R @ own @ backward(parent.R)
        omega = step("both back", i, parent.omega, rotated(back, parent.omega))
        alpha = step("both back", i, parent.alpha, rotated(back, parent.alpha))
        alpha = alpha + self.signed("alpha", i, np.cross(omega, rates)) + forced
        moved = step("own motion", i, moved, self.carried(i, arm, parent.omega + rates, alpha))
        return Frame(R, own, arm, axes, omega + rates, alpha, a + moved)

    def carried(self, i: int, arm: ndarray, omega: ndarray, alpha: ndarray) -> ndarray:
        """The acceleration of the end of an arm from that of its beginning."""
        return np.cross(alpha, arm) + self.step("offset", i, centripetal(omega, arm))

    def wrench(self, b: int) -> tuple[ndarray, ndarray]:
        """The force of a body, and its moment about the origin of its joint."""
        step, tree, joint = self.step, self.tree, self.tree.body_joint[b]
        frame, first, com = self.frames[joint], self.frames[0], np.tile(tree.com[b], (len(self.q), 1))
        R, omega, alpha = frame.R, frame.omega, frame.alpha
        c = step("com before", b, rotated(R, com), rotated(R @ backward(frame.own), com))
        arm = c
        if joint in self.following:
            arm = step("offset for CoM", b, c, self.frames[self.following[joint]].arm)
        swung = step("centripetal", b, centripetal(omega, arm))
        F = tree.mass[b] * (frame.a + np.cross(alpha, arm) + swung)
        I, of_first = R @ np.array(tree.inertia[b]) @ backward(R), rotated(backward(first.R), first.omega)
        gyroscopic = np.cross(omega, rotated(I, omega))
        gyroscopic = step("first omega", b, gyroscopic, np.cross(omega, rotated(I @ R, of_first)))
        gyroscopic = step("alpha for omega", b, gyroscopic, np.cross(omega, rotated(I, alpha)))
        lever = step("lever", b, c, rotated(R @ backward(self.before(joint).R), frame.arm))
        return F, rotated(I, alpha) + gyroscopic + self.signed("CoM", b, np.cross(lever, F))

    def forces(self) -> ndarray:
        """Of the joints, (rows, nv), inward."""
        step, tree, tau = self.step, self.tree, np.array(self.tree.armature or 0.0) * self.qdd
        F, N = np.zeros((2, len(tree.parent), len(self.q), 3))
        for b, joint in enumerate(tree.body_joint):
            if joint >= 0:
                force, moment = self.wrench(b)
                F[joint] += force
                N[joint] += moment
        for i, joint in reversed(list(enumerate(tree.parent))):
            frame, parent, acting = self.frames[i], self.before(i), F[i] if tree.kind[i] == "slide" else N[i]
            axes = step("next axis", i, frame.axes, self.frames[self.following.get(i, i)].axes[:, :1])
            tau[:, tree.coordinates.joints[i].qd] += np.einsum("skc,sc->sk", axes, acting)
            if joint >= 0:
                force = step("force", i, F[i], rotated(parent.R @ backward(frame.R), F[i]))
                back = parent.R @ backward(frame.R @ frame.own)
                force = step("force turned back", i, force, rotated(back, F[i]))
                F[joint] += force
                N[joint] += step("n", i, N[i]) + self.signed("moment", i, np.cross(frame.arm, force))
        return tau


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
    (states, nv), blocks = (
        equations.qd.shape,
        2 + equations.nv,
    )  # velocity terms, h at rest, unit accelerations
    qd, qdd, g = (np.zeros((blocks, states, n)) for n in (nv, nv, 3))
    qd[0], g[1], qdd[2:] = equations.qd, equations.tree.gravity, np.eye(nv)[:, None]
    each = np.tile(equations.q, (blocks, 1)), *(part.reshape(blocks * states, -1) for part in (qd, qdd, g))
    rows = (np.tile(part, (at.shape[1], 1)) for part in each)
    forces = Recursion(equations.tree, slip, np.repeat(at, blocks * states, axis=1), *rows).forces()
    forces = forces.reshape(at.shape[1], blocks, states, nv)
    return equations.layout.packed(np.moveaxis(forces[:, 2:], 1, 3), forces[:, 0], forces[:, 1])
