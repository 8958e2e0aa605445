"""Two runs of one case by the same scheme, of a method of tmt and of an integrator of MuJoCo; and the rows of the table."""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from ...core.check import Result
from ...core.rows import Row, column
from ...judge import run as rules
from ...robots.case import Case
from ..runs import Run

SCHEMES_OF_RK4 = ("rk4", "rk4_mean_speed")
RECORDED = 64  # states of a run that are compared: one for each of the scene's own steps, or fewer


@dataclass(kw_only=True)
class TrajectoryRow(Row):
    """The largest difference of the engines in single steps, or in an open loop."""

    scene: str
    engine_integrator: str
    twin: str
    dt: float = column("s", digits=5)
    level: str
    largest_difference: float | None
    unit: str
    worst_difference: float | None
    band: float
    worst_unit: str
    difference_over_band: float | None
    worst_place: str
    judged_until: float = column("s")
    required: float = column("s")
    diverged_at: float | None = column("s")
    twin_diverged_at: float | None = column("s")


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One case by one scheme and step in both engines."""

    runs: dict[str, Run]  # by engine, MuJoCo last; at each of their steps
    scheme: str
    integrator: str  # of MuJoCo
    width: np.ndarray  # (recorded, 2 nv): the band of rounding, of movements first
    widest: np.ndarray  # (2 nv,): the width of the band from which on it judges no more

    @property
    def case(self) -> Case:
        return next(iter(self.runs.values())).case

    @property
    def t(self) -> np.ndarray:
        """(steps + 1,) s."""
        return next(iter(self.runs.values())).t

    @property
    def steps(self) -> int:
        return len(self.t) - 1

    @property
    def dt(self) -> float:
        return self.case.duration / self.steps

    @property
    def every(self) -> int:
        """The number of steps from one recorded state to the next."""
        return self.steps // recorded(self.case)

    @property
    def band(self) -> np.ndarray:
        """The widest of the positions at each recorded state, rad or m."""
        return self.width[:, : self.case.coordinates.nv].max(axis=1)

    @property
    def ended(self) -> float:
        """When the first of the runs has diverged, s; inf: none has."""
        return min(run.ended for run in self.runs.values())

    @cached_property
    def judged(self) -> int:
        """The number of recorded states up to where the band is not narrow, or a run diverges; at least 1."""
        narrow = (self.width < self.widest).all(axis=1) & (self.t[:: self.every] < self.ended)
        return max(1, int(np.argmin(np.append(narrow, False))))

    @property
    def judged_until(self) -> float:
        """The time of the last of these, s."""
        return float(self.t[:: self.every][self.judged - 1])

    @cached_property
    def apart(self) -> np.ndarray:
        """The largest difference of each movement of the engines while they are judged, (nv,) rad or m."""
        first, mujoco = (run.q[self.t <= self.judged_until] for run in self.runs.values())
        return rules.moved_from(first, mujoco, self.case.coordinates).max(axis=0)

    @property
    def where(self) -> str:
        """The place of its checks."""
        return f"{self.case.name}, {self.integrator}, {rules.step_in_words(self.case, self.steps)}"

    @property
    def required(self) -> float:
        """The shortest time for which it must be judged, s; 0: the scene states none."""
        return rules.required_time(self.case, self.scheme, self.dt)

    def until_diverged(self, name: str) -> Iterator[np.ndarray]:
        """q or v of each engine, (steps + 1, n), NaN from where its run has diverged."""
        for run in self.runs.values():
            yield np.where((self.t < run.ended)[:, None], getattr(run, name), np.nan)


@dataclass
class TrajectoryResult(Result):
    pairs: list[Pair] = field(default_factory=list)
    # of each scene whose true motion is known: the largest error of both engines, rad or m
    errors: dict[str, tuple[float | None, ...]] = field(default_factory=dict)

    @property
    def of_beginnings(self) -> list[TrajectoryRow]:
        """The rows of runs that have the beginning of a scene alone."""
        to_end = {(pair.case.name, pair.dt) for pair in self.pairs}
        return [row for row in self.rows if (row.scene, row.dt) not in to_end]

    def pair_of(self, case: Case, *schemes: str) -> Pair | None:
        """The runs of a case with its own step by one of these schemes."""
        of_case = [pair for pair in self.pairs if (pair.case.name, pair.steps) == (case.name, case.steps)]
        return next((pair for pair in of_case if pair.scheme in schemes), None)


def recorded(case: Case) -> int:
    """The number of states of a run that are compared, without its start: one for each 1, 2, 4 ... steps."""
    count = case.steps
    while count > RECORDED and count % 2 == 0:
        count //= 2
    return count
