"""The runs of each scene by each method and setting: errors, times, and the error that rounding leaves."""

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

import tmt
from tmt.methods import METHODS

from ...core import timing
from ...core.check import Result
from ...core.rows import MOVEMENT, MovementRow, column
from ...engines import GRID, IN_QUICK_RUNS, Dynamics, Engine, Method, Setting
from ...judge.rounding import growth
from ...judge.run import diverged_at, movement_unit
from ...judge.scale import EPS
from ...robots.case import Case
from ...truth.reference import Reference, coarsest_steps, reference
from ..followed import follow
from .settings import MOST_SECONDS, estimated, methods, settings_of

NEAR_ROUNDING = 30  # a smaller multiple of the error of rounding counts as rounding
GROWTH_STEPS = 16  # of the run whose growth is computed, between two recorded times
EACH_STEP = 12  # nv up to which the growth takes the Jacobian of every step, not of one in GROWTH_STEPS
TimedCall = tuple[Callable[[], object], float]  # a run takes this many times as long as the call
FIRST_STEPS = 512  # a longer run of MuJoCo is timed over its first steps only


@dataclass
class SpeedRow(MovementRow):
    """One run of a method in a scene, or why there is none."""

    scene: str
    engine: str
    method: str
    dt: float | None = column("s", digits=5, default=None)
    tolerance: float | None = None
    steps: int | None = None
    timed_steps: int | None = None
    evaluations: int | None = None
    seconds: float | None = None
    error: float | None = column(MOVEMENT, default=None)  # at the end
    worst_error: float | None = column(MOVEMENT, default=None)
    energy_error: float | None = column("J", default=None)
    diverged: bool | None = None
    why_not: str | None = None

    @property
    def time(self) -> float:
        """The time of the run, s; infinite where it was not timed."""
        return math.inf if self.seconds is None else self.seconds

    @property
    def largest_error(self) -> float:
        """The worst error of the run, rad or m; infinite if it diverged."""
        return math.inf if self.worst_error is None else self.worst_error


class Run(NamedTuple):
    method: Method
    setting: Setting
    early: float  # rad or m: the largest error of the first second
    row: SpeedRow

    @property
    def dt(self) -> float:
        """The step, s; not a number for a method that chooses its own."""
        return math.nan if self.row.dt is None else self.row.dt


@dataclass
class SceneRuns:
    case: Case
    reference: Reference
    floor: float  # rad or m: the error that rounding, or the reference, leaves
    runs: list[Run] = field(default_factory=list)

    @cached_property
    def energy(self) -> np.ndarray:
        """The energy of the reference, J, (65,)."""
        nq = self.case.coordinates.nq
        return tmt.energy(self.reference.high[:, :nq], self.reference.high[:, nq:], self.case.tree)


@dataclass
class SpeedResult(Result):
    floors: dict[str, float] = field(default_factory=dict)  # by scene, see SceneRuns
    regular: str = ""  # the scene in which errors are regular
    unit: str = "rad"
    servos_off: bool = False  # whether the robot has servos, which do not act in the regular scene


def scene_runs(case: Case, engines: Mapping[str, Engine], size: str) -> SceneRuns:
    """The runs of a scene by compiled methods, which are not yet timed."""
    exact = reference(case)
    scene = SceneRuns(case, exact, max(floor(case, engines["tmt"].of(case)), exact.apart))
    scene.runs = runs_of(scene, engines, size, compiled=True)
    for run in scene.runs:
        run.row.seconds = None
    return scene


def runs_of(scene: SceneRuns, engines: Mapping[str, Engine], size: str, compiled: bool) -> list[Run]:
    """The runs by methods whose loop is compiled, or by the others."""
    every = methods(engines, size, scene.case)
    some = [method for method in every if (method.engine in IN_QUICK_RUNS) == compiled]
    return [run for method in some for run in series(scene, engines[method.engine], method, size)]


