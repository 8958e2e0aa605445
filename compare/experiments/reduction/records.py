"""What reduction finds: rows of its tables, what each scene needs, and swings that are known exactly."""

from dataclasses import dataclass, field
from typing import NamedTuple

from ...core.check import Result
from ...core.rows import MOVEMENT, MovementRow, Row, column
from ...robots.case import Case


@dataclass(kw_only=True)
class ReductionRow(MovementRow):
    """The time of an RK4 step of a model in an engine."""

    scene: str
    hinges: str = column(names=True)
    engine: str
    nv: int
    operations: int | None
    ns_per_step: float | None = None
    speedup: float | None = None  # relative to the whole model
    max_difference: float | None = column(MOVEMENT, default=None)  # from the whole model
    integrator: str = "RK4"


@dataclass
class NeedRow(Row):
    scene: str
    joint: str
    why_needed: str


@dataclass(kw_only=True)
class SubsetRow(Row):
    """Blocks of Mbar or of the bias with joints locked."""

    SHARE = "difference_over_bar"
    locked: str = column(names=True)
    quantity: str
    parties: str
    states: int = 0
    largest_difference: float | None = None
    unit: str
    difference_over_bar: float | None = None


Model = tuple[str, Case | None]  # the name of a scene, and what is run; None: nothing moves


class Need(NamedTuple):
    """The joints of a scene."""

    needed: tuple[str, ...]
    locked: tuple[str, ...]  # as the scene says
    stays: tuple[str, ...]  # those that can be locked
    undecided: tuple[str, ...]


class Swing(NamedTuple):
    dt: list[float]  # s
    errors: dict[str, list[float]]  # of each engine, rad
    orders: dict[str, float]


@dataclass
class ReductionResult(Result):
    models: list[Model] | None = None  # that are timed; None: no joint can be locked
    needs: dict[str, Need] = field(default_factory=dict)  # by scene
    apart: dict[tuple[str, str], float] = field(default_factory=dict)  # by scene and engine, rad or m
    swings: dict[str, Swing] = field(default_factory=dict)  # by scene
