"""Compiled models from a source, a file or MJCF text: all of it, or without some of its joints.

Textures and visual meshes are nearly all of a robot's memory (252 MB of one quadruped, 22 kB without), and every copy copies
them: what is only drawn is left out. No bodies are fused (fusestatic gives wrong inertias up to MuJoCo 3.10) and nothing is
printed as XML (which has seven digits).
"""

import warnings
from collections.abc import Mapping
from pathlib import Path

import mujoco
import numpy as np

from ...process.parts import is_pipe, named_by
from .names import aligns, joint_name, joint_places, kind_of, parts_of, rotors
from .urdf_file import advice, spec_of

FROM_GEOMS = int(mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE)
KINDS_OF_PARTS = [mujoco.mjtJoint.mjJNT_SLIDE] * 3 + [mujoco.mjtJoint.mjJNT_BALL]  # of a free joint


class ModelError(ValueError):
    """A file that cannot be compared; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def name_of(source: Path | str | None) -> str:
    """A source in a message: a Path, MJCF text, or None for a compiled model."""
    return str(source) if isinstance(source, Path) else "the model" if source is None else "the text"


def editable(source: Path | str) -> mujoco.MjSpec:
    """The MjSpec of a file (a Path) or of MJCF text."""
    if isinstance(source, Path):
        return spec_of(source)
    return mujoco.MjSpec.from_string(source)


def editable_again(source: Path | str) -> mujoco.MjSpec:
    """The MjSpec, without the warnings of MuJoCo's compiler, which the first reading has."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return editable(source)


