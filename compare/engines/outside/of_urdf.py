"""Engines whose readers of MJCF lose masses or joints: they read a URDF text of the model that MuJoCo compiled."""

import numpy as np

from .. import Array, Course
from .model import File, Numbers, ReadModel, Unread

SPEEDS = "armature", "damping", "stiffness"  # numbers of each speed


class OfUrdf(ReadModel):
    """A URDF has no gravity, springs or armature; these are set afterwards."""

    has_free_bodies = False

    def __init__(self, file: File, precision: str):
        from ..mujoco.handed_on import urdf
        from ..mujoco.names import joint_places
        from ..mujoco.source import Source

        try:
            model = Source(file.path).model
            text = urdf(model, self.has_free_bodies)
        except ValueError as error:
            raise Unread(str(error)) from None
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

    def start(self, q: Array, v: Array, dt: float, damping: Array) -> None:
        """Prepare steps of dt from a state, with this damping of the joints."""
        raise NotImplementedError

    def step(self, force: Array, v: Array) -> tuple[Array, Array]:
        """q and v after a step from speeds v."""
        raise NotImplementedError

    def run(self, course: Course) -> tuple[Array, int]:
        (q, v, tau), states = course[:3], [course.start]
        self.start(q, v, course.dt, self.damping)
        for step in range(1, course.steps + 1):
            q, v = self.step(tau - self.stiffness * (q[self.at] - self.rest), v)
            if step % course.every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), course.steps

    def fields(self) -> Numbers:
        speeds = {name: getattr(self, name) for name in SPEEDS}
        return {"gravity": self.gravity(), **speeds}

    def mend(self, name: str, values: Array) -> bool:
        if name == "gravity":
            self.set_gravity(values)
        elif name in SPEEDS:
            setattr(self, name, np.array(values))
            return not values[self.is_free].any()
        return name == "gravity"
