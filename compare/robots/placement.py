"""Where the frames of a file may lie without another motion: the stated robot, moved and turned with gravity.

The anchor of a hinge may lie anywhere on its axis, that of a slide anywhere.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

import tmt

from ..core.finding import Finding
from .joint_map import places_of

SAME = 1e-9  # of the length of a vector: one that is the same but for rounding
MOST_AXES = 6  # of the first joints: pairs of them are tried


@dataclass(frozen=True)
class Placement:
    """A stated Tree as a file places it; it moves in the same way if gravity is turned with it."""

    tree: tmt.Tree
    turn: np.ndarray  # (3, 3), of the stated robot and its gravity
    shift: np.ndarray  # (3,) m, of its origin
    along: tuple[str, ...]  # joints whose anchor is elsewhere on their axis
    is_with_gravity: bool  # whether gravity is turned with the robot; else the turn is an error

    @property
    def is_same(self) -> bool:
        return not (self.is_turned or self.is_moved or self.along)

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
        cosine = np.clip((np.trace(self.turn) - 1.0) / 2.0, -1.0, 1.0)
        values = {"shift": self.shift.tolist(), "angle": float(np.degrees(np.arccos(cosine)))}
        values |= {"axis": axis_of(self.turn).tolist(), "along": self.along, "is_moved": self.is_moved}
        values |= {"is_turned": self.is_turned, "is_with_gravity": self.is_with_gravity}
        return [Finding("remarks", "placed", values)]


def placed(stated: tmt.Tree, tree: tmt.Tree) -> Placement:
    """The stated Tree, moved and turned such that most of its vectors are those of the Tree of a file, which has its joints."""
    joints = [tree.joint_names.index(name) for name in stated.joint_names]
    anchors, _, axes = places_of(stated)
    file_anchors, _, _ = (values[joints] for values in places_of(tree))
    turn = turned(vectors_of(stated, range(len(joints))), vectors_of(tree, joints))
    anchors, axes = anchors @ turn.T, axes @ turn.T
    free = [directions(kind, axis) for kind, axis in zip(stated.kind, axes)]
    size = max(1.0, np.abs(anchors).max(), np.abs(file_anchors).max())
    shift = shifted(anchors, file_anchors, free, SAME * size)
    moved, along = anchors + shift, []
    for i, (name, projection) in enumerate(zip(stated.joint_names, free)):
        apart = file_anchors[i] - moved[i]
        is_on_axis = np.abs(apart - projection @ apart).max() <= SAME * size
        if is_on_axis and np.abs(apart).max() > SAME * size:
            moved[i] += projection @ apart
            along.append(name)
    changed = along or shift.any() or (turn != np.eye(3)).any()
    tree_there = moved_tree(stated, turn, moved, shift) if changed else stated
    is_with_gravity = bool(same_vectors(np.array([tree_there.gravity]), np.array([tree.gravity]))[0])
    return Placement(tree_there, turn, shift, tuple(along), is_with_gravity)


def moved_tree(stated: tmt.Tree, turn: np.ndarray, anchors: np.ndarray, shift: np.ndarray) -> tmt.Tree:
    """The Tree with other anchors in the world, (n, 3), and with all of its vectors turned."""
    before, _, _ = places_of(stated)
    origins = [anchors[parent] if parent >= 0 else np.zeros(3) for parent in stated.parent]
    at = list(stated.body_joint)
    centres = (before[at] + np.array(stated.com)) @ turn.T + shift
    return replace(
        stated,
        offset=rows(anchors - origins),
        axis=rows(np.array(stated.axis) @ turn.T),
        com=rows(centres - anchors[at]),
        inertia=tuple(rows(symmetric(turn @ inertia @ turn.T)) for inertia in np.array(stated.inertia)),
        gravity=tuple((turn @ stated.gravity).tolist()),
    )


def rows(values: np.ndarray) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, values.tolist()))


def symmetric(tensor: np.ndarray) -> np.ndarray:
    return (tensor + tensor.T) / 2.0


def vectors_of(tree: tmt.Tree, joints: Sequence[int]) -> np.ndarray:
    """Vectors that turn with a robot, (k, 3): axes, distances of anchors and centres of mass of some joints; gravity last."""
    anchors, _, axes = (values[list(joints)] for values in places_of(tree))
    centres = np.zeros_like(anchors)
    for mass, joint, com in zip(tree.mass, tree.body_joint, tree.com):
        centres[list(joints).index(joint)] += np.multiply(mass, com)
    return np.vstack([axes, np.diff(anchors, axis=0), centres, tree.gravity])


def turned(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """The rotation, (3, 3), by which most vectors, (k, 3), are the others; the identity unless one makes more of them so."""
    best, turn = same_vectors(vectors, others).sum(), np.eye(3)
    for candidate in rotations(vectors, others):
        same = same_vectors(vectors @ candidate.T, others)
        if same.sum() > best:
            best, turn = same.sum(), candidate
    return turn


def same_vectors(vectors: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether each of some vectors, (k, 3), is the other but for rounding."""
    lengths = np.linalg.norm(vectors, axis=1)
    return np.abs(vectors - others).max(axis=1) <= SAME * lengths


