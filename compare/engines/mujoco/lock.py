"""A model with fewer joints: the file is read again as an MjSpec, and its joints are taken out there.

A joint that is only deleted stays at its reference. At another position the body's frame must be turned about the joint's
anchor, or moved along its axis, and the joints that come before it in the same body turned and moved back, for they act before
it. A free joint becomes three slides and a ball before. Nothing is fused (fusestatic gives
wrong inertias up to MuJoCo 3.10) and nothing is printed as XML (which has seven digits).
"""

import os
import warnings
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from .joints import joint_name, kind_of, parts_of
from .rotors import rotors

NO_DEFAULTS = {  # of a joint that is added: a class of the file may have others
    "ref": 0.0,
    "springref": 0.0,
    "springdamper": np.zeros(2),
    "limited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "range": np.zeros(2),
}
ALIGNED, BY_COMPILER = mujoco.mjtAlignFree.mjALIGNFREE_TRUE, mujoco.mjtAlignFree.mjALIGNFREE_AUTO


class ModelError(ValueError):
    """A file that cannot be compared; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def name_of(source: Path | str | None) -> str:
    """What a message calls a source, a Path or MJCF text; None: a compiled model."""
    return str(source) if isinstance(source, Path) else "the model" if source is None else "the text"


def editable(source: Path | str) -> mujoco.MjSpec:
    """The editable form of a file (a Path) or of MJCF text."""
    return (
        mujoco.MjSpec.from_file(os.fsencode(source)) if isinstance(source, Path) else mujoco.MjSpec.from_string(source)
    )


def editable_again(source: Path | str) -> mujoco.MjSpec:
    """The same, without the warnings of MuJoCo's compiler, which the first reading has."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return editable(source)


def locked_model(source: Path | str | None, positions: Mapping, bare: bool = False) -> mujoco.MjModel:
    """The compiled model without the joints that are with_names in `positions`, {name: rad, m or quaternion}.

    Names are those of joints.places; every body keeps its number. Keyframes and sensors go, and so do the actuators and
    equalities of a locked joint; bare: all tendons and equalities, and all actuators but those with armature. ModelError if
    more refers to it, or there is no source.
    """
    names = ", ".join(positions)
    if source is None:
        raise ModelError(f"a model that was changed after it was read cannot have {names} locked")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the compiler's, of the file as it is
            return compiled_without(editable(source), positions, bare)
    except ValueError as error:
        raise ModelError(f"MuJoCo cannot compile {name_of(source)} with {names} locked: {error}") from None


def compiled_without(spec: mujoco.MjSpec, positions: Mapping, bare: bool) -> mujoco.MjModel:
    """The model of a spec whose joints at these positions have been taken out."""
    spec.compiler.fusestatic = False
    whole = with_names(spec)  # anchors, axes and frames as they are after defaults, degrees and nested frames
    parted = {name: parts_of(name) for name in free_joints(whole) if set(parts_of(name)) & set(positions)}
    clear(spec, {*positions, *parted}, bare)
    keep_springs(spec, whole)
    rests, elements = {}, {joint.name: joint for joint in spec.joints}
    for name, parts in parted.items():
        rests |= part(spec, whole, elements[name], parts)
    if parted:
        whole = spec.compile()
    for body in spec.bodies:
        elements = {joint.name: joint for joint in body.joints}
        joints = [whole.joint(name) for name in elements]
        if not {joint.name for joint in joints} & set(positions):
            continue
        number = joints[0].bodyid[0]
        frame = whole.body_pos[number].copy(), whole.body_quat[number].copy()
        moved = []  # anchor and axis of the joints that stay, those before a locked one moved by it
        for joint in joints:
            if joint.name not in positions:
                moved.append((joint.name, joint.pos.copy(), joint.axis.copy()))
                continue
            anchor, shift, turn = movement(whole, joint, positions[joint.name])
            if turn is not None:
                back = conjugate(turn)
                frame = placed(*frame, anchor - turned(anchor, turn)), product(frame[1], turn)
                moved = [(name, anchor + turned(pos - anchor, back), turned(axis, back)) for name, pos, axis in moved]
            elif shift is not None:
                frame = placed(*frame, shift), frame[1]
                moved = [(name, pos - shift, axis) for name, pos, axis in moved]
        if body.frame is not None:
            body.set_frame(body.parent.add_frame())  # what was a nested frame's part is in the compiled numbers
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        body.pos, body.quat = frame
        for name, pos, axis in moved:
            joint = elements[name]
            if joint.frame is not None:
                joint.set_frame(body.add_frame())
            joint.pos, joint.axis = pos, axis
        for joint in joints:
            if joint.name in positions:
                spec.delete(elements[joint.name])
    model = spec.compile()
    for name, rest in rests.items():
        if name not in positions:
            start = model.joint(name).qposadr[0]
            model.qpos_spring[start : start + len(rest)] = rest
    return model


