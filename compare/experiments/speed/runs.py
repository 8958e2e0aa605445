"""The table of runs: scene, engine, method and setting; error and time of each. And the error that rounding leaves."""

import math
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

import tmt
from tmt.methods import METHODS

from ...core import timing
from ...core.check import Result
from ...core.rows import MOVEMENT, MovementRow, column
from ...engines import GRID, IN_QUICK_RUNS, RECORDS, Dynamics, Engine, Method, Setting
from ...engines.outside.file import EngineError, TooLong
from ...judge.rounding import growth
from ...judge.run import movement_unit
from ...judge.scale import EPS
from ...robots.case import Case
from ...truth.reference import NoReference, Reference, coarsest_steps, reference
from ..runs import follow
from .settings import budget, methods, settings_of

NEAR = 1.0  # rad or m: a run whose largest error is smaller has not diverged
EARLY = 1.0  # s: until then chaos has not grown, and errors fall regularly
GROWTH_STEPS = 16  # of the run whose growth is computed, between two recorded times
EACH_STEP = 12  # nv up to which the growth takes the Jacobian of every step, not of one in GROWTH_STEPS
FIRST_STEPS = 512  # a longer run of MuJoCo or tmt is timed over its first steps only
ROUNDS = 5  # of timing in turns
Settings = Mapping[Method, Sequence[Setting]]  # from coarse to fine


@dataclass(kw_only=True)
class RunRow(MovementRow):
    """One run of a method in a scene, or why there is none."""

    scene: str
    engine: str
    method: str
    scheme: str = ""  # methods of the same scheme differ only by rounding
    order: int | None = None
    dt: float | None = column("s", digits=5, default=None)
    tolerance: float | None = None
    steps: int | None = None
    timed_steps: int | None = None  # fewer than steps: the time is extrapolated
    evaluations: int | None = None
    seconds: float | None = None  # of the engine's own steps
    compile_seconds: float | None = None  # until the first run of the method could begin
    error: float | None = column(MOVEMENT, default=None)  # at the end
    worst_error: float | None = column(MOVEMENT, default=None)
    early_error: float | None = column(MOVEMENT, default=None)  # the largest of the first second
    energy_error: float | None = column("J", default=None)
    ended: str | None = None  # why it did not reach the end
    why_not: str | None = None

    @property
    def time(self) -> float:
        """The time of the run, s; infinite where it was not timed."""
        return math.inf if self.seconds is None else self.seconds

    @property
    def largest_error(self) -> float:
        """The worst error of the run, rad or m; infinite if it diverged or is none."""
        return math.inf if self.worst_error is None else self.worst_error

    @property
    def extrapolated(self) -> bool:
        return self.timed_steps is not None and self.timed_steps != self.steps

    def setting(self, duration: float) -> Setting:
        return Setting(duration, None if self.tolerance else self.steps, self.tolerance)


@dataclass
class SceneRuns:
    case: Case
    reference: Reference
    floor: float  # rad or m: the error that rounding, or the reference, leaves
    rows: list[RunRow] = field(default_factory=list)


@dataclass
class SpeedResult(Result):
    floors: dict[str, float] = field(default_factory=dict)  # by scene, see SceneRuns
    regular: str = ""  # the scene in which errors are regular
    unit: str = "rad"
    servos_off: bool = False  # whether the robot has servos, which do not act in the regular scene


def scene_runs(case: Case, engines: Mapping[str, Engine], size: str) -> SceneRuns | NoReference:
    """The runs of a scene by compiled methods, whose times are taken later; or why it has no reference."""
    try:
        exact = reference(case)
        rounded = floor(case, engines["tmt"].of(case))
    except NoReference as error:
        return error
    scene = SceneRuns(case, exact, max(rounded, exact.apart))
    scene.rows = rows_of(scene, engines, size, compiled=True)
    for row in scene.rows:
        row.seconds = None
    return scene


def rows_of(scene: SceneRuns, engines: Mapping[str, Engine], size: str, compiled: bool) -> list[RunRow]:
    """Rows of the methods whose loop is compiled here, or of the others, each of whose runs is timed."""
    case, every = scene.case, methods(engines, size, scene.case)
    some = [method for method in every if (method.engine in IN_QUICK_RUNS) == compiled]
    settings = {method: settings_of(method, case, size) for method in some}
    longest = max((budget(method, case.robot, size).seconds for method in some), default=0.0)
    return measure(case, engines, settings, scene.reference, math.inf if compiled else longest)


