"""Compiled models from a source, a file or MJCF text: all of it, without geoms, or without some of its joints.

Textures and meshes are nearly all of a robot's memory (252 MB of one quadruped, 22 kB without), and every copy copies them:
what is only drawn is left out, and geoms where nothing can touch.

Joints are taken out of an MjSpec. A joint that is only deleted stays at its reference. At another position the body's frame must
be turned about the joint's anchor, or moved along its axis; the joints that come before it in the same body act before it and
must be turned and moved back. A free joint is first replaced by three slides and a ball. No bodies are fused (fusestatic gives
wrong inertias up to MuJoCo 3.10) and nothing is printed as XML (which has seven digits).
"""

import os
import warnings
from collections.abc import Callable, Mapping
from pathlib import Path

import mujoco
import numpy as np

from .names import aligns, joint_name, kind_of, parts_of, rotors

BY_GEOMS = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_TRUE
BY_QUATERNION = mujoco.mjtOrientation.mjORIENTATION_QUAT
WRAPPED = mujoco.mjtWrap.mjWRAP_SPHERE, mujoco.mjtWrap.mjWRAP_CYLINDER
INERTIAL = "mass", "inertia", "ipos", "iquat"
MOVING_FIELDS = (
    "body_",
    "dof_",
    "jnt_",
    "tendon_",
    "eq_",
    "actuator_",
)  # beginnings of fields that may change a motion
CONTACT_FIELDS = "body_margin", "dof_length"  # of these those that decide contacts and which bodies sleep
NO_DEFAULTS = {  # of a joint that is added: a class of the file may have others
    "ref": 0.0,
    "springref": 0.0,
    "springdamper": np.zeros(2),
    "limited": mujoco.mjtLimited.mjLIMITED_FALSE,
    "range": np.zeros(2),
}


class ModelError(ValueError):
    """A file that cannot be compared; the message is one line."""

    def __str__(self):
        return " ".join(super().__str__().split())


def name_of(source: Path | str | None) -> str:
    """A source in a message: a Path, MJCF text, or None for a compiled model."""
    return str(source) if isinstance(source, Path) else "the model" if source is None else "the text"


def editable(source: Path | str) -> mujoco.MjSpec:
    """The MjSpec of a file (a Path) or of MJCF text."""
    return (
        mujoco.MjSpec.from_file(os.fsencode(source)) if isinstance(source, Path) else mujoco.MjSpec.from_string(source)
    )


def editable_again(source: Path | str) -> mujoco.MjSpec:
    """The MjSpec, without the warnings of MuJoCo's compiler, which the first reading has."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return editable(source)


def compiled(source: Path | str, compiling: Callable[[], mujoco.MjModel]) -> tuple[mujoco.MjModel, tuple[str, ...]]:
    """What `compiling` returns and the warnings of MuJoCo's compiler, one line each; ModelError if it fails."""
    text = text_of(source) if isinstance(source, Path) else source
    if not text.strip():
        raise ModelError(f"{name_of(source)} is empty; expected MJCF")
    lines, before = [], mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(lines.append)
    try:
        with warnings.catch_warnings(record=True) as caught:
            warnings.simplefilter("always")
            model = compiling()
    except ValueError as error:
        if "<mujoco" not in text:
            raise ModelError(f"{name_of(source)} is not MJCF: {error}") from None
        raise ModelError(f"MuJoCo cannot compile {name_of(source)}: {error}") from None
    finally:
        mujoco.set_mju_user_warning(before)
    lines += [warning.message for warning in caught]
    return model, tuple(dict.fromkeys(" ".join(str(line).split()) for line in lines))


def text_of(path: Path) -> str:
    """The text of a file; ModelError if it cannot be read twice."""
    if path.exists() and not (path.is_file() or path.is_dir()):
        raise ModelError(f"{path} is not a regular file; expected an MJCF file")
    try:
        return path.read_text(encoding="utf-8", errors="replace")
    except OSError as error:
        raise ModelError(f"cannot read {path}: {error.strerror}; expected an MJCF file") from None


