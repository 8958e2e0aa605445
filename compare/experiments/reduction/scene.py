"""The motions of a file that smaller models repeat: of a keyframe, recorded controls, a user's scenes."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from ...engines.mujoco.motion import Motion, Path, Simulation, Use, apart, data_at, inputs_of, used
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.smaller import Smaller
from ...engines.mujoco.step import start_of
from ...robots.case import Case
from ...robots.coordinates import Coordinates
from ...stability.place import posture_of, postures_of, standing_at
from ...stability.rest import NEAR_REST
from ..setup import Setup

DURATION = 1.0  # s, of the motion from a keyframe
FINER = 8  # fold, the step of the reference
STANDS = 0.1  # rad or m: what sinks less to its rest stands there


@dataclass(frozen=True)
class Scene:
    """The motions of a file, by its own step and integrator unless others are said.

    whole: the file with everything. points: names of sites whose places count too.
    """

    reading: Reading
    motions: list[Motion]
    whole: Smaller
    points: tuple[str, ...]

    @property
    def name(self) -> str:
        return "; ".join(motion.name for motion in self.motions)

    @property
    def duration(self) -> float:
        return sum(motion.duration for motion in self.motions)

    @cached_property
    def use(self) -> Use:
        return used(self.simulation(self.whole))

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.reading.tree.joint_names, self.reading.tree.kind)

    def simulation(self, small: Smaller, dt: float | None = None, integrator: str = "") -> Simulation:
        reading = self.reading
        return Simulation(small.model, self.motions, dt or reading.dt, integrator or reading.integrator)

    def run(self, small: Smaller, dt: float | None = None, integrator: str = "") -> list[Path]:
        return self.simulation(small, dt, integrator)()

    def finely(self, small: Smaller) -> list[Path]:
        """By a finer step; of order 4 where no constraint makes the motion less smooth."""
        integrator = self.reading.integrator if self.use.has_constraints else "RK4"
        return self.run(small, self.reading.dt / FINER, integrator)

    def positions(self, small: Smaller) -> np.ndarray:
        """Some of the positions of its run, (states, nq)."""
        return np.vstack([path.samples for path in self.run(small)])

    def apart(self, paths: Iterable[Path], others: Iterable[Path]) -> float:
        """How far runs are apart, rad or m."""
        return apart(list(paths), list(others), self.points)


def scene_of(setup: Setup, reading: Reading) -> Scene:
    """All of --scenes; else --controls from a posture; else a posture, of a robot that stands its rest.

    ValueError where that cannot be.
    """
    request = setup.request
    points = tuple(request.points.split(",")) if request.points else ()
    whole = Smaller.whole(reading.source, points)
    cases = [case for case in setup.robot.cases if "user" in case.scene.tags]
    motions = [motion_of_case(case, reading, whole) for case in cases]
    scene = Scene(reading, motions or [motion_of_posture(setup, reading, whole)], whole, points)
    paths = scene.run(whole)
    if scene.apart(paths, paths):  # not finite
        raise ValueError(f"the file's own run fails ({reading.integrator}, {1e3 * reading.dt:g} ms)")
    return scene


def motion_of_case(case: Case, reading: Reading, whole: Smaller) -> Motion:
    scene, still = case.scene, np.zeros(reading.model.nv)
    if scene.locked or np.any(scene.damping) or not scene.gravity:
        raise ValueError(f"the scene {scene.name} changes the model: locked, damping or gravity")
    key = scene.posture if isinstance(scene.posture, str) and scene.posture in reading.keyframes else ""
    controls = case.controller.controls if case.controller else ()
    state = start_of(reading.model, reading.drive, key, still, case.posture, controls)
    data = data_at(reading.model, state, whole.model)
    data.qvel[:] = case.v
    data.qfrc_applied[:] = 0.0 if case.controller else case.tau
    return Motion(scene.name, scene.duration, data, np.zeros(1), inputs_of(data, 1))


def motion_of_posture(setup: Setup, reading: Reading, whole: Smaller) -> Motion:
    """With the recorded controls, if there are any."""
    request = setup.request
    posture = posture_of(request.posture, reading) if request.posture else postures_of(reading)[0]
    q, name = np.array(posture.q) if posture.q else None, posture.name
    state = start_of(reading.model, reading.drive, posture.key, np.zeros(reading.model.nv), q)
    recorded = dict(request.controls or {})
    times = recorded.pop("time", np.zeros(1))
    if not recorded:
        place = standing_at(reading, posture)
        if place.left <= NEAR_REST and np.abs(place.moved).max(initial=0.0) <= STANDS:
            state, name = place.rest, f"{name}, at rest"
    data = data_at(reading.model, state, whole.model)
    inputs = inputs_of(data, len(times)) | {name: values[:, None] for name, values in recorded.items()}
    return Motion(name, float(times[-1]) or DURATION, data, times, inputs)
