"""Where Mbar is singular: joints that move without moving any mass, alone or against each other.

What counts is Mbar in units of the largest value that each of its diagonal entries can have: an eigenvalue of
that which is no larger than its rounding is zero.
"""

import math
from collections.abc import Iterable
from functools import lru_cache
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from tmt.derivation import method
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import ZERO

Array = NDArray[np.float64]
ZERO_BELOW = 64 * np.finfo(float).eps  # an eigenvalue of the scaled Mbar, for each hinge
CLEAR = 1e-6  # a share of the inertia that is carried, far above rounding
APART = 1e-3  # sine of the angle between two axes that are clearly not parallel


def scales(tree: Mechanism) -> Array:
    """The largest value of each Mbar_ii, kg m2, (nv,): all that is carried stretched out, slides by 1 m."""
    sums = np.array(tree.armature)
    for mass, com, inertia, carrier in zip(tree.mass, tree.com, tree.inertia, tree.body_joint):
        reach, spread = math.hypot(*com), sum(abs(inertia[i][i]) for i in range(3))
        for i in tree.path(carrier):
            slides = tree.kind[i] == "slide"
            sums[tree.coordinates.joints[i].qd] += mass if slides else mass * reach * reach + spread
            reach += math.hypot(*tree.offset[i]) + slides
    return sums


@lru_cache(maxsize=256)  # not in the Tree: vars(tree) are its fields
def never(tree: Mechanism) -> bool:
    """Whether Mbar is regular at every q, by an argument from the tips inward: False may also mean unknown.

    A joint whose own rotor has inertia is at rest if nothing moves. A body with inertia about every axis is
    at rest only if it does not turn; and it does not turn only if none of the hinges and balls does that move
    it and not yet another such body, if those are one joint, or two hinges in a row that are not parallel. If
    it does not turn, its mass is at rest only if none of the slides moves that move it, if those are in a row
    and none of their directions follows from the others.
    """
    size, joints = scales(tree), tree.coordinates.joints
    first_speed = [joint.qd.start for joint in joints]
    shares = [np.divide(tree.armature[joint.qd], size[joint.qd]).min() for joint in joints]
    resting = {i for i, share in enumerate(shares) if share > CLEAR}
    bodies = zip(tree.body_joint, tree.mass, tree.inertia)
    for carrier, mass, inertia in sorted(bodies, key=lambda body: body[0]):
        moving = [i for i in tree.path(carrier) if i not in resting]
        turning = [i for i in moving if tree.kind[i] != "slide"]
        sliding = [i for i in moving if tree.kind[i] == "slide"]
        if turning:
            largest = max(size[joints[i].qd].max() for i in turning)
            if np.linalg.eigvalsh(inertia)[0] < CLEAR * largest or not _turn_alone(tree, turning):
                continue
        if sliding:
            axes = np.array([tree.axis[first_speed[i]] for i in sliding])
            in_a_row = all(tree.parent[outer] == inner for outer, inner in pairwise(sliding))
            has_mass = mass > CLEAR * max(size[first_speed[i]] for i in sliding)
            if not (has_mass and in_a_row and np.linalg.svd(axes)[1].min() > APART and len(sliding) <= 3):
                continue
        resting.update(moving)
    return len(resting) == len(joints)


def _turn_alone(tree: Mechanism, turning: list[int]) -> bool:
    if len(turning) == 1:
        return True
    outer, inner = turning[:2]
    kinds = {tree.kind[i] for i in turning}
    if len(turning) > 2 or kinds != {"hinge"} or tree.parent[outer] != inner:
        return False
    axes = np.array([tree.axis[tree.coordinates.joints[i].qd.start] for i in turning])
    return bool(np.linalg.norm(np.cross(axes[0], axes[1])) > APART)


def mass_matrices(tree: Mechanism, q: Array) -> Array:
    """Mbar at positions q (N, nq): (N, nv, nv), in time that grows less with n than that of method.py."""
    count, n = len(q), len(tree.axis)
    total = np.zeros((count, n, n)) + np.diag(tree.armature)
    for body in method.bodies(tree, list(q.T)):
        moving = [k for k in range(n) if body.T[k] is not ZERO]
        T, B = np.zeros((2, count, 3, len(moving)))
        for column, k in enumerate(moving):
            for axis, (of_T, of_B) in enumerate(zip(body.T[k], body.B[k])):
                T[:, axis, column], B[:, axis, column] = of_T, of_B
        inertia = np.array([list(row) for row in body.inertia])
        own = body.mass * T.transpose(0, 2, 1) @ T + B.transpose(0, 2, 1) @ inertia @ B
        total[:, np.array(moving, int)[:, None], moving] += own
    return total


def found(tree: Mechanism, M: Array) -> NDArray[np.bool_]:
    """Which joints move without moving mass, (..., n), for Mbar (..., nv, nv): none where it is regular."""
    root = np.sqrt(scales(tree))
    values, vectors = np.linalg.eigh(M / np.multiply.outer(root, root))
    moving = np.abs(vectors[..., 0]) / root
    moving /= moving.max(axis=-1, keepdims=True)
    speeds = (values[..., :1] <= ZERO_BELOW * len(root)) & (moving > CLEAR)
    return np.stack([speeds[..., joint.qd].any(axis=-1) for joint in tree.coordinates.joints], axis=-1)


def reason(tree: Mechanism, moving: Iterable[bool]) -> str:
    """Which joints, as given by `found`, move without moving mass, in words."""
    chosen = [i for i, moves in enumerate(moving) if moves]
    names = [repr(tree.joint_names[i]) for i in chosen]
    kinds = {tree.kind[i] for i in chosen}
    kind = kinds.pop() if len(kinds) == 1 else "joint"
    if len(names) == 1:
        return f"{kind} {names[0]} {'moves' if kind == 'slide' else 'turns'} without moving any mass"
    move = "turn" if kind in ("hinge", "ball") else "move"
    return f"{kind}s {', '.join(names)} {move} together without moving any mass"


def check_tree(tree: Mechanism) -> None:
    """Raise ValueError if Mbar is singular at every q, or its numbers are beyond those of a double."""
    with np.errstate(all="ignore"):
        size = scales(tree)
        if not size.all():
            none = [not size[joint.qd].all() for joint in tree.coordinates.joints]
            raise ValueError(f"{reason(tree, none)}; Mbar is singular at every q")
        if not np.isfinite(size).all() or size.min() < np.finfo(float).tiny / CLEAR:
            sizes = f"from {size.min():.3g} to {size.max():.3g} kg m2"
            raise ValueError(f"Mbar of the Tree has sizes {sizes}; doubles cannot hold that")
        if never(tree):
            return
        # two states with nothing special about them: singular at both is singular everywhere
        places = 1 + np.arange(tree.coordinates.nq)
        q = 2 * np.pi * np.outer((0.7548776662466927, 0.5698402909980532), places)
        for joint in tree.coordinates.joints:
            if joint.kind != "hinge":
                q[:, joint.q] = np.sin(q[:, joint.q])
        turning = found(tree, mass_matrices(tree, q))
    if turning.any(axis=-1).all():
        raise ValueError(f"{reason(tree, turning[0])}; Mbar is singular at every q")


def first(tree: Mechanism, q: Array, M: Array | None = None) -> tuple[int, str] | None:
    """The first of the states q (N, nq) at which Mbar is singular, and why; None if there is none."""
    if never(tree) or not len(q):
        return None
    turning = found(tree, mass_matrices(tree, q) if M is None else M)
    bad = turning.any(axis=-1)
    return (int(np.argmax(bad)), reason(tree, turning[np.argmax(bad)])) if bad.any() else None
