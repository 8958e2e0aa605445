"""Where Mbar is singular: hinges that turn without moving any mass, alone or against each other.

What counts is Mbar in units of the largest value that each of its diagonal entries can have: an eigenvalue of that which is
no larger than its rounding is zero.
"""

import math
from functools import lru_cache

import numpy as np

from . import method

ZERO_BELOW = 64 * np.finfo(float).eps  # an eigenvalue of the scaled Mbar, for each hinge
CLEAR = 1e-6  # a share of the inertia that is carried, far above rounding
APART = 1e-3  # sine of the angle between two axes that are clearly not parallel


def scales(tree) -> np.ndarray:
    """The largest value that each Mbar_ii can have at any q, kg m2, (n,): with all that the hinge carries stretched out."""
    sums = np.zeros(len(tree.parent))
    for mass, com, inertia, hinge in zip(tree.mass, tree.com, tree.inertia, tree.body_hinge):
        reach = math.hypot(*com)
        while hinge >= 0:
            sums[hinge] += mass * reach * reach + sum(abs(inertia[i][i]) for i in range(3))
            reach += math.hypot(*tree.offset[hinge])
            hinge = tree.parent[hinge]
    return sums


@lru_cache(maxsize=256)  # not in the Tree: vars(tree) are its fields
def never(tree) -> bool:
    """Whether Mbar is regular at every q, by an argument from the tips inward: False may also mean unknown.

    A body with inertia about every axis is at rest only if it does not turn; and it does not turn only if none of the
    hinges does that move it and not yet another such body, if that is one, or are two in a row that are not parallel.
    """
    resting, size = set(), scales(tree)
    for hinge, inertia in sorted(zip(tree.body_hinge, tree.inertia), key=lambda body: body[0]):
        chain = []
        while hinge >= 0:
            chain.append(hinge)
            hinge = tree.parent[hinge]
        still = [hinge for hinge in chain if hinge not in resting]
        if not still or np.linalg.eigvalsh(inertia)[0] < CLEAR * size[still].max():
            continue
        one = len(still) == 1
        two = len(still) == 2 and tree.parent[still[0]] == still[1]
        if one or (two and np.linalg.norm(np.cross(*(tree.axis[hinge] for hinge in still))) > APART):
            resting.update(still)
    return len(resting) == len(tree.parent)


def mass_matrices(tree, q) -> np.ndarray:
    """Mbar at angles q (N, n): (N, n, n), in time that grows less with n than that of the method's own sums."""
    count, n = q.shape
    total = np.zeros((count, n, n))
    for body in method.bodies(tree, list(q.T)):
        T, B = (
            np.array([[np.broadcast_to(x, count) for x in column] for column in columns]).transpose(2, 1, 0)
            for columns in (body.T, body.B)
        )
        inertia = np.array([list(row) for row in body.inertia])
        total += body.mass * T.transpose(0, 2, 1) @ T + B.transpose(0, 2, 1) @ inertia @ B
    return total


def found(tree, M) -> np.ndarray:
    """Which hinges turn without moving mass at each state of Mbar (..., n, n): (..., n) of bool, none where it is regular."""
    root = np.sqrt(scales(tree))
    values, vectors = np.linalg.eigh(M / np.multiply.outer(root, root))
    turning = np.abs(vectors[..., 0]) / root
    turning /= turning.max(axis=-1, keepdims=True)
    return (values[..., :1] <= ZERO_BELOW * len(root)) & (turning > CLEAR)


def reason(tree, turning) -> str:
    """Which hinges, as given by `found`, turn without moving mass, in words."""
    names = [repr(name) for name, turns in zip(tree.hinge_names, turning) if turns]
    if len(names) == 1:
        return f"hinge {names[0]} turns without moving any mass"
    return f"hinges {', '.join(names)} turn together without moving any mass"


def check_tree(tree) -> None:
    """Raise ValueError if Mbar is singular at every q, or its numbers are beyond those of a double."""
    with np.errstate(all="ignore"):
        size = scales(tree)
        if not size.all():
            raise ValueError(f"{reason(tree, size == 0.0)}; Mbar is singular at every q")
        if not np.isfinite(size).all() or size.min() < np.finfo(float).tiny / CLEAR:
            raise ValueError(
                f"Mbar of the Tree has sizes from {size.min():.3g} to {size.max():.3g} kg m2; doubles cannot hold that"
            )
        if tree.never_singular:
            return
        # two states with nothing special about them: singular at both is singular everywhere
        q = 2 * np.pi * np.outer((0.7548776662466927, 0.5698402909980532), 1 + np.arange(len(size)))
        turning = found(tree, mass_matrices(tree, q))
    if turning.any(axis=-1).all():
        raise ValueError(f"{reason(tree, turning[0])}; Mbar is singular at every q")


def first(tree, q, M=None) -> tuple[int, str] | None:
    """The first of the states q (N, n) at which Mbar is singular, and why; None if there is none."""
    if tree.never_singular or not len(q):
        return None
    turning = found(tree, mass_matrices(tree, q) if M is None else M)
    bad = turning.any(axis=-1)
    return (int(np.argmax(bad)), reason(tree, turning[np.argmax(bad)])) if bad.any() else None
