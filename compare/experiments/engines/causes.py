"""Why an engine has read a number differently: what MuJoCo reads of the file without something that the engine leaves out.

A cause is named where MuJoCo's number of the changed text is the engine's, and no number of that kind speaks against it.
Rounding, and what no text states, are recognized by what was read. Each has a script in tests/engines/test_accusations.py.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from copy import deepcopy
from functools import lru_cache, partial
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.words import some_of
from ...engines import RECORDS, Array
from ...engines.mujoco import read
from ...engines.mujoco.names import joint_places
from ...engines.mujoco.source import ModelError, Source
from ...engines.outside.bodies import numbers_of, size_of
from ...engines.outside.file import File
from ...engines.outside.mjcf_text import whole_text
from ...engines.outside.model import Reading
from ...judge.scale import FACTOR

Element = ElementTree.Element
MASSES = "mass", "moments", "com", "com_moved", "inertia"
PLACES = "com", "com_moved", "inertia", "anchor", "anchor_moved", "axis", "axis_moved"
CLOSE, SINGLE = 1e-6, float(np.finfo(np.float32).eps)
# what MJCF has for a joint that states nothing
OF_JOINTS = {"axis": "0 0 1", "pos": "0 0 0", "damping": "0", "armature": "0", "stiffness": "0"}
POSE = "pos", "quat", "euler", "axisangle", "xyaxes", "zaxis"
KEPT = (
    "compiler",
    "option",
    "default",
    "worldbody",
    "actuator",
)  # sections that numbers of bodies and joints follow from
DRAWN = "material", "mesh", "hfield"  # attributes whose assets are left out


class Cause(NamedTuple):
    kind: str  # a case of the template's macro
    subject: str  # joints, bodies, classes or attributes

    def __str__(self) -> str:
        return f"{self.kind} {self.subject}"


class Text:
    """The text of a file, without what is drawn, and its classes; each loss changes a copy."""

    def __init__(self, root: Element) -> None:
        self.root = root
        self.classes: dict[str, tuple[Element, str | None]] = {}  # with the class around
        defaults = root.findall("default")
        self.outermost = next((default.get("class", "main") for default in defaults), "main")
        for default in defaults:
            self.add_class(default, self.outermost, None)

    def add_class(self, default: Element, name: str, around: str | None) -> None:
        self.classes[name] = default, around
        for inner in default.findall("default"):
            self.add_class(inner, inner.get("class", ""), name)

    def parts(self, *tags: str) -> Iterator[tuple[Element, str]]:
        """The elements of bodies with these tags, and their classes."""
        for world in self.root.findall("worldbody"):
            yield from self.parts_of(world, self.outermost, tags)

    def parts_of(self, body: Element, childclass: str, tags: Sequence[str]) -> Iterator[tuple[Element, str]]:
        childclass = body.get("childclass", childclass)
        for part in body:
            if part.tag in tags:
                yield part, part.get("class", childclass)
            yield from self.parts_of(part, childclass, tags)

    def around(self, name: str | None, tag: str) -> Iterator[tuple[str, Element | None]]:
        """A class and those around it, with what they state for a tag, or None."""
        while name in self.classes:
            default, outer = self.classes[name]
            yield name, default.find(tag)
            name = outer

    def stated(self, part: Element, of_class: str, attribute: str) -> tuple[str | None, str]:
        """An attribute of an element, and the class that states it, "": it does itself; None, "": nothing does."""
        if attribute in part.attrib:
            return part.attrib[attribute], ""
        for name, default in self.around(of_class, part.tag):
            if default is not None and attribute in default.attrib:
                return default.attrib[attribute], name
        return None, ""

    @property
    def roots(self) -> list[Element]:
        """The bodies on the world."""
        return [body for world in self.root.findall("worldbody") for body in world.findall("body")]


def take(text: Text, path: str, attributes: Sequence[str]) -> list[str]:
    """Delete attributes of elements."""
    return taken(text.root.findall(path), attributes)


def taken(elements: Sequence[Element], attributes: Sequence[str]) -> list[str]:
    """Deleted attributes: those that were there."""
    names = [name for name in attributes for element in elements if element.attrib.pop(name, None)]
    return list(dict.fromkeys(names))


def class_without_joint(text: Text) -> list[str]:
    """A class without <joint> hides those around it."""
    empty = []
    for joint, of_class in text.parts("joint"):
        hidden = [name for name, default in text.around(of_class, "joint") if default is None]
        for attribute, default in OF_JOINTS.items():
            _, stating = text.stated(joint, of_class, attribute)
            between = [name for name, _ in text.around(of_class, "joint")]
            passed = [name for name in hidden if stating and between.index(name) < between.index(stating)]
            if passed:
                joint.set(attribute, default)
                empty.append(passed[0])
    return empty


def joint_pos_of_class(text: Text) -> list[str]:
    stating = []
    for joint, of_class in text.parts("joint"):
        _, name = text.stated(joint, of_class, "pos")
        if name:
            joint.set("pos", "0 0 0")
            stating.append(name)
    return stating


def passive_of_free(text: Text) -> list[str]:
    """Damping and armature of free joints."""
    free = [
        joint for joint, of_class in text.parts("joint") if text.stated(joint, of_class, "type")[0] == "free"
    ]
    for joint in free:
        joint.attrib |= {"damping": "0", "armature": "0", "stiffness": "0"}
    return [joint.get("name", "") for joint in free]


def armature_without_motor(text: Text) -> list[str]:
    actuators = [*text.root.findall("actuator/motor"), *text.root.findall("actuator/position")]
    driven = {actuator.get("joint") for actuator in actuators}
    having = [
        joint
        for joint, of_class in text.parts("joint")
        if text.stated(joint, of_class, "armature")[0] not in (None, "0")
    ]
    idle = [joint for joint in having if joint.get("name") not in driven]
    for joint in idle:
        joint.set("armature", "0")
    return [joint.get("name", "") for joint in idle]


def geoms_without_contacts(text: Text) -> list[str]:
    bodies = []
    for body in text.root.iter("body"):
        for geom in body.findall("geom"):
            of_class = next(name for part, name in text.parts("geom") if part is geom)
            bits = [text.stated(geom, of_class, attribute)[0] for attribute in ("contype", "conaffinity")]
            if bits == ["0", "0"]:
                geom.set("mass", "0")
                bodies.append(body.get("name", ""))
    return bodies


def left_out(text: Text, tag: str) -> list[str]:
    """Elements with a tag and what is in them."""
    parents = [part for part in text.root.iter() if part.find(tag) is not None]
    for parent in parents:
        for part in parent.findall(tag):
            parent.remove(part)
    return [f"<{tag}>"] * bool(parents)


def other_roots(text: Text) -> list[str]:
    """The bodies on the world but the first."""
    first, *others = text.roots
    for world in text.root.findall("worldbody"):
        for body in world.findall("body"):
            if body is not first:
                world.remove(body)
    return [body.get("name", "") for body in others]


def fixed_root(text: Text) -> list[str]:
    """The pose of bodies on the world that have no joint."""
    fixed = [body for body in text.roots if not {part.tag for part in body} & {"joint", "freejoint"}]
    posed = [body for body in fixed if set(POSE) & body.attrib.keys()]
    taken(posed, POSE)
    return [body.get("name", "") for body in posed]


Loss = Callable[[Text], list[str]]
# of elements by their path, the attributes that are deleted
DELETED = {
    "option_gravity": ("option", "gravity"), "gravity_flag": ("option/flag", "gravity"),
    "total_mass": ("compiler", "settotalmass"), "bounds": ("compiler", "boundmass", "boundinertia"),
    "groups": ("compiler", "inertiagrouprange"),
    "geom_mass_of_class": (".//default/geom", "mass"), "shell_inertia": (".//geom", "shellinertia"),
    "armature_of_actuator": ("actuator/*", "armature"), "no_springs": (".//joint", "stiffness"),
}  # fmt: skip
LEFT_OUT = "frame", "replicate"
LOSSES: Mapping[str, Loss] = {
    **{loss.__name__: loss for loss in (class_without_joint, joint_pos_of_class, passive_of_free, armature_without_motor,
                                        geoms_without_contacts, fixed_root, other_roots)},
    **{kind: partial(take, path=path, attributes=attributes) for kind, (path, *attributes) in DELETED.items()},
    **{tag: partial(left_out, tag=tag) for tag in LEFT_OUT},
}  # fmt: skip


class Origin:
    """What the numbers of a file follow from: its text, and the model that MuJoCo compiles of it."""

    def __init__(self, file: File) -> None:
        self.file = file
        self.source = Source(file.path, file.floating)
        self.model = self.source.model
        self.places = joint_places(self.model)
        self.meshed = {name for name, are_meshes in self.source.mesh_geoms if any(are_meshes)}  # of bodies
        self.root = Element("mujoco")
        if file.path.suffix == ".urdf":
            return
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


def causes_of(engine: str, file: File, reading: Reading, entries: Sequence[Entry]) -> dict[Entry, Cause]:
    """The causes of entries, as far as one is known: losses, each with those that were found before, then what else is seen."""
    origin, causes = origin_of(file), dict[Entry, Cause]()
    if origin.root.find("worldbody") is not None:
        explain_by_losses(engine, origin, reading, entries, causes)
    finds = [SEEN[kind] for kind in OF_ENGINES.get(engine, ()) if kind in SEEN]
    for entry in [entry for entry in entries if entry not in causes]:
        subjects = {find.__name__: find(origin, reading, entry, entries) for find in finds}
        kind = next((kind for kind, subject in subjects.items() if subject), None)
        if kind:
            causes[entry] = Cause(kind, str(subjects[kind]))
    return causes


def losses_of(engine: str) -> list[str]:
    return [kind for kind in OF_ENGINES.get(engine, ()) if kind in LOSSES]


def explain_by_losses(
    engine: str, origin: Origin, reading: Reading, entries: Sequence[Entry], causes: dict[Entry, Cause]
) -> None:
    lost, is_new, eps = list[Loss](), True, RECORDS[engine].eps
    known = losses_of(engine)
    while is_new and len(causes) < len(entries):
        is_new = False
        for kind in known:
            if LOSSES[kind] in lost:
                continue
            changed, source = origin.without([*lost, LOSSES[kind]])
            numbers = numbers_without(origin, source)
            fitting = [
                entry for entry in entries if entry not in causes and fits(reading, numbers, eps, entry)
            ]
            if fitting:
                causes |= dict.fromkeys(fitting, Cause(kind, some_of(changed)))
                lost.append(LOSSES[kind])
                is_new = True


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
    # the text of meshes is rounded
    bar = max(FACTOR * eps * size_of(reading["stated"], number), CLOSE * np.abs(changed).max(initial=0.0))
    distances = changed - read, changed - stated, read - stated
    if number.startswith("anchor"):  # any point of the axis is one
        axis = numbers[number.replace("anchor", "axis")]
        distances = tuple(d - axis * (axis * d).sum(axis=1, keepdims=True) for d in distances)
    to_read, to_stated, is_wrong = (np.ravel(np.abs(distance) > bar) for distance in distances)
    return bool(not to_read[entry.place] and to_stated[entry.place] and not (to_stated & ~is_wrong).any())


def joints_lost(engine: str, file: File, speeds: int) -> Cause | None:
    """Why an engine has this number of speeds, or None."""
    origin = origin_of(file)
    for kind in losses_of(engine):
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
    stated = (
        {body.name for body in origin.source.spec.bodies if body.explicitinertial}
        if origin.source.spec
        else set()
    )
    return [name for name in entry.bodies if name in origin.meshed - stated]


def turned_start(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """Positions of a free body are turned about the place that the file gives it, by the turn that it has there."""
    model, root = (
        origin.model,
        origin.carriers(origin.file.names[entry.joint])[-1] if entry.number in PLACES else 0,
    )
    if not root or model.body_dofnum[root] != 6:
        return None
    turn, shift = Rotation.from_quat(np.roll(model.body_quat[root], -1)), model.body_pos[root]
    moved = turn.apply(shift) - shift
    read, stated = (reading[which]["com"][entry.joint] for which in ("read", "stated"))
    is_so = turn.magnitude() and np.allclose(read + moved, stated, atol=CLOSE)
    return origin.name(root) if is_so else None


def oblique_turn(origin: Origin, reading: Reading, entry: Entry, entries: Sequence[Entry]) -> str | None:
    """The axis of an axisangle is not of length 1."""
    for body in origin.root.iter("body"):
        axis = [float(x) for x in body.get("axisangle", "0 0 1 0").split()[:3]]
        carriers = map(origin.name, origin.carriers(origin.file.names[entry.joint]))
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
# what is known of each engine, in the order in which it is tried
OF_ENGINES: Mapping[str, Sequence[str]] = {
    "drake": ("class_without_joint", "no_springs", "armature_of_actuator", "passive_of_free", "armature_without_motor",
              "gravity_flag", "total_mass", "bounds", "groups", "shell_inertia", "frame", "replicate", FLOAT32,
              "mass_of_meshes", "several_joints"),
    "pinocchio": ("joint_pos_of_class", "armature_of_actuator", "option_gravity", "gravity_flag", "total_mass", "bounds",
                  "groups", "geom_mass_of_class", "geoms_without_contacts", "fixed_root", "frame", "other_roots",
                  "oblique_turn", "mass_of_meshes", "turned_start"),
    "newton": ("armature_of_actuator", "passive_of_free", "option_gravity", "total_mass", "shell_inertia", "replicate",
               "small_inertia", "mass_of_meshes", "several_joints"),
}  # fmt: skip
