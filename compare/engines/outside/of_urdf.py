"""Engines whose readers of MJCF lose masses or joints: they read a URDF text of the model that MuJoCo compiled.

What a URDF cannot state is set by this program, and is no loss of the engine's.
"""

from abc import abstractmethod

import numpy as np

from .. import Array
from .bodies import Numbers
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
        self.read = {"armature": np.zeros(nv), "stiffness": np.zeros(nv)}

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
        springs = self.read["stiffness"] * (self.stated["rest"] - q)[first]
        return np.asarray(springs - damping * v * self.order.is_of_free())

    def fields(self) -> Numbers:
        return {"gravity": self.gravity(), **self.read}

    def set_field(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.set_gravity(values)
            return True
        if values[self.order.is_of_free()].any():
            raise Unwritten(f"free joints have no {name}")
        self.read[name] = np.array(values)
        return True

    def armature_matrix(self) -> Array:
        """In the engine's order."""
        return np.diag(self.read["armature"][self.order.v])
