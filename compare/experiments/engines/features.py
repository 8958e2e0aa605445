"""Why an engine has another number: MuJoCo reads the file without a feature of it, and then has the engine's number.

A feature is one record: its name, and what is done to MuJoCo's specification of the file so that it is not
there. All are tried for all engines. One is a cause of an entry if MuJoCo has the engine's number without it,
with it does not, and no other entry of that quantity that it changes was read as MuJoCo reads it.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

from ...engines import Array, EngineRecord
from ...engines.mujoco import read
from ...engines.mujoco.locked import without_visuals
from ...engines.mujoco.names import bit
from ...engines.mujoco.source import ModelError, Source
from ...engines.outside.bodies import Numbers, numbers_of, size_of
from ...engines.outside.file import File
from ...engines.outside.model import Reading
from ...judge.scale import FACTOR

Spec = Any  # an MjSpec; its elements have what their classes state
OTHERS = "keys", "tendons", "equalities", "excludes", "pairs", "sensors"  # that refer to bodies and joints
PASSIVE = "damping", "armature", "stiffness"
IDENTITY = (1.0, 0.0, 0.0, 0.0)


def put(elements: Iterator[Any] | Sequence[Any], **values: Any) -> None:
    for element in elements:
        for name, value in values.items():
            setattr(element, name, value)


def zero(elements: Iterator[Any] | Sequence[Any], *names: str) -> None:
    """Set fields to 0, which are numbers or arrays."""
    for element in elements:
        for name in names:
            value = getattr(element, name)
            setattr(element, name, np.zeros_like(value) if np.ndim(value) else 0.0)


def full(geoms: Sequence[Any]) -> None:
    for geom in geoms:
        geom.typeinertia = type(geom.typeinertia)(0)


def without_flag_gravity(spec: Spec) -> None:
    spec.option.disableflags &= ~bit("GRAVITY")


def class_values(elements: Sequence[Any], kind: str, field: str, default: Any) -> None:
    """The default in place of what classes state for a field of elements."""
    for element in elements:
        stated = getattr(getattr(element.classname, kind), field)
        if np.array_equal(getattr(element, field), stated):
            setattr(element, field, default)


def classes_of_joints(spec: Spec) -> None:
    """What a class has of the outermost one is lost, as if the class had no <joint> of its own."""
    outermost = spec.default.joint
    for field in ("axis", "pos", *PASSIVE):
        for joint in [joint for joint in spec.joints if joint.classname.name != spec.default.name]:
            stated = [getattr(of, field) for of in (joint.classname.joint, outermost, joint)]
            if all(np.array_equal(value, stated[0]) for value in stated):
                zero([joint], field)
                put([joint] * (field == "axis"), axis=(0.0, 0.0, 1.0))


def undriven_armature(spec: Spec) -> None:
    driven = set()
    for actuator in spec.actuators:
        is_position = actuator.biastype.name == "mjBIAS_AFFINE" and actuator.biasprm[1]
        if actuator.biastype.name == "mjBIAS_NONE" or is_position:
            driven.add(actuator.target)
    put([joint for joint in spec.joints if joint.name not in driven], armature=0.0)


def several(spec: Spec) -> Iterator[list[Any]]:
    return (list(body.joints) for body in spec.bodies if len(body.joints) > 1)


def place_first_on_carrier(spec: Spec) -> None:
    """All joints of a body but the last are where they were if the body were placed after them."""
    for body in spec.bodies:
        for joint in list(body.joints)[:-1]:
            turn = Rotation.from_quat(np.roll(body.quat, -1))
            joint.pos = turn.inv().apply(np.subtract(joint.pos, body.pos))


def place_later_at_origin(spec: Spec) -> None:
    for joints in several(spec):
        put(joints[1:], pos=(0.0, 0.0, 0.0))


def delete_bodies(spec: Spec, is_lost: Callable[[Any], bool]) -> None:
    while lost := [body for body in spec.bodies if body.parent and is_lost(body)]:
        spec.delete(lost[0])


def frames(spec: Spec) -> None:
    delete_bodies(spec, lambda body: body.frame is not None)
    for kind in ("joints", "geoms"):
        for element in [element for element in getattr(spec, kind) if element.frame is not None]:
            spec.delete(element)


def other_roots(spec: Spec) -> None:
    for body in list(spec.worldbody.bodies)[1:]:
        spec.delete(body)


def fixed_roots(spec: Spec) -> None:
    put([body for body in spec.worldbody.bodies if not body.joints], pos=(0, 0, 0), quat=IDENTITY)


# what a file may state, and a spec as if it did not
FEATURES: Mapping[str, Callable[[Spec], None]] = {
    "gravity of <option>": lambda spec: put([spec.option], gravity=(0.0, 0.0, -9.81)),
    "flag that disables gravity": without_flag_gravity,
    "settotalmass of <compiler>": lambda spec: put([spec.compiler], settotalmass=-1.0),
    "boundmass and boundinertia of <compiler>": lambda spec: put([spec.compiler], boundmass=0.0, boundinertia=0.0),
    "inertiagrouprange of <compiler>": lambda spec: put([spec.compiler], inertiagrouprange=(0, 5)),
    "shellinertia of geoms": lambda spec: full(spec.geoms),
    "mass of geoms in default classes": lambda spec: class_values(spec.geoms, "geom", "mass", np.nan),
    "density of geoms in default classes": lambda spec: class_values(spec.geoms, "geom", "density", 1000.0),
    "geoms that touch nothing": lambda spec: put(
        [geom for geom in spec.geoms if not (geom.contype or geom.conaffinity)], mass=0.0),
    "pos of joints in default classes": lambda spec: class_values(spec.joints, "joint", "pos", np.zeros(3)),
    "classes around one without <joint>": classes_of_joints,
    "damping, armature and stiffness of free joints": lambda spec: zero(
        [joint for joint in spec.joints if joint.type.name == "mjJNT_FREE"], *PASSIVE),
    "springdamper of joints": lambda spec: zero(spec.joints, "springdamper"),
    "stiffness of joints": lambda spec: zero(spec.joints, "stiffness"),
    "damping of joints": lambda spec: zero(spec.joints, "damping"),
    "armature of actuators": lambda spec: zero([a for a in spec.actuators if hasattr(a, "armature")], "armature"),
    "armature of joints that no motor or position actuator drives": undriven_armature,
    "armature of joints": lambda spec: zero(spec.joints, "armature"),
    "pose of a body for all of its joints but the last": place_first_on_carrier,
    "pos of the joints of a body but that of the first": place_later_at_origin,
    "ref of joints that share a body": lambda spec: put([joint for joints in several(spec) for joint in joints], ref=0.0),
    "pose of bodies on the world without a joint": fixed_roots,
    "<frame> and <replicate>, with all that is in them": frames,
    "bodies on the world but the first": other_roots,
}  # fmt: skip


class Entry(NamedTuple):
    """An entry of a number that an engine has read differently."""

    number: str
    place: int  # in all numbers as one row


def causes_of(
    record: EngineRecord, file: File, reading: Reading, entries: Sequence[Entry]
) -> dict[Entry, str]:
    """The features without which MuJoCo has the engine's number, by entries; each is tried beside those that were found."""
    found, causes = list[str](), dict[Entry, str]()
    for _ in range(2):  # a feature may explain only beside one that is found after it
        for name in FEATURES:
            still_open = [entry for entry in entries if entry not in causes]
            if not still_open or name in found:
                continue
            numbers = numbers_without(file, [*found, name])
            fitting = [entry for entry in still_open if fits(reading, numbers, record.eps, entry)]
            if fitting:
                causes |= dict.fromkeys(fitting, name)
                found.append(name)
    return causes


