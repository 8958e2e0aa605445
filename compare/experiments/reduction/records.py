"""What reduction finds: rows of its tables, and what each scene needs."""

from dataclasses import dataclass

from ...core.rows import Row, column


@dataclass
class NeedRow(Row):
    scene: str
    joint: str
    why_needed: str


@dataclass
class StageRow(Row):
    """A stage of a step by MuJoCo's timers: of the whole file, without what is not used, smaller."""

    stage: str
    whole_file: float = column("us")
    free_file: float = column("us")
    smaller_file: float = column("us")


@dataclass
class UseRow(Row):
    """What a file has of a kind, None: unknown, and what the motion used."""

    part: str
    in_file: int | None
    used: int
    names: str


@dataclass
class FreeRow(Row):
    """What was taken out of a file; it is back if the motion was not the same to the last bit."""

    kind: str
    taken_out: int
    same_bits: bool
    before: float | None = column("us", default=None)  # of a step
    after: float | None = column("us", default=None)


@dataclass
class JointRow(Row):
    """How far a joint moved, rad or m. None: it is not to be locked.

    predicted: how far it would move another one if it were locked; error_alone: the error of its lock in a
    run.
    """

    joint: str
    moved: float
    predicted: float | None = None
    error_alone: float | None = None
    locked: bool = False


@dataclass
class PairRow(Row):
    """Geoms that came near and never touched."""

    geom: str
    other: str
    distance: float = column("m")


@dataclass
class LimitRow(Row):
    """The largest stable step of a file; limit: as in step_limits.csv, or rests_elsewhere."""

    model: str
    integrator: str
    limit: str
    step: float | None = column("s", digits=4, default=None)
    joint: str = ""


@dataclass(kw_only=True)
class FrontierRow(Row):
    """A model with an integrator and a step: time over error, rad or m.

    error_at_own_step: from the file's own run, both by its own step and integrator: of the model alone.
    best_for: the errors for which it is the answer.
    """

    model: str
    locked: int
    integrator: str
    dt: float = column("s")
    error: float
    error_of_model: float
    error_of_step: float
    error_at_own_step: float | None = None
    time_of_second: float = column("s", default=0.0)  # of motion
    gain: float = 1.0  # over the file as it is
    stable_at_rest: bool = True  # False: a step of an answer, or one as long, which is not stable there
    best_for: str = ""
