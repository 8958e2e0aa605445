"""Engines whose readers of MJCF lose masses or joints: they read a URDF text of the model that MuJoCo compiled.

What a URDF cannot state is set by this program, and is no loss of the engine's.
"""

from abc import abstractmethod
from xml.etree import ElementTree

import numpy as np

from .. import Array
from .file import File, Unwritten
from .model import FROM_URDF, SteppedModel


class OfUrdf(SteppedModel):
    """A URDF has no gravity, springs or armature; these are set afterwards."""

    way = FROM_URDF
    unwritten = ("gravity", "armature", "stiffness")

    def __init__(self, file: File, precision: str):
        from ..mujoco.handed_on import urdf
        from ..mujoco.source import Source

        try:
            text = urdf(Source(file.path, file.floating).model)
        except ValueError as error:
            raise Unwritten(str(error)) from None
        self.file, nv = file, file.coordinates.nv
        self.load(text)
        self.used = {"gravity": self.gravity(), "armature": np.zeros(nv), "stiffness": np.zeros(nv)}

    @abstractmethod
    def load(self, text: str) -> None:
        """Read the text."""

    @abstractmethod
    def gravity(self) -> Array: ...

    @abstractmethod
    def set_gravity(self, gravity: Array) -> None: ...

    def other_force(self, q: Array, v: Array) -> Array:
        """Of springs, and of the damping of free joints."""
        first, damping = self.file.coordinates.places.first_positions, self.stated["damping"]
        springs = self.used["stiffness"] * (self.stated["rest"] - q)[first]
        return np.asarray(springs - damping * v * self.order.is_of_free())

    def apply(self, name: str) -> None:
        if name == "gravity":
            self.set_gravity(self.used[name])
        elif self.used[name][self.order.is_of_free()].any():
            raise Unwritten(f"free joints have no {name}")

    def armature_matrix(self) -> Array:
        """In the engine's order."""
        return np.diag(self.used["armature"][self.order.v])


def without_world(text: str) -> str:
    """A URDF whose root is the link of its floating joint; Unwritten if other joints stand on the world."""
    robot = ElementTree.fromstring(text)
    carried: set[str] = set()
    for joint in robot.findall("joint"):
        parent, child = (next(joint.iter(tag)).attrib["link"] for tag in ("parent", "child"))
        if parent in carried or (joint.get("type") == "floating" and not carried):
            carried.add(child)
        elif joint.get("type") != "fixed":
            raise Unwritten("joints stand on the world beside a free base")
        if parent not in carried:
            robot.remove(joint)
    for link in robot.findall("link"):
        if link.attrib["name"] not in carried:
            robot.remove(link)
    return ElementTree.tostring(robot, encoding="unicode")
