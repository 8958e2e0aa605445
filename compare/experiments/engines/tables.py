"""The tables of other engines: one row of each."""

from dataclasses import dataclass, field
from typing import Any

from ...core.check import Result
from ...core.rows import MOVEMENT, MovementRow, Row, column


@dataclass
class AnswerRow(Row):
    """An engine and its three answers, in words."""

    engine: str
    precision: str
    reads_the_file: str
    equations: str  # M, h and accelerations
    as_it_runs: str


@dataclass(kw_only=True)
class EngineRow(Row):
    """A quantity of an engine, whose numbers are MuJoCo's as far as they can be set, compared with exact values."""

    engine: str
    precision: str
    quantity: str
    unit: str
    states: int
    worst_difference: float | None
    bar: float
    difference_over_bar: float | None
    difference_eps: float  # the largest distance from the exact value
    mujoco_eps: float
    worst_entry: str  # the joint or the two joints of the entry that is closest to its bar
    passed: bool


@dataclass
class ReadRow(Row):
    """A number that an engine has read differently, with the feature that explains it, or why the engine takes no part."""

    engine: str
    number: str | None = column(optional=True)
    of: str | None = column(optional=True)
    read: float | None = column(optional=True)
    compared: float | None = column(optional=True)
    unit: str | None = column(optional=True)
    set_by_this_program: bool | None = column(optional=True)
    cause: str | None = column(optional=True)
    why_not: str | None = None


@dataclass(kw_only=True)
class RunRow(MovementRow):
    """The file as it runs beside MuJoCo: free runs, and the first field that differs in steps from MuJoCo's own states."""

    engine: str
    iterations: int
    ls_iterations: int
    own_settings: bool  # iterations are the file's
    apart_1: float | None = column(MOVEMENT)  # the largest of q after 1 step
    apart_10: float | None = column(MOVEMENT)
    apart_100: float | None = column(MOVEMENT)
    first_step: int | None = None
    first_field: str | None = None
    first_of: str | None = None
    first_share: float | None = None  # of the field's largest entry


@dataclass
class EnginesResult(Result):
    answers: dict[str, dict[str, Any]] = field(
        default_factory=dict
    )  # what cells of an AnswerRow say, by engine
