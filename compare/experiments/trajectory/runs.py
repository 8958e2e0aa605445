"""One scene by every scheme and step: a method of tmt and the integrators of MuJoCo with the same scheme."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...core.pictures import Pictures
from ...core.rows import Row, column
from ...core.text import say
from ...engines import LABELS, Dynamics, Engine, Method, Motion, compared, methods_in
from ...judge import run as rules
from ...judge.rounding import NARROW, band, step_rounding
from ...robots.case import Case
from ..followed import Deviation, check_closest, differences

STEPS_AT_MOST = 8192  # of a run that is finer than the scene's own
MOST_ENTRIES = 2_700_000  # of all Jacobians of a run, which take the time
RECORDED = 64  # states of a run that are compared: one for each of the scene's own steps, or fewer


@dataclass(kw_only=True)
class TrajectoryRow(Row):
    """The largest difference of the engines in single steps, or in an open loop."""

    scene: str
    engine_integrator: str
    twin: str
    dt: float = column("s", digits=5)
    level: str = ""
    largest_difference: float | None = None
    unit: str = "rad"
    worst_difference: float | None = None
    band: float | None = None
    worst_unit: str = ""
    difference_over_band: float | None = None
    worst_place: str = ""
    judged_until: float = column("s")
    required: float = column("s")
    diverged_at: float | None = column("s", default=None)
    twin_diverged_at: float | None = column("s", default=None)

    @property
    def urgency(self) -> tuple[bool, bool, float]:
        share = self.difference_over_band
        return True, True, np.inf if share is None else -share


class Path(NamedTuple):
    """The run of one engine at each of its steps."""

    q: np.ndarray  # (steps + 1, nq) rad
    v: np.ndarray  # (steps + 1, nv)
    ended: float | None = None  # s: when it diverged
    left: float | None = None  # s: when it left its start

    @classmethod
    def of(cls, case: Case, motion: Motion) -> "Path":
        ended = rules.diverged_at(case, motion.t, motion.q, motion.v)
        return cls(motion.q, motion.v, ended, rules.departure(motion.t, motion.q, case.coordinates))


class Ours(NamedTuple):
    """One case with one scheme and step by TMT, or by a user's own equations."""

    case: Case
    scheme: str
    steps: int
    t: np.ndarray  # (steps + 1,) s
    path: Path
    width: np.ndarray  # (recorded, 2 nv): the band of rounding, of movements first
    widest: np.ndarray  # (2 nv,): the width of the band from which on it judges no more
    at: np.ndarray  # (states,) s: recorded times from which a single step is compared
    states: list[np.ndarray]  # q and v at these times
    stepped: list[np.ndarray]  # q and v one step later
    step_tolerance: np.ndarray  # (states, 2 nv)

    @property
    def dt(self) -> float:
        return self.case.duration / self.steps

    @property
    def every(self) -> int:
        """The number of steps from one recorded state to the next."""
        return self.steps // recorded(self.case)


@dataclass(kw_only=True)
class Run:
    """One case by one scheme and step in both engines."""

    case: Case
    scheme: str
    integrator: str  # of MuJoCo
    steps: int
    t: np.ndarray  # (steps + 1,) s
    every: int  # steps from one recorded state to the next
    paths: dict[str, Path]  # by engine, MuJoCo last
    band: np.ndarray  # (recorded,) of rounding, rad or m
    judged_until: float  # s

    def until_diverged(self, engine: str, values: np.ndarray) -> np.ndarray:
        """Values of the run of an engine, (times, n), NaN from where it has diverged."""
        ended = self.paths[engine].ended
        return values if ended is None else np.where((self.t < ended)[:, None], values, np.nan)


@dataclass
class TrajectoryResult(Result):
    runs: list[Run] = field(default_factory=list)
    # of each scene whose true motion is known: the largest error of both engines, rad or m
    errors: dict[str, tuple[float | None, float | None]] = field(default_factory=dict)
    pictures: list[Pictures] = field(default_factory=list)


def steps_afforded(case: Case) -> int:
    """The steps of a run for which its band is computed: each has a Jacobian of (2 nv)^2 entries."""
    return MOST_ENTRIES // (2 * case.coordinates.nv) ** 2


def step_counts(case: Case, finer: Sequence[int]) -> list[int]:
    """The numbers of steps of a case's runs: its own, and multiples of it up to 8192 and steps_afforded."""
    most = min(STEPS_AT_MOST, steps_afforded(case))
    return [case.steps * multiple for multiple in finer if multiple == 1 or case.steps * multiple <= most]


