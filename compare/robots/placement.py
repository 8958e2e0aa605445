"""Two files of one robot: which joints are the same, and where frames may lie without another motion.

Joints are the same by name, else by their order among those of their kind. The anchor of a hinge may lie
anywhere on its axis, that of a slide anywhere: the stated ones are put at the foot of the perpendicular from
the file's. Frames may be parallel at any position of the joints, and the robot with its gravity may be moved
and turned. What is moved counts as a number that differs: the placement has the fewest of both.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any, NamedTuple

import numpy as np

import tmt
from tmt.derivation.method import joint_frames

from ..core.finding import Finding
from ..core.words import some_of
from .coordinates import FREE, free_joints

SAME = 1e-9  # of the length of a vector: one that is the same within rounding
MOST_AXES = 6  # of the first joints: pairs of them are tried


class Unmatched(ValueError):
    """Some joints have no counterpart; the message names them."""


class Matched(NamedTuple):
    """The joints of a file."""

    names: tuple[str, ...]  # in the order of the reference's joints
    renamed: tuple[str, ...]  # "wrist as hand": not matched by name


def matched_joints(reference: tmt.Tree, tree: tmt.Tree, whose: str) -> Matched:
    """The joints of a tree for those of a reference: by name, else by their order. Unmatched, if one is left."""
    names, right = tree.joint_names, reference.joint_names
    pairs = {i: names.index(name) for i, name in enumerate(right) if name in names}
    for i, kind in enumerate(reference.kind):
        alike = [j for j in range(len(names)) if j not in pairs.values() and tree.kind[j] == kind]
        if i not in pairs and alike:
            pairs[i] = alike[0]
    wrong = [
        f"joint {names[j]} is a {tree.kind[j]}, expected a {reference.kind[i]} as in {whose}"
        for i, j in sorted(pairs.items())
        if reference.kind[i] != tree.kind[j]
    ]
    for word, joints, matched in (("missing", reference, pairs.keys()), ("additional", tree, pairs.values())):
        if left := [k for k in range(len(joints.joint_names)) if k not in matched]:
            wrong.append(f"{word} joints: {some_of(named_with_kind(joints, left))}")
    if wrong:
        raise Unmatched("; ".join(wrong))
    found = tuple(names[pairs[i]] for i in range(len(right)))
    return Matched(found, tuple(f"{name} as {other}" for name, other in zip(found, right) if name != other))


def named_with_kind(tree: tmt.Tree, joints: Sequence[int]) -> list[str]:
    """Some joints with their kind: "wrist (hinge)"; the parts of a free joint as that one."""
    named = {i: f"{name} ({kind})" for i, (name, kind) in enumerate(zip(tree.joint_names, tree.kind))}
    for first in free_joints(tree):
        free = f"{tree.joint_names[first].removesuffix(' x')} (free)"
        named |= dict.fromkeys(range(first, first + len(FREE)), free)
    return list(dict.fromkeys(named[joint] for joint in joints))


@dataclass(frozen=True)
class Placement:
    """A stated Tree as a file places it; it moves in the same way if gravity is turned with it."""

    tree: tmt.Tree
    turn: np.ndarray  # (3, 3), of the stated robot and its gravity
    shift: np.ndarray  # (3,) m, of its origin
    along: tuple[str, ...]  # joints whose anchor is elsewhere on their axis
    drawn: tuple[str, ...]  # joints that the file draws at another position, its `ref`
    is_with_gravity: bool  # whether gravity is turned with the robot; else the turn is an error

    @property
    def is_same(self) -> bool:
        return not (self.is_turned or self.is_moved or self.along or self.drawn)

    @property
    def is_turned(self) -> bool:
        return bool(np.any(self.turn != np.eye(3)))

    @property
    def is_moved(self) -> bool:
        return bool(self.shift.any())

    def remarks(self) -> list[Finding]:
        """Where the file has the robot, and that its motion is the same."""
        if self.is_same:
            return []
        from scipy.spatial.transform import Rotation  # slow import

        vector = Rotation.from_matrix(self.turn).as_rotvec(degrees=True)
        angle = float(np.linalg.norm(vector))
        axis = np.round(vector / (angle or 1.0), 9) + 0.0  # -0 would be shown
        names = ("along", "is_moved", "is_turned", "drawn", "is_with_gravity")
        values = {name: getattr(self, name) for name in names}
        values |= {"shift": self.shift.tolist(), "angle": angle, "axis": axis.tolist()}
        return [Finding("remarks", "placed", values)]


def placed(stated: tmt.Tree, tree: tmt.Tree) -> Placement:
    """The stated Tree, drawn at the file's `ref`, turned and moved, where more of its vectors are the file's then."""
    joints = [tree.joint_names.index(name) for name in stated.joint_names]
    reference = tuple(tree.reference[joint] for joint in joints)
    differs = [name for name, a, b in zip(stated.joint_names, stated.reference, reference) if a != b]
    wanted, tried = vectors_of(tree, joints), list[tuple[int, tmt.Tree, np.ndarray]]()
    for robot in (stated, drawn_at(stated, reference))[: 1 + bool(differs)]:
        vectors = vectors_of(robot, range(len(joints)))
        for turn in (np.eye(3), *rotations(vectors, wanted)):
            tried.append((same_vectors(vectors @ turn.T, wanted).sum(), robot, turn))
    _, there, turn = max(tried, key=lambda trial: trial[0])  # the first of the best
    drawn = () if there is stated else tuple(differs)
    anchors, axes = places_of(there)
    centres = (anchors[list(there.body_joint)] + np.array(there.com)) @ turn.T
    anchors, axes, others = anchors @ turn.T, axes @ turn.T, places_of(tree)[0][joints]
    # onto directions in which an anchor may be moved without another motion
    onto = {
        "slide": lambda axis: np.eye(3),
        "hinge": lambda axis: np.outer(axis, axis),
        "ball": lambda axis: np.zeros((3, 3)),
    }
    free = np.array([onto[kind](axis) for kind, axis in zip(there.kind, axes)])
    tolerance = SAME * max(1.0, np.abs(anchors).max(), np.abs(others).max())
    # by how much centres of mass are elsewhere, from their anchors
    beside = centres_of(tree, joints) - centres_of(there, range(len(joints))) @ turn.T
    moves = []
    for shift in (np.zeros(3), *(others - anchors)[:MOST_AXES]):
        to_foot = np.einsum("nij,nj->ni", free, others - anchors - shift)
        is_along = np.abs(to_foot).max(axis=1) > tolerance
        for along in (np.zeros_like(anchors), to_foot * is_along[:, None]):
            apart, moved = others - anchors - shift - along, int(shift.any()) + int(along.any(axis=1).sum())
            differ = differing(there.parent, apart, beside + along, tolerance)
            moves.append((differ + moved, differ, shift, along))
    _, _, shift, along = min(moves, key=lambda move: move[:2])
    is_along = along.any(axis=1)
    if is_along.any() or shift.any() or (turn != np.eye(3)).any():
        turns, gravity = np.array([turn] * len(centres)), tuple((turn @ there.gravity).tolist())
        feet, axes = anchors + shift + along, np.array(there.axis) @ turn.T
        there = with_frames(there, feet, axes, centres + shift, turns, gravity=gravity)
    is_with_gravity = bool(same_vectors(np.array([there.gravity]), np.array([tree.gravity]))[0])
    names = tuple(name for name, is_it in zip(there.joint_names, is_along) if is_it)
    return Placement(there, turn, shift, names, drawn, is_with_gravity)


def places_of(tree: tmt.Tree) -> tuple[np.ndarray, np.ndarray]:
    """The anchor of each joint in the world, m, and its first axis, (n, 3) each."""
    anchors: list[np.ndarray] = []
    for parent, offset in zip(tree.parent, tree.offset):
        anchors.append(np.add(offset, anchors[parent] if parent >= 0 else 0.0))
    return np.array(anchors), np.array([tree.axis[joint.qd.start] for joint in tree.coordinates.joints])


def vectors_of(tree: tmt.Tree, joints: Sequence[int]) -> np.ndarray:
    """Vectors that turn with a robot, (k, 3): axes, distances of anchors, centres of mass; gravity last."""
    anchors, axes = (values[list(joints)] for values in places_of(tree))
    return np.vstack([axes, np.diff(anchors, axis=0), centres_of(tree, joints), tree.gravity])


def centres_of(tree: tmt.Tree, joints: Sequence[int]) -> np.ndarray:
    """The centre of mass of what each joint moves alone, from its anchor, m, (n, 3); 0 without mass."""
    moments = np.zeros((len(joints), 4))
    for mass, joint, com in zip(tree.mass, tree.body_joint, tree.com):
        moments[list(joints).index(joint)] += np.multiply(mass, (*com, 1.0))
    return moments[:, :3] / np.where(moments[:, 3:] > 0.0, moments[:, 3:], 1.0)


def drawn_at(stated: tmt.Tree, reference: Sequence[float]) -> tmt.Tree:
    """The same robot with frames that are parallel at other positions of its joints; a ball's stays."""
    q, at = list(stated.zero), list(stated.body_joint)
    for joint, position in zip(stated.coordinates.joints, reference):
        if joint.kind != "ball":
            q[joint.q.start] = position
    frames = joint_frames(stated, q)
    anchors = np.array([tuple(frame.origin) for frame in frames])
    axes = np.array([tuple(axis) for frame in frames for axis in frame.axes])
    turns = np.array([[list(row) for row in frames[joint].rotation] for joint in at])
    centres = anchors[at] + np.einsum("bij,bj->bi", turns, stated.com)
    return with_frames(stated, anchors, axes, centres, turns, reference=tuple(reference))


