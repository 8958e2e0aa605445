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
        from ..mujoco.names import joint_places
        from ..mujoco.source import Source

        model = Source(file.path, file.floating).model
        try:
            text = urdf(model)
        except ValueError as error:
            raise Unwritten(str(error)) from None
        self.file, nv = file, file.coordinates.nv
        places, joints = joint_places(model), file.coordinates.places.joints
        free = {f"{name} {part}" for name in file.free for part in ("x", "y", "z", "turn")}
        speeds = [(joint, name) for joint, name in zip(joints, file.names) for _ in joint.speeds]
        self.q_start = np.array([joint.q.start for joint, _ in speeds])  # of each speed
        self.rest = np.array([model.qpos_spring[places[name].qpos.start] for _, name in speeds])
        self.is_free = np.array([name in free for _, name in speeds])
        self.load(text)
        self.read = {"armature": np.zeros(nv), "damping": self.damping(), "stiffness": np.zeros(nv)}

    @abstractmethod
    def load(self, text: str) -> None:
        """Read the text."""

    @abstractmethod
    def damping(self) -> Array:
        """Of the joints, as read, in the Tree's order, (nv,)."""

    @abstractmethod
    def gravity(self) -> Array: ...

    @abstractmethod
    def set_gravity(self, gravity: Array) -> None: ...

    def other_force(self, q: Array, v: Array) -> Array:
        """Of springs."""
        return np.asarray(self.read["stiffness"] * (self.rest - q[self.q_start]))

    def fields(self) -> Numbers:
        return {"gravity": self.gravity(), **self.read}

    def set_field(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.set_gravity(values)
            return True
        self.read[name] = np.array(values)
        return not values[self.is_free].any()

    def armature_matrix(self) -> Array:
        """In the engine's order."""
        return np.diag(self.read["armature"][self.order.v])
