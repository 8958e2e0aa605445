"""One scene by every scheme and step: a method of tmt and the integrators of MuJoCo with the same scheme."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt.methods import METHODS

from ...core.check import About, Result
from ...core.text import say
from ...engines import LABELS, Dynamics, Engine, Method, Setting, compared
from ...judge import run as rules
from ...judge.agree import closest
from ...judge.rounding import NARROW, band, step_rounding
from ...robots.case import Case
from ...robots.coordinates import rates_at
from ...robots.file import steps_afforded
from ..runs import follow
from .pairs import Pair, TrajectoryResult, TrajectoryRow, recorded

STEPS_AT_MOST = 8192  # of a run that is finer than the scene's own
# decay rate times dt up to which RK4 is stable: beyond, each stage multiplies the rounding of the one before
FASTEST = 2.785
BEARABLE = 2.0  # the fastest rate times dt up to which every scheme is stable, about


def compare_case(case: Case, engines: Mapping[str, Engine], finer: Sequence[int]) -> TrajectoryResult:
    """One case with every scheme that both engines have. finer: multiples of the scene's own steps."""
    first, mujoco = case.robot.compared
    result, dynamics = TrajectoryResult("trajectory", label=LABELS[first]), compared(engines, case)
    available = {method.scheme for method in engines[first].methods_in(case).values()}
    schemes: dict[str, list[Method]] = {}
    for method in engines[mujoco].methods_in(case).values():
        if method.scheme in available:
            schemes.setdefault(method.scheme, []).append(method)
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for steps in [case.steps * multiple for multiple in finer]:
            if steps > max(case.steps, min(STEPS_AT_MOST, steps_afforded(case.coordinates.nv))):
                break
            for scheme, methods in schemes.items():
                part = stable_part(case, scheme, case.duration / steps)
                pairs = compare_scheme(result, part, dynamics, steps, scheme, methods)
                if part is case:
                    result.pairs.append(pairs[0])
    return result


def stable_part(case: Case, scheme: str, dt: float) -> Case:
    """The case; in a scene of a file, if the scheme does not bear dt, its beginning with a step that it bears.

    The forces of springs limit every scheme, those of damping RK4, and those of servos Euler, too.
    """
    stepping, (decay, frequency) = METHODS[scheme], rates_at(case.tree, case.q)
    has_damping = not case.tree.has_gains or getattr(stepping, "implicit_gains", False)
    rate = frequency if has_damping and stepping.stages == 1 else max(decay, frequency)
    if "user" in case.scene.tags or not case.robot.is_read or rate * dt <= BEARABLE:
        return case
    return case.changed(duration=case.steps / rate, dt=1.0 / rate)


def compare_scheme(
    result: Result, case: Case, dynamics: Mapping[str, Dynamics], steps: int, scheme: str,
    methods: Sequence[Method],
) -> list[Pair]:  # fmt: skip
    """A run of TMT, or of a user's equations, and that of each integrator of MuJoCo with the same scheme.

    Compared are single steps from the recorded states of the first run, each within the rounding of a step,
    and the runs themselves, within the band, while it is narrow.
    """
    stepping, tree, tau = METHODS[scheme], case.tree, case.tau
    dt, every, (first, mujoco) = case.duration / steps, steps // recorded(case), dynamics.values()
    setting = Setting(case.duration, steps, intervals=steps)
    run = follow(case, first, setting, scheme)
    width = band(stepping, tree, run.q, run.v, tau, dt, every, steps_afforded(case.coordinates.nv))
    widest, at = rules.widest_judged(case, run.q, run.v), run.t[::every]
    alive = at < run.ended

    def one_step(dynamics: Dynamics, method: str) -> np.ndarray:
        """q and v one step after each of the states, (states, nq + nv)."""
        motion = dynamics.run(q, v, tau, dt, 1, method)
        return np.hstack([motion.q[:, 1], motion.v[:, 1]])

    def apart(states: np.ndarray, others: np.ndarray) -> np.ndarray:
        """Absolute differences of positions, as tangents, then of speeds: (states, 2 nv)."""
        nq = case.coordinates.nq
        tangents = case.coordinates.difference(states[:, :nq], others[:, :nq])
        return np.abs(np.hstack([tangents, states[:, nq:] - others[:, nq:]]))

    q, v = run.q[::every][alive], run.v[::every][alive]
    stepped = one_step(first, scheme)
    # the bound of a step's rounding is of first order in dt: too small beyond half a turn of a joint, and
    # where several stages are not stable
    turning = [i for i, unit in enumerate(case.coordinates.units) if unit == "rad"]
    rates = np.maximum(*(np.abs(speeds[:, turning]) for speeds in (v, stepped[:, case.coordinates.nq :])))
    is_small = dt * rates.max(axis=1, initial=0.0) <= np.pi
    is_stable = stepping.stages == 1 or dt * max(rates_at(tree, case.q)) <= FASTEST
    single = is_stable & is_small
    q, v, stepped, steps_at = q[single], v[single], stepped[single], at[alive][single]
    rounding = step_rounding(stepping, tree, q, v, tau, dt)
    pairs = []
    for method in methods:
        runs = {case.robot.compared[0]: run, "mujoco": follow(case, mujoco, setting, method.name)}
        pair = Pair(runs=runs, scheme=scheme, integrator=method.name, width=width, widest=widest)
        if single.any():
            off = apart(stepped, one_step(mujoco, method.name))
            check_level(result, pair, "one step", steps_at, off, rounding)
            if (rounding.min(axis=0) >= widest).any():
                result.not_judged(pair.where, "one step", say(result.finding("wide_step")))
        count = pair.judged
        off = apart(*(np.hstack([each.q, each.v])[::every][:count] for each in runs.values()))
        check_level(result, pair, "open loop", at[:count], off, width[:count])
        check_end(result, pair)
        pairs.append(pair)
    return pairs