def without_visuals(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The spec without what is only drawn; when compiled it has every body of the file.

    A medium pushes geoms that touch nothing: there they stay.
    """
    for body in spec.bodies[1:]:
        if mujoco.mjtInertiaFromGeom(body.compiler.inertiafromgeom) == BY_GEOMS and body.geoms:
            # the inertia is that of its geoms, whatever the file states
            body.explicitinertial, body.ipos, body.mass = False, np.full(3, np.nan), 0.0
    for compiler in (spec.compiler, *(body.compiler for body in spec.bodies)):
        if mujoco.mjtInertiaFromGeom(compiler.inertiafromgeom) == BY_GEOMS:
            compiler.inertiafromgeom = mujoco.mjtInertiaFromGeom.mjINERTIAFROMGEOM_AUTO  # discardvisual demands it
    spec.compiler.fusestatic = False  # fused bodies would only be renumbered
    spec.compiler.discardvisual = not (spec.option.density or spec.option.viscosity)
    return spec


def without_geoms(spec: mujoco.MjSpec) -> mujoco.MjSpec:
    """The spec without what only contacts, sensors and pictures need; the inertia of every body stays, to the last bit.

    Geoms stay that a tendon wraps around, and those of a free body whose frame the compiler turns into its inertial frame.
    """
    without_visuals(spec).compiler.discardvisual = True
    for element in (*spec.sensors, *spec.pairs, *spec.excludes, *spec.tuples, *spec.skins):
        spec.delete(element)
    wrapped = {wrap.target.name for tendon in spec.tendons for wrap in tendon.path if wrap.type in WRAPPED}

    def delete_geoms(bodies):
        for geom in [geom for body in bodies for geom in body.geoms if not geom.name or geom.name not in wrapped]:
            spec.delete(geom)

    bodies = [body for body in spec.bodies if not any(map(aligns, body.joints))]
    keeps_mass = spec.compiler.settotalmass <= 0.0
    if keeps_mass:  # geoms take no part in an inertia that the file states
        delete_geoms([body for body in bodies if body.explicitinertial or body.name == "world"])
    if any(body.geoms for body in bodies[1:]) or not keeps_mass:
        whole = spec.compile()
        for body in bodies[1:]:
            body.explicitinertial, body.fullinertia, body.ialt.type = True, np.full(6, np.nan), BY_QUATERNION
            for name in INERTIAL:
                setattr(body, name, getattr(whole, f"body_{name}")[body.id].copy())
        spec.compiler.settotalmass = -1.0
        delete_geoms(bodies)
    used = {name for geom in spec.geoms for name in (geom.meshname, geom.hfieldname)}
    for asset in (*spec.meshes, *spec.hfields):
        if asset.name not in used:
            spec.delete(asset)
    return spec


def moves_the_same(first: mujoco.MjModel, second: mujoco.MjModel) -> bool:
    """Whether two models have the same numbers, to the last bit, in all that decides a motion without contacts."""
    names = [name for name in dir(first) if name.startswith(MOVING_FIELDS) and name not in CONTACT_FIELDS]
    pairs = [(np.asarray(getattr(first, name)), np.asarray(getattr(second, name))) for name in names]
    return all(np.array_equal(a, b) for a, b in pairs if a.dtype.kind == "f")


def locked_model(source: Path | str | None, positions: Mapping, bare: bool = False) -> mujoco.MjModel:
    """The compiled model without the joints named in `positions`, {name: rad, m or quaternion}, see names.joint_places.

    Every body keeps its number. Keyframes and sensors are deleted, and the actuators and equalities of a locked joint; bare:
    all tendons and equalities, and all actuators except those with armature. ModelError if anything else refers to a locked
    joint, or there is no source.
    """
    names = ", ".join(positions)
    if source is None:
        raise ModelError(f"cannot lock {names}: the model was changed after it was read")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # the compiler's, of the file as it is
            return compiled_without(editable(source), positions, bare)
    except ValueError as error:
        raise ModelError(f"MuJoCo cannot compile {name_of(source)} with locked joints {names}: {error}") from None


def compiled_without(spec: mujoco.MjSpec, positions: Mapping, bare: bool) -> mujoco.MjModel:
    spec = without_geoms(spec) if bare else without_visuals(spec)
    whole = with_names(spec)  # anchors, axes and frames as they are after defaults, degrees and nested frames
    free = [joint_name(whole, j) for j in range(whole.njnt) if kind_of(whole, j) == "free"]
    parted = {name: parts_of(name) for name in free if set(parts_of(name)) & set(positions)}
    clear(spec, {*positions, *parted}, bare)
    keep_springs(spec, whole)
    rests, elements = {}, {joint.name: joint for joint in spec.joints}
    for name, parts in parted.items():
        rests |= split_free_joint(spec, whole, elements[name], parts)
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
                back = turn * [1.0, -1.0, -1.0, -1.0]
                frame = placed(*frame, anchor - turned(anchor, turn)), product(frame[1], turn)
                moved = [(name, anchor + turned(pos - anchor, back), turned(axis, back)) for name, pos, axis in moved]
            elif shift is not None:
                frame = placed(*frame, shift), frame[1]
                moved = [(name, pos - shift, axis) for name, pos, axis in moved]
        if body.frame is not None:
            body.set_frame(body.parent.add_frame())  # what was a nested frame's part is in the compiled numbers
        body.alt.type = BY_QUATERNION
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
    """Delete keyframes, sensors, and what refers to a locked joint."""
    gone = [*spec.keys, *spec.sensors]
    gone += [e for e in spec.equalities if bare or {e.name1, e.name2} & locked]
    gone += [a for a in spec.actuators if a.target in locked or (bare and not a.armature)]
    gone += [*spec.tendons, *spec.tuples] if bare else []
    for element in gone:
        spec.delete(element)


def keep_springs(spec: mujoco.MjSpec, whole: mujoco.MjModel) -> None:
    """Keep the stiffness and damping that the compiler chose by the inertia of the whole model (springdamper)."""
    for joint in spec.joints:
        if np.any(joint.springdamper):
            chosen = whole.joint(joint.name)
            for name, value in (("stiffness", chosen.stiffness[0]), ("damping", chosen.damping[0])):
                stated = getattr(joint, name)
                setattr(joint, name, [value, *np.atleast_1d(stated)[1:]] if np.ndim(stated) else value)
            joint.springdamper = np.zeros(2)


def split_free_joint(spec: mujoco.MjSpec, whole: mujoco.MjModel, free, parts: list[str]) -> dict:
    """Replace a free joint by three slides and a ball; returns the rest positions of their springs by name."""
    name, old = free.name, whole.joint(free.name)
    body, start = free.parent, old.qposadr[0]
    if aligns(free):
        raise ValueError(
            f"free joint {name!r} is aligned with the inertia of its body: none of its parts can be locked"
        )
    values = {field: getattr(free, field) for field in ("damping", "armature", "stiffness")}
    values = {field: np.array(value) if np.ndim(value) else value for field, value in values.items()}
    values["armature"] += rotors(whole)[old.dofadr[0]]  # of actuators, which are gone
    if body.frame is not None:
        body.set_frame(body.parent.add_frame())
    body.alt.type = BY_QUATERNION
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
    """A point of a frame in the coordinates in which the frame is given."""
    return origin + turned(point, quat)


def turned(vector: np.ndarray, quat: np.ndarray) -> np.ndarray:
    result = np.zeros(3)
    mujoco.mju_rotVecQuat(result, vector, quat)
    return result


def product(first: np.ndarray, second: np.ndarray) -> np.ndarray:
    result = np.zeros(4)
    mujoco.mju_mulQuat(result, first, second)
    return result
