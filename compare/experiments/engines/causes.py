"""Why an engine has read a number differently: facts of the file that are known to be read otherwise, looked up for each number.

A cause is named only where the file has the fact at that joint or body, and the engine has read what follows from it. Each kind
has a script that shows it in tests/engines/test_accusations.py.
"""

from collections.abc import Callable, Sequence
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...core.words import some_of
from ...engines.mujoco.names import joint_places
from ...engines.mujoco.source import Source
from ...engines.outside.file import File
from ...engines.outside.mjcf_text import included
from ...engines.outside.model import Reading

OF_JOINTS = "armature", "damping", "stiffness", "axis"
PLACES = "com", "com_moved", "inertia", "anchor", "anchor_moved", "axis", "axis_moved"
MASSES = "mass", "moments", "com", "com_moved", "inertia"
CLOSE = 1e-6  # m
STANDARD = (0.0, 0.0, -9.81)


class Cause(NamedTuple):
    kind: str  # a macro of the template
    subject: str  # joint, body, class or attribute

    def __str__(self) -> str:
        return f"{self.kind} {self.subject}"


class Text:
    """An MJCF file as text: elements by their names, the classes of defaults; and its compiled model."""

    def __init__(self, file: File) -> None:
        source, path = Source(file.path, file.floating), file.path
        self.model = source.model
        self.meshed = {name for name, are_meshes in source.mesh_geoms if any(are_meshes)}  # of bodies
        self.places = joint_places(self.model)
        self.root = ElementTree.Element("mujoco")
        if path.suffix != ".urdf":
            self.root = included(ElementTree.parse(path).getroot(), path.parent)
        outermost = next((default.get("class", "main") for default in self.root.findall("default")), "main")
        self.classes: dict[str, tuple[ElementTree.Element, str | None]] = {}  # with the class around
        for default in self.root.findall("default"):
            self.add_class(default, outermost, None)
        self.class_of: dict[str, str] = {}  # of joints, by name
        for world in self.root.findall("worldbody"):
            self.add_joints(world, outermost)
        actuators = [*self.root.findall("actuator/motor"), *self.root.findall("actuator/position")]
        self.driven = {actuator.get("joint", "") for actuator in actuators}

    def add_class(self, default: ElementTree.Element, name: str, around: str | None) -> None:
        self.classes[name] = default, around
        for inner in default.findall("default"):
            self.add_class(inner, inner.get("class", ""), name)

    def add_joints(self, body: ElementTree.Element, childclass: str) -> None:
        childclass = body.get("childclass", childclass)
        for joint in body.findall("joint"):
            self.class_of[joint.get("name", "")] = joint.get("class", childclass)
        for child in body.findall("body"):
            self.add_joints(child, childclass)

    def passed_over(self, joint: str, attribute: str) -> str | None:
        """The class without a <joint> between a joint and the class around it that states the attribute; None: there is none."""
        name, empty = self.class_of.get(joint), None
        while name in self.classes:
            default, around = self.classes[name]
            stated = default.find("joint")
            if stated is not None and attribute in stated.attrib:
                return empty
            empty, name = name if stated is None else empty, around
        return None

    def carriers(self, joint: str) -> list[int]:
        """The bodies from that of a joint of the Tree to the last one before the world."""
        body, carriers = int(self.model.jnt_bodyid[self.places[joint].joint]), []
        while body:
            carriers.append(body)
            body = int(self.model.body_parentid[body])
        return carriers

    def turn(self, body: int) -> Rotation:
        """From the axes of a body to those of its parent, at qpos0."""
        return Rotation.from_quat(np.roll(self.model.body_quat[body], -1))


class Entry(NamedTuple):
    """An entry of a number that an engine has read differently."""

    text: Text
    reading: Reading
    number: str
    joints: Sequence[str]  # of the Tree
    joint: int  # to whose row it belongs
    bodies: Sequence[str]  # that move with that joint
    place: int  # in all numbers as one row
    wrong: set[int]  # the joints of all entries of this number that differ

    def values(self, number: str) -> tuple[np.ndarray, np.ndarray]:
        """What was read, and what is stated."""
        return self.reading["read"][number], self.reading["stated"][number]

    @property
    def name(self) -> str:
        """Of the joint."""
        return self.joints[self.joint]

    @property
    def is_zero(self) -> bool:
        return not np.ravel(self.values(self.number)[0])[self.place]

    @property
    def root(self) -> int:
        """The last body before the world, for an entry of a place; 0: none."""
        return self.text.carriers(self.name)[-1] if self.number in PLACES else 0

    @property
    def geoms(self) -> list[ElementTree.Element]:
        """The geoms of which the bodies have their mass, for an entry of masses."""
        geoms: list[ElementTree.Element] = []
        for name in self.bodies if self.number in MASSES else ():
            body = self.text.root.find(f".//body[@name='{name}']")
            if body is not None and body.find("inertial") is None:
                geoms += body.findall("geom")
        return geoms


def class_without_joint(entry: Entry) -> str | None:
    """A class between has no <joint>, and the engine has MJCF's default: 0, and an axis along z of the body."""
    name = entry.text.passed_over(entry.name, entry.number) if entry.number in OF_JOINTS else None
    if name and entry.number == "axis":
        z = np.array([0.0, 0.0, 1.0])
        for body in entry.text.carriers(entry.name):
            z = entry.text.turn(body).apply(z)
        return name if np.allclose(entry.values("axis")[0][entry.joint], z, atol=CLOSE) else None
    return name if name and entry.is_zero else None


