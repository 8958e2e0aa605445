"""Mbar and h by the recursion of Newton and Euler with one slip: motion outward, forces inward.

A slip is a record in SLIPS: the step that it changes, its name, where it is made. A step's wrong values are
where `Recursion.step` is called with its name. Arrays are (rows, 3), in the world's axes.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np
from numpy import ndarray

import tmt
from tmt.derivation.mechanism import origin_in_parent, turn_in_parent

from ..robots.coordinates import point_inertia
from .conventions import matrices
from .model import MOST_SPEEDS, Equations
from .places import sets_of_bodies, sets_of_joints
from .variants import Variant, slip


class Slip(NamedTuple):
    """One slip."""

    step: str
    name: str
    at: str = "joint"


Wrong = Callable[[], ndarray]  # the wrong values of a step
AXES = "to the axes of the body before"
SLIPS = (
    Slip("order", "order of rotations at {}: its turn before those of the joints that carry it"),
    Slip("transposed", "rotation of {} transposed, R' for R"),
    Slip("absolute", "rotation of {} not combined with those of the joints that carry it"),
    Slip("axis", "axis of {} not turned to the inertial frame"),
    Slip("axis in B", "axis of {} not turned to the inertial frame in the angular velocities"),
    Slip("lever", "lever of {} measured from the origin of the world, not from the joint"),
    Slip("lever from the first", "lever of {} measured from the first joint"),
    Slip("lever from the joint before", "lever of {} measured from the joint before"),
    Slip("column", "column of T of {} left out", "joint and body"),
    Slip("carried back", "angular velocity passed on to {} with R for R'"),
    Slip("carried as it is", "angular velocity passed on to {} not turned to its axes"),
    Slip("relative", "angular velocity of {} relative to the body before, not to the world"),
    Slip("alpha", "convective angular acceleration omega x axis qd of {} left out"),
    Slip("coriolis", "Coriolis acceleration 2 omega x axis qd of {} left out"),
    Slip("base", "acceleration of the joint before {} left out"),
    Slip("base of body", "acceleration of the joint left out in that of the CoM of {}", "body"),
    Slip("centripetal of offset",
         "centripetal acceleration omega x (omega x o) of the offset of {} left out"),
    Slip("centripetal", "centripetal acceleration omega x (omega x c) of the CoM of {} left out", "body"),
    Slip("offset outward", "acceleration alpha x o of the offset of {} left out"),
    Slip("CoM outward", "acceleration alpha x c of the CoM of {} left out", "body"),
    Slip("not turned", "inertia of {} not turned to the inertial frame", "body"),
    Slip("turned back", "R' I R for R I R' of {}", "body"),
    Slip("turned back", "R for R' in the angular velocity of {}", "body"),
    Slip("world axes", "inertia of {} in world axes, R I R', for one in its own axes", "body"),
    Slip("about the joint", "inertia of {} about its joint and mass counted again", "body"),
    Slip("parallel axis", "parallel-axis term m (c'c 1 - c c') of {} left out", "body"),
    Slip("relative B",
         "angular velocity of {} relative to the body before, not to the world, in its rotation", "body"),
    Slip("column of B", "speed of {} left out of the angular velocity", "joint and body"),
    Slip("CoM inward", "moment c x F of the force at the CoM of {} left out", "body"),
    Slip("sign inward", "moment c x F of the force at the CoM of {} with the other sign", "body"),
    Slip("offset inward", "moment of the force passed on by {} left out"),
    Slip("CoM for offset inward",
         "lever of the force passed on by {}: the CoM of the body before instead of the offset"),
    Slip("force turned back", "force passed on by {} turned with R' for R"),
    Slip("force not turned", f"force passed on by {{}} not turned {AXES}"),
    Slip("moment turned back", "moment passed on by {} turned with R' for R"),
    Slip("moment not turned", f"moment passed on by {{}} not turned {AXES}"),
    *(Slip(f"sines of components {two}",
           f"sine and cosine exchanged in the position of the CoM of {{}} ({two})", "body")
      for two in ("xy", "xz", "yz")),
    *(Slip(f"angle of components {k}",
           f"angle from the joint before for that from the world in {k} of the CoM of {{}}", "body")
      for k in "xyz"),
    *(Slip(f"signs of components {k}", f"sign of {k} of the CoM of {{}} from its joint", "body")
      for k in "xyz"),
)  # fmt: skip


class Frame(NamedTuple):
    """A joint's frame and its motion at qdd = 0."""

    turn: ndarray  # (rows, 3, 3)
    origin: ndarray
    axes: list[ndarray]
    omega: ndarray
    alpha: ndarray
    a: ndarray  # of the origin
    own: ndarray  # its turn in its parent's frame, (rows, 3, 3)
    passed: ndarray  # omega as its children take it
    slides: bool = False


