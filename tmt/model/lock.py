"""A Tree with some joints locked."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any, NamedTuple

from tmt.derivation.mechanism import Mechanism, origin_in_parent, rotation_in_parent
from tmt.derivation.vectors import IDENTITY, ZERO, Matrix, Vector

from .checks import check_quaternion
from .values import CLOSE_TO_ONE as CLOSE_TO_ONE
from .values import numbers_of, require, shown


class Carrier(NamedTuple):
    """What carries a frame: a free joint of the new tree, and where the frame is in that joint's frame."""

    joint: int
    origin: Vector
    rotation: Matrix

    def point(self, point: Iterable[float]) -> tuple[float, ...]:
        return tuple(self.origin + self.rotation @ Vector(*point))

    def direction(self, direction: Iterable[float]) -> tuple[float, ...]:
        return tuple(self.rotation @ Vector(*direction))

    def axes(self, axes: Sequence[Sequence[float]]) -> Any:
        return tuple(map(tuple, self.rotation @ Matrix(axes)))

    def tensor(self, tensor: Sequence[Sequence[float]]) -> Any:
        turned = self.rotation @ Matrix(tensor) @ self.rotation.transposed
        halves = [(row + column) * 0.5 for row, column in zip(turned, turned.transposed)]
        return tuple(map(tuple, halves))


WORLD = Carrier(-1, ZERO, IDENTITY)


def locked(tree: Mechanism, angles: Mapping[str, Any]) -> dict[str, Any]:
    """The fields that differ in the tree without the joints that are named in `angles`, see Tree.lock."""
    names, joints = tree.joint_names, tree.coordinates.joints
    require(isinstance(angles, Mapping), "angles", angles, "a dict of positions by the names of joints is")
    if unknown := [name for name in angles if name not in names]:
        raise ValueError(f"there is no joint {shown(unknown[0])} to lock; the joints are {', '.join(names)}")
    if len(angles) == len(names):
        raise ValueError(f"all joints ({', '.join(names)}) are locked; at least one must be free")
    q = list(tree.zero)
    for name, value in angles.items():
        joint = joints[names.index(name)]
        shape = (1, 4) if joint.kind == "ball" else (1, 1)
        (q[joint.q],) = numbers_of("lock", [value] if joint.kind == "ball" else [[value]], shape)
        if joint.kind == "ball":
            check_quaternion("a locked position", tuple(q[joint.q]))
    free = [i for i, name in enumerate(names) if name not in angles]
    speeds = [k for i in free for k in joints[i].speeds]
    refuse_fed_back(tree, free, q)
    before: list[Carrier] = []  # of the frame of the joint before each
    frames: list[Carrier] = []  # of its own
    for i, joint in enumerate(joints):
        before.append(frames[tree.parent[i]] if tree.parent[i] >= 0 else WORLD)
        if i in free:
            frames.append(Carrier(free.index(i), ZERO, before[i].rotation))
            continue
        moves = any(q[joint.q][1:]) if joint.kind == "ball" else q[joint.q.start] != tree.reference[i]
        turn = rotation_in_parent(tree, i, q) if moves else IDENTITY  # which rounds nothing
        origin = Vector(*before[i].point(origin_in_parent(tree, i, q)))
        frames.append(Carrier(before[i].joint, origin, before[i].rotation @ turn))
    of_bodies, of_sites = (
        [frames[i] if i >= 0 else WORLD for i in x] for x in (tree.body_joint, tree.site_joint)
    )
    fields: dict[str, Any] = {
        "parent": [before[i].joint for i in free],
        "offset": [before[i].point(tree.offset[i]) for i in free],
        "axis": [before[i].direction(tree.axis[k]) for i in free for k in joints[i].speeds],
        "body_joint": [carrier.joint for carrier in of_bodies],
        "com": [carrier.point(com) for carrier, com in zip(of_bodies, tree.com)],
        "inertia": [carrier.tensor(inertia) for carrier, inertia in zip(of_bodies, tree.inertia)],
        "rest": [value for i in free for value in tree.rest[joints[i].q]],
        "site_joint": [carrier.joint for carrier in of_sites],
        "site_offset": [carrier.point(offset) for carrier, offset in zip(of_sites, tree.site_offset)],
        "site_rotation": [carrier.axes(axes) for carrier, axes in zip(of_sites, tree.site_rotation)],
    }
    for name in ("joint_names", "kind", "stiffness", "reference"):
        fields[name] = [getattr(tree, name)[i] for i in free]
    for name in ("damping", "armature"):
        fields[name] = [getattr(tree, name)[k] for k in speeds]
    for name in ("position_gain", "speed_gain"):
        gain = getattr(tree, name)
        fields[name] = [[gain[i][k] for k in speeds] for i in speeds] if gain else ()
    return fields


def refuse_fed_back(tree: Mechanism, free: Sequence[int], q: Sequence[float]) -> None:
    """Raise ValueError if a locked joint's position makes a torque at a free one: no Tree has that."""
    joints, names = tree.coordinates.joints, tree.joint_names
    for i, joint in enumerate(joints):
        if i in free or not tree.position_gain or not q[joint.q.start]:
            continue
        for other in free:
            if any(tree.position_gain[k][joint.qd.start] for k in joints[other].speeds):
                torque = f"its position makes a torque at {names[other]!r} (position_gain)"
                expected = "a joint that is fed back to itself alone, or 0, is expected"
                raise ValueError(f"{names[i]!r} cannot be locked at {q[joint.q.start]}: {torque}; {expected}")
