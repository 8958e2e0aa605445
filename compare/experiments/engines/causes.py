"""Why an engine has read a number differently: what MuJoCo reads of the file without something that the engine leaves out.

A cause is named where MuJoCo's number of the changed text is the engine's, and no number of that kind speaks against it.
Rounding, and what no text states, are recognized by what was read. Each has a script in tests/engines/test_accusations.py.
"""

from collections.abc import Mapping, Sequence
from contextlib import suppress
from copy import deepcopy
from functools import lru_cache
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.words import some_of
from ...engines import Array, EngineRecord
from ...engines.mujoco import read
from ...engines.mujoco.names import joint_places
from ...engines.mujoco.source import ModelError, Source
from ...engines.outside.bodies import numbers_of, size_of
from ...engines.outside.file import File, Unread
from ...engines.outside.mjcf_text import whole_text
from ...engines.outside.model import Reading
from ...judge.scale import FACTOR
from .losses import LOSSES, Loss, Text, taken

MASSES = "mass", "moments", "com", "com_moved", "inertia"
PLACES = "com", "com_moved", "inertia", "anchor", "anchor_moved", "axis", "axis_moved"
CLOSE, SINGLE = 1e-6, float(np.finfo(np.float32).eps)
# sections that numbers of bodies and joints follow from, and attributes whose assets are left out
KEPT = "compiler", "option", "default", "worldbody", "actuator"
DRAWN = "material", "mesh", "hfield"


class Cause(NamedTuple):
    kind: str  # a case of the template's macro
    subject: str  # joints, bodies, classes or attributes

    def __str__(self) -> str:
        return f"{self.kind} {self.subject}"


class Origin:
    """What the numbers of a file follow from: its text, and the model that MuJoCo compiles of it."""

    def __init__(self, file: File) -> None:
        self.file = file
        self.source = Source(file.path, file.floating)
        self.model = self.source.model
        self.places = joint_places(self.model)
        self.meshed = {name for name, are_meshes in self.source.mesh_geoms if any(are_meshes)}  # of bodies
        self.root = ElementTree.Element("mujoco")
        with suppress(Unread, OSError):  # a file that is not all in its text
            if file.path.suffix != ".urdf":
                self.root = ElementTree.fromstring(whole_text(file.path))
        for section in [part for part in self.root if part.tag not in KEPT]:
            self.root.remove(section)
        for part in list(self.root.iter()):
            taken([part], DRAWN)
            for shown in [child for child in part if child.tag in ("light", "camera")]:
                part.remove(shown)

    def without(self, losses: Sequence[Loss]) -> tuple[list[str], Source | None]:
        """What the last loss changes, after the others, and the source of the changed text; None: MuJoCo makes no model of it."""
        text, changed = Text(deepcopy(self.root)), list[str]()
        for loss in losses:
            changed = list(dict.fromkeys(filter(None, loss(text))))
        joints = {joint.get("name") for joint, _ in text.parts("joint")}
        for section in text.root.findall("actuator"):
            for actuator in [actuator for actuator in section if actuator.get("joint") not in joints]:
                section.remove(actuator)
        try:
            return changed, Source(ElementTree.tostring(text.root, encoding="unicode")) if changed else None
        except ModelError:
            return changed, None

    def carriers(self, joint: str) -> list[int]:
        """The bodies from that of a joint of the Tree to the last one before the world."""
        body, carriers = int(self.model.jnt_bodyid[self.places[joint].joint]), []
        while body:
            carriers.append(body)
            body = int(self.model.body_parentid[body])
        return carriers

    def name(self, body: int) -> str:
        return str(self.model.body(body).name) or f"body {body}"


@lru_cache(maxsize=4)
def origin_of(file: File) -> Origin:
    return Origin(file)


class Entry(NamedTuple):
    """An entry of a number that an engine has read differently."""

    number: str
    place: int  # in all numbers as one row
    joint: int  # of the Tree, to whose row it belongs
    bodies: tuple[str, ...]  # that move with that joint