def rotations(vectors: np.ndarray, others: np.ndarray) -> Iterator[np.ndarray]:
    """Rotations by which two vectors that are not parallel become the others. The last vector is among those that are tried."""
    tried = [*range(min(MOST_AXES, len(vectors) - 1)), len(vectors) - 1]
    for i, j in combinations(tried, 2):
        frame, other = frame_of(vectors[i], vectors[j]), frame_of(others[i], others[j])
        if frame is not None and other is not None:
            yield other @ frame.T


def frame_of(first: np.ndarray, second: np.ndarray) -> np.ndarray | None:
    """Orthonormal axes, as columns, along the first vector and the plane of both; None where they are parallel."""
    normal, lengths = np.cross(first, second), np.linalg.norm(first) * np.linalg.norm(second)
    if np.linalg.norm(normal) <= 1e-6 * lengths or lengths == 0.0:
        return None
    x, z = first / np.linalg.norm(first), normal / np.linalg.norm(normal)
    return np.column_stack([x, np.cross(z, x), z])


def directions(kind: str, axis: np.ndarray) -> np.ndarray:
    """The projection, (3, 3), onto the directions in which the anchor of a joint may be moved without another motion."""
    if kind == "slide":
        return np.eye(3)
    return np.outer(axis, axis) if kind == "hinge" else np.zeros((3, 3))


def shifted(
    anchors: np.ndarray, others: np.ndarray, free: Sequence[np.ndarray], tolerance: float
) -> np.ndarray:
    """The shift, (3,) m, with which most anchors, (n, 3), are the others but for free directions; 0 unless more are so then."""

    def count(shift: np.ndarray) -> int:
        apart = others - anchors - shift
        left = [vector - projection @ vector for vector, projection in zip(apart, free)]
        return int((np.abs(left).max(axis=1) <= tolerance).sum())

    best, chosen = count(np.zeros(3)), np.zeros(3)
    for shift in (others - anchors)[:MOST_AXES]:
        if count(shift) > best:
            best, chosen = count(shift), shift
    return chosen


def axis_of(turn: np.ndarray) -> np.ndarray:
    """The axis of a rotation, (3,), of length 1; 0 of none."""
    _, vectors = np.linalg.eigh(turn + turn.T)
    axis = vectors[:, -1]
    off = np.array([turn[2, 1] - turn[1, 2], turn[0, 2] - turn[2, 0], turn[1, 0] - turn[0, 1]])
    return np.where(np.abs(axis) < SAME, 0.0, axis * (-1.0 if off @ axis < 0.0 else 1.0))
