"""Engines whose readers of MJCF lose masses or joints: they read a URDF text of the model that MuJoCo compiled.

What a URDF cannot state is set by this program, and is no loss of the engine's.
"""

import numpy as np

from .. import Array
from .model import FROM_URDF, File, Numbers, SteppedModel, Unasked, Unwritten

SPEEDS = "armature", "damping", "stiffness"  # numbers of each speed


class OfUrdf(SteppedModel):
    """A URDF has no gravity, springs or armature; these are set afterwards."""

    way = FROM_URDF
    unwritten = ("gravity", "armature", "stiffness")
    has_free_bodies = False  # whether this program asks the engine about them

    def __init__(self, file: File, precision: str):
        from ..mujoco.handed_on import urdf
        from ..mujoco.names import joint_places
        from ..mujoco.source import Source

        if file.free and not self.has_free_bodies:
            raise Unasked("a free base")
        model = Source(file.path).model
        try:
            text = urdf(model, self.has_free_bodies)
        except ValueError as error:
            raise Unwritten(str(error)) from None
        self.file, (self.armature, self.stiffness) = file, np.zeros((2, file.coordinates.nv))
        places, joints = joint_places(model), file.coordinates.places.joints
        free = {f"{name} {part}" for name in file.free for part in ("x", "y", "z", "turn")}
        speeds = [(joint, name) for joint, name in zip(joints, file.names) for _ in places[name].dofs]
        self.at = np.array([joint.q.start for joint, _ in speeds])  # in q, of each speed
        self.rest = np.array([model.qpos_spring[places[name].qpos.start] for _, name in speeds])
        self.is_free = np.array([name in free for _, name in speeds])
        self.damping = self.load(text, file)

    def load(self, text: str, file: File) -> Array:
        """Read the text; the damping of the joints, (nv,)."""
        raise NotImplementedError

    def gravity(self) -> Array:
        raise NotImplementedError

    def set_gravity(self, gravity: Array) -> None:
        raise NotImplementedError

    def springs(self, q: Array) -> Array:
        return -self.stiffness * (q[self.at] - self.rest)

    def fields(self) -> Numbers:
        return {"gravity": self.gravity()} | {name: getattr(self, name) for name in SPEEDS}

    def set_field(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.set_gravity(values)
            return True
        setattr(self, name, np.array(values))
        return not values[self.is_free].any()
