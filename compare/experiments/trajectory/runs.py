"""One scene by every scheme and step: a method of tmt and the integrators of MuJoCo with the same scheme."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...core.rows import Row, column
from ...core.text import say
from ...engines import LABELS, Dynamics, Engine, Method, Motion, compared, methods_in
from ...judge import run as rules
from ...judge.rounding import NARROW, band, step_rounding
from ...robots.case import Case
from ...robots.coordinates import rates_at
from ...robots.file import steps_afforded
from ..followed import Deviation, check_closest, differences, one_step

STEPS_AT_MOST = 8192  # of a run that is finer than the scene's own
# decay rate times dt up to which RK4 is stable: beyond, each stage multiplies the rounding of the one before
FASTEST = 2.785
BEARABLE = 2.0  # the fastest rate times dt up to which every scheme is stable, about
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


@dataclass(frozen=True)
class Run:
    """One case by one scheme and step in both engines."""

    case: Case
    scheme: str
    steps: int
    t: np.ndarray  # (steps + 1,) s
    paths: dict[str, Path]  # by engine, MuJoCo last
    band: np.ndarray  # (recorded,) of rounding, rad or m
    integrator: str = ""  # of MuJoCo
    judged_until: float = 0.0  # s

    @property
    def dt(self) -> float:
        return self.case.duration / self.steps

    @property
    def every(self) -> int:
        """The number of steps from one recorded state to the next."""
        return self.steps // recorded(self.case)

    @property
    def ends(self) -> list[float | None]:
        """When the run of each engine has diverged, s."""
        return [path.ended for path in self.paths.values()]

    @property
    def where(self) -> str:
        """The place of its checks."""
        return f"{self.case.name}, {self.integrator}, {rules.step_in_words(self.case, self.steps)}"

    @property
    def required(self) -> float:
        """The shortest time for which it must be judged, s; 0: the scene states none."""
        return rules.required_time(self.case, self.scheme, self.dt)

    def until_diverged(self, engine: str, values: np.ndarray) -> np.ndarray:
        """Values of the run of an engine, (times, n), NaN from where it has diverged."""
        ended = self.paths[engine].ended
        return values if ended is None else np.where((self.t < ended)[:, None], values, np.nan)


class Twin(NamedTuple):
    """The side of TMT, or of a user's own equations: its run, and what MuJoCo's is compared with."""

    run: Run
    width: np.ndarray  # (recorded, 2 nv): the band of rounding, of movements first
    widest: np.ndarray  # (2 nv,): the width of the band from which on it judges no more
    at: np.ndarray  # (states,) s: recorded times from which a single step is compared
    states: list[np.ndarray]  # q and v at these times
    stepped: list[np.ndarray]  # q and v one step later
    step_tolerance: np.ndarray  # (states, 2 nv)


@dataclass
class TrajectoryResult(Result):
    runs: list[Run] = field(default_factory=list)
    # of each scene whose true motion is known: the largest error of both engines, rad or m
    errors: dict[str, tuple[float | None, float | None]] = field(default_factory=dict)

    @property
    def of_beginnings(self) -> list[TrajectoryRow]:
        """The rows of runs that have the beginning of a scene alone."""
        to_end = {(run.case.name, run.dt) for run in self.runs}
        return [row for row in self.rows if (row.scene, row.dt) not in to_end]

    def run_of(self, case: Case, *schemes: str) -> Run | None:
        """The run of a case with its own step by one of these schemes."""
        of_case = [run for run in self.runs if (run.case.name, run.steps) == (case.name, case.steps)]
        return next((run for run in of_case if run.scheme in schemes), None)


def step_counts(case: Case, finer: Sequence[int]) -> list[int]:
    """The numbers of steps of a case's runs: its own, and multiples of it up to 8192 and steps_afforded."""
    most = min(STEPS_AT_MOST, steps_afforded(case.coordinates.nv))
    return [case.steps * multiple for multiple in finer if multiple == 1 or case.steps * multiple <= most]


def recorded(case: Case) -> int:
    """The number of states of a run that are compared, without its start: one for each 1, 2, 4 ... steps."""
    count = case.steps
    while count > RECORDED and count % 2 == 0:
        count //= 2
    return count


