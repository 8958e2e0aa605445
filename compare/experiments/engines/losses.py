"""What engines leave out of the text of a file: each loss changes a text, and says of which names."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from xml.etree import ElementTree

Element = ElementTree.Element
# what MJCF has for a joint that states nothing
OF_JOINTS = {"axis": "0 0 1", "pos": "0 0 0", "damping": "0", "armature": "0", "stiffness": "0"}
POSE = "pos", "quat", "euler", "axisangle", "xyaxes", "zaxis"


class Text:
    """The text of a file, without what is drawn, and its classes; each loss changes a copy."""

    def __init__(self, root: Element) -> None:
        self.root = root
        world = root.find("worldbody")  # whole_text has one
        self.world = Element("worldbody") if world is None else world
        self.classes: dict[str, tuple[Element, str | None]] = {}  # with the class around
        defaults = root.findall("default")
        self.outermost = next((default.get("class", "main") for default in defaults), "main")
        for default in defaults:
            self.add_class(default, self.outermost, None)

    def add_class(self, default: Element, name: str, around: str | None) -> None:
        self.classes[name] = default, around
        for inner in default.findall("default"):
            self.add_class(inner, inner.get("class", ""), name)

    def parts(self, tag: str) -> list[tuple[Element, str]]:
        """The elements of bodies with a tag, and their classes."""
        return list(self.parts_of(self.world, self.outermost, tag))

    def parts_of(self, body: Element, childclass: str, tag: str) -> Iterator[tuple[Element, str]]:
        childclass = body.get("childclass", childclass)
        for part in body:
            if part.tag == tag:
                yield part, part.get("class", childclass)
            yield from self.parts_of(part, childclass, tag)

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
        names = [name for name, _ in text.around(of_class, "joint")]
        hidden = [name for name, default in text.around(of_class, "joint") if default is None]
        for attribute, default in OF_JOINTS.items():
            _, stating = text.stated(joint, of_class, attribute)
            if stating and hidden and names.index(hidden[0]) < names.index(stating):
                joint.set(attribute, default)
                empty.append(hidden[0])
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
    bodies = {geom: body for body in text.root.iter("body") for geom in body.findall("geom")}
    apart = []
    for geom, of_class in text.parts("geom"):
        bits = {text.stated(geom, of_class, attribute)[0] for attribute in ("contype", "conaffinity")}
        if bits == {"0"} and geom in bodies:
            geom.set("mass", "0")
            apart.append(bodies[geom].get("name", ""))
    return apart


def left_out(text: Text, tag: str) -> list[str]:
    """Elements with a tag and what is in them."""
    parents = [part for part in text.root.iter() if part.find(tag) is not None]
    for parent in parents:
        for part in parent.findall(tag):
            parent.remove(part)
    return [f"<{tag}>"] * bool(parents)


def other_roots(text: Text) -> list[str]:
    """The bodies on the world but the first."""
    others = text.world.findall("body")[1:]
    for body in others:
        text.world.remove(body)
    return [body.get("name", "") for body in others]


def fixed_root(text: Text) -> list[str]:
    """The pose of bodies on the world that have no joint."""
    fixed = [
        body
        for body in text.world.findall("body")
        if not {part.tag for part in body} & {"joint", "freejoint"}
    ]
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
    "springdamper": (".//joint", "springdamper"),
}  # fmt: skip
LEFT_OUT = "frame", "replicate"
LOSSES: Mapping[str, Loss] = {
    **{loss.__name__: loss for loss in (class_without_joint, joint_pos_of_class, passive_of_free, armature_without_motor,
                                        geoms_without_contacts, fixed_root, other_roots)},
    **{kind: partial(take, path=path, attributes=attributes) for kind, (path, *attributes) in DELETED.items()},
    **{tag: partial(left_out, tag=tag) for tag in LEFT_OUT},
}  # fmt: skip
