"""The motions that smaller models repeat: of a keyframe, recorded controls, a user's scenes, the arm's scenes."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

import tmt

from ...engines.mujoco.motion import Path, Roll, Use, apart, carried, joints, path_of, used
from ...engines.mujoco.names import INTEGRATORS, element_name, joint_places, set_control
from ...engines.mujoco.reading import Reading
from ...engines.mujoco.smaller import Smaller, locked
from ...engines.mujoco.source import Source
from ...engines.mujoco.stepper import Stepper
from ...robots.case import Case
from ...stability.motion import Motion, motion_of, posture_of, postures_of
from ..options import ReductionOptions
from ..setup import Setup

DURATION = 1.0  # s, of the motion from a keyframe


@dataclass
class Scene:
    """Motions of a whole model by its own step and integrator.

    points: sites whose places count too. left: what is left of the model.
    """

    tree: tmt.Tree
    whole: Smaller
    stepper: Stepper
    rolls: Sequence[Roll]
    points: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        self.left = self.whole

    @property
    def name(self) -> str:
        return "; ".join(roll.name for roll in self.rolls)

    @property
    def duration(self) -> float:
        return self.stepper.dt * sum(roll.steps for roll in self.rolls)

    def carried(self, small: Smaller, from_keys: bool = False) -> Iterator[tuple[Stepper, Roll]]:
        """Its motions by a smaller model. from_keys: from the keyframes of their names."""
        stepper = Stepper(small.model, self.stepper.dt, self.stepper.integrator)
        return ((stepper, carried(roll, self.stepper, stepper, from_keys)) for roll in self.rolls)

    def run(self, small: Smaller, from_keys: bool = False) -> list[Path]:
        return [path_of(*motion) for motion in self.carried(small, from_keys)]

    def timed(self, small: Smaller) -> Callable[[], object]:
        """The same as one call, to be timed."""
        loops = [stepper.loop(*roll[1:]) for stepper, roll in self.carried(small)]
        return lambda: [loop() for loop in loops]

    @cached_property
    def paths(self) -> list[Path]:
        """Of the whole model."""
        return [path_of(self.stepper, roll) for roll in self.rolls]

    @property
    def is_finite(self) -> bool:
        return all(np.isfinite(path.q).all() for path in self.paths)

    @cached_property
    def use(self) -> Use:
        return used(self.stepper, self.rolls, self.paths)

    def error(self, small: Smaller, from_keys: bool = False) -> float:
        """How far a model is from the whole one, rad or m; inf where its run fails."""
        return apart(self.run(small, from_keys), self.paths, self.points)

    def recipe(self, small: Smaller, file: str, error: float) -> dict[str, Any] | None:
        """How plain MuJoCo repeats the error of a file with a smaller model, rad or m; None: controls change on the way.

        places: of the whole model's positions, those that the smaller one has. Each motion starts from a
        keyframe of its name.
        """
        if self.points or any(roll.controls is not None for roll in self.rolls):
            return None
        of_whole, stepper = joints(self.whole.model), self.stepper
        places = [k for name in joints(small.model) for k in range(self.whole.model.nq)[of_whole[name][0]]]
        motions = [
            {"key": roll.name, "steps": roll.steps, "start": stepper.as_fields(roll.state)}
            for roll in self.rolls
        ]
        step = {"dt": stepper.dt, "integrator": stepper.integrator}
        return {"file": file, **step, "places": places, "error": error, "motions": motions}


def scene_of(setup: Setup, reading: Reading) -> tuple[Scene, list[Motion]]:
    """All of --scenes; else --controls, or what the file states, from a posture. Or ValueError."""
    asked = setup.asked(ReductionOptions)
    points = tuple(asked.points.split(",")) if asked.points else ()
    whole = Smaller.whole(reading.source, points)
    stepper = Stepper(whole.model, reading.dt, reading.integrator)
    cases = [case for case in setup.robot.cases if "user" in case.scene.tags]
    for case in cases:
        if case.scene.locked or np.any(case.scene.damping) or not case.scene.gravity:
            raise ValueError(f"the scene {case.name} changes the model: locked, damping or gravity")
    rolls = [roll_of(case, stepper) for case in cases]
    motions = [Motion(reading.model, roll.name, roll.state, "") for roll in rolls]
    if not rolls:
        posture = posture_of(asked.posture, reading) if asked.posture else postures_of(reading)[0]
        motion, controls = motion_of(reading, posture, asked.recorded), None
        steps = max(1, round((motion.times[-1] if len(motion.times) else DURATION) / reading.dt))
        if len(motion.times):
            controls = np.vstack([np.array(part) for _, part in motion.parts(stepper, steps, 0.0, 0.0)])
        rolls, motions = [Roll(motion.name, motion.state, steps, controls)], [motion]
    return Scene(reading.tree, whole, stepper, rolls, points), motions


def scene_of_case(case: Case, source: Source) -> Scene:
    """A scene of a robot whose numbers are stated, with its damping, gravity and locks, by its file's step.

    It ends where rounding has grown, if the scene says so.
    """
    scene, whole = case.scene, Smaller.whole(source)
    for more, name in zip(np.broadcast_to(scene.damping, len(case.robot.joints)), case.robot.joints):
        joint = whole.spec.joint(name)
        damping = np.array(joint.damping, dtype=float)  # since MuJoCo 4 the first of three numbers
        damping.flat[0] += more
        joint.damping = damping if damping.ndim else float(damping)
    if not scene.gravity:
        whole.spec.option.gravity = np.zeros(3)
    joints, q = case.robot.coordinates.by_name, case.robot.posture(scene.posture)
    whole = locked(Smaller(whole.spec), {name: q[joints[name].q] for name in scene.locked})
    integrator = next(name for name, member in INTEGRATORS.items() if member == whole.model.opt.integrator)
    stepper = Stepper(whole.model, float(whole.model.opt.timestep), integrator)
    return Scene(case.tree, whole, stepper, [roll_of(case, stepper)])


def roll_of(case: Case, stepper: Stepper) -> Roll:
    """The motion of a scene: its posture, speeds, and torques or controls."""
    scene, m = case.scene, stepper.model
    q, v, forces = m.qpos0.copy(), np.zeros(m.nv), np.zeros(m.nv)
    for name, place in joint_places(m).items():
        joint = case.coordinates.by_name[name]
        q[place.qpos], v[place.dofs] = case.q[joint.q], case.v[joint.qd]
        forces[place.dofs] = 0.0 if case.controller else case.tau[joint.qd]
    is_key = scene.posture in [element_name(m, "key", number) for number in range(m.nkey)]
    data = stepper.put(stepper.start(str(scene.posture) if is_key else "", q, v))
    data.qfrc_applied[:] = forces
    for number, u in enumerate(case.controller.controls if case.controller else ()):
        if u is not None:
            set_control(m, number, u, data.ctrl, data.act)
    lasts = min(scene.judged or scene.duration, scene.duration)
    return Roll(scene.name, stepper.state(), max(1, round(lasts / stepper.dt)))