Causes = dict[Entry, Cause]


def causes_of(record: EngineRecord, file: File, reading: Reading, entries: Sequence[Entry]) -> Causes:
    """The causes of entries, as far as one is known: losses of the text, then what else is seen."""
    origin = origin_of(file)
    causes = explained_by_losses(record, origin, reading, entries)
    finds = [SEEN[kind] for kind in OF_ENGINES.get(record.label, ()) if kind in SEEN]
    for entry in [entry for entry in entries if entry not in causes]:
        for find in finds:
            subject = find(origin, reading, entry, entries)
            if subject and entry not in causes:
                causes[entry] = Cause(find.__name__, subject)
    return causes


def losses_of(record: EngineRecord, origin: Origin) -> list[str]:
    """The kinds of what an engine leaves out of a text; none of a URDF."""
    kinds = OF_ENGINES.get(record.label, ()) if origin.root.find("worldbody") is not None else ()
    return [kind for kind in kinds if kind in LOSSES]


def explained_by_losses(
    record: EngineRecord, origin: Origin, reading: Reading, entries: Sequence[Entry]
) -> Causes:
    """Of each loss, with those that explain others, the entries that it explains; until none explains more."""
    causes, lost, untried = Causes(), list[Loss](), losses_of(record, origin) if entries else []
    while untried:
        kind = untried.pop(0)
        changed, source = origin.without([*lost, LOSSES[kind]])
        numbers = numbers_without(origin, source)
        open_entries = [entry for entry in entries if entry not in causes]
        fitting = [entry for entry in open_entries if fits(reading, numbers, record.eps, entry)]
        if fitting:
            causes |= dict.fromkeys(fitting, Cause(kind, some_of(changed)))
            lost.append(LOSSES[kind])
            untried = [kind for kind in losses_of(record, origin) if LOSSES[kind] not in lost]
    return causes


def numbers_without(origin: Origin, source: Source | None) -> Mapping[str, Array]:
    """numbers_of a changed text; none if it has other joints."""
    try:
        tree = read(source).tree if source else None
    except ModelError:
        tree = None
    if tree is None or (tree.joint_names, tree.kind) != (origin.file.names, origin.file.kinds):
        return {}
    return numbers_of(tree)


def fits(reading: Reading, numbers: Mapping[str, Array], eps: float, entry: Entry) -> bool:
    """Whether an entry of a changed text is what was read, and no entry that it changes was read as stated."""
    if not numbers:
        return False
    number = entry.number
    read, stated, changed = reading["read"][number], reading["stated"][number], numbers[number]
    bar = FACTOR * eps * max(size_of(numbers, number), size_of(reading["stated"], number))
    distances = changed - read, changed - stated, read - stated
    if number.startswith("anchor"):  # any point of the axis is one
        axis = numbers[number.replace("anchor", "axis")]
        distances = tuple(d - axis * (axis * d).sum(axis=1, keepdims=True) for d in distances)
    to_read, to_stated, is_wrong = (np.ravel(np.abs(distance) > bar) for distance in distances)
    return bool(not to_read[entry.place] and to_stated[entry.place] and not (to_stated & ~is_wrong).any())


def joints_lost(record: EngineRecord, file: File, speeds: int) -> Cause | None:
    """Why an engine has this number of speeds, or None."""
    origin = origin_of(file)
    for kind in losses_of(record, origin):
        changed, source = origin.without([LOSSES[kind]])
        if changed and (source.model.nv if source else 0) == speeds:
            return Cause(kind, some_of(changed))
    return None