def feature_of_speeds(file: File, speeds: int) -> str | None:
    """The feature without which MuJoCo has this number of speeds, or None."""
    for name in FEATURES:
        try:
            if without(file, [name]).nv == speeds:
                return name
        except ValueError:
            continue
    return None


def without(file: File, names: Sequence[str]) -> Any:
    """MuJoCo's model of the file without features; ValueError if there is none."""
    stated = Source(file.path, file.floating).spec
    spec = without_visuals(stated)
    for kind in OTHERS:
        for element in list(getattr(spec, kind)):
            spec.delete(element)
    for name in names:
        FEATURES[name](spec)
    joints = {joint.name for joint in spec.joints}
    for actuator in [actuator for actuator in spec.actuators if actuator.target not in joints]:
        spec.delete(actuator)
    return spec.compile()


def numbers_without(file: File, names: Sequence[str]) -> Numbers:
    """numbers_of MuJoCo's model without features; none if it has other joints, or cannot be compiled."""
    try:
        tree = read(without(file, names)).tree
    except (ValueError, ModelError):
        return {}
    is_same = (tree.joint_names, tree.kind) == (file.names, file.kinds)
    return numbers_of(tree) if is_same else {}


def fits(reading: Reading, numbers: Numbers, eps: float, entry: Entry) -> bool:
    """Whether an entry of MuJoCo's changed model is what was read, and none that it changes was read as stated."""
    if entry.number not in numbers:
        return False
    read, stated, changed = reading.read[entry.number], reading.stated[entry.number], numbers[entry.number]
    bar = FACTOR * eps * max(size_of(numbers, entry.number), size_of(reading.stated, entry.number))
    distances: Sequence[Array] = (changed - read, changed - stated, read - stated)
    from_read, from_stated, is_wrong = (np.ravel(np.abs(distance) > bar) for distance in distances)
    is_other = not from_read[entry.place] and from_stated[entry.place]
    return bool(is_other and not (from_stated & ~is_wrong).any())
