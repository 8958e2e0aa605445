"""A Tree as the compiled loops take it: records of its joints and bodies, and arrays."""

from functools import lru_cache
from typing import NamedTuple

import numpy as np

from tmt.equations.composite import carried_by_joint
from tmt.model.coordinates import KINDS


class Arrays(NamedTuple):
    """A Tree as the loops take it, its masses handed inward."""

    joints: np.ndarray  # (n,) of JOINT, each after the one that carries it
    before: np.ndarray  # (nv,) the speed before each on its path to the world, or -1
    gravity: tuple
    nq: int
    position_gain: np.ndarray  # (nv, nv), or (0, 0) where there is none
    speed_gain: np.ndarray


# what the loops know of a joint, of a hinge or slide the first of several: whole numbers, then doubles, with their shapes
WHOLE = ("kind", "parent", "at", "by", "count", "forks", "goes_on")
NUMBERS = {"reference": (), "moves": (), "offset": 3, "axis": 9, "mass": (), "moment": 3, "inertia": 9} | {
    "armature": 3, "damping": 3, "stiffness": (), "rest": 4
}  # fmt: skip
JOINT = np.dtype([(name, "i8") for name in WHOLE] + [(name, "f8", shape) for name, shape in NUMBERS.items()])


WORLD = np.dtype([("gravity", "f8", 3), ("nq", "i8")])
BODY = np.dtype([("joint", "i8"), ("mass", "f8"), ("com", "f8", 3), ("inertia", "f8", 9)])


@lru_cache(maxsize=64)
def arrays(tree, about_world: bool = False) -> Arrays:
    """The Tree as arrays; about_world: its places are those about the origin of the world, and no longer about the first joint
    that turns."""
    joints = tree.coordinates.joints
    before = [v - 1 for v in range(len(tree.axis))]
    for parent, joint in zip(tree.parent, joints):
        before[joint.qd.start] = joints[parent].qd.stop - 1 if parent >= 0 else -1
    gains = (matrix(gain) for gain in (tree.position_gain, tree.speed_gain))
    return Arrays(
        np.array(rows(tree, about_world=about_world), JOINT),
        np.array(before),
        tree.gravity,
        tree.coordinates.nq,
        *gains,
    )


def order_of(tree) -> list[int]:
    """The joints as the loops walk them, each followed by one that it carries where there is one; before them the world, -1."""
    order, todo = [], [-1]
    while todo:
        order.append(todo.pop())
        todo += [i for i in reversed(range(len(tree.parent))) if tree.parent[i] == order[-1]]
    return order


def bodies(tree) -> np.ndarray:
    """The bodies of a Tree, (m,) of BODY: `joint` is the place of the joint among those of `arrays`, -1 the world."""
    place = {i: k for k, i in enumerate(order_of(tree), -1)}
    own = zip(tree.body_hinge, tree.mass, tree.com, tree.inertia)
    return np.array(
        [(place[joint], mass, com, [x for row in inertia for x in row]) for joint, mass, com, inertia in own], BODY
    )


def rows(tree, number=float, about_world=False) -> list[tuple]:
    """The joints by the names of JOINT in the order of `order_of`. number: see composite.py."""
    order = order_of(tree)
    place = {i: k for k, i in enumerate(order, -1)}
    masses, grounded, result = carried_by_joint(tree), {-1: True}, []
    for k, i in enumerate(order[1:]):
        (kind, at, by), parent, own = tree.coordinates.joints[i], tree.parent[i], masses[i].rounded(number)
        # what only slides carry: the common point O of all that hangs on it moves with it
        grounded[i] = kind == "slide" and grounded[parent]
        still = grounded[parent] and not about_world
        count = by.stop - by.start
        result.append((
            tuple(KINDS).index(kind), place[parent], at.start, by.start, count,
            any(place[c] != k + 1 for c in range(len(place) - 1) if tree.parent[c] == i),
            order[k + 2 : k + 3] != [] and tree.parent[order[k + 2]] == i,
            tree.reference[i], 0.0 if still else 1.0, (0.0,) * 3 if still else tree.offset[i],
            [x for axis in [*tree.axis[by], *[(0.0,) * 3] * (3 - count)] for x in axis],
            own.mass, tuple(own.moment), [x for row in own.inertia for x in row],
            *((*values[by], *(0.0,) * (3 - count)) for values in (tree.armature, tree.damping)),
            tree.stiffness[i], (*tree.rest[at], *(0.0,) * (4 - (at.stop - at.start))),
        ))  # fmt: skip
    return result


def in_parts(tree) -> tuple:
    """The Tree as loop_answers.py takes it: arrays one by one."""
    inner, outer, n = arrays(tree), arrays(tree, about_world=True), len(tree.axis)
    gains = np.zeros((2, n, n) if tree.has_gains else (2, 0, 0))
    for of, gain in zip(gains, (inner.position_gain, inner.speed_gain)):
        if len(gain):
            of[:] = gain
    world = np.array([(inner.gravity, inner.nq)], WORLD)
    return inner.joints, outer.joints, bodies(tree), inner.before, world, gains


def matrix(rows) -> np.ndarray:
    """Rows as an array of two dimensions, whatever their number."""
    return np.array(rows, dtype=float).reshape(len(rows), len(rows))