def with_frames(
    tree: tmt.Tree, anchors: np.ndarray, axes: np.ndarray, centres: np.ndarray, turns: np.ndarray, **more: Any
) -> tmt.Tree:
    """A Tree with other anchors (n, 3), axes (nv, 3), centres of mass (m, 3) in the world, turned tensors.

    turns: (m, 3, 3), of each body; more: other fields of the Tree.
    """
    origins = [anchors[parent] if parent >= 0 else np.zeros(3) for parent in tree.parent]
    tensors = turns @ np.array(tree.inertia) @ turns.transpose(0, 2, 1)
    tensors = (tensors + tensors.transpose(0, 2, 1)) / 2.0
    numbers: dict[str, Any] = {"axis": axes, "inertia": tensors, "offset": anchors - origins}
    numbers["com"] = centres - anchors[list(tree.body_joint)]
    return replace(tree, **numbers, **more)


def same_vectors(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether each of some vectors, (k, 3), is the other within rounding."""
    return np.abs(vectors - others).max(axis=1) <= SAME * np.linalg.norm(vectors, axis=1)


def rotations(vectors: np.ndarray, others: np.ndarray) -> Iterator[np.ndarray]:
    """Rotations by which two vectors that are not parallel become the others. The last vector is tried."""
    tried = [*range(min(MOST_AXES, len(vectors) - 1)), len(vectors) - 1]
    for i, j in combinations(tried, 2):
        frame, other = frame_of(vectors[i], vectors[j]), frame_of(others[i], others[j])
        if frame is not None and other is not None:
            yield other @ frame.T


def frame_of(first: np.ndarray, second: np.ndarray) -> np.ndarray | None:
    """Orthonormal axes, as columns, along the first vector and in the plane of both; None: parallel."""
    normal, lengths = np.cross(first, second), np.linalg.norm(first) * np.linalg.norm(second)
    if np.linalg.norm(normal) <= 1e-6 * lengths or lengths == 0.0:
        return None
    x, z = first / np.linalg.norm(first), normal / np.linalg.norm(normal)
    return np.column_stack([x, np.cross(z, x), z])


def differing(parents: Sequence[int], anchors: np.ndarray, centres: np.ndarray, tolerance: float) -> int:
    """How many numbers differ by differences of anchors and of centres of mass, (n, 3) m: of anchors or offsets."""
    offsets = anchors - np.vstack([anchors, np.zeros(3)])[list(parents)]  # -1: the last
    of_anchors, of_offsets, of_centres = (
        int((np.abs(vectors).max(axis=1) > tolerance).sum()) for vectors in (anchors, offsets, centres)
    )
    return min(of_anchors, of_offsets) + of_centres
