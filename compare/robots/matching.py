"""Which joint of a file is which of a reference: by its name, else by its place, its axis and its type."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np
from scipy.optimize import linear_sum_assignment

import tmt

from .given import some

OTHER_TYPE = 1e6  # what keeps two joints from being matched: a hinge is no slide
# what speaks against a match: the angle of the axes (1 if upright on each other), joints between it and the world, the place as
# a share of the robot's size, an axis of the opposite sense, and, between equal ones, the order
OF_AXIS, OF_DEPTH, OF_PLACE, OF_SENSE, OF_ORDER = 4.0, 1.5, 1.0, 0.5, 1e-3


class Unmatched(ValueError):
    """Joints of which some have no counterpart; the message says which."""


class Matched(NamedTuple):
    """The joints of a file."""

    names: tuple[str, ...]  # in the order of the reference's joints
    renamed: tuple[str, ...]  # "wrist as hand": those that are not matched by their names


def matched_joints(reference: tmt.Tree, tree: tmt.Tree, whose: str) -> Matched:
    """The joints of a tree that are those of the reference, called `whose`. Unmatched if one of them has no counterpart."""
    pairs = same_names(reference.hinge_names, tree.hinge_names)
    left = [i for i in range(len(reference.hinge_names)) if i not in pairs]
    free = [j for j in range(len(tree.hinge_names)) if j not in pairs.values()]
    costs = costs_of(reference, tree)
    rows, columns = linear_sum_assignment(costs[np.ix_(left, free)])
    pairs |= {left[i]: free[j] for i, j in zip(rows, columns) if costs[left[i], free[j]] < OTHER_TYPE}
    refuse_unmatched(reference, tree, pairs, whose)
    names = tuple(tree.hinge_names[pairs[i]] for i in range(len(reference.hinge_names)))
    other = [f"{name} as {right}" for name, right in zip(names, reference.hinge_names) if name != right]
    return Matched(names, tuple(other))


def same_names(reference: Sequence[str], names: Sequence[str]) -> dict[int, int]:
    """Those of the same name, and of the same except for capital letters: by their numbers."""
    pairs = {i: names.index(name) for i, name in enumerate(reference) if name in names}
    small, right = [name.casefold() for name in names], [name.casefold() for name in reference]
    for i, name in enumerate(right):
        if i not in pairs and small.count(name) == right.count(name) == 1 and small.index(name) not in pairs.values():
            pairs[i] = small.index(name)
    return pairs


def costs_of(reference: tmt.Tree, tree: tmt.Tree) -> np.ndarray:
    """What speaks against it that a joint of the reference (row) is a joint of a tree (column)."""
    (anchors, depths, axes), (other_anchors, other_depths, other_axes) = map(places_of, (reference, tree))
    along = np.einsum("id,jd->ij", axes, other_axes)
    apart = np.linalg.norm(anchors[:, None] - other_anchors, axis=-1)
    costs = (
        OF_AXIS * (1.0 - np.abs(along))
        + OF_SENSE * (along < 0.0)
        + OF_DEPTH * np.abs(np.subtract.outer(depths, other_depths))
    )
    costs += OF_PLACE * apart / max(np.ptp(anchors, axis=0).max(), np.ptp(other_anchors, axis=0).max(), 1e-9)
    costs += OF_ORDER * np.abs(np.subtract.outer(np.arange(len(depths)), np.arange(len(other_depths))))
    return np.where(np.array(reference.kind)[:, None] == np.array(tree.kind), costs, OTHER_TYPE)


def places_of(tree: tmt.Tree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of each joint the anchor in the world, m (n, 3), how many joints are before it (n,), and its first axis (n, 3)."""
    anchors, depths = [], []
    for parent, offset in zip(tree.parent, tree.offset):
        anchors.append(np.add(offset, anchors[parent] if parent >= 0 else 0.0))
        depths.append(depths[parent] + 1 if parent >= 0 else 0)
    axes = [tree.axis[by.start] for _, _, by in tree.coordinates.joints]
    return np.array(anchors), np.array(depths), np.array(axes)


def refuse_unmatched(reference: tmt.Tree, tree: tmt.Tree, pairs: Mapping[int, int], whose: str) -> None:
    """Unmatched, if a joint is missing, one too many, or of another type than that of its name."""
    ours, theirs = (dict(zip(one.hinge_names, one.kind)) for one in (reference, tree))
    said = [
        f"joint {theirs_name} is a {theirs[theirs_name]}, that of {whose} a {ours[name]}"
        for i, j in sorted(pairs.items())
        for name, theirs_name in [(reference.hinge_names[i], tree.hinge_names[j])]
        if ours[name] != theirs[theirs_name]
    ]
    missing = [f"{name} ({kind})" for i, (name, kind) in enumerate(ours.items()) if i not in pairs]
    extra = [f"{name} ({kind})" for j, (name, kind) in enumerate(theirs.items()) if j not in pairs.values()]
    for names, what in ((missing, f"of {whose} {{}} missing"), (extra, f"{{}} not in {whose}")):
        if names:
            one = len(names) == 1
            said.append(f"joint{'s' * (not one)} {some(names)} {what.format('is' if one else 'are')}")
    if said:
        raise Unmatched("; ".join(said))
