"""The rows of the tables of stability, and its result."""

from dataclasses import dataclass, field
from functools import partial

from ...core.check import Result
from ...core.rows import Column, Row, column
from ...engines import LABELS

time_step = partial(column, "s", digits=5)


@dataclass(kw_only=True)
class OfMethod(Row):
    scene: str
    engine: str
    method: str

    @property
    def who(self) -> str:
        """The engine and the method in words."""
        return f"{LABELS[self.engine]} {self.method}"


@dataclass(kw_only=True)
class LimitRow(OfMethod):
    """The step limit of a method at a posture: stability.csv."""

    damping: float
    mode: float = column("per_s")  # rate of the mode that limits the step
    predicted_dt: float | None = time_step()
    observed_dt: float | None = time_step()
    limit: str  # "finite", "never_fails" or "always_fails"
    criterion: str = "no mode grows from the second to the last quarter of a run"
    passed: bool | None = None  # None: runs do not show the limit

    @property
    def apart(self) -> float | None:
        """How far the observed limit is from the predicted one, relative; None if one of them is missing."""
        if not (self.observed_dt and self.predicted_dt):
            return None
        return abs(self.observed_dt / self.predicted_dt - 1.0)


@dataclass(kw_only=True)
class DepartureRow(OfMethod):
    """When a run leaves a saddle: departure.csv. unit: of the perturbation, in the name of its column."""

    dt: float = time_step()
    perturbation: float
    predicted: float | None = column("s")
    observed: float | None = column("s")
    unit: str = "rad"

    def columns(self) -> dict[str, tuple[str, Column]]:
        named = {"perturbation": f"perturbation_{self.unit.replace(' ', '_')}"}
        columns = super().columns()
        return {named.get(name, name): place for name, place in columns.items() if name != "unit"}


@dataclass(kw_only=True)
class ClaimRow(OfMethod):
    """A run of one of the assignment's three claims: stability_claims.csv."""

    claim: int
    dt: float = time_step()
    torque: str = ""  # one of those that hold the posture
    observed: float | None = column("s")
    direction: int | None
    moved: float | None = column("rad")
    ulps: int | None = column(optional=True)  # by which the torque is off
    step: float | None = column("rad", optional=True)  # the largest dt |qd|
    half_ulp: float | None = column("rad", optional=True)  # half a unit in the last place of that angle
    diverged_at: float | None = column("s", optional=True)
    run: float | None = column("s", optional=True)


@dataclass
class StabilityResult(Result):
    centres: tuple[str, ...] = ()  # stable postures
    schemes: dict[tuple[str, str], str] = field(default_factory=dict)  # by engine and method