def measure(
    case: Case, engines: Mapping[str, Engine], settings: Settings, reference: Reference,
    budget: float = math.inf,
) -> list[RunRow]:  # fmt: skip
    """Rows of all methods and settings, with the errors of each run and its time, taken once.

    budget: s; a method has no finer run after one that takes longer. A method that its engine does not run is
    one row with the reason; an engine that gives no answer in time is not asked again.
    """
    rows: list[RunRow] = []
    silent: dict[str, str] = {}  # engines, and why
    paths: list[np.ndarray] = []  # of the rows that reach the end
    for method, of_method in settings.items():
        row_of = partial(
            RunRow, scene=case.name, engine=method.engine, method=method.name, scheme=method.scheme, order=method.order,
            unit=movement_unit(case.coordinates),
        )  # fmt: skip
        for setting in of_method:
            try:
                begin = time.process_time()
                if method.engine in silent:
                    raise EngineError(silent[method.engine])
                run = follow(case, engines[method.engine].of(case), setting, method.name)
            except EngineError as error:
                if isinstance(error, TooLong):
                    silent[method.engine] = str(error)
                rows.append(row_of(why_not=str(error).rstrip(".")))
                break
            row = row_of(
                tolerance=setting.tolerance, dt=setting.duration / setting.steps if setting.steps else None,
                steps=run.steps, evaluations=run.evaluations, seconds=run.seconds, compile_seconds=run.preparation,
            )  # fmt: skip
            rows.append(row)
            with np.errstate(all="ignore"):
                errors = np.maximum(reference.error(run.q), reference.apart if reference.why else 0.0)
            # a run that stays near has about the energy of the reference
            if not errors.max() <= NEAR and run.ended < math.inf:
                row.ended = run.why or f"diverged at {run.ended:.2g} s"
            else:
                paths.append(np.hstack([run.q, run.v]))
                row.error, row.worst_error = float(errors[-1]), float(errors.max())
                row.early_error = float(errors[reference.t <= EARLY].max())
            # of this process, which another one may interrupt, its own time
            spent = row.time if RECORDS[method.engine].reads_file else time.process_time() - begin
            if spent > budget:
                break
    states, nq = np.array([*paths, reference.high]), case.coordinates.nq
    energy = tmt.energy(case.tree, states[..., :nq], states[..., nq:])
    for row, off in zip([row for row in rows if row.worst_error is not None], np.abs(energy - energy[-1])):
        row.energy_error = float(off.max())
    return rows


def floor(case: Case, dynamics: Dynamics) -> float:
    """The error of the angles that rounding leaves, rad: eps times the largest growth of a small difference.

    dynamics: tmt's, run by RK4 with 1024 steps or as many as the scene needs; NoReference if the run
    diverges.
    """
    recorded = GROWTH_STEPS * GRID
    first = recorded * max(1, round(case.duration / 5.0), -(-coarsest_steps(case) // recorded))
    for steps in (first, 4 * first, 16 * first):
        dt = case.duration / steps
        run = follow(case, dynamics, Setting(case.duration, steps, intervals=steps), "rk4")
        if np.isfinite(run.q).all():
            stride = 1 if case.coordinates.nv <= EACH_STEP else GROWTH_STEPS
            grown = growth(METHODS["rk4"], case.tree, run.q, run.v, case.tau, dt, GROWTH_STEPS, stride)
            return float(EPS * 10.0 ** grown.max() * max(1.0, np.abs(run.q).max()))
    reached = f"scene {case.name!r}: RK4 with {steps} steps does not reach its end"
    raise NoReference(f"{reached}; expected a shorter scene")


def prepared(case: Case, row: RunRow, engines: Mapping[str, Engine]) -> tuple[Callable[[], object], float]:
    """A call by which a run is timed, and how many times as long the run takes."""
    setting = part = row.setting(case.duration)
    if row.engine in IN_QUICK_RUNS and (setting.steps or 0) > FIRST_STEPS:  # each of its steps costs the same
        part = Setting(case.duration * FIRST_STEPS / (setting.steps or 1), FIRST_STEPS)
    call, _ = engines[row.engine].of(case).prepare(*case.start, case.tau, part, row.method)
    return call, setting.duration / part.duration


def take_times(case: Case, rows: Sequence[RunRow], engines: Mapping[str, Engine]) -> None:
    """Set the seconds of rows to the least of their times; their runs take turns.

    Engines in processes of their own have timed their runs there, without what it takes to ask them.
    """
    rows = [row for row in rows if not RECORDS[row.engine].reads_file]
    calls = [prepared(case, row, engines) for row in rows]
    for row, (_, factor), seconds in zip(rows, calls, timing.in_turns([call for call, _ in calls], ROUNDS)):
        row.seconds = factor * min(seconds)
        row.timed_steps = row.steps and round(row.steps / factor)


def same_scheme(rows: Sequence[RunRow], row: RunRow) -> RunRow | None:
    """tmt's run with the scheme and the step of a row, or None."""
    twins = (one for one in rows if (one.scene, one.engine, one.method) == (row.scene, "tmt", row.scheme))
    return next((twin for twin in twins if row.dt and twin.dt == row.dt), None)
