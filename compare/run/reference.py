"""The reference of a file: the arm's numbers, a solution's, tmt's equations for the model, a user's own."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from ..core.finding import Finding
from ..core.text import block, say
from ..core.words import in_one_line
from ..engines import Engine
from ..engines.mujoco import ModelError, Mujoco, Reading, Source, engine, has_hinges, parse, read
from ..engines.mujoco.parameters import closed_loop, of_source, of_welded, remarks
from ..engines.own import Own, OwnEquations, OwnError
from ..engines.own.own_file import aside, own_object, raised_in
from ..experiments.options import SOLUTIONS
from ..robots import Robot
from ..robots.arm import ARM
from ..robots.case import SEED
from ..robots.file import not_compared, robot_of, robot_of_solution
from ..robots.joint_map import JointsError, joint_map
from ..robots.placement import Matched, Unmatched, matched_joints, placed

REFERENCES = {"arm": "the stated numbers", "model": "tmt's equations for the model as compiled"}
SOLUTION = "solution"  # the kind of reference that is another file


class JointsDiffer(ModelError):
    """A file and a reference with different joints; why: which are missing or extra."""

    def __init__(self, shown: str, whose: str, why: str):
        super().__init__(f"{shown} cannot be compared with {whose}: {why}")
        self.why = why


class Reference(NamedTuple):
    kind: str  # of REFERENCES, "solution" or "own"
    file: str  # as it is given, in one line
    remarks: tuple[str, ...] = ()  # what is fixed, changed or switched off, of MuJoCo's compiler: a line each
    to_know: tuple[str, ...] = ()  # of these for the first screen: what is fixed, or cannot be read
    loop: str = ""  # of the first screen of a comparison: constraints that close it
    source: str = ""  # the solution, or the place of own equations, as given, in one line
    own: Own | None = None  # the engine of these equations
    renamed: tuple[str, ...] = ()  # "wrist as hand": joints matched under other names
    otherwise: tuple[str, ...] = ()  # modelled in another way, with the same motion, a line each

    @property
    def name(self) -> str:
        return "arm" if self.kind == "arm" else self.source or self.file

    @property
    def subject(self) -> str:
        """Both sides by their names."""
        paths = self.file, self.source.removesuffix(":")
        names = [Path(path).name for path in paths]
        file, other = names if names[0] != names[1] else paths
        return block("run", "subject", kind=self.kind, file=file, other=other)

    @property
    def lines(self) -> tuple[str, ...]:
        """The first lines of the report."""
        other = REFERENCES.get(self.kind, self.source.removesuffix(":"))
        lines = [f"reference: {self.kind}; {self.file} compared with {other}"]
        lines += [f"joints matched: {', '.join(self.renamed)}"] if self.renamed else []
        return tuple(map(in_one_line, (*lines, *self.otherwise, *self.remarks)))


class Compared(NamedTuple):
    reference: Reference
    robot: Robot
    mujoco: Mujoco
    reading: Reading | None  # None: the robot's numbers are stated


def compared_with(
    asked: str | None, path: str | None, joints: str | None = None, shown: str | None = None,
    solution: str | None = None, floating: bool = False,
) -> Compared:  # fmt: skip
    """A file (None: the arm's) and the reference that --reference asks for.

    asked: "arm", "model", another robot's file or own equations; None: the arm for a file with its hinges,
    else model. joints: of own equations, with commas, see joint_map; shown: the name of the file, if not its
    path; solution: the path of the other robot's file, if not `asked`; floating: the base of a URDF has a
    free joint. ModelError, in one line, for a file that cannot be compared, JointsDiffer for different
    joints, OwnError for equations that cannot be used.
    """
    source, shown = Source(Path(path or ARM.mjcf), floating), in_one_line(shown or path or "mjcf/arm.xml")
    if asked == "arm" or (asked is None and (path is None or has_hinges(source, ARM.joints))):
        return with_arm(source, path, shown)
    if asked and is_solution(asked):
        return with_solution(source, shown, asked, solution or asked)
    reading = read(source)
    robot, mujoco, found = robot_of(reading, shown), engine(reading), remarks(reading, has_scenes=True)
    loop = closed_loop(reading, Path(shown).name)
    reference = reference_of("model", source, shown, found)._replace(loop=say(loop) if loop else "")
    if asked in (None, "model"):
        return Compared(reference, robot, mujoco, reading)
    try:
        own = own_engine(asked, robot, mujoco, joints)
    except OwnError as error:
        raise OwnError(f"{error}. {reference.loop}" if loop else str(error)) from None
    robot = replace(robot, own=tuple(own.equations.functions))
    return Compared(
        reference._replace(kind="own", source=in_one_line(asked), own=own), robot, mujoco, reading
    )


def reference_of(kind: str, source: Source, shown: str, found: Sequence[Finding]) -> Reference:
    """The reference of a file, with what is found of it: fixed, changed or switched off."""
    lines = *map(say, found), *(f"MuJoCo warns: {line}" for line in source.warnings)
    to_know = tuple(say(finding) for finding in found if finding.kind in ("fixed_base", "missing"))
    return Reference(kind, shown, lines, to_know)


def with_solution(source: Source, shown: str, asked: str, solution: str) -> Compared:
    """A file and that of another robot with the same joints, placed as in the file; solution: its path."""
    reading, other, name = read(source), Source(Path(solution)), in_one_line(asked)
    stated = read(other)
    reference = reference_of(SOLUTION, source, shown, remarks(reading, has_scenes=True))
    names, renamed = joints_matched(stated, reading, shown, name)
    tree = reading.tree
    on_joints = Counter(names[joint] for joint in stated.tree.body_joint)  # bodies with mass
    if on_joints != Counter(tree.joint_names[joint] for joint in tree.body_joint):
        source, other = source.joined(), other.joined()
        reading, stated = read(source), read(other)
    placement = placed(replace(stated.tree, joint_names=names), reading.tree)
    otherwise = placement.remarks() + of_welded(source) + not_compared(reading, stated, names)
    # its actuators do not act: those of the file may differ
    stated = replace(stated, tree=placement.tree, drive=None)
    robot = robot_of_solution(reading, shown, stated, name)
    reference = reference._replace(source=name, renamed=renamed, otherwise=tuple(map(say, otherwise)))
    return Compared(reference, robot, engine(reading, stated), reading)


def with_arm(source: Source, path: str | None, shown: str) -> Compared:
    """A file (None: the arm's) and the arm's numbers, placed as in the file, whose welded bodies are one."""
    reference = reference_of("arm", source, shown, of_source(source) if path else [])
    if path is None:
        return Compared(reference, ARM, parse(source, ARM.tree), None)
    source, robot, names = source.joined(), replace(ARM, mjcf=Path(path)), Matched(ARM.joints, ())
    reading = read(source)
    if not has_hinges(source, ARM.joints):
        names = joints_matched(ARM, reading, shown, "the arm")
    robot = robot.with_joints(names.names)
    placement = placed(robot.tree, reading.tree)
    if not placement.is_same:
        # landmarks are those of the stated place, and so are the last digits of rounding
        printed = tuple(item._replace(to_every_digit=(), sizes=()) for item in robot.printed)
        robot = replace(robot, tree=placement.tree, landmarks=None, printed=printed)
    otherwise = tuple(map(say, placement.remarks() + of_welded(source)))
    reference = reference._replace(renamed=names.renamed, otherwise=otherwise)
    return Compared(reference, robot, parse(source, robot.tree), None)


def is_solution(reference: str) -> bool:
    return reference.lower().endswith(SOLUTIONS)


def joints_matched(stated: Robot | Reading, reading: Reading, shown: str, whose: str) -> Matched:
    """The file's joints in the order of the stated ones, and those renamed. JointsDiffer if any is left."""
    try:
        return matched_joints(stated.tree, reading.tree, whose)
    except Unmatched as error:
        raise JointsDiffer(shown, whose, str(error)) from None


def own_engine(reference: str, robot: Robot, mujoco: Engine, joints: str | None) -> Own:
    """The engine of the equations that FILE.py:OBJECT or MODULE:OBJECT names, called once; or OwnError."""
    source, coordinates, rng = own_object(reference), robot.coordinates, np.random.default_rng(SEED)
    q = np.concatenate([robot.posture()[None], coordinates.random(rng, 2, robot.ranges)])
    try:
        stated = joint_map(coordinates, joints.split(",")) if joints else None
        with aside(reference.rstrip(":")), raised_in(reference.rstrip(":")):
            equations = OwnEquations(source, coordinates, stated, robot.tree)
            equations.try_at(q, *rng.uniform(-1.0, 1.0, (2, len(q), coordinates.nv)))
    except JointsError as error:
        raise OwnError(f"--joints: {error}") from None
    except OwnError as error:
        raise OwnError(f"{reference.rstrip(':')}: {error}") from None
    return Own(equations, (method.scheme for method in mujoco.methods.values()))
