"""One scene by every scheme and step: a method of tmt and the integrators of MuJoCo with the same scheme."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...core.rows import Row, column
from ...core.text import say
from ...engines import LABELS, Dynamics, Engine, Method, compared
from ...judge import run as rules
from ...judge.agree import closest
from ...judge.rounding import NARROW, band, step_rounding
from ...robots.case import Case
from ...robots.coordinates import rates_at
from ...robots.file import steps_afforded

STEPS_AT_MOST = 8192  # of a run that is finer than the scene's own
# decay rate times dt up to which RK4 is stable: beyond, each stage multiplies the rounding of the one before
FASTEST = 2.785
BEARABLE = 2.0  # the fastest rate times dt up to which every scheme is stable, about
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


class Path(NamedTuple):
    """The run of one engine at each of its steps."""

    q: np.ndarray  # (steps + 1, nq) rad
    v: np.ndarray  # (steps + 1, nv)
    ended: float | None = None  # s: when it diverged
    left: float | None = None  # s: when it left its start


@dataclass(frozen=True, kw_only=True)
class Run:
    """One case by one scheme and step in both engines."""

    case: Case
    scheme: str
    steps: int
    t: np.ndarray  # (steps + 1,) s
    paths: dict[str, Path]  # by engine, MuJoCo last
    width: np.ndarray  # (recorded, 2 nv): the band of rounding, of movements first
    widest: np.ndarray  # (2 nv,): the width of the band from which on it judges no more
    integrator: str  # of MuJoCo
    judged_until: float = 0.0  # s

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
    def ends(self) -> list[float | None]:
        """When the run of each engine has diverged, s."""
        return [path.ended for path in self.paths.values()]

    @property
    def apart(self) -> float:
        """The largest difference of the engines while they are judged, rad or m."""
        last = int(np.searchsorted(self.t, self.judged_until * (1 + 1e-9), side="right"))
        first, mujoco = (path.q[: last : self.every] for path in self.paths.values())
        return float(rules.moved_from(first, mujoco, self.case.coordinates).max())

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


def follow(case: Case, engines: Mapping[str, Engine], finer: Sequence[int]) -> TrajectoryResult:
    """One case with every scheme that both engines have. finer: multiples of the scene's own steps."""
    first, mujoco = case.robot.compared
    result, dynamics = TrajectoryResult("trajectory", label=LABELS[first]), compared(engines, case)
    available = {method.scheme for method in engines[first].methods_in(case).values()}
    schemes: dict[str, list[Method]] = {}
    for method in engines[mujoco].methods_in(case).values():
        if method.scheme in available:
            schemes.setdefault(method.scheme, []).append(method)
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for steps in step_counts(case, finer):
            for scheme, methods in schemes.items():
                part = stable_part(case, scheme, case.duration / steps)
                runs = compare_scheme(result, part, dynamics, steps, scheme, methods)
                if part is case:
                    result.runs.append(runs[0])
    return result


def stable_part(case: Case, scheme: str, dt: float) -> Case:
    """The case; in a scene of a file, if the scheme does not bear dt, its beginning, with a step that it bears.

    The forces of springs limit every scheme, those of damping RK4, and those of servos Euler, too.
    """
    stepping, (decay, frequency) = METHODS[scheme], rates_at(case.tree, case.q)
    has_damping = not case.tree.has_gains or getattr(stepping, "implicit_gains", False)
    rate = frequency if has_damping and stepping.stages == 1 else max(decay, frequency)
    if "user" in case.scene.tags or not case.robot.is_read or rate * dt <= BEARABLE:
        return case
    return case.changed(duration=case.steps / rate, dt=1.0 / rate)


def path_of(case: Case, dynamics: Dynamics, dt: float, steps: int, method: str) -> tuple[np.ndarray, Path]:
    """The times, (steps + 1,) s, and the path of an engine in a case."""
    t, q, v, *_ = dynamics.run(*case.start, case.tau, dt, steps, method)
    left = rules.departure(t, q, case.coordinates)
    return t, Path(q, v, rules.diverged_at(case, t, q, v), left)


