"""A model with fewer joints: the file is read again as an MjSpec, and its joints are taken out there.

A joint that is only deleted stays at zero. At another angle the body's frame must be turned about the joint's anchor,
and the joints that come before it in the same body turned back, for they act before it. Nothing is fused (fusestatic
gives wrong inertias up to MuJoCo 3.10) and nothing is printed as XML (which has seven digits).
"""

import os
import warnings
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np


class ModelError(ValueError):
    """A file that cannot be compared; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def name_of(source: Path | str) -> str:
    """What a message calls a source, a Path or MJCF text."""
    return str(source) if isinstance(source, Path) else "the text"


def editable(source: Path | str) -> mujoco.MjSpec:
    """The editable form of a file (a Path) or of MJCF text."""
    return (
        mujoco.MjSpec.from_file(os.fsencode(source)) if isinstance(source, Path) else mujoco.MjSpec.from_string(source)
    )


def locked_model(source: Path | str | None, angles: dict) -> mujoco.MjModel:
    """The compiled model without the joints that are named in `angles`, {name: rad}; every body keeps its number.

    Keyframes and sensors go, and so do the actuators and equalities of a locked joint. ModelError if more refers to it, or
    there is no source.
    """
    if source is None:
        raise ModelError(f"a model that was changed after it was read cannot have {', '.join(angles)} locked")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the compiler's, of the file as it is
            return compiled_without(editable(source), angles)
    except ValueError as error:
        raise ModelError(f"MuJoCo cannot compile {name_of(source)} with {', '.join(angles)} locked: {error}") from None


def compiled_without(spec: mujoco.MjSpec, angles: Mapping[str, float]) -> mujoco.MjModel:
    """The model of a spec whose joints at these angles have been taken out."""
    spec.compiler.fusestatic = False
    whole = spec.compile()  # anchors, axes and frames as they are after defaults, degrees and nested frames
    bound = [a for a in spec.actuators if a.target in angles]
    bound += list(spec.sensors)  # they measure, and change nothing
    bound += [e for e in spec.equalities if {e.name1, e.name2} & set(angles)]
    for element in (*spec.keys, *bound):  # a keyframe has an angle for every hinge
        spec.delete(element)
    for number, body in enumerate(spec.bodies):
        joints = [whole.joint(joint.name) for joint in body.joints]
        if not {joint.name for joint in joints} & set(angles):
            continue
        frame = whole.body_pos[number].copy(), whole.body_quat[number].copy()
        moved = []  # anchor and axis of the joints that stay, those before a locked one moved by it
        for joint in joints:
            if joint.name not in angles:
                moved.append((joint.name, joint.pos.copy(), joint.axis.copy()))
                continue
            angle = angles[joint.name] - float(whole.qpos0[joint.qposadr[0]])
            if angle:
                turn, back = np.zeros((2, 4))
                mujoco.mju_axisAngle2Quat(turn, joint.axis, angle)
                mujoco.mju_negQuat(back, turn)
                frame = placed(*frame, joint.pos - turned(joint.pos, turn)), product(frame[1], turn)
                moved = [
                    (name, joint.pos + turned(pos - joint.pos, back), turned(axis, back)) for name, pos, axis in moved
                ]
        if body.frame is not None:
            body.set_frame(body.parent.add_frame())  # what was a nested frame's part is in the compiled numbers
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        body.pos, body.quat = frame
        for name, pos, axis in moved:
            joint = spec.joint(name)
            if joint.frame is not None:
                joint.set_frame(body.add_frame())
            joint.pos, joint.axis = pos, axis
        for joint in joints:
            if joint.name in angles:
                spec.delete(spec.joint(joint.name))
    return spec.compile()


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
