"""Why an engine has read a number differently: facts of the file that are known to be read otherwise, looked up for each number.

A cause is named only where the file has the fact at that joint or body, and the engine has read what follows from it. Each kind
has a script that shows it in tests/engines/test_accusations.py.
"""

from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import numpy as np
from scipy.spatial.transform import Rotation

from ...engines.mujoco.source import Source
from ...engines.outside.mjcf_text import included
from ...engines.outside.model import Reading

OF_JOINTS = "armature", "damping", "stiffness", "axis"
PLACES = "com", "com_moved", "inertia", "anchor", "anchor_moved", "axis", "axis_moved"
MASSES = "mass", "moments", "com", "com_moved", "inertia"
STANDARD = (0.0, 0.0, -9.81)


class Cause(NamedTuple):
    kind: str  # a macro of the template
    subject: str  # joint, body, class or attribute

    def __str__(self) -> str:
        return f"{self.kind} {self.subject}"


class Text:
    """An MJCF file as text: elements by their names, the classes of defaults; and its compiled model."""

    def __init__(self, path: Path) -> None:
        self.model = Source(path).model
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

    def carriers(self, name: str, is_joint: bool) -> list[int]:
        """The bodies from the one of a name, or that of a joint of that name, to the last one before the world."""
        bodies = {self.model.body(k).name: k for k in range(self.model.nbody)}
        joints = {self.model.joint(k).name: int(self.model.jnt_bodyid[k]) for k in range(self.model.njnt)}
        body = joints[name] if is_joint and name in joints else bodies.get(name, 0)
        carriers = []
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
    name: str  # of a body or joint
    joint: int  # of the Tree, to whose row it belongs
    place: int  # in all numbers as one row
    wrong: set[str]  # the names of all entries of this number that differ

    def values(self, number: str) -> tuple[np.ndarray, np.ndarray]:
        """What was read, and what is stated."""
        return self.reading["read"][number], self.reading["stated"][number]

    @property
    def is_zero(self) -> bool:
        return not self.values(self.number)[0][self.place]

    def carriers(self, name: str) -> list[int]:
        """The bodies from that of a name among the entries to the last one before the world."""
        return self.text.carriers(name, self.number.startswith(("axis", "anchor")))

    @property
    def root(self) -> int:
        """The last body before the world, for an entry of a place; 0: none."""
        return next(reversed(self.carriers(self.name)), 0) if self.number in PLACES else 0

    @property
    def geoms(self) -> list[ElementTree.Element]:
        """The geoms of which the body has its mass, for an entry of masses."""
        body = self.text.root.find(f".//body[@name='{self.name}']")
        if self.number not in MASSES or body is None or body.find("inertial") is not None:
            return []
        return body.findall("geom")


def class_without_joint(entry: Entry) -> str | None:
    """A class between has no <joint>, and the engine has MJCF's default: 0, and an axis along z of the body."""
    name = entry.text.passed_over(entry.name, entry.number) if entry.number in OF_JOINTS else None
    if name and entry.number == "axis":
        z = np.array([0.0, 0.0, 1.0])
        for body in entry.carriers(entry.name):
            z = entry.text.turn(body).apply(z)
        return name if np.allclose(entry.values("axis")[0][entry.joint], z, atol=1e-6) else None
    return name if name and entry.is_zero else None


def no_springs(entry: Entry) -> str | None:
    """None of the springs of the joints was read."""
    return "stiffness" if entry.number == "stiffness" and not entry.values("stiffness")[0].any() else None


def armature_without_motor(entry: Entry) -> str | None:
    """The engine has the armature of all joints that a motor or a position servo drives, and of no other."""
    driven = entry.wrong & entry.text.driven
    unexplained = [name for name in driven if not entry.text.passed_over(name, "armature")]
    is_lost = entry.number == "armature" and entry.is_zero and entry.name not in driven
    return entry.name if is_lost and not unexplained else None


def option_gravity(entry: Entry) -> str | None:
    is_gravity = entry.number == "gravity"
    return "gravity" if is_gravity and np.allclose(entry.values("gravity")[0], STANDARD, atol=1e-6) else None


def total_mass(entry: Entry) -> str | None:
    """All masses are the same multiple of the compiled ones."""
    if entry.number not in MASSES or entry.text.root.find("compiler[@settotalmass]") is None:
        return None
    read, stated = entry.values("mass")
    ratios = read[stated > 0.0] / stated[stated > 0.0]
    return "settotalmass" if np.ptp(ratios) <= 1e-5 * abs(ratios[0]) else None


def mass_of_meshes(entry: Entry) -> str | None:
    return entry.name if any("mesh" in geom.attrib for geom in entry.geoms) else None


def mass_without_contacts(entry: Entry) -> str | None:
    """The geoms of a body without an inertial do not collide, and the engine has less mass."""
    if not entry.geoms:
        return None
    model, (read, stated) = entry.text.model, entry.values("mass")
    geoms = model.geom_bodyid == model.body(entry.name).id
    touches = model.geom_contype[geoms] | model.geom_conaffinity[geoms]  # of those that are not only drawn
    all_touch = touches.size and touches.all()
    return entry.name if read[entry.joint] < stated[entry.joint] and not all_touch else None


def small_inertia(entry: Entry) -> str | None:
    """The masses are right, and no moment of inertia is smaller than the compiled one: some are raised to a floor."""
    if entry.number != "moments" or "mass" in entry.reading["mended"]:
        return None
    read, stated = entry.values("moments")
    return entry.name if (read >= stated * (1.0 - 1e-5)).all() else None


def mass_of_geoms(entry: Entry) -> str | None:
    return entry.name if entry.geoms else None


def fixed_root(entry: Entry) -> str | None:
    """Without the pose of a body on the world that has no joint, all is where the engine has it."""
    model, root = entry.text.model, entry.root
    has_pose = model.body_pos[root].any() or model.body_quat[root][1:].any()
    if not root or model.body_jntnum[root] or not has_pose:
        return None
    read, stated = entry.values("com")
    placed = entry.text.turn(root).apply(read[entry.joint]) + model.body_pos[root]
    return str(model.body(root).name) if np.allclose(placed, stated[entry.joint], atol=1e-6) else None


def turned_start(entry: Entry) -> str | None:
    """Positions of a free body are turned about the place that the file gives it, by the turn that it has there."""
    model, root = entry.text.model, entry.root
    if not root or model.body_dofnum[root] != 6:
        return None
    read, stated = entry.values("com")
    moved = model.body_pos[root] - entry.text.turn(root).apply(model.body_pos[root])
    is_so = moved.any() and np.allclose(stated[entry.joint] + moved, read[entry.joint], atol=1e-6)
    return str(model.body(root).name) if is_so else None


def several_joints(entry: Entry) -> str | None:
    """All that is at another place is carried by a body with several joints."""
    model = entry.text.model
    several = {
        name: [body for body in entry.carriers(name) if model.body_jntnum[body] > 1] for name in entry.wrong
    }
    if entry.number not in PLACES or not all(several.values()):
        return None
    return str(model.body(several[entry.name][0]).name)


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
