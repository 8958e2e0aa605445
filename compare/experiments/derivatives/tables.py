"""The rows of the tables of derivatives, and the result that has them."""

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import inf

from ...core.check import Result
from ...core.rows import Row, column


@dataclass(kw_only=True)
class DerivativeRow(Row):
    """One way to a derivative: its largest error over the states of a subject."""

    subject: str  # a scene, or what is hard about its states
    quantity: str  # of ways.QUANTITIES, and the integrator
    way: str
    eps: float | None  # of a difference, rad, m and per s; None: it is exact
    error: float | None  # relative to the largest entry of the same unit; None: not a number
    states: int


@dataclass(kw_only=True)
class CostRow(Row):
    """One way to a derivative: the error that it reaches, and the time of an evaluation."""

    quantity: str
    way: str
    best_eps: float | None
    error: float | None  # with that
    error_at_usual: float | None  # with USUAL, 1e-6
    time: float | None = column("us")


@dataclass(kw_only=True)
class HardRow(Row):
    """What differences are worth where they are hard; of steps the centred ones."""

    subject: str
    quantity: str
    eps: float  # that serves the scenes best
    error: float | None  # with that
    scenes_error: float | None  # with that, along the scenes
    best_eps: float
    best_error: float | None


@dataclass
class DerivativesResult(Result):
    """Its result: what its figure needs, too."""

    main: str = ""  # the subject that is drawn
    times: dict[tuple[str, str], float] = field(default_factory=dict)  # s, by quantity and way


def errors_of(rows: Iterable[DerivativeRow]) -> dict[float, float]:
    """The largest error for each eps, 0 where there is none; inf where one is not a number."""
    errors: dict[float, float] = {}
    for row in rows:
        error = inf if row.error is None else row.error
        errors[row.eps or 0.0] = max(error, errors.get(row.eps or 0.0, 0.0))
    return errors
