"""A Tree with some joints locked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeVar

import numpy as np

from tmt.derivation.mechanism import Mechanism, origin_in_parent, rotation_in_parent
from tmt.derivation.vectors import IDENTITY, ZERO, Matrix, Vector

from .checks import check_quaternion
from .values import CLOSE_TO_ONE as CLOSE_TO_ONE
from .values import numbers_of, require, shown

Value = TypeVar("Value")


class Carrier(NamedTuple):
    """What carries a frame: a free joint of the new tree, and where the frame is in that joint's frame."""

    joint: int
    origin: Vector
    rotation: Matrix

    def point(self, point: Sequence[float]) -> tuple[float, float, float]:
        """A point of the frame, in the axes and from the origin of the free joint's."""
        turned = Vector(*point)
        if self.rotation is not IDENTITY:
            turned = self.rotation @ turned
        x, y, z = self.origin + turned
        return x, y, z

    def direction(self, direction: Sequence[float]) -> tuple[float, float, float]:
        return self._replace(origin=ZERO).point(direction)

    def tensor(self, tensor: Sequence[Sequence[float]]) -> Any:
        if self.rotation is IDENTITY:
            return tensor
        turned = np.array([list(row) for row in self.rotation @ Matrix(tensor) @ self.rotation.transposed])
        return (turned + turned.T) / 2.0

    def turned(self, axes: Sequence[Sequence[float]]) -> Any:
        return tuple(tuple(row) for row in self.rotation @ Matrix(axes))

    def onward(self, origin: Vector, rotation: Matrix) -> Carrier:
        turned = self.rotation if rotation is IDENTITY else self.rotation @ rotation
        return Carrier(self.joint, Vector(*self.point(tuple(origin))), turned)


WORLD = Carrier(-1, ZERO, IDENTITY)


def locked(tree: Mechanism, angles: Mapping[str, Any]) -> dict[str, Any]:
    """The fields that differ in the tree without the joints that are named in `angles`, see Tree.lock."""
    names, joints = tree.joint_names, tree.coordinates.joints
    require(isinstance(angles, Mapping), "angles", angles, "a dict of positions by the names of joints is")
    if unknown := [name for name in angles if name not in names]:
        raise ValueError(f"there is no joint {shown(unknown[0])} to lock; the joints are {', '.join(names)}")
    if len(angles) == len(names):
        raise ValueError(f"all joints ({', '.join(names)}) are locked; at least one must be free")
    if not angles:
        return {}
    q = list(tree.zero)
    for name, value in angles.items():
        joint = joints[names.index(name)]
        q[joint.q] = _position(joint.kind, value)
    free = [i for i, name in enumerate(names) if name not in angles]
    speeds = [k for i in free for k in joints[i].speeds]
    _refuse_fed_back(tree, angles.keys(), q)

    before: list[Carrier] = []  # of the frame of the joint before each
    frames: list[Carrier] = []  # of its own
    for i in range(len(names)):
        before.append(frames[tree.parent[i]] if tree.parent[i] >= 0 else WORLD)
        if i in free:
            frames.append(Carrier(free.index(i), ZERO, before[i].rotation))
        else:
            frames.append(before[i].onward(*_fixed(tree, i, q)))
    carried = [frames[joint] if joint >= 0 else WORLD for joint in tree.body_joint]
    of_sites = [frames[joint] if joint >= 0 else WORLD for joint in tree.site_joint]
    fields = {
        name: chosen(getattr(tree, name), free) for name in ("joint_names", "kind", "stiffness", "reference")
    }
    fields |= {name: chosen(getattr(tree, name), speeds) for name in ("damping", "armature")}
    for name in ("position_gain", "speed_gain"):
        fields[name] = tuple(chosen(row, speeds) for row in chosen(getattr(tree, name), speeds))
    return fields | {
        "parent": tuple(before[i].joint for i in free),
        "offset": tuple(before[i].point(tree.offset[i]) for i in free),
        "axis": tuple(before[i].direction(tree.axis[k]) for i in free for k in joints[i].speeds),
        "body_joint": tuple(carrier.joint for carrier in carried),
        "com": tuple(carrier.point(com) for carrier, com in zip(carried, tree.com)),
        "inertia": tuple(carrier.tensor(inertia) for carrier, inertia in zip(carried, tree.inertia)),
        "rest": tuple(value for i in free for value in tree.rest[joints[i].q]),
        "site_joint": tuple(carrier.joint for carrier in of_sites),
        "site_offset": tuple(carrier.point(offset) for carrier, offset in zip(of_sites, tree.site_offset)),
        "site_rotation": tuple(
            carrier.turned(rotation) for carrier, rotation in zip(of_sites, tree.site_rotation)
        ),
    }


def chosen(values: Sequence[Value], places: Sequence[int]) -> tuple[Value, ...]:
    return tuple(values[i] for i in places) if values else ()


def _refuse_fed_back(tree: Mechanism, locked_names: Any, q: Sequence[float]) -> None:
    """Raise ValueError if a locked joint's position makes a torque at a free one: no Tree has that."""
    joints = dict(zip(tree.joint_names, tree.coordinates.joints))
    for name in locked_names if tree.position_gain else ():
        position = q[joints[name].q.start]
        for other, joint in joints.items():
            gains = [tree.position_gain[k][joints[name].qd.start] for k in joint.speeds]
            if other not in locked_names and position and any(gains):
                torque = f"its position makes a torque at {other!r} (position_gain)"
                expected = "a joint that is fed back to itself alone, or 0, is expected"
                raise ValueError(f"{name!r} cannot be locked at {shown(position)}: {torque}; {expected}")


def _fixed(tree: Mechanism, i: int, q: Sequence[float]) -> tuple[Vector, Matrix]:
    joint = tree.coordinates.joints[i]
    if any(q[joint.q][1:]) if joint.kind == "ball" else q[joint.q.start] != tree.reference[i]:
        return origin_in_parent(tree, i, q), rotation_in_parent(tree, i, q)
    return Vector(*tree.offset[i]), IDENTITY


def _position(kind: str, value: Any) -> tuple[float, ...]:
    if kind != "ball":
        return numbers_of("lock", [value], (1,))
    (quaternion,) = numbers_of("lock", [value], (1, 4))
    check_quaternion("a locked position", quaternion)
    return quaternion