def with_names(spec: mujoco.MjSpec) -> mujoco.MjModel:
    """The compiled model of a spec, in which every joint is given the name that the project calls it by."""
    whole = spec.compile()
    other = [(joint, joint_name(whole, joint.id)) for joint in spec.joints if joint.name != joint_name(whole, joint.id)]
    for joint, name in other:
        for actuator in spec.actuators:
            actuator.target = name if joint.name and actuator.target == joint.name else actuator.target
        joint.name = name
    return spec.compile() if other else whole


def clear(spec: mujoco.MjSpec, locked: set, bare: bool) -> None:
    """Delete what has a number for every joint, measures, or refers to a locked joint."""
    gone = [*spec.keys, *spec.sensors]  # sensors measure, and change nothing
    gone += [e for e in spec.equalities if bare or {e.name1, e.name2} & locked]
    gone += [a for a in spec.actuators if a.target in locked or (bare and not a.armature)]
    gone += [*spec.tendons, *spec.tuples] if bare else []
    for element in gone:
        spec.delete(element)


def keep_springs(spec: mujoco.MjSpec, whole: mujoco.MjModel) -> None:
    """Give joints whose springs and dampers the compiler chooses by the inertia the numbers that it chose for the whole model."""
    for joint in spec.joints:
        if np.any(joint.springdamper):
            known = whole.joint(joint.name)
            for name, value in (("stiffness", known.stiffness[0]), ("damping", known.damping[0])):
                given = getattr(joint, name)
                setattr(joint, name, [value, *np.atleast_1d(given)[1:]] if np.ndim(given) else value)
            joint.springdamper = np.zeros(2)


def free_joints(model: mujoco.MjModel) -> list[str]:
    return [joint_name(model, j) for j in range(model.njnt) if kind_of(model, j) == "free"]


def part(spec: mujoco.MjSpec, whole: mujoco.MjModel, free, parts: list[str]) -> dict:
    """Put three slides and a ball in the place of a free joint; where their springs rest, by their names."""
    name, old = free.name, whole.joint(free.name)
    body, start = free.parent, old.qposadr[0]
    if aligns(free):
        raise ValueError(
            f"free joint {name!r} is aligned with the inertia of its body; none of its parts can be locked"
        )
    values = {field: getattr(free, field) for field in ("damping", "armature", "stiffness")}
    values = {field: np.array(value) if np.ndim(value) else value for field, value in values.items()}
    values["armature"] += rotors(whole)[old.dofadr[0]]  # of actuators, which are gone
    if body.frame is not None:
        body.set_frame(body.parent.add_frame())
    body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
    body.pos, body.quat = np.zeros(3), [1.0, 0.0, 0.0, 0.0]
    spec.delete(free)
    kinds = [mujoco.mjtJoint.mjJNT_SLIDE] * 3 + [mujoco.mjtJoint.mjJNT_BALL]
    for part, kind, axis in zip(parts, kinds, [*np.eye(3), np.eye(3)[2]]):
        body.add_joint(name=part, type=kind, axis=axis, pos=np.zeros(3), **NO_DEFAULTS, **values)
    rest = whole.qpos_spring[start : start + 7]
    return dict(zip(parts, (rest[0:1], rest[1:2], rest[2:3], rest[3:7])))


def movement(whole: mujoco.MjModel, joint, position) -> tuple:
    """What a joint at a position does to its body's frame, in that frame: anchor, shift along the axis or None, turn or None."""
    if kind_of(whole, joint.id) == "ball":
        return joint.pos, None, np.array(position, float)
    off = position - float(whole.qpos0[joint.qposadr[0]])
    if not off:
        return joint.pos, None, None
    if kind_of(whole, joint.id) == "slide":
        return joint.pos, joint.axis * off, None
    turn = np.zeros(4)
    mujoco.mju_axisAngle2Quat(turn, joint.axis, off)
    return joint.pos, None, turn


def placed(origin: np.ndarray, quat: np.ndarray, point: np.ndarray) -> np.ndarray:
    """A point of a frame, where that frame is described."""
    return origin + turned(point, quat)


def turned(vector: np.ndarray, quat: np.ndarray) -> np.ndarray:
    """A vector turned by a quaternion."""
    result = np.zeros(3)
    mujoco.mju_rotVecQuat(result, vector, quat)
    return result


def product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    """The product of two quaternions."""
    result = np.zeros(4)
    mujoco.mju_mulQuat(result, first, second)
    return result


def conjugate(quat: np.ndarray) -> np.ndarray:
    """The inverse of a quaternion of length 1."""
    result = np.zeros(4)
    mujoco.mju_negQuat(result, quat)
    return result


def aligns(joint) -> bool:
    """Whether the compiler turns the frame of a free joint's body into its inertial frame."""
    if mujoco.mjtJoint(joint.type) != mujoco.mjtJoint.mjJNT_FREE:
        return False
    align = mujoco.mjtAlignFree(joint.align)
    return align == ALIGNED or (align == BY_COMPILER and bool(joint.compiler.alignfree))
