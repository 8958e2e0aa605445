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
    """An MJCF file as text: elements by their names, and the classes of defaults."""

    def __init__(self, path: Path) -> None:
        self.model = Source(path).model
        self.root = ElementTree.Element("mujoco")
        if path.suffix != ".urdf":
            self.root = included(ElementTree.parse(path).getroot(), path.parent)
        self.classes: dict[str, tuple[ElementTree.Element, str | None]] = {}  # with the class around
        outermost = "main"
        for default in self.root.findall("default"):
            outermost = default.get("class", "main")
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
        bodies = [self.model.body(k).name for k in range(self.model.nbody)]
        joints = [self.model.joint(k).name for k in range(self.model.njnt)]
        if is_joint and name in joints:
            body = int(self.model.jnt_bodyid[joints.index(name)])
        else:
            body = bodies.index(name) if name in bodies else 0
        carriers = []
        while body:
            carriers.append(body)
            body = int(self.model.body_parentid[body])
        return carriers

    def turn_of_body(self, joint: str) -> np.ndarray:
        """The rotation of the body of a joint at qpos0, from its axes to those of the world."""
        turn = Rotation.identity()
        for body in self.carriers(joint, True):
            turn = Rotation.from_quat(np.roll(self.model.body_quat[body], -1)) * turn
        return turn.as_matrix()

    def has_mass_of_geoms(self, name: str) -> bool:
        element = self.root.find(f".//body[@name='{name}']")
        return element is not None and element.find("inertial") is None and element.find("geom") is not None

    def geoms(self, name: str, attribute: str) -> list[ElementTree.Element]:
        """The geoms of a body that have an attribute."""
        return self.root.findall(f".//body[@name='{name}']/geom[@{attribute}]")

    def compiler(self, attribute: str) -> bool:
        return any(attribute in compiler.attrib for compiler in self.root.findall("compiler"))


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

    def carriers(self, name: str) -> list[int]:
        """The bodies from that of a name among the entries to the last one before the world."""
        return self.text.carriers(name, self.number.startswith(("axis", "anchor")))

    @property
    def root(self) -> int:
        """The last body before the world; 0: none."""
        return next(reversed(self.carriers(self.name)), 0)


def class_without_joint(entry: Entry) -> str | None:
    """A class between has no <joint>, and the engine has MJCF's default: 0, and an axis along z of the body."""
    name = entry.text.passed_over(entry.name, entry.number) if entry.number in OF_JOINTS else None
    read = entry.values(entry.number)[0]
    if name and entry.number == "axis":
        z = entry.text.turn_of_body(entry.name) @ (0.0, 0.0, 1.0)
        return name if np.allclose(read[entry.joint], z, atol=1e-6) else None
    return name if name and not read[entry.place] else None


def no_springs(entry: Entry) -> str | None:
    """None of the springs of the joints was read."""
    return "stiffness" if entry.number == "stiffness" and not entry.values("stiffness")[0].any() else None


def armature_without_motor(entry: Entry) -> str | None:
    """The engine has the armature of all joints that a motor or a position servo drives, and of no other."""
    is_zero = entry.number == "armature" and not entry.values("armature")[0][entry.place]
    driven = entry.wrong & entry.text.driven
    unexplained = [name for name in driven if not entry.text.passed_over(name, "armature")]
    return entry.name if is_zero and entry.name not in driven and not unexplained else None


def option_gravity(entry: Entry) -> str | None:
    is_gravity = entry.number == "gravity"
    return "gravity" if is_gravity and np.allclose(entry.values("gravity")[0], STANDARD, atol=1e-6) else None


def total_mass(entry: Entry) -> str | None:
    """All masses are the same multiple of the compiled ones."""
    if entry.number not in MASSES or not entry.text.compiler("settotalmass"):
        return None
    read, stated = entry.values("mass")
    ratios = read[stated > 0.0] / stated[stated > 0.0]
    return "settotalmass" if np.ptp(ratios) <= 1e-5 * abs(ratios[0]) else None


def mass_of_meshes(entry: Entry) -> str | None:
    is_of_geoms = entry.number in MASSES and entry.text.has_mass_of_geoms(entry.name)
    return entry.name if is_of_geoms and entry.text.geoms(entry.name, "mesh") else None


def mass_of_geoms(entry: Entry) -> str | None:
    return entry.name if entry.number in MASSES and entry.text.has_mass_of_geoms(entry.name) else None


def mass_without_contacts(entry: Entry) -> str | None:
    """The geoms of a body without an inertial do not collide, and the engine has less mass."""
    if entry.number not in MASSES or not entry.text.has_mass_of_geoms(entry.name):
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


def several_joints(entry: Entry) -> str | None:
    """All that is at another place is carried by a body with several joints."""
    counts = entry.text.model.body_jntnum
    several = [[body for body in entry.carriers(name) if counts[body] > 1] for name in entry.wrong]
    if entry.number not in PLACES or not all(several):
        return None
    body = next(body for body in entry.carriers(entry.name) if counts[body] > 1)
    return str(entry.text.model.body(body).name)


def fixed_root(entry: Entry) -> str | None:
    """Without the pose of a body on the world that has no joint, all is where the engine has it."""
    model, root = entry.text.model, entry.root
    has_pose = (model.body_pos[root].any() or model.body_quat[root][1:].any()) and not model.body_jntnum[root]
    if entry.number not in PLACES or not (root and has_pose):
        return None
    turn = Rotation.from_quat(np.roll(model.body_quat[root], -1))
    read, stated = entry.values("com")
    is_so = np.allclose(turn.apply(read[entry.joint]) + model.body_pos[root], stated[entry.joint], atol=1e-6)
    return str(model.body(root).name) if is_so else None


def turned_start(entry: Entry) -> str | None:
    """Positions of a free body are turned about the place that the file gives it, by the turn that it has there."""
    model, root = entry.text.model, entry.root
    if entry.number not in PLACES or not root or model.body_dofnum[root] != 6:
        return None
    turn = Rotation.from_quat(np.roll(model.body_quat[root], -1))
    read, stated = entry.values("com")
    moved = model.body_pos[root] - turn.apply(model.body_pos[root])
    is_so = moved.any() and np.allclose(stated[entry.joint] + moved, read[entry.joint], atol=1e-6)
    return str(model.body(root).name) if is_so else None


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