def compiled(source: Path | str) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """The model without what is only drawn, and the warnings of MuJoCo's compiler, one line each; ModelError if it fails."""
    text = text_of(source) if isinstance(source, Path) else source
    if not text.strip():
        raise ModelError(f"{name_of(source)} is empty; expected MJCF or URDF")
    lines, before = [], mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lines.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model = without_visuals(editable(source)).compile()
        bytes(model.names).decode()
    except UnicodeDecodeError:
        raise ModelError(f"{name_of(source)} has names that are not UTF-8; save it as UTF-8") from None
    except ValueError as error:
        is_model = "<mujoco" in text or "<robot" in text
        problem = f"MuJoCo cannot compile {name_of(source)}" if is_model else f"{name_of(source)} is not MJCF"
        raise ModelError(f"{problem}: {error}{advice(str(error))}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    lines += [warning.message for warning in caught]
    return model, tuple(dict.fromkeys(" ".join(str(line).split()) for line in lines))


def text_of(path: Path) -> str:
    for part in filter(is_pipe, named_by(path)):  # MuJoCo would wait for it
        raise ModelError(f"{part} is a pipe or a device; expected a regular file")
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ModelError(f"cannot read {path}: {error.strerror}; expected an MJCF or URDF file") from None


def without_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The spec without what is only drawn; when compiled it has every body of the file.

    A medium pushes geoms that touch nothing, and they may have the mass: there they stay.
    """
    has_mass = any(body.compiler.inertiafromgeom == FROM_GEOMS for body in spec.bodies)
    spec.compiler.fusestatic = False  # fused bodies would only be renumbered
    spec.compiler.discardvisual = not (spec.option.density or spec.option.viscosity or has_mass)
    return spec


def locked_model(source: Path | str | None, positions: Mapping, bare: bool = False) -> mujoco.MjModel:
    """The compiled model without the joints named in `positions`, {name: rad, m or quaternion}, see names.joint_places.

    Every body keeps its number. Keyframes and sensors are deleted, and the actuators and equalities of a locked joint; bare:
    all tendons, equalities and geoms without mass, and all actuators except those with armature. ModelError if anything else
    refers to a locked joint, or there is no source.
    """
    names = ", ".join(positions)
    if source is None:
        raise ModelError(f"cannot lock {names}: the model was changed after it was read")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the compiler's, of the file as it is
            return compiled_without(without_visuals(editable(source)), positions, bare)
    except ValueError as error:
        raise ModelError(
            f"MuJoCo cannot compile {name_of(source)} with locked joints {names}: {error}"
        ) from None


def compiled_without(spec: mujoco.MjSpec, positions: Mapping, bare: bool) -> mujoco.MjModel:
    """The model whose bodies and other joints are placed as mj_kinematics places them with the joints locked."""
    whole = spec.compile()
    data, places = mujoco.MjData(whole), joint_places(whole)
    data.qpos[:] = whole.qpos0
    for name, place in places.items():
        if name in positions or kind_of(whole, place.joint) == "free":
            data.qpos[place.qpos] = positions.get(name, (1.0, 0.0, 0.0, 0.0) if place.kind == "ball" else 0.0)
    mujoco.mj_kinematics(whole, data)
    for joint in spec.joints:
        joint.name = joint_name(whole, joint.id)
    numbers = {joint.name: joint.id for joint in spec.joints}  # a change of the spec takes them away
    # a free joint goes as a whole, and the parts that stay are added
    gone = {joint_name(whole, places[name].joint) for name in positions}
    for body, number in [
        (body, body.id) for body in spec.bodies if {joint.name for joint in body.joints} & gone
    ]:
        axes = data.xmat[number].reshape(3, 3)
        parent, quat = whole.body_parentid[number], np.zeros(4)
        mujoco.mju_mulQuat(quat, data.xquat[parent] * [1.0, -1.0, -1.0, -1.0], data.xquat[number])
        body.set_frame(body.parent.add_frame())
        body.alt.type = mujoco.mjtOrientation.mjORIENTATION_QUAT
        body.pos, body.quat = (data.xpos[number] - data.xpos[parent]) @ data.xmat[parent].reshape(3, 3), quat
        for joint in list(body.joints):
            i = numbers[joint.name]
            if joint.name not in gone:
                joint.set_frame(body.add_frame())
                joint.pos, joint.axis = (data.xanchor[i] - data.xpos[number]) @ axes, data.xaxis[i] @ axes
            elif kind_of(whole, i) == "free":
                add_parts(
                    body, joint, whole, whole.jnt_dofadr[i], set(parts_of(joint.name)) - set(positions), axes
                )
    clear(spec, gone, bare)
    model = spec.compile()
    for name, place in joint_places(
        model
    ).items():  # of springdamper the compiler chooses both by the inertia
        before = places[name]
        model.qpos_spring[place.qpos] = whole.qpos_spring[before.qpos]
        model.dof_damping[place.dofs] = whole.dof_damping[before.dofs]
        model.jnt_stiffness[place.joint] = whole.jnt_stiffness[before.joint]
    return model


def add_parts(
    body: mujoco.MjsBody, free, whole: mujoco.MjModel, dof: int, names: set[str], axes: np.ndarray
) -> None:
    """Add slides and a ball that a free joint consists of. dof: its first speed; axes: of the body, as columns."""
    if aligns(free):
        why = "is aligned with the inertia of its body: none of its parts can be locked"
        raise ValueError(f"free joint {free.name!r} {why}")
    armature = float(whole.dof_armature[dof] + rotors(whole)[dof])  # of actuators too, which are deleted
    no_defaults = {"ref": 0.0, "springdamper": np.zeros(2), "limited": mujoco.mjtLimited.mjLIMITED_FALSE}
    for name, kind, axis in zip(parts_of(free.name), KINDS_OF_PARTS, [*axes, axes[2]]):
        if name in names:
            body.add_joint(name=name, type=kind, axis=axis, pos=np.zeros(3), armature=armature, **no_defaults)


def clear(spec: mujoco.MjSpec, gone: set[str], bare: bool) -> None:
    """Delete what refers to joints of these names, then the joints: the other way round MuJoCo crashes."""
    elements = [*spec.keys, *spec.sensors]
    elements += [e for e in spec.equalities if bare or {e.name1, e.name2} & gone]
    elements += [a for a in spec.actuators if a.target in gone or (bare and not a.armature)]
    if bare:
        elements += [*spec.tendons, *spec.tuples, *spec.pairs]
        stated = [
            body
            for body in spec.bodies
            if body.explicitinertial and body.compiler.inertiafromgeom != FROM_GEOMS
        ]
        elements += [geom for body in stated for geom in body.geoms]
    for element in (*elements, *[joint for joint in spec.joints if joint.name in gone]):
        spec.delete(element)
    used = {name for geom in spec.geoms for name in (geom.meshname, geom.hfieldname)}
    for asset in [asset for asset in (*spec.meshes, *spec.hfields) if bare and asset.name not in used]:
        spec.delete(asset)