def series(scene: SceneRuns, engine: Engine, method: Method, size: str) -> Iterator[Run]:
    """The runs of a method from coarse to fine, until one takes too long or gains nothing."""
    best, last, seconds = math.inf, 0, estimated(method, scene.case.tree)
    for setting in settings_of(method, scene.case, size):
        run = measured(scene, engine, method, setting)
        yield run
        error, work = run.row.largest_error, run.row.evaluations or run.row.steps or 2 * last + 1
        too_long = method.adaptive and work * seconds > MOST_SECONDS[size] / 2
        if too_long or gained_nothing(error, work, best, last, scene.floor):
            return
        best, last = min(best, error), work


def gained_nothing(error: float, work: int, best: float, last: int, floor: float) -> bool:
    """Whether a run that cost more is not more exact, when the best error is already near rounding."""
    return best < NEAR_ROUNDING * floor and work > 1.2 * last and not error < 0.7 * best


def measured(scene: SceneRuns, engine: Engine, method: Method, setting: Setting) -> Run:
    """One run. With a reference in doubles, errors below the floor of the scene are set to it."""
    case, reference = scene.case, scene.reference
    motion, seconds, errors, early, _ = follow(engine.of(case), case, method, setting, reference)
    least, unit = scene.floor if reference.why else 0.0, movement_unit(case.robot.coordinates)
    dt = setting.duration / setting.steps if setting.steps else None
    row = SpeedRow(case.name, method.engine, method.name, dt, setting.tolerance, motion.steps, unit=unit)
    row.timed_steps, row.evaluations, row.seconds = motion.steps, motion.evaluations, seconds
    row.diverged = diverged_at(case, reference.t, motion.q, motion.v) is not None
    if not row.diverged:
        row.error, row.worst_error = max(float(errors[-1]), least), max(float(errors.max()), least)
        row.energy_error = float(np.abs(tmt.energy(motion.q, motion.v, case.tree) - scene.energy).max())
    return Run(method, setting, max(early, least), row)


def floor(case: Case, dynamics: Dynamics) -> float:
    """The error of the angles that rounding leaves, rad: eps times the largest growth of a small difference.

    dynamics: tmt's, run by RK4 with 1024 steps or as many as the scene needs; ValueError if the run diverges.
    """
    recorded = GROWTH_STEPS * GRID
    first = recorded * max(1, round(case.duration / 5.0), -(-coarsest_steps(case) // recorded))
    for steps in (first, 4 * first, 16 * first):
        dt = case.duration / steps
        motion = dynamics.run(*case.start, case.tau, dt, steps, "rk4")
        if np.isfinite(motion.q).all():
            stride = 1 if case.coordinates.nv <= EACH_STEP else GROWTH_STEPS
            grown = growth(METHODS["rk4"], case.tree, motion.q, motion.v, case.tau, dt, GROWTH_STEPS, stride)
            return float(EPS * 10.0 ** grown.max() * max(1.0, np.abs(motion.q).max()))
    reached = f"scene {case.name!r}: RK4 with {steps} steps does not reach its end"
    raise ValueError(f"{reached}; expected a shorter scene")


def prepared(case: Case, runs: Sequence[Run], engines: Mapping[str, Engine]) -> list[TimedCall]:
    """The calls by which runs are timed, and for each how many times as long the run takes."""
    calls = []
    for method, setting, *_ in runs:
        part, steps = setting, setting.steps or 0
        if method.engine == "mujoco" and steps > FIRST_STEPS:  # each of its steps costs the same
            part = Setting(setting.duration * FIRST_STEPS / steps, FIRST_STEPS)
        call, _ = engines[method.engine].of(case).prepare(*case.start, case.tau, part, method.name)
        calls.append((call, setting.duration / part.duration))
    return calls


def take_times(runs: Sequence[Run], calls: Sequence[TimedCall]) -> None:
    """Set the seconds of runs to the least of their times; their calls are timed in turns."""
    times = timing.in_turns([call for call, _ in calls], rounds=5)
    for run, (_, factor), seconds in zip(runs, calls, times):
        run.row.seconds = factor * min(seconds)
        run.row.timed_steps = run.row.steps and round(run.row.steps / factor)
