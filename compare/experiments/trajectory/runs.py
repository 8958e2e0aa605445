"""One scene by every scheme and step: a method of tmt and the integrators of MuJoCo with the same scheme."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS

from ...engines import LABELS, Dynamics, Engine, Method, compared, methods_in
from ...judge.check import About, Result
from ...judge.rounding import NARROW, band, slope_rounding, step_rounding
from ...judge.run import (
    check_movement,
    departure,
    deviation_alive,
    diverged_at,
    movement_unit,
    required_time,
    step_in_words,
)
from ...judge.scale import EPS
from ...robots.case import Case, Coordinates
from ...truth.linear import Held
from ...truth.smallest import reduced
from ...truth.steps import beyond_limit
from .motion import Drawn, at_equal_times, drawn_motion
from .rules import check_divergence, check_level, check_same_bits, ends_first, judged

STEPS_AT_MOST = 8192  # steps of a run that is finer than the scene's own
MOST_ENTRIES, FEW_ENTRIES = 2_700_000, 100_000  # of all Jacobians of a run, which take the time; in a small run
RECORDED = 64  # states of a run that are compared: one for each of the scene's own steps, or fewer
HALF_TURN = (
    np.pi
)  # rad: the bound of a step's rounding is of first order in dt, and too small where a joint turns farther


class TmtSide(NamedTuple):
    """One case with one scheme and step by TMT, or by a user's own equations, recorded at the scene's own steps."""

    t: np.ndarray  # (steps + 1,) s
    q: np.ndarray  # (steps + 1, nq) rad
    v: np.ndarray  # (steps + 1, nv)
    width: np.ndarray  # (recorded, 2 nv): the band of rounding, of movements first
    ended: float | None  # s: when it diverged
    states: list  # the recorded q and v before that
    derivative: np.ndarray  # (states, nv) rad/s2: accelerations
    derivative_tolerance: np.ndarray  # (states,)
    stepped: list  # q and v one step from each of the states
    step_tolerance: np.ndarray  # (states, 2 nv)
    perturbed: np.ndarray  # (steps + 1, nq): positions of the run from a start that is 1 eps off


def steps_afforded(case: Case, entries: int = MOST_ENTRIES) -> int:
    """The steps of a run for which its band is computed: each has a Jacobian of (2 nv)^2 of all the entries."""
    return entries // (2 * case.coordinates.nv) ** 2


def step_counts(case: Case, finer: Sequence[int], entries: int = MOST_ENTRIES) -> list[int]:
    """The numbers of steps of a case's runs, multiples of its own: its own, and those up to 8192 and steps_afforded."""
    most = min(STEPS_AT_MOST, steps_afforded(case, entries))
    return [case.steps * multiple for multiple in finer if multiple == 1 or case.steps * multiple <= most]


def recorded(case: Case) -> int:
    """The number of states of a run that are compared, without its start: all its own steps, or every 2nd, 4th ..."""
    count = case.steps
    while count > RECORDED and count % 2 == 0:
        count //= 2
    return count


def state_difference(coordinates: Coordinates, state: Sequence, other: Sequence) -> np.ndarray:
    """The difference of states (q, v): movements and speeds, (..., 2 nv)."""
    return np.concatenate([coordinates.difference(state[0], other[0]), state[1] - other[1]], axis=-1)


def follow_and_draw(
    case: Case, engines: Mapping[str, Engine], finer: Sequence[int], entries: int
) -> tuple[Result, Drawn | None]:
    """The runs of a case, and its motion as it is drawn."""
    result = follow(case, engines, finer, entries=entries)
    with np.errstate(over="ignore", invalid="ignore"):
        return result, drawn_motion(case, engines, result.curves)


def follow(
    case: Case,
    engines: Mapping[str, Engine],
    finer: Sequence[int],
    cache: dict | None = None,
    entries: int = MOST_ENTRIES,
) -> Result:
    """One case with every scheme and step size, and once by RK4 without the joints that it does not need.

    finer: steps as multiples of the scene's own. cache: where TMT's side is kept for comparisons with several engines.
    entries: of the Jacobians of a run, see `steps_afforded`.
    """
    ours, theirs = case.robot.compared
    result, cache = Result("trajectory", label=LABELS[ours]), {} if cache is None else cache
    if case not in cache:  # a file's scenes are not reduced here
        cache[case] = None if case.robot.is_read else reduced(case)
    schemes, available = {}, {method.scheme for method in methods_in(engines[ours], case).values()}
    for method in methods_in(engines[theirs], case).values():
        if method.scheme in available:
            schemes.setdefault(method.scheme, []).append(method)
    runs = [(case, steps, *item) for steps in step_counts(case, finer, entries) for item in schemes.items()]
    if smaller := cache[case]:
        runs.append((smaller, smaller.steps, "rk4", schemes["rk4"]))
    dynamics = {each: compared(engines, each) for each in {run[0] for run in runs}}
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for each, steps, scheme, methods in runs:
            if (each, steps, scheme) not in cache:
                cache[each, steps, scheme] = tmt_side(each, dynamics[each][ours], steps, scheme, entries)
            compare_runs(result, each, dynamics[each][theirs], steps, methods, cache[each, steps, scheme])
    if result.notes:  # one finding for all runs
        result.notes = [result.finding("long_steps", runs=[note.values for note in result.notes])]
    unjudged = [row for row in result.rows if row["level"] == "open loop" and not row["judged_until_s"]]
    if unjudged:
        runs = [
            {
                "integrator": row["engine_integrator"],
                "steps": round(case.duration / row["dt_s"]),
                "beyond_limit": beyond_limit(Held(case), row["twin"], row["dt_s"]),
            }
            for row in unjudged
        ]
        result.find("unjudged", scene=case.name, narrow=NARROW, unit=movement_unit(case.coordinates), runs=runs)
    return result


