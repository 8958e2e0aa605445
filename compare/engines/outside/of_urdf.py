"""Engines whose readers of MJCF lose masses or joints: they read a URDF text of the model that MuJoCo compiled."""

import numpy as np

from .model import File, ReadModel, Unread, together


class OfUrdf(ReadModel):
    """A URDF has no gravity, springs or armature; these are set afterwards."""

    has_free_bodies = False

    def __init__(self, file: File, precision: str):
        from ..mujoco.names import joint_places
        from ..mujoco.source import Source
        from ..mujoco.urdf import urdf

        try:
            model = Source(file.path).model
            text = urdf(model, self.has_free_bodies)
        except ValueError as error:
            raise Unread(str(error)) from None
        self.file, (self.armature, self.stiffness) = file, np.zeros((2, file.coordinates.nv))
        places, free = (
            joint_places(model),
            [f"{name} {part}" for name in file.free for part in ("x", "y", "z", "turn")],
        )
        speeds = [(k, name) for k, name in enumerate(file.names) for _ in places[name].dofs]
        self.at = np.array(
            [file.coordinates.places.joints[k].q.start for k, _ in speeds]
        )  # in q, of each speed
        self.rest = np.array([model.qpos_spring[places[name].qpos.start] for _, name in speeds])
        self.is_free = np.array([name in free for _, name in speeds])
        self.damping = self.load(text, file)

    def load(self, text: str, file: File) -> np.ndarray:
        """Read the text; the damping of the joints, (nv,)."""
        raise NotImplementedError

    def bodies(self) -> list[list[tuple[float, np.ndarray, np.ndarray]]]:
        """Of each joint the bodies that move with it and not with the next one: see model.combined."""
        raise NotImplementedError

    def gravity(self) -> np.ndarray:
        raise NotImplementedError

    def set_gravity(self, gravity: np.ndarray) -> None:
        raise NotImplementedError

    def start(self, q, v, dt: float, damping: np.ndarray) -> None:
        """Prepare steps of dt from a state, with this damping of the joints."""
        raise NotImplementedError

    def step(self, force, v) -> tuple[np.ndarray, np.ndarray]:
        """q and v after a step from speeds v."""
        raise NotImplementedError

    def run(self, q, v, tau, times, steps, method, tolerance):
        every, states = steps // (len(times) - 1), [np.concatenate([q, v])]
        self.start(q, v, times[-1] / steps, self.damping)
        for step in range(1, steps + 1):
            q, v = self.step(tau - self.stiffness * (q[self.at] - self.rest), v)
            if step % every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), steps

    def numbers(self):
        mass, moments = zip(*map(together, self.bodies()))
        numbers = {"gravity": self.gravity(), "mass": np.array(mass), "moments": np.array(moments)}
        return numbers | {name: getattr(self, name) for name in ("armature", "damping", "stiffness")}

    def mend(self, name, values):
        if name == "gravity":
            self.set_gravity(values)
        elif name in ("armature", "damping", "stiffness"):
            setattr(self, name, np.array(values))
            return not values[self.is_free].any()
        return name == "gravity"
