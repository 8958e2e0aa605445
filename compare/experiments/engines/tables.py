"""The tables of other engines: one row of each."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from ...core.check import Result
from ...core.rows import Row, column


@dataclass(kw_only=True)
class EngineRow(Row):
    """A quantity of an engine compared with exact values, with what it has read and with what this program has set."""

    engine: str
    precision: str
    quantity: str
    unit: str
    states: int
    as_read_over_bar: float  # equal to difference_over_bar where nothing is set
    worst_difference: float | None
    bar: float
    difference_over_bar: float | None
    difference_eps: float  # the largest distance from the exact value
    mujoco_eps: float
    passed: bool


@dataclass
class ReadRow(Row):
    """A number that an engine has read differently, with its cause, or why the engine takes no part."""

    engine: str
    number: str | None = column(optional=True)
    of: str | None = column(optional=True)
    read: float | None = column(optional=True)
    compared: float | None = column(optional=True)
    unit: str | None = column(optional=True)
    set_by_this_program: bool | None = column(optional=True)
    cause: str | None = column(optional=True)  # a kind of causes.CAUSES, and its subject
    why_not: str | None = None


@dataclass(kw_only=True)
class MethodRow(Row):
    """One run of an integrator. seconds: as this program calls it; seconds_alone: of the engine's own steps without Python's."""

    scene: str
    engine: str
    method: str
    scheme: str
    dt: float | None = column("s", digits=5)
    tolerance: float | None
    worst_error: float | None = column("rad")
    seconds: float
    seconds_alone: float | None
    scatter: float  # ratio of its two fastest times
    steady: bool  # False: the time may be that of other processes
    seconds_prepared: float | None
    ended: str | None
    order: int | None
    measured_order: float | None = None
    finer_left_out: bool = False  # since this run took too long

    @property
    def own_seconds(self) -> float:
        """The time of the engine itself."""
        return self.seconds if self.seconds_alone is None else self.seconds_alone


@dataclass(kw_only=True)
class AnswerRow(Row):
    """An engine: its two verdicts, and the cheapest of its methods for an error. ms: of a second of motion."""

    engine: str
    precision: str
    as_read: str
    as_set: str
    within_1e_3: str | None
    within_1e_3_cost: float | None = column("ms")
    within_1e_6: str | None
    within_1e_6_cost: float | None = column("ms")
    within_1e_9: str | None
    within_1e_9_cost: float | None = column("ms")
    floor: float | None = column("rad")  # the smallest error
    floor_method: str | None
    floor_reached: bool  # False: it falls with finer steps or tolerances
    finer_left_out: bool  # of a method that has not reached its floor, since they take too long


@dataclass(kw_only=True)
class ServoRow(Row):
    """The response of one method to a step of the targets of the servos, against the exact one."""

    scene: str
    engine: str
    method: str
    servo: str  # whose law acts, and when: servos.OWN, HELD, AT_EACH_STAGE
    dt: float = column("s", digits=5)
    deviation: float | None = column("rad", default=None)
    why: str = ""  # what explains the deviation, see servos.alike; "": nothing does
    unexplained: float | None = column("rad", default=None)  # difference from the run that explains it
    ended: str | None = None

    @property
    def label(self) -> str:
        return f"{self.engine} {self.method}"


@dataclass(kw_only=True)
class BatchRow(Row):
    """The time of steps of many worlds at once."""

    engine: str
    method: str
    device: str
    worlds: int
    steps: int
    dt: float = column("s", digits=5)
    worst_error: float | None = column("rad")  # of the first world
    per_step_and_world: float = column("us")
    seconds_prepared: float | None


@dataclass
class Share:
    """What is said of what one engine has read."""

    way: str  # ReadModel.way
    unwritten: Sequence[str]  # what a URDF cannot state, set here
    differing: list[str] = field(default_factory=list)  # what it has read differently, or lacks


@dataclass
class EnginesResult(Result):
    readers: dict[str, Share] = field(default_factory=dict)  # by the labels of engines
    # by the labels of ServoRow: times, s, and deviations from the exact response, (times, nv)
    responses: dict[str, tuple[np.ndarray, np.ndarray]] = field(default_factory=dict)
    not_asked: list[str] = field(default_factory=list)  # engines of which nothing is said

    def labels(self, way: str) -> list[str]:
        """The engines that read the file in a way."""
        return [label for label, share in self.readers.items() if share.way == way]