def check_level(
    result: Result, pair: Pair, level: str, at: np.ndarray, apart: np.ndarray, tolerance: np.ndarray
) -> None:
    """A row and a check: the component and the recorded state that come closest to their tolerance.

    at: (states,) s. apart, tolerance: (states, 2 nv), movements in rad or m first, then speeds.
    """
    (k, i), coordinates = closest(apart, tolerance), pair.case.coordinates
    unit, joint = coordinates.units[i % coordinates.nv], coordinates.speeds[i % coordinates.nv]
    unit, place = f"{unit}/s" if i >= coordinates.nv else unit, f"{joint} at t = {at[k]:.3f} s"
    quantity = f"{level}, {result.label} to MuJoCo"
    check = result.check(pair.where, quantity, apart[k, i], tolerance[k, i], unit, place, True)
    largest = None if check.value is None else apart[:, : coordinates.nv].max()
    twin_diverged_at, diverged_at = (rules.number_or_none(run.ended) for run in pair.runs.values())
    result.rows.append(TrajectoryRow(
        scene=pair.case.name, engine_integrator=pair.integrator, twin=pair.scheme, dt=pair.dt, level=level,
        largest_difference=largest, unit=rules.movement_unit(pair.case.coordinates),
        worst_difference=check.value, band=check.tolerance, worst_unit=check.unit, worst_place=check.note,
        difference_over_band=check.over_tolerance, judged_until=pair.judged_until, required=pair.required,
        diverged_at=diverged_at, twin_diverged_at=twin_diverged_at,
    ))  # fmt: skip


def check_end(result: Result, pair: Pair) -> None:
    """How long a run is judged, whether both runs diverge alike, and whether it moves."""
    case, times = pair.case, pair.t[:: pair.every]
    alive = times[times < pair.ended][-1]
    check_time_judged(result, pair, alive)
    is_known = check_divergence(result, pair)
    if not (alive or is_known or pair.required):
        result.not_judged(pair.where, "open loop", say(result.finding("diverges_at_once")))
    if case.is_free and "own" not in case.scene.tags:
        paths = [run.q[pair.t < pair.ended] for run in pair.runs.values()]
        moved = min(rules.deviation(q, case.q, case.coordinates) for q in paths)
        rules.check_movement(result, pair.where, moved, rules.movement_unit(case.coordinates))


def check_time_judged(result: Result, pair: Pair, alive: float) -> None:
    """A run is judged for the time that its scene states, or for a tenth of it, or of `alive`, s."""
    until, least = pair.judged_until, pair.required or min(rules.LEAST_JUDGED * pair.case.duration, alive)
    if until < least:
        reason = say(result.finding("wide", until=until, least=least))
        result.not_judged(pair.where, "time judged", reason, "s")
    elif pair.required:
        result.check(pair.where, "time judged", until, least, "s", rule="at least", about=About.PREDICTION)


def check_divergence(result: Result, pair: Pair) -> bool:
    """Whether the steps at which both diverge are compared: if the band is narrow at the next recorded state."""
    steps, dt = pair.steps, pair.dt
    if pair.ended == np.inf:
        return False
    is_narrow = bool(pair.band[-(-round(pair.ended / dt) // pair.every)] < NARROW)
    if is_narrow:
        ends = [run.ended for run in pair.runs.values()]
        first, mujoco = (steps + 1 if at == np.inf else round(at / dt) for at in ends)
        whose = "TMT's" if result.label == "TMT" else result.label
        note = f"{steps + 1}: never" if steps + 1 in (first, mujoco) else ""
        what = f"step of divergence, MuJoCo's, is {whose}"
        result.check(pair.where, what, mujoco, first, "", note, rule="equal")
    return is_narrow
