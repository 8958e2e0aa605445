"""The reference: what a file is compared with, the arm's stated numbers or tmt's equations for the compiled model."""

from pathlib import Path
from typing import NamedTuple

from .engines.mujoco import Mujoco, Reading, engine, has_hinges, load, read
from .process.streams import in_one_line
from .robots import Robot
from .robots.arm import ARM
from .robots.file import robot_of

REFERENCES = {"arm": "the stated numbers", "model": "tmt's equations for the model as compiled"}
OWN_FILE = "mjcf/arm.xml"  # what is compared where no file is given


class Reference(NamedTuple):
    """What a file is compared with."""

    kind: str  # of REFERENCES
    file: str  # as it is given, in one line
    open_tree: tuple[str, ...] = ()  # equalities of the file that are off
    warnings: tuple[str, ...] = ()  # of MuJoCo's compiler, one line each

    @property
    def name(self) -> str:
        """The arm, or the file."""
        return self.kind if self.kind == "arm" else self.file

    @property
    def compared(self) -> str:
        """What agrees or does not."""
        return "The two models" if self.kind == "arm" else "TMT and MuJoCo"

    @property
    def lines(self) -> tuple[str, ...]:
        """The first lines of the output and of the report."""
        said = [f"reference: {self.kind}; {self.file} compared with {REFERENCES[self.kind]}"]
        if self.open_tree:
            said.append(f"open tree: {len(self.open_tree)} equalities off: {', '.join(self.open_tree)}")
        return tuple(map(in_one_line, (*said, *(f"MuJoCo warns: {line}" for line in self.warnings))))


class Compared(NamedTuple):
    """What is compared: MuJoCo's model, the robot, and what the file was read as."""

    reference: Reference
    robot: Robot
    mujoco: Mujoco
    reading: Reading | None  # None: the robot's numbers are stated


def compared_with(asked: str | None, path: str | None) -> Compared:
    """A file (None: the arm's own) and the reference that is asked for; None: the arm, if the file has exactly its hinges.

    ModelError, in one line, for a file that cannot be compared so.
    """
    file, shown = path or ARM.mjcf, in_one_line(path or OWN_FILE)
    if asked is None:
        asked = "arm" if path is None or has_hinges(path, ARM.joints) else "model"
    if asked == "arm":
        mujoco = load(file, ARM.tree)
        return Compared(Reference("arm", shown, warnings=mujoco.warnings), ARM, mujoco, None)
    reading = read(Path(file))
    reference = Reference("model", shown, reading.open_tree, reading.warnings)
    return Compared(reference, robot_of(reading, shown), engine(reading), reading)
