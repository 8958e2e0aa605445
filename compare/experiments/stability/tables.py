"""The rows of the tables of stability, and the methods of both engines that they are of."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

from ...core.check import Result
from ...core.rows import Row, column
from ...engines import LABELS, Engine, Method

SCHEMES = ("rk4", "explicit_euler", "semi_implicit_euler", "implicit", "implicit_midpoint")  # tmt's names
MOST_DIGITS = 5  # of a step in a report


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
    predicted_dt: float | None = column("s", MOST_DIGITS)
    observed_dt: float | None = column("s", MOST_DIGITS)
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
    """When a run leaves a saddle: departure.csv."""

    dt: float = column("s", MOST_DIGITS)
    perturbation: float = column("rad")
    predicted: float | None = column("s")
    observed: float | None = column("s")


@dataclass(kw_only=True)
class ClaimRow(OfMethod):
    """A run of one of the assignment's three claims: stability_claims.csv."""

    claim: int
    dt: float = column("s", MOST_DIGITS)
    torque: str = ""  # one of those that hold the posture
    observed: float | None = column("s")
    direction: int | None
    moved: float | None = column("rad")
    ulps: int | None = column(optional=True)  # by which the torque is off
    step: float | None = column("rad", optional=True)  # the largest dt |qd|
    half_ulp: float | None = column("rad", optional=True)  # half a unit in the last place of that angle
    diverged_at: float | None = column("s", optional=True)
    run: float | None = column("s", optional=True)


class Runs(NamedTuple):
    """Runs that have begun, each a list of rows, and what judges the rows of all."""

    rows: Iterable[list[Any]]
    judge: Callable[[Result, list[Any]], None]


def methods_of(engines: Mapping[str, Engine], schemes: tuple[str, ...] = ()) -> tuple[Method, ...]:
    """The fixed-step methods of tmt and of MuJoCo; of these schemes alone, and then of MuJoCo the first of each."""
    ours, mujoco = ([*engines[name].methods.values()] for name in ("tmt", "mujoco"))
    first = {method.scheme: method for method in reversed(mujoco)}
    methods = [*ours, *(method for method in mujoco if not schemes or first[method.scheme] is method)]
    return tuple(m for m in methods if not m.adaptive and (not schemes or m.scheme in schemes))


def rk4_of_both(engines: Mapping[str, Engine]) -> tuple[Method, ...]:
    return methods_of(engines, ("rk4",))
