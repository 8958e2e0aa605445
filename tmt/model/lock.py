"""A Tree with some joints locked."""

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from tmt.derivation.vectors import IDENTITY, ZERO, Matrix, Vector, rotation, turn_of
from tmt.model.values import numbers_of, shown

CLOSE_TO_ONE = 1e-6  # how far the length of a quaternion may be from 1


def locked(tree, angles: Mapping):
    """What Tree.lock says."""
    names, joints = tree.joint_names, tree.coordinates.joints
    if not isinstance(angles, Mapping):
        raise ValueError(
            f"lock is given {shown(angles)}; a dict of angles in rad by the names of hinges is expected"
        )
    if unknown := [name for name in angles if name not in names]:
        raise ValueError(f"there is no hinge {shown(unknown[0])} to lock; the hinges are {', '.join(names)}")
    if len(angles) == len(names):
        raise ValueError(f"all hinges ({', '.join(names)}) are locked; at least one must be free")
    if not angles:
        return tree
    held = {name: _position(tree.kind[names.index(name)], value) for name, value in angles.items()}
    free = [i for i, name in enumerate(names) if name not in held]

    # of each joint's frame: the free joint that carries it now, and where it is in the frame of that one
    frames = []

    def frame(joint):
        return frames[joint] if joint >= 0 else (-1, ZERO, IDENTITY)

    for i, name in enumerate(names):
        carrier, origin, turn = frame(tree.parent[i])
        if i in free:
            frames.append((free.index(i), ZERO, turn))
        else:
            shift, turned = _placed(tree, i, held[name])
            frames.append((carrier, _moved(origin, turn, shift), turn if turned is None else turn @ turned))

    _refuse_fed_back(tree, held, free)
    before = {i: frame(tree.parent[i]) for i in free}
    carried = [frame(joint) for joint in tree.body_joint]
    at = [k for i in free for k in range(*joints[i].q.indices(len(tree.rest)))]
    by = [(i, k) for i in free for k in range(*joints[i].qd.indices(len(tree.axis)))]
    return replace(
        tree,
        joint_names=[names[i] for i in free],
        parent=[before[i][0] for i in free],
        offset=[tuple(_moved(*before[i][1:], tree.offset[i])) for i in free],
        axis=[tuple(_moved(ZERO, before[i][2], tree.axis[k])) for i, k in by],
        damping=[tree.damping[k] for _, k in by],
        body_joint=[carrier for carrier, _, _ in carried],
        com=[tuple(_moved(origin, turn, com)) for com, (_, origin, turn) in zip(tree.com, carried)],
        inertia=[_turned(turn, inertia) for inertia, (_, _, turn) in zip(tree.inertia, carried)],
        kind=[tree.kind[i] for i in free],
        armature=[tree.armature[k] for _, k in by],
        stiffness=[tree.stiffness[i] for i in free],
        rest=[tree.rest[k] for k in at],
        reference=[tree.reference[i] for i in free],
        position_gain=_gains_of_free(tree.position_gain, by),
        speed_gain=_gains_of_free(tree.speed_gain, by),
    )


def _gains_of_free(gain, by) -> list:
    """The rows and columns of a controller's gain at the speeds of the free joints."""
    return [[gain[k][l] for _, l in by] for _, k in by] if gain else []


def _refuse_fed_back(tree, held, free):
    """Raise ValueError if the position of a locked joint makes a torque at a free one: a Tree has no place for it."""
    names, joints = tree.joint_names, tree.coordinates.joints
    for name, position in held.items() if tree.position_gain else ():
        l = joints[names.index(name)].qd.start
        for i in free:
            if position and any(
                tree.position_gain[k][l] for k in range(*joints[i].qd.indices(len(tree.axis)))
            ):
                raise ValueError(
                    f"{name!r} cannot be locked at {shown(position)}: its position makes a torque at {names[i]!r} "
                    "(position_gain); a joint that is fed back to itself alone, or 0, is expected"
                )


def _placed(tree, i, position):
    """Where joint i at a position puts the frame that it carries, in the parent's frame: origin, and turn if there is one."""
    joint = tree.coordinates.joints[i]
    if joint.kind == "ball":
        own = Matrix(tree.axis[joint.qd]).transposed
        return tree.offset[i], own @ turn_of(position) @ own.transposed if any(position[1:]) else None
    off, axis = position - tree.reference[i], tree.axis[joint.qd.start]
    if joint.kind == "slide" and off:
        return Vector(*tree.offset[i]) + Vector(*axis) * off, None
    return tree.offset[i], rotation(axis, off) if off and joint.kind == "hinge" else None


def _moved(origin, turn, point):
    """A point of a frame in the axes and from the origin of the one that carries it."""
    return origin + (turn @ Vector(*point) if turn is not IDENTITY else Vector(*point))


def _turned(turn, inertia):
    """A tensor in the axes of the frame that carries it, symmetric."""
    if turn is IDENTITY:
        return inertia
    tensor = np.array([list(row) for row in turn @ Matrix(inertia) @ turn.transposed])
    return (tensor + tensor.T) / 2.0


def _position(kind, value):
    """A position that is given for one joint: a float, or a quaternion."""
    (position,) = numbers_of("lock", [value], (1, 4) if kind == "ball" else (1,))
    if kind == "ball" and abs(math.hypot(*position) - 1.0) > CLOSE_TO_ONE:
        raise ValueError(f"lock is given {shown(value)}; a quaternion of length 1 is expected")
    return position