def rotated(R: ndarray, r: ndarray) -> ndarray:
    return np.einsum("sij,sj->si", R, r)


def backward(R: ndarray) -> ndarray:
    return np.swapaxes(R, 1, 2)


def crossing(r: ndarray) -> ndarray:
    """The matrices (rows, 3, 3) of r x ..."""
    return np.cross(r[:, None, :], np.eye(3)).swapaxes(1, 2)


def centripetal(omega: ndarray, r: ndarray) -> ndarray:
    return np.cross(omega, np.cross(omega, r))


class Recursion:
    """Mbar and h with a slip at some joints or bodies. at: (joints or bodies, rows), where it is made."""

    def __init__(self, tree: tmt.Tree, q: ndarray, qd: ndarray, slip: str = "", at: ndarray | None = None):
        self.tree, self.q, self.qd, self.slip, self.at, self.rows = tree, q, qd, slip, at, len(q)
        self.joints, zero = tree.coordinates.joints, np.zeros((len(q), 3))
        self.identity = np.broadcast_to(np.eye(3), (len(q), 3, 3))
        self.world = Frame(self.identity, zero, [], zero, zero, zero, self.identity, zero)
        self.frames: list[Frame] = []
        for i in range(len(tree.parent)):
            self.frames.append(self.frame(i))

    def step(self, name: str, index: int, right: ndarray, wrong: Wrong | None = None) -> ndarray:
        """A step's values: wrong ones, by default zero, in the rows with this slip at a joint or body."""
        if name != self.slip or self.at is None or not self.at[index].any():
            return right
        where = self.at[index].reshape(-1, *[1] * (right.ndim - 1))
        return np.where(where, wrong() if wrong else 0.0, right)

    def everywhere(self, vector: Sequence[float]) -> ndarray:
        return np.broadcast_to(np.array(vector), (self.rows, 3))

    def before(self, i: int) -> Frame:
        return self.frames[self.tree.parent[i]] if self.tree.parent[i] >= 0 else self.world

    def frame(self, i: int) -> Frame:
        """The frame of a joint, outward."""
        step, joint, parent, columns = self.step, self.joints[i], self.before(i), list(self.q.T)
        offset = [np.broadcast_to(x, self.rows) for x in origin_in_parent(self.tree, i, columns)]
        r, omega = rotated(parent.turn, np.stack(offset, axis=-1)), parent.omega
        a = parent.a + step("centripetal of offset", i, centripetal(omega, r))
        a = a + step("offset outward", i, np.cross(parent.alpha, r))
        a = step("base", i, a, lambda: a - parent.a)
        local, rates = [self.everywhere(axis) for axis in self.tree.axis[joint.qd]], self.qd[:, joint.qd]
        if joint.kind == "slide":
            axis = step("axis", i, rotated(parent.turn, local[0]), lambda: local[0])
            a = a + step("coriolis", i, 2.0 * np.cross(omega, axis * rates))
            return parent._replace(origin=parent.origin + r, axes=[axis], a=a, own=self.identity, slides=True)
        own = matrices(turn_in_parent(self.tree, i, columns), self.rows)
        turn = parent.turn @ step("transposed", i, own, lambda: backward(own))
        turn = step("order", i, turn, lambda: own @ parent.turn)
        turn = step("absolute", i, turn, lambda: own)
        carrier = turn if joint.kind == "ball" else parent.turn
        axes = [step("axis", i, rotated(carrier, axis), axis.copy) for axis in local]
        spin = np.einsum("ksc,sk->sc", axes, rates)
        to_parent = backward(parent.turn)
        passed = parent.passed
        passed = step("carried back", i, passed, lambda: rotated(turn @ own @ to_parent, parent.passed))
        passed = step("carried as it is", i, passed, lambda: rotated(turn @ to_parent, passed))
        alpha = parent.alpha + step("alpha", i, np.cross(passed, spin))
        used = step("relative", i, passed + spin, lambda: spin)
        return Frame(turn, parent.origin + r, axes, used, alpha, a, own, passed + spin)

    def inertia(self, b: int, turn: ndarray) -> ndarray:
        """The tensor of a body in the world's axes, (rows, 3, 3)."""
        about_joint = point_inertia(np.array(self.tree.com[b]), self.tree.mass[b])
        I = self.identity @ np.array(self.tree.inertia[b])
        I = self.step("about the joint", b, I, lambda: I + about_joint)
        I = self.step("parallel axis", b, I, lambda: I - about_joint)
        turned = self.step("not turned", b, turn @ I @ backward(turn), lambda: I)
        turned = self.step("world axes", b, turned, lambda: turn @ turned @ backward(turn))
        return self.step("turned back", b, turned, lambda: backward(turn) @ I @ turn)

    def segment(self, b: int, right: ndarray, alone: ndarray) -> ndarray:
        """What the segment from a body's joint to its CoM adds to a velocity or acceleration.

        alone: as if the joint's own turn were all.
        """
        name, _, components = self.slip.partition(" of components ")
        where = ["xyz".index(k) for k in components]
        if not where:
            return right
        wrong = right.copy()
        of_slip = {"sines": right[:, where[::-1]], "signs": -right[:, where], "angle": alone[:, where]}
        wrong[:, where] = of_slip[name]
        return self.step(self.slip, b, right, lambda: wrong)

    def values(self) -> tuple[ndarray, ndarray, ndarray]:
        """Mbar (rows, nv, nv), velocity terms of h and h at rest (rows, nv)."""
        tree, nv = self.tree, len(self.tree.axis)
        velocity_terms, rest = np.zeros((2, self.rows, nv))
        M = np.zeros((self.rows, nv, nv)) + np.diag(tree.armature if len(tree.armature) else [0.0] * nv)
        for b, mass in ((b, mass) for b, mass in enumerate(tree.mass) if tree.body_joint[b] >= 0):
            frame = self.frames[tree.body_joint[b]]
            I, omega = self.inertia(b, frame.turn), frame.omega
            moment = rotated(I, frame.alpha) + np.cross(omega, rotated(I, omega))
            T, B, levers, turns = self.columns(b)
            velocity_terms += mass * np.einsum("snc,sc->sn", levers, self.acceleration(b))
            velocity_terms += np.einsum("snc,sc->sn", turns, moment)
            rest -= mass * levers @ np.array(tree.gravity)
            M += mass * levers @ backward(T) + turns @ I @ backward(B)
        return M, velocity_terms, rest

    def acceleration(self, b: int) -> ndarray:
        """Of the CoM of a body at qdd = 0."""
        frame, joint = self.frames[self.tree.body_joint[b]], self.joints[self.tree.body_joint[b]]
        com, speed = self.everywhere(self.tree.com[b]), self.qd[:, [joint.qd.start]]
        r, spin = rotated(frame.turn, com), self.everywhere(self.tree.axis[joint.qd.start]) * speed
        a = self.step("CoM outward", b, np.cross(frame.alpha, r))
        a = a + self.step("centripetal", b, centripetal(frame.omega, r))
        a = self.segment(b, a, centripetal(spin, rotated(frame.own, com)))
        return self.step("base of body", b, frame.a + a, lambda: a)

    def columns(self, b: int) -> tuple[ndarray, ndarray, ndarray, ndarray]:
        """T and B of a body, and the columns by which its force and moment act, (rows, nv, 3) each."""
        tree, joint, step = self.tree, self.tree.body_joint[b], self.step
        T, B, levers, turns = np.zeros((4, self.rows, len(tree.axis), 3))
        frame, com = self.frames[joint], self.everywhere(tree.com[b])
        r, alone = rotated(frame.turn, com), rotated(frame.own, com)
        is_outward = self.slip.endswith("outward")
        is_inward = self.slip.endswith("inward") or self.slip.startswith(("force", "moment"))
        for i, of_force, of_moment in self.wrenches(b, r) if is_inward or is_outward else self.movers(b):
            mover, is_own = self.frames[i], float(i == joint)
            for n, axis in enumerate(mover.axes, self.joints[i].qd.start):
                local = self.everywhere(tree.axis[n])
                if mover.slides:
                    T[:, n] = levers[:, n] = axis
                    continue
                arm = self.segment(b, np.cross(axis, r), is_own * np.cross(local, alone))
                right = np.cross(axis, self.lever(i, frame.origin)) + arm
                T[:, n] = levers[:, n] = step("column", i * len(tree.mass) + b, right)
                turning = step("axis in B", i, axis, local.copy)
                turning = step("column of B", i * len(tree.mass) + b, turning)
                turning = step("relative B", b, turning, partial(np.multiply, turning, is_own))
                B[:, n] = turns[:, n] = turning
                if is_inward or is_outward:  # by virtual power also how the joint accelerates the CoM
                    (T if is_outward else levers)[:, n] = np.einsum("sij,si->sj", of_force, axis)
                if is_inward:
                    turns[:, n] = np.einsum("sij,si->sj", of_moment, axis)
        return T, B, levers, turns

    def movers(self, b: int) -> Iterator[tuple[int, ndarray, ndarray]]:
        return ((i, self.identity, self.identity) for i in self.tree.path(self.tree.body_joint[b]))

    def lever(self, i: int, x: ndarray) -> ndarray:
        """From the origin of joint i to a point."""
        lever = self.step("lever", i, x - self.frames[i].origin, lambda: x)
        lever = self.step("lever from the first", i, lever, lambda: x - self.frames[0].origin)
        return self.step("lever from the joint before", i, lever, lambda: x - self.before(i).origin)

    def wrenches(self, b: int, r: ndarray) -> Iterator[tuple[int, ndarray, ndarray]]:
        """The joints that move a body, inward; its force and moment as moments there, (rows, 3, 3)."""
        step, joint, force, of_moment = self.step, self.tree.body_joint[b], self.identity, self.identity
        arm = step("CoM outward", b, step("CoM inward", b, r))
        of_force = crossing(step("sign inward", b, arm, lambda: -r))
        what, _, how = self.slip.partition(" ")
        while joint >= 0:
            yield joint, of_force, of_moment
            parent, frame, turned = self.before(joint), self.frames[joint], self.identity
            if what in ("force", "moment"):
                own = backward(frame.own) if how == "turned back" else self.identity
                wrong = partial(np.matmul, parent.turn @ own, backward(frame.turn))
                turned = step(self.slip, joint, self.identity, wrong)
            if what == "force":
                force, turned = turned @ force, self.identity
            lever = step("offset inward", joint, frame.origin - parent.origin)
            lever = step("offset outward", joint, lever)
            joint_before = self.tree.parent[joint]
            lever = step("CoM for offset inward", joint, lever, partial(self.com_of, joint_before))
            of_force, of_moment = turned @ of_force + crossing(lever) @ force, turned @ of_moment
            joint = joint_before

    def com_of(self, joint: int) -> ndarray:
        """From a joint to the CoM of its body."""
        coms = (com for com, at in zip(self.tree.com, self.tree.body_joint) if at == joint)
        turn = self.frames[joint].turn if joint >= 0 else self.identity
        return rotated(turn, self.everywhere(next(coms, (0.0, 0.0, 0.0))))