def tmt_side(case: Case, dynamics: Dynamics, steps: int, scheme: str, entries: int = MOST_ENTRIES) -> TmtSide:
    """TMT's side of a case, or a user's: the run, its band, and accelerations and single steps at its recorded states."""
    stepping, tree, tau = METHODS[scheme], case.tree, case.tau
    dt, every = case.duration / steps, steps // recorded(case)
    t, q, v, *_ = dynamics.run(*case.start, tau, dt, steps, scheme)
    ended = diverged_at(case, t, q, v)
    alive = t[::every] < (np.inf if ended is None else ended)
    states = [path[::every][alive] for path in (q, v)]
    start = (perturbed(values) for values in case.start)
    return TmtSide(
        t, q, v,
        band(stepping, tree, q, v, tau, dt, every, steps_afforded(case, entries)),
        ended,
        states,
        dynamics.acceleration(*states, tau),
        slope_rounding(METHODS["rk4"], tree, *states, tau, dt)[2],
        one_step(dynamics, states, tau, dt, scheme),
        step_rounding(stepping, tree, *states, tau, dt),
        dynamics.run(*start, tau, dt, steps, scheme).q,
    )  # fmt: skip


def perturbed(start: np.ndarray) -> np.ndarray:
    """Numbers that are off by eps, or by their own last place where that is more."""
    return start + np.maximum(np.spacing(np.abs(start)), EPS)


def compare_runs(
    result: Result, case: Case, dynamics: Dynamics, steps: int, methods: Sequence[Method], mine: TmtSide
) -> None:
    """One side and the integrators of MuJoCo with the same scheme, from the same start with the same step.

    Single steps that turn a joint by more than half a turn are not compared, but counted in result.notes.
    """
    tau, dt, every, coordinates = case.tau, case.duration / steps, steps // recorded(case), case.coordinates
    t, times, first, name = mine.t, mine.t[::every], None, case.robot.compared[0]
    angle_band = mine.width[:, : coordinates.nv].max(axis=1)
    turning = [i for i, unit in enumerate(coordinates.units) if unit == "rad"]
    accelerations = dynamics.acceleration(*mine.states, tau)
    records = {(name, methods[0].scheme): at_equal_times(case, t, mine.q, mine.v, mine.ended)}
    for method in methods:
        _, *theirs = dynamics.run(*case.start, tau, dt, steps, method.name)[:3]
        ends = {name: mine.ended, "mujoco": diverged_at(case, t, *theirs)}
        records["mujoco", method.name] = at_equal_times(case, t, *theirs, ends["mujoco"])
        count = judged(times, angle_band, ends)
        where = f"{case.name}, {method.name}, {step_in_words(case, steps)}"
        until, required = float(times[count - 1]), required_time(case, method.scheme, dt)
        about = {"scene": case.name, "engine_integrator": method.name, "twin": method.scheme, "dt_s": dt}
        ending = {
            "judged_until_s": until, "required_s": required, "diverged_at_s": ends["mujoco"],
            "twin_diverged_at_s": ends[name],
        }  # fmt: skip
        slow = dt * np.abs(mine.states[1][:, turning]).max(axis=1, initial=0.0) <= HALF_TURN
        stepped = one_step(dynamics, mine.states, tau, dt, method.name)
        judged_states = [[path[::every][:count] for path in paths] for paths in ((mine.q, mine.v), theirs)]
        alive = times[: len(mine.states[0])]
        for level, difference, tolerance, at in (
            ("derivative", mine.derivative - accelerations, mine.derivative_tolerance[:, None], alive),
            (
                "one step",
                state_difference(coordinates, mine.stepped, stepped)[slow],
                mine.step_tolerance[slow],
                alive[slow],
            ),
            ("open loop", state_difference(coordinates, *judged_states), mine.width[:count], times[:count]),
        ):
            if not len(at):
                continue
            check_level(result, where, about | {"level": level}, coordinates, difference, tolerance, at, ending)
        if not slow.all():
            result.find("long_steps", run=where, fast=int(np.sum(~slow)), states=len(slow))
        if required:  # a scene may not state it
            result.check(where, "time judged", until, required, "s", rule="at least", about=About.PREDICTION)
        check_divergence(result, where, ends, dt, steps, angle_band)
        if case.is_free and "own" not in case.scene.tags:
            before = t < ends_first(ends)
            moved = min(deviation_alive(path[before], case.q, coordinates) for path in (mine.q, theirs[0]))
            check_movement(result, where, moved, movement_unit(coordinates))
        if first is None:
            first = method, theirs
            result.curves[(case.name, method.scheme, steps)] = {
                "integrator": method.name, "t": t, "every": every, name: [mine.q, mine.v], "mujoco": theirs,
                "band": angle_band, "perturbed": mine.perturbed, "judged_until_s": until, "ended": ends,
                "left": {name: departure(t, mine.q, coordinates), "mujoco": departure(t, theirs[0], coordinates)},
                "records": records,
            }  # fmt: skip
        else:
            check_same_bits(result, where, first[0].name, first[1], theirs)


def one_step(
    dynamics: Dynamics, states: Sequence[np.ndarray], tau: np.ndarray, dt: float, method: str
) -> list[np.ndarray]:
    """q and v one step after each of the states."""
    motion = dynamics.run(*states, tau, dt, 1, method)
    return [motion.q[:, 1], motion.v[:, 1]]
