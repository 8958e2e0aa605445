"""MJCF with all of its includes in one text, for engines that cannot read them or need names."""

from pathlib import Path
from xml.etree import ElementTree


def whole_text(path: Path) -> str:
    """The text of a file: its includes in their places, no keyframes, and a name for the model, each body and each joint.

    A joint without a name is `joint 3`, as it is in the compared model: its number in MuJoCo. ParseError if it is no XML.
    """
    root = included(ElementTree.parse(path).getroot(), path.parent)
    for keyframe in root.findall("keyframe"):
        root.remove(keyframe)
    root.attrib.setdefault("model", "robot")
    bodies, joints = [], []
    for world in root.findall("worldbody"):
        visit(world, bodies, joints)
    for number, body in enumerate(bodies, start=1):
        body.attrib.setdefault("name", f"body {number}")
    for number, joint in enumerate(joints):
        joint.attrib.setdefault("name", f"joint {number}")
    return ElementTree.tostring(root, encoding="unicode")


def included(element: ElementTree.Element, folder: Path) -> ElementTree.Element:
    """The element with its includes replaced by what their files hold; paths are those of the main file's folder."""
    children = list(element)
    for child in children:
        element.remove(child)
    for child in children:
        if child.tag == "include":
            element.extend(included(ElementTree.parse(folder / child.attrib["file"]).getroot(), folder))
        else:
            element.append(included(child, folder))
    return element


def visit(parent: ElementTree.Element, bodies: list, joints: list) -> None:
    """Add the bodies and joints below an element in MuJoCo's order: the joints of a body, then those of its children."""
    for child in parent:
        if child.tag == "body":
            bodies.append(child)
            joints += [part for part in child if part.tag in ("joint", "freejoint")]
            visit(child, bodies, joints)
