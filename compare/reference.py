"""The reference: what a file is compared with.

The arm's stated numbers, tmt's equations for the compiled model, or equations of a user's own: FILE.py:OBJECT, MODULE:OBJECT.
"""

import dataclasses
from pathlib import Path
from typing import NamedTuple

import numpy as np

from .case import SEED
from .engines import Engine
from .engines.mujoco import ModelError, Mujoco, Reading, engine, has_hinges, load, read
from .engines.mujoco.flags import integrator_by_name
from .engines.own import Own, OwnEquations, OwnError
from .joint_map import JointsError, joint_map
from .own_file import OwnFileError, aside, own_object
from .process.streams import in_one_line
from .robots import Robot
from .robots.arm import ARM
from .robots.file import robot_of

REFERENCES = {"arm": "the stated numbers", "model": "tmt's equations for the model as compiled"}
OWN_FILE = "mjcf/arm.xml"  # what is compared where no file is given


class Reference(NamedTuple):
    """What a file is compared with."""

    kind: str  # of REFERENCES, or "own"
    file: str  # as it is given, in one line
    open_tree: tuple[str, ...] = ()  # equalities of the file that are off
    warnings: tuple[str, ...] = ()  # of MuJoCo's compiler, one line each
    asked: str = ""  # where equations of one's own come from, as it is given, in one line
    own: Engine | None = None  # of these equations

    @property
    def name(self) -> str:
        """The arm, or the file; or where one's own equations come from."""
        return {"arm": "arm", "own": self.asked}.get(self.kind, self.file)

    @property
    def compared(self) -> str:
        """What agrees or does not."""
        return {"arm": "The two models", "own": "Your equations and MuJoCo"}.get(self.kind, "TMT and MuJoCo")

    @property
    def lines(self) -> tuple[str, ...]:
        """The first lines of the output and of the report."""
        said = [f"reference: {self.kind}; {self.file} compared with {REFERENCES.get(self.kind, self.asked)}"]
        if self.open_tree:
            said.append(f"open tree: {len(self.open_tree)} equalities off: {', '.join(self.open_tree)}")
        return tuple(map(in_one_line, (*said, *(f"MuJoCo warns: {line}" for line in self.warnings))))


class Compared(NamedTuple):
    """What is compared: MuJoCo's model, the robot, and what the file was read as."""

    reference: Reference
    robot: Robot
    mujoco: Mujoco
    reading: Reading | None  # None: the robot's numbers are stated

    def asked_step(self, dt: float | None, integrator: str | None) -> tuple[float, str] | None:
        """A step, s, and an integrator that are asked about, the file's where one is None; None: both are.

        ModelError, in one line: there is no such integrator, or no servo to ask about.
        """
        if dt is None and integrator is None:
            return None
        if self.reading is None or not self.robot.drive.actuators:
            why = "has no actuator" if self.reading else "is compared by its stated numbers, which have no actuator"
            raise ModelError(f"--dt and --integrator ask about a robot's own servos, and {self.robot.name} {why}")
        try:
            name = integrator_by_name(integrator or self.reading.integrator)
        except ValueError as error:
            raise ModelError(f"--integrator: {error}") from None
        return (self.reading.dt if dt is None else dt), name


def compared_with(asked: str | None, path: str | None, joints: str | None = None, shown: str | None = None) -> Compared:
    """A file (None: the arm's own) and the reference that is asked for; None: the arm, if the file has exactly its hinges.

    joints: of equations of one's own, separated by commas, see joint_map; shown: what the file is called, if not by its path.
    ModelError, in one line, for a file that cannot be compared so; OwnFileError for equations that cannot be used.
    """
    file, shown = path or ARM.mjcf, in_one_line(shown or path or OWN_FILE)
    if asked is None:
        asked = "arm" if path is None or has_hinges(path, ARM.joints) else "model"
    if asked == "arm":
        mujoco = load(file, ARM.tree)
        return Compared(Reference("arm", shown, warnings=mujoco.warnings), ARM, mujoco, None)
    reading = read(Path(file))
    robot, of_file = robot_of(reading, shown), (shown, reading.open_tree, reading.warnings)
    if asked == "model":
        return Compared(Reference("model", *of_file), robot, engine(reading), reading)
    mujoco = engine(reading)
    own = own_engine(asked, robot, mujoco, joints)
    robot = dataclasses.replace(robot, own=tuple(own.equations.functions))
    return Compared(Reference("own", *of_file, in_one_line(asked), own), robot, mujoco, reading)


def own_engine(asked: str, robot: Robot, mujoco: Engine, joints: str | None) -> Own:
    """The engine of the equations that FILE.py:OBJECT or MODULE:OBJECT names, called once. OwnFileError if that cannot be."""
    source, coordinates, rng = own_object(asked), robot.coordinates, np.random.default_rng(SEED)
    try:
        stated = joint_map(coordinates, joints.split(",")) if joints else None
    except JointsError as error:
        raise OwnFileError(f"--joints: {error}") from None
    q = np.concatenate([robot.posture()[None], coordinates.random(rng, 2, robot.ranges)])
    try:
        with aside():
            equations = OwnEquations(source, coordinates, stated, robot.tree)
            equations.try_at(q, *rng.uniform(-1.0, 1.0, (2, len(q), coordinates.nv)))
    except OwnError as error:
        raise OwnFileError(f"{asked.rstrip(':')}: {error}") from None
    return Own(equations, (method.scheme for method in mujoco.methods.values()))
