"""A file as MuJoCo can compile it: a URDF's meshes are found by their packages, and its floating base hangs on the world."""

import os
from pathlib import Path
from xml.etree import ElementTree

import mujoco

ADVICE = {  # by what MuJoCo says of a file that it cannot compile
    "Error opening file": "package://NAME/... is looked for in a folder NAME beside the file or above it, else beside the file",
    "no decoder found": "MuJoCo reads STL, OBJ and MSH; collision meshes may be deleted: contacts are not compared",
    "mass and inertia of moving bodies": "boundmass and boundinertia of <compiler> give some, or both joints in one body",
}


def advice(error: str) -> str:
    """What may help, to be put after an error of MuJoCo's compiler."""
    return "".join(f"; {text}" for part, text in ADVICE.items() if part in error)


def spec_of(path: Path) -> mujoco.MjSpec:
    spec = mujoco.MjSpec.from_file(os.fsencode(path))
    of_free = [joint.parent.parent for joint in spec.joints if joint.type == mujoco.mjtJoint.mjJNT_FREE]
    for base in [body for body in of_free if body.parent == spec.worldbody]:
        robot = ElementTree.fromstring(path.read_text(encoding="utf-8", errors="replace"))
        named = [(link, "name") for link in robot.iter("link")]
        for element, key in named + [(end, "link") for end in robot.iter("parent")]:
            if element.get(key) == base.name:
                element.set(key, "world")
        spec = mujoco.MjSpec.from_string(ElementTree.tostring(robot, encoding="unicode"))
        spec.modelfiledir = str(path.parent)
        break
    for mesh in spec.meshes:
        if "://" in mesh.file:
            mesh.file = str(place_of(mesh.file, path.absolute()) or mesh.file)
    return spec


def place_of(address: str, path: Path) -> Path | None:
    """The file of package://NAME/... in a folder NAME beside a URDF or above it, else beside the URDF; None: it is not there."""
    _, _, relative = address.partition("://")
    places = [*(above / relative for above in path.parents), path.parent / Path(relative).name]
    return next((place for place in places if place.is_file()), None)
