"""Engines whose readers of MJCF lose masses or joints: they read a URDF text of the model that MuJoCo compiled.

What a URDF cannot state is set by this program, and is no loss of the engine's.
"""

from collections.abc import Callable

import numpy as np

from .. import Array, Course
from .model import FROM_URDF, File, Numbers, ReadModel, Unasked, Unwritten

SPEEDS = "armature", "damping", "stiffness"  # numbers of each speed


class OfUrdf(ReadModel):
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

    def start(self, q: Array, v: Array, dt: float, damping: Array) -> None:
        """Prepare steps of dt from a state, with this damping of the joints."""
        raise NotImplementedError

    def step(self, force: Array, v: Array) -> tuple[Array, Array]:
        """q and v after a step from speeds v."""
        raise NotImplementedError

    def own_step(self) -> None:
        """The engine's own step, from where it is."""
        raise NotImplementedError

    def step_alone(self, course: Course) -> Callable[[], object]:
        self.start(course.q, course.v, course.dt, self.damping)
        return self.own_step

    def run(self, course: Course) -> tuple[Array, int]:
        (q, v), states = course[:2], [course.start]
        self.start(q, v, course.dt, self.damping)
        for step in range(1, course.steps + 1):
            q, v = self.step(course.force(q, v) - self.stiffness * (q[self.at] - self.rest), v)
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
