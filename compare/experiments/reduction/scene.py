"""The motion of a file that a smaller model is to repeat: of a keyframe, of recorded controls, or of a user's scene."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...engines.mujoco.motion import Motion, Path, Simulation, Use, used
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.smaller import Smaller
from ...engines.mujoco.step import start_of
from ...robots.coordinates import Coordinates
from ...stability.place import posture_of, postures_of
from ..setup import Setup

DURATION = 1.0  # s, of the motion from a keyframe
FINER = 8  # fold, the step of the reference


@dataclass(frozen=True)
class Scene:
    """A motion of a file, by its own step and integrator. whole: the file with everything."""

    reading: Reading
    motion: Motion
    whole: Smaller

    @cached_property
    def use(self) -> Use:
        return used(self.whole.model, self.motion, self.reading.dt, self.reading.integrator)

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.reading.tree.joint_names, self.reading.tree.kind)

    def simulation(self, small: Smaller) -> Simulation:
        return Simulation(small.model, self.motion, self.reading.dt, self.reading.integrator)

    def run(self, small: Smaller) -> Path:
        return self.simulation(small)()

    def finely(self, small: Smaller) -> Path:
        """By a finer step; of order 4 where no constraint makes the motion less smooth."""
        integrator = self.reading.integrator if self.use.has_constraints else "RK4"
        return Simulation(small.model, self.motion, self.reading.dt / FINER, integrator)()


def scene_of(setup: Setup, reading: Reading) -> Scene:
    """The first of --scenes; else --controls, or constant ones, from a keyframe. ValueError where that cannot be."""
    request, model = setup.request, reading.model
    points = tuple(request.points.split(",")) if request.points else ()
    whole, still = Smaller.whole(reading.source, points), np.zeros(model.nv)
    if cases := [case for case in setup.robot.cases if "user" in case.scene.tags]:
        case, scene = cases[0], cases[0].scene
        if scene.locked or np.any(scene.damping) or not scene.gravity:
            raise ValueError(f"the scene {scene.name} changes the model: locked, damping or gravity")
        key = scene.posture if isinstance(scene.posture, str) and scene.posture in reading.keyframes else ""
        controls, forces = (case.controller.controls, None) if case.controller else ((), case.tau)
        state = start_of(model, reading.drive, key, still, case.posture, controls)
        motion = Motion.of(whole.model, state, scene.name, scene.duration, None, points, case.v, forces)
        return Scene(reading, motion, whole)
    posture = posture_of(request.posture, reading) if request.posture else postures_of(reading)[0]
    state = start_of(model, reading.drive, posture.key, still, np.array(posture.q) if posture.q else None)
    recorded, duration = None, DURATION
    if request.controls:
        controls_at = dict(request.controls)
        times = controls_at.pop("time")
        recorded, duration = (times, controls_at), float(times[-1])
    return Scene(reading, Motion.of(whole.model, state, posture.name, duration, recorded, points), whole)