def no_springs(entry: Entry) -> str | None:
    """None of the springs of the joints was read."""
    return "stiffness" if entry.number == "stiffness" and not entry.values("stiffness")[0].any() else None


def armature_without_motor(entry: Entry) -> str | None:
    """The engine has the armature of all joints that a motor or a position servo drives, and of no other."""
    driven = {entry.joints[joint] for joint in entry.wrong} & entry.text.driven
    unexplained = [name for name in driven if not entry.text.passed_over(name, "armature")]
    is_lost = entry.number == "armature" and entry.is_zero and entry.name not in driven
    return entry.name if is_lost and not unexplained else None


def option_gravity(entry: Entry) -> str | None:
    is_gravity = entry.number == "gravity"
    return "gravity" if is_gravity and np.allclose(entry.values("gravity")[0], STANDARD, atol=CLOSE) else None


def total_mass(entry: Entry) -> str | None:
    """All masses are the same multiple of the compiled ones."""
    if entry.number not in MASSES or entry.text.root.find("compiler[@settotalmass]") is None:
        return None
    read, stated = entry.values("mass")
    ratios = read[stated > 0.0] / stated[stated > 0.0]
    return "settotalmass" if np.ptp(ratios) <= 1e-5 * abs(ratios[0]) else None


def mass_of_meshes(entry: Entry) -> str | None:
    meshed = [name for name in entry.bodies if name in entry.text.meshed]
    return some_of(meshed) if entry.geoms and meshed else None


def mass_without_contacts(entry: Entry) -> str | None:
    """The geoms of a body without an inertial do not collide, and the engine has less mass."""
    if not entry.geoms:
        return None
    model, (read, stated) = entry.text.model, entry.values("mass")
    geoms = np.isin(model.geom_bodyid, [model.body(name).id for name in entry.bodies])
    touches = model.geom_contype[geoms] | model.geom_conaffinity[geoms]  # of those that are not only drawn
    all_touch = touches.size and touches.all()
    return some_of(entry.bodies) if read[entry.joint] < stated[entry.joint] and not all_touch else None


def small_inertia(entry: Entry) -> str | None:
    """The masses are right, and no moment of inertia is smaller than the compiled one: some are raised to a floor."""
    if entry.number != "moments" or "mass" in entry.reading["mended"]:
        return None
    read, stated = entry.values("moments")
    return some_of(entry.bodies) if (read >= stated * (1.0 - 1e-5)).all() else None


def mass_of_geoms(entry: Entry) -> str | None:
    return some_of(entry.bodies) if entry.geoms else None


def is_displaced(entry: Entry, turn: Rotation, shift: np.ndarray) -> bool:
    """Whether turn and shift lead from where the engine has a joint to where it is stated, or of one without an axis its body."""
    (axis, stated_axis), (anchor, stated) = entry.values("axis"), entry.values("anchor")
    joint = entry.joint
    if not stated_axis[joint].any():
        com, stated = entry.values("com")
        return bool(np.allclose(turn.apply(com[joint]) + shift, stated[joint], atol=CLOSE))
    beside = (turn.apply(anchor[joint]) + shift - stated[joint]) * stated[joint].any()  # 0 for a slide
    is_on_line = np.allclose(np.cross(beside, stated_axis[joint]), 0.0, atol=CLOSE)
    return bool(is_on_line and np.allclose(turn.apply(axis[joint]), stated_axis[joint], atol=CLOSE))


def fixed_root(entry: Entry) -> str | None:
    """Without the pose of a body on the world that has no joint, all is where the engine has it."""
    model, root = entry.text.model, entry.root
    if not root or model.body_jntnum[root]:
        return None
    shift, turn = model.body_pos[root], entry.text.turn(root)
    has_pose = shift.any() or turn.magnitude()
    return str(model.body(root).name) if has_pose and is_displaced(entry, turn, shift) else None


def turned_start(entry: Entry) -> str | None:
    """Positions of a free body are turned about the place that the file gives it, by the turn that it has there."""
    model, root = entry.text.model, entry.root
    if not root or model.body_dofnum[root] != 6:
        return None
    turn, shift = entry.text.turn(root), model.body_pos[root]
    is_so = turn.magnitude() and is_displaced(entry, Rotation.identity(), turn.apply(shift) - shift)
    return str(model.body(root).name) if is_so else None


def several_joints(entry: Entry) -> str | None:
    """All that is at another place is carried by a body with several joints."""
    model, several = entry.text.model, {}
    for joint in entry.wrong:
        bodies = entry.text.carriers(entry.joints[joint])
        several[joint] = [body for body in bodies if model.body_jntnum[body] > 1]
    if entry.number not in PLACES or not all(several.values()):
        return None
    return str(model.body(several[entry.joint][0]).name)


CAUSES: tuple[Callable[[Entry], str | None], ...] = (
    class_without_joint, no_springs, armature_without_motor, option_gravity, total_mass, mass_of_meshes,
    mass_without_contacts, small_inertia, mass_of_geoms, fixed_root, turned_start, several_joints,
)  # fmt: skip


def cause_of(entry: Entry) -> Cause | None:
    """The first cause that fits an entry, or None."""
    for find in CAUSES:
        if subject := find(entry):
            return Cause(find.__name__, subject)
    return None
