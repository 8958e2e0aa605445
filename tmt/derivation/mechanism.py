"""The numbers of a tree of joints and bodies, as the method takes them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

from .coordinates import Coordinates, coordinates_of
from .vectors import IDENTITY, Matrix, Scalar, Scalars, Vector, rotation, rotation_of

UNIT = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
Names = tuple[str, ...]
Indices = tuple[int, ...]
Numbers = tuple[float, ...]
Rows = tuple[Numbers, ...]


@dataclass(frozen=True, match_args=False)
class Mechanism:
    """The fields of `tmt.Tree`, which says what they are, in any type of number and unchecked."""

    joint_names: Names
    parent: Indices
    offset: Rows
    axis: Rows
    damping: Numbers
    body_names: Names
    body_joint: Indices
    mass: Numbers
    com: Rows
    inertia: tuple[Rows, ...]
    gravity: Numbers
    kind: Names
    armature: Numbers
    stiffness: Numbers
    rest: Numbers
    reference: Numbers
    position_gain: Rows
    speed_gain: Rows
    site_names: Names
    site_joint: Indices
    site_offset: Rows
    site_rotation: tuple[Rows, ...]

    @property
    def coordinates(self) -> Coordinates:
        return coordinates_of(self.kind)

    @property
    def zero(self) -> Numbers:
        """The reference position, (nq,): every frame is parallel to the inertial frame."""
        position: Numbers = ()
        for kind, reference in zip(self.kind, self.reference):
            position += (1.0, 0.0, 0.0, 0.0) if kind == "ball" else (reference,)
        return position

    @property
    def has_springs(self) -> bool:
        return any(self.stiffness)

    @property
    def has_gains(self) -> bool:
        return bool(self.position_gain or self.speed_gain)

    def site_of(self, name: str) -> Site:
        """The site of that name, or the frame of the joint of that body; ValueError if there is neither."""
        if name in self.site_names:
            k = self.site_names.index(name)
            return Site(self.site_joint[k], self.site_offset[k], self.site_rotation[k])
        if name not in self.body_names:
            known = dict.fromkeys([*self.site_names, *self.body_names])
            raise ValueError(f"there is no site or body {name!r}; the model has {', '.join(known)}")
        return Site(self.body_joint[self.body_names.index(name)], (0.0,) * 3, UNIT)

    def path(self, joint: int) -> list[int]:
        joints = []
        while joint >= 0:
            joints.append(joint)
            joint = self.parent[joint]
        return joints

    def moves(self, body: int) -> list[bool]:
        path = self.path(self.body_joint[body])
        return [joint in path for joint in range(len(self.parent))]


class Site(NamedTuple):
    joint: int
    offset: Sequence[Scalar]  # of its origin, in the frame of the joint, m
    rotation: Sequence[Sequence[Scalar]]  # its axes as columns, in the frame of the joint


def origin_in_parent(tree: Mechanism, i: int, q: Scalars) -> Vector:
    """Origin of joint i's frame in its parent's, at the position q of the tree (nq,)."""
    joint, offset = tree.coordinates.joints[i], Vector(*tree.offset[i])
    if joint.kind != "slide":
        return offset
    return offset + Vector(*tree.axis[joint.qd.start]) * (q[joint.q.start] - tree.reference[i])


def rotation_in_parent(tree: Mechanism, i: int, q: Scalars) -> Matrix:
    """Turn of joint i's frame in its parent's, which takes components in it to those in the parent's."""
    joint = tree.coordinates.joints[i]
    if joint.kind == "slide":
        return IDENTITY
    if joint.kind == "ball":
        axes = Matrix(tree.axis[joint.qd])
        return axes.transposed @ rotation_of(q[joint.q]) @ axes
    return rotation(tree.axis[joint.qd.start], q[joint.q.start] - tree.reference[i])