def one_step(
    dynamics: Dynamics, states: Sequence[np.ndarray], tau: np.ndarray, dt: float, method: str
) -> list[np.ndarray]:
    """q and v one step after each of the states, q and v."""
    motion = dynamics.run(states[0], states[1], tau, dt, 1, method)
    return [motion.q[:, 1], motion.v[:, 1]]


def differences(case: Case, states: Sequence[np.ndarray], others: Sequence[np.ndarray]) -> np.ndarray:
    """Absolute differences of q (times, nq) and v (times, nv) of two runs: (times, 2 nv), movements first."""
    movements = case.coordinates.difference(states[0], others[0])
    return np.abs(np.concatenate([movements, states[1] - others[1]], axis=-1))


def compare_scheme(
    result: Result, case: Case, dynamics: Mapping[str, Dynamics], steps: int, scheme: str,
    methods: Sequence[Method],
) -> list[Run]:  # fmt: skip
    """A run of TMT, or of a user's equations, and that of each integrator of MuJoCo with the same scheme.

    Compared are single steps from the recorded states of the first run, each within the rounding of a step,
    and the runs themselves, within the band, while it is narrow.
    """
    stepping, tree, tau = METHODS[scheme], case.tree, case.tau
    dt, every, (first, mujoco) = case.duration / steps, steps // recorded(case), dynamics.values()
    t, path = path_of(case, first, dt, steps, scheme)
    width = band(stepping, tree, path.q, path.v, tau, dt, every, steps_afforded(case.coordinates.nv))
    widest, at = rules.widest_judged(case, path.q, path.v), t[::every]
    alive = at < ends_first([path.ended])
    states = [path.q[::every][alive], path.v[::every][alive]]
    stepped = one_step(first, states, tau, dt, scheme)
    # the bound of a step's rounding is of first order in dt: too small beyond half a turn of a joint, and
    # where several stages are not stable
    turning = [i for i, unit in enumerate(case.coordinates.units) if unit == "rad"]
    rates = np.maximum(*(np.abs(speeds[:, turning]) for speeds in (states[1], stepped[1])))
    is_small = dt * rates.max(axis=1, initial=0.0) <= np.pi
    is_stable = stepping.stages == 1 or dt * max(rates_at(tree, case.q)) <= FASTEST
    single = is_stable & is_small
    states, stepped = ([values[single] for values in pair] for pair in (states, stepped))
    rounding = step_rounding(stepping, tree, states[0], states[1], tau, dt)
    runs = []
    for method in methods:
        paths = {case.robot.compared[0]: path, "mujoco": path_of(case, mujoco, dt, steps, method.name)[1]}
        run = Run(case=case, scheme=scheme, steps=steps, t=t, paths=paths, width=width, widest=widest,
                  integrator=method.name)  # fmt: skip
        count = judged(at, width < widest, run.ends)
        run = replace(run, judged_until=float(at[count - 1]))
        if single.any():
            apart = differences(case, stepped, one_step(mujoco, states, tau, dt, method.name))
            check_level(result, run, "one step", at[alive][single], apart, rounding)
            if (rounding.min(axis=0) >= widest).any():
                result.not_judged(run.where, "one step", say(result.finding("wide_step")))
        pair = ([one.q[::every][:count], one.v[::every][:count]] for one in paths.values())
        check_level(result, run, "open loop", at[:count], differences(case, *pair), width[:count])
        check_end(result, run)
        runs.append(run)
    return runs


def check_level(
    result: Result, run: Run, level: str, at: np.ndarray, apart: np.ndarray, tolerance: np.ndarray
) -> None:
    """A row and a check: the component and the recorded state that come closest to their tolerance.

    at: (states,) s. apart, tolerance: (states, 2 nv), movements in rad or m first, then speeds.
    """
    (k, i), coordinates = closest(apart, tolerance), run.case.coordinates
    unit, joint = coordinates.units[i % coordinates.nv], coordinates.speeds[i % coordinates.nv]
    unit, place = f"{unit}/s" if i >= coordinates.nv else unit, f"{joint} at t = {at[k]:.3f} s"
    quantity = f"{level}, {result.label} to MuJoCo"
    check = result.check(run.where, quantity, apart[k, i], tolerance[k, i], unit, place, True)
    largest = None if check.value is None else apart[:, : coordinates.nv].max()
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