def recorded(case: Case) -> int:
    """The number of states of a run that are compared, without its start: all its own steps, or every 2nd, 4th ..."""
    count = case.steps
    while count > RECORDED and count % 2 == 0:
        count //= 2
    return count


def follow(case: Case, engines: Mapping[str, Engine], finer: Sequence[int]) -> TrajectoryResult:
    """One case with every scheme that both engines have and every step size, in multiples of the scene's own steps."""
    ours, theirs = case.robot.compared
    result, dynamics = TrajectoryResult("trajectory", label=LABELS[ours]), compared(engines, case)
    available = {method.scheme for method in methods_in(engines[ours], case).values()}
    schemes: dict[str, list[Method]] = {}
    for method in methods_in(engines[theirs], case).values():
        if method.scheme in available:
            schemes.setdefault(method.scheme, []).append(method)
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for steps in step_counts(case, finer):
            for scheme, methods in schemes.items():
                mine = run_of_ours(case, dynamics[ours], steps, scheme)
                runs = [compare_run(result, mine, dynamics[theirs], method) for method in methods]
                result.runs.append(runs[0])
    return result


def run_of_ours(case: Case, dynamics: Dynamics, steps: int, scheme: str) -> Ours:
    """TMT's side of a case, or a user's: the run, its band, and single steps from its recorded states."""
    stepping, tree, tau = METHODS[scheme], case.tree, case.tau
    dt, every = case.duration / steps, steps // recorded(case)
    motion = dynamics.run(*case.start, tau, dt, steps, scheme)
    t, q, v = motion.t, motion.q, motion.v
    path = Path.of(case, motion)
    width = band(stepping, tree, q, v, tau, dt, every, steps_afforded(case))
    alive = t[::every] < (np.inf if path.ended is None else path.ended)
    states, times = [values[::every][alive] for values in (q, v)], t[::every][alive]
    stepped = one_step(dynamics, states, tau, dt, scheme)
    # the bound of a step's rounding is of first order in dt, and too small where a joint turns by more than half a turn
    turning = [i for i, unit in enumerate(case.coordinates.units) if unit == "rad"]
    rates = np.maximum(*(np.abs(speeds[:, turning]) for speeds in (states[1], stepped[1])))
    single = dt * rates.max(axis=1, initial=0.0) <= np.pi
    states, stepped = ([values[single] for values in pair] for pair in (states, stepped))
    tolerance, widest = step_rounding(stepping, tree, *states, tau, dt), rules.widest_judged(case, q, v)
    return Ours(case, scheme, steps, t, path, width, widest, times[single], states, stepped, tolerance)


def one_step(
    dynamics: Dynamics, states: Sequence[np.ndarray], tau: np.ndarray, dt: float, method: str
) -> list[np.ndarray]:
    """q and v one step after each of the states."""
    motion = dynamics.run(*states, tau, dt, 1, method)
    return [motion.q[:, 1], motion.v[:, 1]]


def compare_run(result: Result, mine: Ours, dynamics: Dynamics, method: Method) -> Run:
    """One side and an integrator of MuJoCo with the same scheme, from the same start with the same step."""
    case, dt, every, coordinates = mine.case, mine.dt, mine.every, mine.case.coordinates
    theirs = Path.of(case, dynamics.run(*case.start, case.tau, dt, mine.steps, method.name))
    ends, times = (mine.path.ended, theirs.ended), mine.t[::every]
    count = judged(times, mine.width < mine.widest, ends)
    run = Run(
        case=case, scheme=method.scheme, integrator=method.name, steps=mine.steps, t=mine.t, every=every,
        paths=dict(zip(case.robot.compared, (mine.path, theirs))), band=mine.width[:, : coordinates.nv].max(axis=1),
        judged_until=float(times[count - 1]),
    )  # fmt: skip
    where = f"{case.name}, {method.name}, {rules.step_in_words(case, mine.steps)}"
    required = rules.required_time(case, method.scheme, dt)
    row = TrajectoryRow(
        scene=case.name, engine_integrator=method.name, twin=method.scheme, dt=dt, unit=rules.movement_unit(coordinates),
        judged_until=run.judged_until, required=required, diverged_at=theirs.ended, twin_diverged_at=mine.path.ended,
    )  # fmt: skip
    if len(mine.at):
        stepped = one_step(dynamics, mine.states, case.tau, dt, method.name)
        off = differences(coordinates, mine.stepped, stepped)
        check_level(
            result,
            where,
            replace(row, level="one step"),
            Deviation(coordinates, mine.at, off, mine.step_tolerance),
        )
        if (mine.step_tolerance.min(axis=0) >= mine.widest).any():
            result.not_judged(where, "one step", say(result.finding("wide_step")))
    ours, other = ([path.q[::every][:count], path.v[::every][:count]] for path in (mine.path, theirs))
    deviation = Deviation(
        coordinates, times[:count], differences(coordinates, ours, other), mine.width[:count]
    )
    check_level(result, where, replace(row, level="open loop"), deviation)
    check_end(result, where, run, required)
    return run


