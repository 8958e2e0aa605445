"""The rows of the tables of stability, and its result."""

from dataclasses import dataclass, field
from functools import partial

from ...core.check import Result
from ...core.rows import Column, Row, column
from ...engines import LABELS
from ...stability.answer import step_column
from ...stability.limits import Curve

time_step = partial(step_column, digits=5)


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
    push: float | None = column("rad_per_s2", optional=True)  # of the residual, to the fastest unstable mode
    predicted: float | None = column("s", optional=True)
    observed: float | None = column("s")
    direction: int | None
    moved: float | None = column("rad")
    ulps: int | None = column(optional=True)  # by which the torque is off
    step: float | None = column("rad", optional=True)  # the largest dt |qd|
    half_ulp: float | None = column("rad", optional=True)  # half a unit in the last place of that angle
    diverged_at: float | None = column("s", optional=True)
    run: float | None = column("s", optional=True)


@dataclass(kw_only=True)
class OwnRunRow(Row):
    """A run of the whole file: own_run.csv."""

    start: str
    dt: float = time_step()
    integrator: str
    outcome: str  # "calm", "worse", "alike" or "fails", see own_run
    failed_at: float | None = column("s")
    full_model_rms_speed: float | None
    full_model_warnings: int
    full_model_resets: int
    full_model_calm: bool
    finer_dt: float | None = column("s")
    finer_rms_speed: float | None
    moved: float | None = None  # rad or m, of a run that comes to rest: from the rest of the posture
    moved_joint: str = ""
    rests_elsewhere: bool = False
    has_fallen: bool = False


@dataclass(kw_only=True)
class ControlRow(Row):
    """A controller at its own rate: control.csv. Limits are None where all that was tried is stable.

    growth: in a period. longest_delay: 0 if it is not stable.
    """

    posture: str
    integrator: str
    period: float = column("s", digits=4)
    delay: float = column("s", digits=4)
    growth: float = column(digits=6)
    grows_in_run: bool
    longest_period: float | None = column("s", digits=4)
    longest_delay: float | None = column("s", digits=4)
    servos: int

    @property
    def is_stable(self) -> bool:
        return self.growth <= 1.0


@dataclass
class StabilityResult(Result):
    centres: tuple[str, ...] = ()  # stable postures
    schemes: dict[tuple[str, str], str] = field(default_factory=dict)  # by engine and method
    growth: dict[str, dict[str, Curve]] = field(default_factory=dict)  # by surroundings and integrator