def follow(
    case: Case, engines: Mapping[str, Engine], finer: Sequence[int], few: Sequence[str] = ()
) -> TrajectoryResult:
    """One case with every scheme that both engines have. finer: multiples of the scene's own steps.

    few: MuJoCo's integrators for a scene whose errors are not regular; (): all.
    """
    first, mujoco = case.robot.compared
    result, dynamics = TrajectoryResult("trajectory", label=LABELS[first]), compared(engines, case)
    available = {method.scheme for method in methods_in(engines[first], case).values()}
    chosen = () if "regular" in case.scene.tags else few
    schemes: dict[str, list[Method]] = {}
    for method in methods_in(engines[mujoco], case).values():
        if method.scheme in available and (not chosen or method.name in chosen):
            schemes.setdefault(method.scheme, []).append(method)
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for steps in step_counts(case, finer):
            for scheme, methods in schemes.items():
                stable = stable_part(case, scheme)
                twin = run_of_twin(stable, dynamics[first], steps, scheme)
                runs = [compare_run(result, twin, dynamics[mujoco], method) for method in methods]
                if stable is case:
                    result.runs.append(runs[0])
    return result


def stable_part(case: Case, scheme: str) -> Case:
    """The case; in a scene of a file whose step the scheme does not bear, its beginning, with a step that it bears.

    The forces of springs limit every scheme, those of damping RK4, and those of servos Euler, too.
    """
    stepping, (decay, frequency) = METHODS[scheme], rates_at(case.tree, case.q)
    has_damping = not case.tree.has_gains or getattr(stepping, "implicit_gains", False)
    rate = frequency if has_damping and stepping.stages == 1 else max(decay, frequency)
    if "user" in case.scene.tags or not case.robot.is_read or rate * case.scene.dt <= BEARABLE:
        return case
    return case.changed(duration=case.steps / rate, dt=1.0 / rate)


def run_of_twin(case: Case, dynamics: Dynamics, steps: int, scheme: str) -> Twin:
    """TMT's side of a case, or a user's: the run, its band, and single steps from its recorded states."""
    stepping, tree, tau = METHODS[scheme], case.tree, case.tau
    dt, every = case.duration / steps, steps // recorded(case)
    motion = dynamics.run(*case.start, tau, dt, steps, scheme)
    path = Path.of(case, motion)
    width = band(stepping, tree, path.q, path.v, tau, dt, every, steps_afforded(case.coordinates.nv))
    alive = motion.t[::every] < ends_first([path.ended])
    states, times = [values[::every][alive] for values in (path.q, path.v)], motion.t[::every][alive]
    stepped = one_step(dynamics, states, tau, dt, scheme)
    # the bound of a step's rounding is of first order in dt: too small beyond half a turn of a joint, and
    # where several stages are not stable
    turning = [i for i, unit in enumerate(case.coordinates.units) if unit == "rad"]
    rates = np.maximum(*(np.abs(speeds[:, turning]) for speeds in (states[1], stepped[1])))
    is_slow = stepping.stages == 1 or dt * max(rates_at(tree, case.q)) <= FASTEST
    single = is_slow & (dt * rates.max(axis=1, initial=0.0) <= np.pi)
    states, stepped = ([values[single] for values in pair] for pair in (states, stepped))
    of_positions = width[:, : case.coordinates.nv].max(axis=1)
    run = Run(case, scheme, steps, motion.t, {case.robot.compared[0]: path}, of_positions)
    tolerance = step_rounding(stepping, tree, states[0], states[1], tau, dt)
    widest = rules.widest_judged(case, path.q, path.v)
    return Twin(run, width, widest, times[single], states, stepped, tolerance)


