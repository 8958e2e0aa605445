"""A URDF as MuJoCo can read it: meshes by their packages, a floating base; and whether its base is fixed."""

import os
from pathlib import Path
from xml.etree import ElementTree

import mujoco

from .names import moving

ADVICE = {  # by what MuJoCo says of a file that it cannot compile
    "Error opening file": "package://NAME/... is looked for in a folder NAME beside the file or above it, else beside the file",
    "no decoder found": "MuJoCo reads STL, OBJ and MSH; collision meshes may be deleted: contacts are not compared",
    "mass and inertia of moving bodies": "a link without mass cannot move: give it one by boundmass and boundinertia of "
    "<compiler>, or, in MJCF, put its joint into the next body",
}


def advice(error: str) -> str:
    """What may help, to be put after an error of MuJoCo's compiler."""
    return "".join(f"; {text}" for part, text in ADVICE.items() if part in error)


def spec_of(path: Path) -> mujoco.MjSpec:
    """The MjSpec of a file. The meshes of a URDF are found, and a joint of type floating hangs on the world."""
    robot = robot_of_urdf(path)
    if robot is not None and free_the_base(robot):
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))
        spec.modelfiledir = str(path.parent)
    else:
        spec = mujoco.MjSpec.from_file(os.fsencode(path))
    for mesh in spec.meshes:
        if "://" in mesh.file:
            mesh.file = str(place_of(mesh.file, path.absolute()) or mesh.file)
    return spec


def place_of(address: str, path: Path) -> Path | None:
    """The file of package://NAME/... in a folder NAME beside a URDF or above it, else beside the URDF; None: it is not there."""
    _, _, relative = address.partition("://")
    places = [*(above / relative for above in path.parents), path.parent / Path(relative).name]
    return next((place for place in places if place.is_file()), None)


def robot_of_urdf(source: Path | str) -> ElementTree.Element | None:
    """The element `robot` of a URDF, a file or a text; None for MJCF and for what is no XML."""
    try:
        text = source.read_bytes() if isinstance(source, Path) else source.encode()
        robot = ElementTree.fromstring(text) if b"<robot" in text else None
    except (ElementTree.ParseError, OSError, LookupError, ValueError):  # MuJoCo says what is wrong
        return None
    return robot if robot is not None and robot.tag == "robot" else None


def root_of(robot: ElementTree.Element) -> ElementTree.Element | None:
    """The link of a URDF on which all others hang."""
    children = {child.get("link") for child in robot.findall("joint/child")}
    return next((link for link in robot.findall("link") if link.get("name") not in children), None)


def free_the_base(robot: ElementTree.Element) -> bool:
    """Call the root `world` if a joint of type floating hangs on it, as MuJoCo needs it; whether that was done."""
    root, joints = root_of(robot), robot.findall("joint[@type='floating']/parent")
    if root is None or root.get("name") not in [parent.get("link") for parent in joints] or root.get("name") == "world":
        return False
    for parent in robot.findall("joint/parent"):
        if parent.get("link") == root.get("name"):
            parent.set("link", "world")
    root.set("name", "world")
    return True


def fixed_base(source: Path | str, model: mujoco.MjModel) -> tuple[str, float] | None:
    """The name of a URDF's root, and the mass, kg, of what MuJoCo fixes to the world with it; None where nothing has mass."""
    robot = robot_of_urdf(source)
    root = root_of(robot) if robot is not None else None
    mass = float(model.body_mass[~moving(model)].sum())
    return (root.get("name", ""), mass) if root is not None and mass and root.get("name") != "world" else None
