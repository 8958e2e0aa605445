"""One scene by every scheme and step: a method of tmt and the integrators of MuJoCo with the same scheme."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...core.text import say
from ...engines import LABELS, Dynamics, Engine, Method, compared, methods_in
from ...judge import run
from ...judge.agree import closest
from ...judge.rounding import NARROW, band, step_rounding
from ...judge.run import departure
from ...robots.case import Case, Coordinates

STEPS_AT_MOST = 8192  # of a run that is finer than the scene's own
MOST_ENTRIES = 2_700_000  # of all Jacobians of a run, which take the time
RECORDED = 64  # states of a run that are compared: one for each of the scene's own steps, or fewer


class TmtSide(NamedTuple):
    """One case with one scheme and step by TMT, or by a user's own equations, recorded at the scene's own steps."""

    t: np.ndarray  # (steps + 1,) s
    q: np.ndarray  # (steps + 1, nq) rad
    v: np.ndarray  # (steps + 1, nv)
    width: np.ndarray  # (recorded, 2 nv): the band of rounding, of movements first
    widest: np.ndarray  # (2 nv,): the width of the band from which on it judges no more
    ended: float | None  # s: when it diverged
    at: np.ndarray  # (states,) s: recorded times from which a single step is compared
    states: list  # q and v at these times
    stepped: list  # q and v one step later
    step_tolerance: np.ndarray  # (states, 2 nv)


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


def follow(case: Case, engines: Mapping[str, Engine], finer: Sequence[int]) -> Result:
    """One case with every scheme that both engines have and every step size, in multiples of the scene's own steps."""
    ours, theirs = case.robot.compared
    result, dynamics = Result("trajectory", label=LABELS[ours]), compared(engines, case)
    available = {method.scheme for method in methods_in(engines[ours], case).values()}
    schemes = {}
    for method in methods_in(engines[theirs], case).values():
        if method.scheme in available:
            schemes.setdefault(method.scheme, []).append(method)
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for steps in step_counts(case, finer):
            for scheme, methods in schemes.items():
                mine = tmt_side(case, dynamics[ours], steps, scheme)
                compare_runs(result, case, dynamics[theirs], steps, methods, mine)
    return result


def tmt_side(case: Case, dynamics: Dynamics, steps: int, scheme: str) -> TmtSide:
    """TMT's side of a case, or a user's: the run, its band, and single steps from its recorded states."""
    stepping, tree, tau = METHODS[scheme], case.tree, case.tau
    dt, every = case.duration / steps, steps // recorded(case)
    t, q, v, *_ = dynamics.run(*case.start, tau, dt, steps, scheme)
    ended = run.diverged_at(case, t, q, v)
    width = band(stepping, tree, q, v, tau, dt, every, steps_afforded(case))
    alive = t[::every] < (np.inf if ended is None else ended)
    states, times = [path[::every][alive] for path in (q, v)], t[::every][alive]
    stepped = one_step(dynamics, states, tau, dt, scheme)
    # the bound of a step's rounding is of first order in dt, and too small where a joint turns by more than half a turn
    turning = [i for i, unit in enumerate(case.coordinates.units) if unit == "rad"]
    rates = np.maximum(*(np.abs(speeds[:, turning]) for speeds in (states[1], stepped[1])))
    single = dt * rates.max(axis=1, initial=0.0) <= np.pi
    states, stepped = ([part[single] for part in pair] for pair in (states, stepped))
    tolerance = step_rounding(stepping, tree, *states, tau, dt)
    widest = run.widest_judged(case, q, v)
    return TmtSide(t, q, v, width, widest, ended, times[single], states, stepped, tolerance)


def one_step(
    dynamics: Dynamics, states: Sequence[np.ndarray], tau: np.ndarray, dt: float, method: str
) -> list:
    """q and v one step after each of the states."""
    motion = dynamics.run(*states, tau, dt, 1, method)
    return [motion.q[:, 1], motion.v[:, 1]]