def compare_run(result: Result, twin: Twin, dynamics: Dynamics, method: Method) -> Run:
    """One side and an integrator of MuJoCo with the same scheme, from the same start with the same step."""
    case, (run, width, widest, at, states, stepped, step_tolerance) = twin.run.case, twin
    first, coordinates, times = run.paths[case.robot.compared[0]], case.coordinates, run.t[:: run.every]
    mujoco = Path.of(case, dynamics.run(*case.start, case.tau, run.dt, run.steps, method.name))
    run = replace(run, integrator=method.name, paths=run.paths | {"mujoco": mujoco})
    count = judged(times, width < widest, run.ends)
    run = replace(run, judged_until=float(times[count - 1]))
    if len(at):
        apart = differences(coordinates, stepped, one_step(dynamics, states, case.tau, run.dt, method.name))
        check_level(result, run, "one step", Deviation(coordinates, at, apart, step_tolerance))
        if (step_tolerance.min(axis=0) >= widest).any():
            result.not_judged(run.where, "one step", say(result.finding("wide_step")))
    last = count * run.every
    pair = ([path.q[: last : run.every], path.v[: last : run.every]] for path in (first, mujoco))
    apart = differences(coordinates, *pair)
    check_level(result, run, "open loop", Deviation(coordinates, times[:count], apart, width[:count]))
    check_end(result, run)
    return run


def check_level(result: Result, run: Run, level: str, deviation: Deviation) -> None:
    """A row and a check: the component and the recorded state that come closest to their tolerance."""
    check = check_closest(result, run.where, f"{level}, {result.label} to MuJoCo", deviation)
    movements = deviation.difference[:, : deviation.coordinates.nv]
    largest = None if check.value is None else movements.max()
    twin_diverged_at, diverged_at = run.ends
    result.rows.append(TrajectoryRow(
        scene=run.case.name, engine_integrator=run.integrator, twin=run.scheme, dt=run.dt, level=level,
        largest_difference=largest, unit=rules.movement_unit(run.case.coordinates),
        worst_difference=check.value, band=check.tolerance, worst_unit=check.unit, worst_place=check.note,
        difference_over_band=check.over_tolerance, judged_until=run.judged_until, required=run.required,
        diverged_at=diverged_at, twin_diverged_at=twin_diverged_at,
    ))  # fmt: skip


def check_end(result: Result, run: Run) -> None:
    """How long a run is judged, whether both runs diverge alike, and whether it moves."""
    case, end, times = run.case, ends_first(run.ends), run.t[:: run.every]
    alive = times[times < end][-1]
    check_time_judged(result, run, alive)
    is_known = check_divergence(result, run)
    if not (alive or is_known or run.required):
        result.not_judged(run.where, "open loop", say(result.finding("diverges_at_once")))
    if case.is_free and "own" not in case.scene.tags:
        alive_paths = [path.q[run.t < end] for path in run.paths.values()]
        moved = min(rules.deviation(q, case.q, case.coordinates) for q in alive_paths)
        rules.check_movement(result, run.where, moved, rules.movement_unit(case.coordinates))


def ends_first(ends: Sequence[float | None]) -> float:
    """When the first of the runs has diverged, s; inf: none has."""
    return min((end for end in ends if end is not None), default=np.inf)


def judged(times: np.ndarray, narrow: np.ndarray, ends: Sequence[float | None]) -> int:
    """The number of recorded states up to where the band is not narrow, (recorded, 2 nv), or a run diverges."""
    alive = times < ends_first(ends)
    return max(1, int(np.argmin(np.append(narrow.all(axis=1) & alive, False))))


def check_time_judged(result: Result, run: Run, alive: float) -> None:
    """A run is judged for the time that its scene states, or for a tenth of it, or of `alive`, s."""
    until, least = run.judged_until, run.required or min(rules.LEAST_JUDGED * run.case.duration, alive)
    if until < least:
        reason = say(result.finding("wide", until=until, least=least))
        result.not_judged(run.where, "time judged", reason, "s")
    elif run.required:
        result.check(run.where, "time judged", until, least, "s", rule="at least", about=About.PREDICTION)


def check_divergence(result: Result, run: Run) -> bool:
    """Whether the steps at which both diverge are compared: if the band is narrow at the next recorded state."""
    end, steps, dt = ends_first(run.ends), run.steps, run.dt
    if end == np.inf:
        return False
    is_narrow = bool(run.band[-(-round(end / dt) // run.every)] < NARROW)
    if is_narrow:
        first, mujoco = (steps + 1 if at is None else round(at / dt) for at in run.ends)
        whose = "TMT's" if result.label == "TMT" else result.label
        note = f"{steps + 1}: never" if steps + 1 in (first, mujoco) else ""
        what = f"step of divergence, MuJoCo's, is {whose}"
        result.check(run.where, what, mujoco, first, "", note, rule="equal")
    return is_narrow
