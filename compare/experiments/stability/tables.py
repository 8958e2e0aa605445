"""The rows of the tables of stability, and its result."""

from dataclasses import dataclass, field

from ...core.check import Result
from ...core.rows import Column, Row, column
from ...engines import LABELS
from ...stability.answer import Curve

STEP_DIGITS = 5  # of a step in a report


def time_step(**more):
    """A field with a time step, s."""
    return column("s", digits=STEP_DIGITS, **more)


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
        return relative_difference(self.observed_dt, self.predicted_dt)


def relative_difference(observed: float | None, predicted: float | None) -> float | None:
    return abs(observed / predicted - 1.0) if observed and predicted else None


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
class ClaimRow(Row):
    """A run of one of the assignment's claims: stability_claims.csv has those of all three."""

    claim: int
    scene: str
    engine: str
    method: str
    dt: float = time_step()

    @property
    def who(self) -> str:
        return f"{LABELS[self.engine]} {self.method}"


@dataclass(kw_only=True)
class TorqueRow(ClaimRow):
    """Claim 1: a run under one of the torques that hold the posture."""

    claim: int = 1
    torque: str
    push: float = column("rad_per_s2")  # what the residual does to the fastest unstable mode
    predicted: float | None = column("s")
    observed: float | None = column("s")
    direction: int | None
    moved: float | None = column("rad")


@dataclass(kw_only=True)
class FinerRow(ClaimRow):
    """Claim 2: a run with the torque one ulp off."""

    claim: int = 2
    ulps: int
    observed: float | None = column("s")
    direction: int | None
    moved: float | None = column("rad")
    step: float | None = column("rad")
    half_ulp: float = column("rad")


@dataclass(kw_only=True)
class KeptRow(ClaimRow):
    """Claim 3: a run at the posture that is kept."""

    claim: int = 3
    torque: str
    observed: float | None = column("s")
    diverged_at: float | None = column("s")
    moved: float | None = column("rad")
    run: float = column("s")


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


@dataclass
class StabilityResult(Result):
    centres: tuple[str, ...] = ()  # stable postures
    schemes: dict[tuple[str, str], str] = field(default_factory=dict)  # by engine and method
    growth: dict[str, dict[str, Curve]] = field(default_factory=dict)  # by surroundings and integrator