def compare_runs(
    result: Result, case: Case, dynamics: Dynamics, steps: int, methods: Sequence[Method], mine: TmtSide
) -> None:
    """One side and the integrators of MuJoCo with the same scheme, from the same start with the same step."""
    tau, dt, every, coordinates = case.tau, case.duration / steps, steps // recorded(case), case.coordinates
    t, times, name, unit = mine.t, mine.t[::every], case.robot.compared[0], run.movement_unit(coordinates)
    width = mine.width[:, : coordinates.nv].max(axis=1)
    for method in methods:
        _, *theirs = dynamics.run(*case.start, tau, dt, steps, method.name)[:3]
        ends = {name: mine.ended, "mujoco": run.diverged_at(case, t, *theirs)}
        count = judged(times, mine.width < mine.widest, ends)
        where = f"{case.name}, {method.name}, {run.step_in_words(case, steps)}"
        until, required = float(times[count - 1]), run.required_time(case, method.scheme, dt)
        about = {"scene": case.name, "engine_integrator": method.name, "twin": method.scheme, "dt_s": dt}
        ending = {"judged_until_s": until, "required_s": required}
        ending |= {"diverged_at_s": ends["mujoco"], "twin_diverged_at_s": ends[name]}
        paths = [[path[::every][:count] for path in side] for side in ((mine.q, mine.v), theirs)]
        levels = [("open loop", *paths, mine.width[:count], times[:count])]
        if len(mine.at):
            stepped = one_step(dynamics, mine.states, tau, dt, method.name)
            levels.insert(0, ("one step", mine.stepped, stepped, mine.step_tolerance, mine.at))
        for level, ours, other, tolerance, at in levels:
            movement = coordinates.difference(ours[0], other[0])
            difference = np.concatenate([movement, ours[1] - other[1]], axis=-1)
            check_level(
                result, where, about | {"level": level}, coordinates, difference, tolerance, at, ending
            )
        if len(mine.at) and (mine.step_tolerance.min(axis=0) >= mine.widest).any():
            result.not_judged(where, "one step", say(result.finding("wide_step")))
        alive = times[times < ends_first(ends)][-1]
        check_time_judged(result, where, case, until, required, alive)
        is_known = check_divergence(result, where, ends, dt, steps, width)
        if not (alive or is_known or required):
            result.not_judged(where, "open loop", say(result.finding("diverges_at_once")))
        if case.is_free and "own" not in case.scene.tags:
            before = t < ends_first(ends)
            moved = min(run.deviation_alive(q[before], case.q, coordinates) for q in (mine.q, theirs[0]))
            run.check_movement(result, where, moved, unit)
        result.curves.setdefault(
            (case.name, method.scheme, steps),
            {
                "integrator": method.name,
                "t": t,
                "every": every,
                name: [mine.q, mine.v],
                "mujoco": theirs,
                "band": width,
                "judged_until_s": until,
                "ended": ends,
                "left": {
                    name: departure(t, mine.q, coordinates),
                    "mujoco": departure(t, theirs[0], coordinates),
                },
            },
        )


def ends_first(ends: Mapping[str, float | None]) -> float:
    """When the first of the runs has diverged, s; inf: none has."""
    return min((end for end in ends.values() if end is not None), default=np.inf)


def judged(times: np.ndarray, narrow: np.ndarray, ends: Mapping[str, float | None]) -> int:
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
    least = required or min(run.LEAST_JUDGED * case.duration, alive)
    if until < least:
        reason = say(result.finding("wide", until=until, least=least))
        result.not_judged(where, "time judged", reason, "s")
    elif required:
        result.check(where, "time judged", until, required, "s", rule="at least", about=About.PREDICTION)


def check_divergence(
    result: Result, where: str, ends: Mapping[str, float | None], dt: float, steps: int, width: np.ndarray
) -> bool:
    """Both diverge at the same step, if one does and the band (recorded,) is narrow at the first recorded state after that.

    Returned: whether that is compared.

    ends: of MuJoCo's partner and of MuJoCo, s.
    """
    end = ends_first(ends)
    if end == np.inf:
        return False
    every = steps // (len(width) - 1)
    is_narrow = bool(width[-(-round(end / dt) // every)] < NARROW)
    if is_narrow:
        ours, theirs = (steps + 1 if at is None else round(at / dt) for at in ends.values())
        whose = "TMT's" if result.label == "TMT" else result.label
        note = f"{steps + 1}: never" if steps + 1 in (ours, theirs) else ""
        result.check(where, f"step of divergence, MuJoCo's, is {whose}", theirs, ours, "", note, rule="equal")
    return is_narrow


def check_level(
    result: Result, where: str, about: dict, coordinates: Coordinates, difference, tolerance, times, ending
) -> None:
    """A row and a check: the component and recorded state that come closest to their tolerance.

    about, ending: the first and the last columns of the row; difference: (states, 2 nv) rad and rad/s; tolerance: broadcast to
    it; times: of the states, s.
    """
    n, difference = coordinates.nv, np.abs(difference)
    tolerance = np.broadcast_to(tolerance, difference.shape)
    k, i = closest(difference, tolerance)
    unit = coordinates.units[i % n] + ("", "/s")[i // n]
    place = f"{coordinates.speeds[i % n]} at t = {times[k]:.3f} s"
    quantity = f"{about['level']}, {result.label} to MuJoCo"
    check = result.check(where, quantity, difference[k, i], tolerance[k, i], unit, place, True)
    found = {
        "largest_difference": None if check.value is None else difference[:, :n].max(),
        "unit": run.movement_unit(coordinates),
        "worst_difference": check.value,
        "band": check.tolerance,
        "worst_unit": unit,
        "difference_over_band": check.over_tolerance,
        "worst_place": place,
    }
    result.rows.append(about | found | ending)
