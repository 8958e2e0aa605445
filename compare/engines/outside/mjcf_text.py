"""MJCF with all of its includes in one text, for engines that cannot read them or need names."""

from collections.abc import Callable, Iterator
from itertools import compress
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TypeVar
from xml.etree import ElementTree

import numpy as np

from ...core.errors import described
from .file import OtherJoints, OtherNames, Unread

Model = TypeVar("Model")
Copied = tuple[Model, Path | str, tuple[str, str] | None]
REFUSED = "Refused"  # the kind of an error that the engine raises
FROM_FILES = "mesh", "hfield"  # of geoms
# of a body in the compiled model
FIELDS = {"pos": "ipos", "quat": "iquat", "mass": "mass", "diaginertia": "inertia"}


def original_or_copy(path: Path, read: Callable[[Path], Model]) -> Copied[Model]:
    """What an engine reads of a file, or, if it raises, of a copy with `whole_text`; of a URDF there is none.

    The model; the file, or the text of its copy; kind and message of the error about the file, None: it is no copy.
    """
    try:
        return read(path), path, None
    except (Exception, SystemExit) as error:
        if path.suffix == ".urdf":
            raise
        is_known = isinstance(error, OtherJoints | OtherNames)
        kind, text = type(error).__name__ if is_known else REFUSED, str(error)
        message = text if is_known else described(error, with_place=False)
    text = whole_text(path)
    with TemporaryDirectory() as folder:
        copy = Path(folder) / path.name
        copy.write_text(text, encoding="utf-8")
        return read(copy), text, (kind, " ".join(message.split()))


def whole_text(path: Path) -> str:
    """The text of a file: its includes in their places, no keyframes, and a name for the model, each body and each joint.

    A joint without a name is `joint 3`, as it is in the compared model: its number in MuJoCo. Meshes and height fields are left
    out: a body whose mass is that of meshes has the inertia that MuJoCo has computed. ParseError if it is no XML.
    """
    root = included(ElementTree.parse(path).getroot(), path.parent)
    for keyframe in root.findall("keyframe"):
        root.remove(keyframe)
    root.attrib.setdefault("model", "robot")
    world, *others = root.findall("worldbody")
    for other in others:  # of files that were included; Pinocchio reads the first as often as there are
        world.extend(other)
        root.remove(other)
    bodies = list(world.iter("body"))
    if root.find(".//mesh") is not None:
        take_meshes_away(bodies, path)
    for parent in list(root.iter()):
        for child in [child for child in parent if child.tag in FROM_FILES or is_from_file(child)]:
            parent.remove(child)
    for number, body in enumerate(bodies, start=1):
        body.attrib.setdefault("name", f"body {number}")
    joints = [part for body in bodies for part in body if part.tag in ("joint", "freejoint")]
    for number, joint in enumerate(joints):
        joint.attrib.setdefault("name", f"joint {number}")
    return ElementTree.tostring(root, encoding="unicode")


def is_from_file(part: ElementTree.Element) -> bool:
    return part.tag == "geom" and any(name in part.attrib for name in FROM_FILES)


def take_meshes_away(bodies: list[ElementTree.Element], path: Path) -> None:
    """Remove geoms that are meshes, by their class too; their bodies get the inertia that MuJoCo has computed, in float32."""
    from ..mujoco.source import Source

    source = Source(path)
    model, mesh_geoms = source.model, source.mesh_geoms
    if not model.nbody - 1 == len(mesh_geoms) == len(bodies):
        raise Unread("its bodies are not all in the text")
    for number, (body, (_, are_meshes)) in enumerate(zip(bodies, mesh_geoms), start=1):
        geoms = list(geoms_in(body))
        if len(geoms) != len(are_meshes):  # MuJoCo was asked without meshes whose files are missing
            are_meshes = [is_from_file(geom) for _, geom in geoms]
        meshes = list(compress(geoms, are_meshes))
        for parent, geom in meshes:
            parent.remove(geom)
        if meshes and body.find("inertial") is None:
            inertial = ElementTree.SubElement(body, "inertial")
            for name, field in FIELDS.items():
                values = np.ravel(getattr(model, f"body_{field}")[number]).tolist()
                inertial.set(name, " ".join(map(repr, values)))


def geoms_in(part: ElementTree.Element) -> Iterator[tuple[ElementTree.Element, ElementTree.Element]]:
    """The geoms of a body with the elements around them: itself, or its frames."""
    for child in part:
        if child.tag == "geom":
            yield part, child
        elif child.tag == "frame":
            yield from geoms_in(child)


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