def check_end(result: Result, where: str, run: Run, required: float) -> None:
    """How long a run is judged, whether both runs diverge alike, and whether it moves."""
    case, ends = run.case, [path.ended for path in run.paths.values()]
    alive = run.t[:: run.every][run.t[:: run.every] < ends_first(ends)][-1]
    check_time_judged(result, where, case, run.judged_until, required, alive)
    is_known = check_divergence(result, where, ends, case.duration / run.steps, run.steps, run.band)
    if not (alive or is_known or required):
        result.not_judged(where, "open loop", say(result.finding("diverges_at_once")))
    if case.is_free and "own" not in case.scene.tags:
        before = run.t < ends_first(ends)
        moved = min(
            rules.deviation_alive(path.q[before], case.q, case.coordinates) for path in run.paths.values()
        )
        rules.check_movement(result, where, moved, rules.movement_unit(case.coordinates))


def ends_first(ends: Sequence[float | None]) -> float:
    """When the first of the runs has diverged, s; inf: none has."""
    return min((end for end in ends if end is not None), default=np.inf)


def judged(times: np.ndarray, narrow: np.ndarray, ends: Sequence[float | None]) -> int:
    """The number of recorded states that are judged: those before the band is wide or a run has diverged, and the start.

    narrow: whether the band still judges each movement and speed, (recorded, 2 nv).
    """
    alive = times < ends_first(ends)
    return max(1, int(np.argmin(np.append(narrow.all(axis=1) & alive, False))))


def check_time_judged(
    result: Result, where: str, case: Case, until: float, required: float, alive: float
) -> None:
    """A run is judged for the time that its scene states, or for a tenth of it while it is alive; else it is not judged.

    until: when it is no more judged; alive: the last recorded time before one of both runs diverges, s.
    """
    least = required or min(rules.LEAST_JUDGED * case.duration, alive)
    if until < least:
        reason = say(result.finding("wide", until=until, least=least))
        result.not_judged(where, "time judged", reason, "s")
    elif required:
        result.check(where, "time judged", until, required, "s", rule="at least", about=About.PREDICTION)


def check_divergence(
    result: Result, where: str, ends: Sequence[float | None], dt: float, steps: int, width: np.ndarray
) -> bool:
    """Both diverge at the same step, if one does and the band (recorded,) is narrow at the first recorded state after that.

    Returned: whether that is compared. ends: of MuJoCo's partner and of MuJoCo, s.
    """
    end = ends_first(ends)
    if end == np.inf:
        return False
    every = steps // (len(width) - 1)
    is_narrow = bool(width[-(-round(end / dt) // every)] < NARROW)
    if is_narrow:
        ours, theirs = (steps + 1 if at is None else round(at / dt) for at in ends)
        whose = "TMT's" if result.label == "TMT" else result.label
        note = f"{steps + 1}: never" if steps + 1 in (ours, theirs) else ""
        result.check(where, f"step of divergence, MuJoCo's, is {whose}", theirs, ours, "", note, rule="equal")
    return is_narrow


def check_level(result: Result, where: str, row: TrajectoryRow, deviation: Deviation) -> None:
    """A check of the component and the recorded state that come closest to their tolerance, and the row, filled in."""
    check = check_closest(result, where, f"{row.level}, {result.label} to MuJoCo", deviation)
    if check.value is not None:
        row.largest_difference = float(deviation.difference[:, : deviation.coordinates.nv].max())
    row.worst_difference, row.band, row.difference_over_band = (
        check.value,
        check.tolerance,
        check.over_tolerance,
    )
    row.worst_unit, row.worst_place = check.unit, check.note
    result.rows.append(row)
