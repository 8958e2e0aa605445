"""Where the frames of a file may lie without another motion: the stated robot, moved and turned with gravity.

The anchor of a hinge may lie anywhere on its axis, that of a slide anywhere; frames may be parallel at any
position of the joints.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import Any

import numpy as np

import tmt
from tmt.derivation.method import joint_frames

from ..core.finding import Finding
from .joint_map import places_of

SAME = 1e-9  # of the length of a vector: one that is the same within rounding
MOST_AXES = 6  # of the first joints: pairs of them are tried


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
    """The stated Tree, moved and turned such that most of its vectors are those of a file's Tree."""
    joints = [tree.joint_names.index(name) for name in stated.joint_names]
    reference = [tree.reference[joint] for joint in joints]
    drawn = tuple(name for name, a, b in zip(stated.joint_names, stated.reference, reference) if a != b)
    vectors = vectors_of(tree, joints)
    turn, most = turned(vectors_of(stated, range(len(joints))), vectors)
    there = drawn_at(stated, reference) if drawn else stated
    other_turn, count = turned(vectors_of(there, range(len(joints))), vectors)
    if count > most:
        stated, turn = there, other_turn
    else:
        drawn = ()
    before, _, axes = places_of(stated)
    anchors, wanted = before @ turn.T, places_of(tree)[0][joints]
    free = [directions(kind, axis) for kind, axis in zip(stated.kind, axes @ turn.T)]
    tolerance = SAME * max(1.0, np.abs(anchors).max(), np.abs(wanted).max())
    shift = shifted(anchors, wanted, free, tolerance)
    moved, along = anchors + shift, []
    for i, (name, projection) in enumerate(zip(stated.joint_names, free)):
        apart = wanted[i] - moved[i]
        is_on_axis = np.abs(apart - projection @ apart).max() <= tolerance
        if is_on_axis and np.abs(apart).max() > tolerance:
            moved[i] += projection @ apart
            along.append(name)
    if along or shift.any() or (turn != np.eye(3)).any():
        at = list(stated.body_joint)
        centres = (before[at] + np.array(stated.com)) @ turn.T + shift
        turns, gravity = np.array([turn] * len(at)), tuple((turn @ stated.gravity).tolist())
        stated = with_frames(stated, moved, np.array(stated.axis) @ turn.T, centres, turns, gravity=gravity)
    is_with_gravity = bool(same_vectors(np.array([stated.gravity]), np.array([tree.gravity]))[0])
    return Placement(stated, turn, shift, tuple(along), drawn, is_with_gravity)


def vectors_of(tree: tmt.Tree, joints: Sequence[int]) -> np.ndarray:
    """Vectors that turn with a robot, (k, 3): axes, distances of anchors, centres of mass; gravity last."""
    anchors, _, axes = (values[list(joints)] for values in places_of(tree))
    centres = np.zeros_like(anchors)
    for mass, joint, com in zip(tree.mass, tree.body_joint, tree.com):
        centres[list(joints).index(joint)] += np.multiply(mass, com)
    return np.vstack([axes, np.diff(anchors, axis=0), centres, tree.gravity])


def drawn_at(stated: tmt.Tree, reference: Sequence[float]) -> tmt.Tree:
    """The same robot with frames that are parallel at other positions of its joints; a ball's stays."""
    q, at = list(stated.zero), list(stated.body_joint)
    for joint, position in zip(stated.coordinates.joints, reference):
        if joint.kind != "ball":
            q[joint.q.start] = position
    frames = joint_frames(stated, q)
    anchors = np.array([tuple(frame.origin) for frame in frames])
    axes = np.array([tuple(axis) for frame in frames for axis in frame.axes])
    turns = np.array([[list(row) for row in frames[joint].turn] for joint in at])
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


def turned(vectors: np.ndarray, others: np.ndarray) -> tuple[np.ndarray, int]:
    """The rotation, (3, 3), by which most vectors, (k, 3), are the others, and how many are.

    It is the identity unless another one makes more of them so.
    """
    best, turn = same_vectors(vectors, others).sum(), np.eye(3)
    for candidate in rotations(vectors, others):
        same = same_vectors(vectors @ candidate.T, others)
        if same.sum() > best:
            best, turn = same.sum(), candidate
    return turn, int(best)


def same_vectors(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether each of some vectors, (k, 3), is the other within rounding."""
    lengths = np.linalg.norm(vectors, axis=1)
    return np.abs(vectors - others).max(axis=1) <= SAME * lengths


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


def directions(kind: str, axis: np.ndarray) -> np.ndarray:
    """The projection, (3, 3), onto directions in which an anchor may be moved without another motion."""
    if kind == "slide":
        return np.eye(3)
    return np.outer(axis, axis) if kind == "hinge" else np.zeros((3, 3))


def shifted(
    anchors: np.ndarray, others: np.ndarray, free: Sequence[np.ndarray], tolerance: float
) -> np.ndarray:
    """The shift, (3,) m, with which most anchors, (n, 3), are the others apart from free directions, or 0."""

    def count(shift: np.ndarray) -> int:
        apart = others - anchors - shift
        left = [vector - projection @ vector for vector, projection in zip(apart, free)]
        return int((np.abs(left).max(axis=1) <= tolerance).sum())

    best, chosen = count(np.zeros(3)), np.zeros(3)
    for shift in (others - anchors)[:MOST_AXES]:
        if count(shift) > best:
            best, chosen = count(shift), shift
    return chosen