def slips_of_recursion(equations: Equations) -> Iterator[Variant]:
    """The values with each slip at each joint or body, at those that are alike, and at all of them."""
    tree, count = equations.tree, len(equations.q)
    places = places_of_slips(tree)
    computed: dict[str, ndarray] = {}
    for record in SLIPS:
        those = places[record.at]
        if those and record.step not in computed:
            at = np.zeros((1 + max(map(max, those.values())), len(those) * count), bool)
            for k, numbers in enumerate(those.values()):
                at[numbers, k * count : (k + 1) * count] = True
            q, qd = (np.tile(part, (len(those), 1)) for part in (equations.q, equations.qd))
            values = equations.layout.packed(*Recursion(tree, q, qd, record.step, at).values())
            computed[record.step] = values.reshape(len(those), count, -1)
        for k, place in enumerate(those):
            yield slip(record.name.format(place), "no", "", computed[record.step][k])


def places_of_slips(tree: tmt.Tree) -> dict[str, dict[str, list[int]]]:
    """Where a slip can be made, by the words of `Slip.at`."""
    names = tree.joint_names
    turned = [i for i, kind in enumerate(tree.kind) if kind != "slide"] if len(names) <= MOST_SPEEDS else []
    moving = [(i, b) for b in range(len(tree.mass)) for i in turned if tree.moves(b)[i]]
    columns = {f"{names[i]} for {tree.body_names[b]}": [i * len(tree.mass) + b] for i, b in moving}
    return {"joint": sets_of_joints(tree), "body": sets_of_bodies(tree), "joint and body": columns}
