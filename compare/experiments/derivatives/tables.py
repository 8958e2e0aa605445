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
    error: float | None  # relative to the largest exact entry of the same unit; None: not a number
    states: int
    unit: str  # of the derivatives with that error
    largest: float  # exact entry of that unit

    @property
    def size(self) -> float:
        """The error; infinite where it is not a number."""
        return inf if self.error is None else self.error


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
class ContactRow(Row):
    """Centred differences of the step of a robot that stands, beside the closed form."""

    posture: str
    integrator: str
    contacts: int  # in which forces act
    eps: float
    difference: float | None  # relative to the largest entry of the same unit; None: there is no closed form
    changed: str  # pairs that open or close within eps; "": contacts stay


@dataclass
class DerivativesResult(Result):
    """Its result: what its figure needs, too."""

    main: str = ""  # the subject that is drawn
    times: dict[tuple[str, str], float] = field(default_factory=dict)  # s, by quantity and way


def worst_of_each_eps(rows: Iterable[DerivativeRow]) -> dict[float, DerivativeRow]:
    """The row with the largest error for each eps, 0 where there is none; from coarse to fine."""
    ascending = sorted(rows, key=lambda row: (-(row.eps or 0.0), row.size))
    return {row.eps or 0.0: row for row in ascending}


def best_of(rows: Iterable[DerivativeRow]) -> DerivativeRow:
    """The row with the largest error for the eps that serves these rows best."""
    return min(worst_of_each_eps(rows).values(), key=lambda row: row.size)