def float32_meshes(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """A difference of the size of the rounding of vertices, which MuJoCo keeps in single precision."""
    read, stated = (np.ravel(reading[which][entry.number])[entry.place] for which in ("read", "stated"))
    is_small = abs(read - stated) <= FACTOR * SINGLE * size_of(reading["stated"], entry.number)
    return some_of(meshed_bodies(origin, entry)) if is_small and entry.number in MASSES else None


def small_inertia(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """All moments of a joint's bodies are larger by the same amount: some inertias were raised to a floor."""
    if entry.number != "moments":
        return None
    read, stated = (reading[which]["moments"][entry.joint] for which in ("read", "stated"))
    raised = read - stated
    is_even = np.ptp(raised) <= 1e-4 * raised.max(initial=0.0)
    return some_of(entry.bodies) if is_even and raised.min() > 0.0 else None


def mass_of_meshes(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """The bodies have their mass of meshes; a copy has MuJoCo's inertia in their place."""
    meshed = meshed_bodies(origin, entry) if entry.number in MASSES and not reading["copied"] else ()
    return some_of(meshed) or None


def meshed_bodies(origin: Origin, entry: Entry) -> list[str]:
    """Those of an entry that have meshes and no <inertial> in the file."""
    spec = origin.source.spec
    stated = {body.name for body in spec.bodies if body.explicitinertial} if spec else set()
    return [name for name in entry.bodies if name in origin.meshed - stated]


def turned_start(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """Positions of a free body are turned about the place that the file gives it, by the turn that it has there."""
    if entry.number not in PLACES:
        return None
    model, root = origin.model, origin.carriers(origin.file.names[entry.joint])[-1]
    if model.body_dofnum[root] != 6:
        return None
    turn, shift = Rotation.from_quat(np.roll(model.body_quat[root], -1)), model.body_pos[root]
    moved = turn.apply(shift) - shift
    read, stated = (reading[which]["com"][entry.joint] for which in ("read", "stated"))
    is_so = turn.magnitude() and np.allclose(read + moved, stated, atol=CLOSE)
    return origin.name(root) if is_so else None


def oblique_turn(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """The axis of an axisangle is not of length 1."""
    for body in origin.root.iter("body") if entry.number in (*PLACES, "moments") else ():
        axis = [float(x) for x in body.get("axisangle", "0 0 1 0").split()[:3]]
        carriers = [origin.name(carrier) for carrier in origin.carriers(origin.file.names[entry.joint])]
        if abs(np.linalg.norm(axis) - 1.0) > CLOSE and body.get("name") in carriers:
            return str(body.get("name"))
    return None


def several_joints(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """All that is at another place is carried by a body with several joints."""
    several: dict[int, list[int]] = {}
    for joint in {other.joint for other in entries if other.number == entry.number}:
        bodies = origin.carriers(origin.file.names[joint])
        several[joint] = [body for body in bodies if origin.model.body_jntnum[body] > 1]
    if entry.number not in PLACES or not all(several.values()):
        return None
    return origin.name(several[entry.joint][0])


SEEN = {find.__name__: find for find in (
    float32_meshes, small_inertia, oblique_turn, mass_of_meshes, turned_start, several_joints,
)}  # fmt: skip
FLOAT32 = float32_meshes.__name__
# what is known of each engine, by its label, in the order in which it is tried
OF_ENGINES: Mapping[str, Sequence[str]] = {
    "Drake": (
        "class_without_joint", "no_springs", "springdamper", "armature_of_actuator", "passive_of_free",
        "armature_without_motor", "gravity_flag", "total_mass", "bounds", "groups", "shell_inertia", "frame", "replicate",
        FLOAT32, "mass_of_meshes", "several_joints",
    ),
    "Pinocchio": (
        "joint_pos_of_class", "armature_of_actuator", "option_gravity", "gravity_flag", "total_mass", "bounds", "groups",
        "geom_mass_of_class", "geoms_without_contacts", "fixed_root", "frame", "other_roots", "oblique_turn",
        "mass_of_meshes", "turned_start",
    ),
    "Newton": (
        "springdamper", "armature_of_actuator", "passive_of_free", "option_gravity", "total_mass", "shell_inertia",
        "replicate", "small_inertia", "mass_of_meshes", "several_joints",
    ),
}  # fmt: skip
