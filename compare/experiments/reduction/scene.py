"""The motion of a file that a smaller model is to repeat: of a keyframe, of recorded controls, or of a user's scene."""

from dataclasses import dataclass
from functools import cached_property

import mujoco
import numpy as np

from ...engines.mujoco.linear import put_controls, start_of
from ...engines.mujoco.motion import Motion, Path, Simulation, Use, used
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.smaller import Smaller
from ...engines.mujoco.step import STATE
from ...robots.case import Case
from ...robots.coordinates import Coordinates
from ...stability.answer import posture_of, postures_of
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
    request = setup.request
    points = tuple(request.points.split(",")) if request.points else ()
    whole = Smaller.whole(reading.source, points)
    data = mujoco.MjData(whole.model)
    if cases := [case for case in setup.robot.cases if "user" in case.scene.tags]:
        scene = cases[0].scene
        put_case(whole.model, data, reading, cases[0])
        return Scene(reading, Motion.of(whole.model, data, scene.name, scene.duration, points=points), whole)
    posture = posture_of(request.posture, reading) if request.posture else postures_of(reading)[0]
    q = np.array(posture.q) if posture.q else None
    state = start_of(reading.model, reading.drive, posture.key, np.zeros(reading.model.nv), q)
    mujoco.mj_setState(whole.model, data, state, STATE)
    recorded, duration = None, DURATION
    if request.controls:
        controls = dict(request.controls)
        times = controls.pop("time")
        recorded, duration = (times, controls), float(times[-1])
    return Scene(reading, Motion.of(whole.model, data, posture.name, duration, recorded, points), whole)


def put_case(model: mujoco.MjModel, data: mujoco.MjData, reading: Reading, case: Case) -> None:
    """The start, controls and forces of a user's scene, everything on; ValueError where it changes the model itself."""
    scene = case.scene
    if scene.locked or np.any(scene.damping) or not scene.gravity:
        raise ValueError(f"the scene {scene.name} changes the model: locked, damping or gravity")
    key = scene.posture if isinstance(scene.posture, str) and scene.posture in reading.keyframes else ""
    state = start_of(reading.model, reading.drive, key, np.zeros(model.nv), case.posture)
    mujoco.mj_setState(model, data, state, STATE)
    data.qvel[:] = case.v
    if case.controller:
        put_controls(model, data, reading.drive, case.controller.controls)
    else:
        data.qfrc_applied[:] = case.tau
