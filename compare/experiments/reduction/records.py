"""Rows of the tables of reduction."""

from dataclasses import dataclass

from ...core.rows import Row, column


@dataclass
class FreeRow(Row):
    """What was taken out of a file; it is back if the motion was not the same to the last bit."""

    kind: str
    taken_out: int
    same_bits: bool


@dataclass
class JointRow(Row):
    """What a scene needs of a joint.

    moved: from the start, rad or m. acceleration: the largest with the joint at its start and at rest, rad/s2
    or m/s2. error_if_locked: of the others, rad or m; None: it is not to be locked. why_needed: "" where it
    is not.
    """

    scene: str
    joint: str
    moved: float
    acceleration: float
    error_if_locked: float | None = None
    locked: bool = False
    why_needed: str = ""


@dataclass
class ModelRow(Row):
    """A model on the way to the smallest. error: from the file's own run, rad or m. step: the time of one."""

    model: str
    joints_locked: int
    error: float
    locked: str = ""
    step: float | None = column("us", default=None)


@dataclass
class UseRow(Row):
    """What a file has of a kind, None: unknown, and what the motion used."""

    part: str
    in_file: int | None
    used: int
    names: str
