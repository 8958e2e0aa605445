"""Five seconds of motion by the same scheme on both sides: a method of tmt for every integrator of MuJoCo."""

from functools import partial
from itertools import groupby
from typing import NamedTuple

import numpy as np

import tmt
from tmt.methods import METHODS

from . import drift, horizon, motion, told
from .agreement import Result
from .band import NARROW, band, slope_rounding, step_rounding
from .engine import INTEGRATORS
from .scenes import SCENES
from .smallest import reduced

TITLE = "Trajectories: the same scheme for every integrator of MuJoCo"
CLAIM = (
    "For every integrator of MuJoCo the same scheme stands on the TMT side (Euler, implicitfast and discrete are one scheme "
    "here, and give the same bits; implicit takes the exact derivative of the bias, which is MuJoCo's qDeriv; RK4 is the "
    "assignment's). The two agree in the derivative at every recorded state, in one step from every recorded state, and in "
    "the open-loop run as long as rounding allows. A scene that does not need all hinges (see reduction) runs once more, by RK4, "
    "without those."
)
MOVES = 0.1  # rad: a free run that moves less shows nothing
BAR = (
    "Derivative and one step: the rounding of a solve with the method's own matrix A, |A^-1| (64 eps |A| |a| + 64 eps S), S "
    "the sum of the absolute terms of the force, and 8 eps of the sums of the step. Open loop: a band computed along the "
    "run, the sum over all earlier steps of that bound, carried to the present by the exact Jacobians of the method's own "
    f"steps. Judged at the states of the coarsest step while the band of the angles is below {NARROW:g} rad and no run has "
    f"diverged; each scene states how long that must be. A free run must move by {MOVES:g} rad. A run has diverged if it stops, "
    "is not finite, or has gained more energy than the stated arm's whole potential range and the kinetic energy at the start. "
    "Where one diverges while the band is narrow, the other must do so at the same step."
)
QUICK = ("ball catch, free", "bent, free", "ball catch, held", "bent, held")  # the scenes of a quick run
EXACT_SCENES = ("bent, free", "ball catch, free")  # compared with a run of the same scheme with many digits
FEW = 8  # of its steps, in a small run


class Ours(NamedTuple):
    """What TMT gives of one scene with one method and step; states are recorded at the scene's coarsest steps."""

    t: np.ndarray  # (steps + 1,) s
    q: np.ndarray  # (steps + 1, n) rad
    qd: np.ndarray
    width: np.ndarray  # (recorded, 2n): the band of rounding
    ended: float | None  # s: when it diverged
    states: list  # the recorded q and qd before that
    derivative: np.ndarray  # (states, n) rad/s2
    derivative_bar: np.ndarray  # (states,)
    stepped: np.ndarray  # (states, 2n): one step from each
    step_bar: np.ndarray
    ulp: np.ndarray  # (steps + 1, n): angles of the run that starts one ulp away


def begin(setup) -> None:
    """Set the long work going, side by side, while other experiments compute.

    A quick run takes fewer scenes, and leaves out many digits and the growth of errors.
    """
    scenes = [scene for scene in SCENES if scene.name in QUICK or not setup.is_quick]
    names = setup.of(EXACT_SCENES, (), EXACT_SCENES[:1])
    exact = [scene for scene in scenes if scene.name in names]
    digits = setup.of(horizon.EXACT_STEPS, 0, FEW)
    grown = setup.of(scenes, [], scenes)
    long = setup.of(horizon.LONG, horizon.LONG, horizon.SHORT)
    curves = setup.map(partial(horizon.grown, duration=long[0], steps=long[1]), grown)
    setup.background["scenes"] = setup.map(partial(follow, engine=setup.engine, steps=setup.steps), scenes)
    setup.background["exact"] = exact, setup.map(partial(horizon.exact_runs, steps=digits), exact)
    setup.background["growth"] = grown, curves, *long


def rows(setup) -> Result:
    """Each scene, integrator and step: three levels of agreement; then drift, growth of errors, many digits."""
    result = Result("trajectory", shown=[
        "scene", "engine_integrator", "dt_s", "level", "largest_difference", "unit", "difference_over_band",
        "judged_until_s", "required_s", "diverged_at_s", "twin_diverged_at_s",
    ])  # fmt: skip
    if "scenes" not in setup.background:
        begin(setup)
    motion.derivative(result, setup.engine)
    drift.drift(result, setup.engine, setup.of(drift.STEPS, drift.STEPS, drift.FEW_STEPS))
    result.curves["runs"] = {}
    for part in setup.background.pop("scenes"):
        result.rows += part.rows
        result.checks += part.checks
        result.curves["runs"] |= part.curves
    horizon.many_digits(result, setup.engine, *setup.background.pop("exact"))
    grown = setup.background.pop("growth")
    if grown[0]:
        horizon.growth_of_errors(result, *grown)
    result.curves["errors"] = motion.held_errors(result) | motion.free_errors(result)
    result.notes = told.notes(result, setup.engine) + result.notes
    return result


def follow(scene, engine, steps, known=None) -> Result:
    """One scene with every scheme and step size, and once by RK4 without the hinges that it does not need.

    steps: the numbers of steps, of a scene of 64; of others as much finer than their own dt. known: a dict in which TMT's
    side is kept, for whoever compares it with several engines.
    """
    result, known = Result("trajectory"), {} if known is None else known
    if scene not in known:
        known[scene] = reduced(scene)
    runs = [(scene, scene.steps * count // 64, twin, list(of_twin)) for count in steps
            for twin, of_twin in groupby(INTEGRATORS, motion.TWINS.get)]  # fmt: skip
    if smaller := known[scene]:
        runs.append((smaller, smaller.steps, "rk4", ["RK4"]))
    engines = {each: each.engine(engine) for each in {run[0] for run in runs}}
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for each, count, twin, integrators in runs:
            if (each, count, twin) not in known:
                known[each, count, twin] = ours(each, count, twin)
            pair(result, each, engines[each], count, twin, integrators, known[each, count, twin])
    return result


def ours(scene, steps, twin) -> Ours:
    """TMT's side of a scene: the run, its band, and the two other levels at its recorded states."""
    stepping, model, tau, dt, every = (
        METHODS[twin],
        scene.model,
        scene.tau,
        scene.duration / steps,
        steps // scene.steps,
    )
    t, q, qd = tmt.simulate(*scene.start, tau, dt, steps, twin, model)
    ended = motion.diverged_at(scene, t, q, qd)
    alive = t[::every] < (np.inf if ended is None else ended)
    states = [path[::every][alive] for path in (q, qd)]
    return Ours(
        t, q, qd,
        band(stepping, model, q, qd, tau, dt, every),
        ended,
        states,
        tmt.acceleration(*states, tau, model),
        slope_rounding(METHODS["rk4"], model, *states, tau, dt)[2],
        stack(*(path[:, 1] for path in tmt.simulate(*states, tau, dt, 1, twin, model)[1:])),
        step_rounding(stepping, model, *states, tau, dt),
        motion.one_ulp(scene, twin, dt, steps),
    )  # fmt: skip


def pair(result, scene, engine, steps, twin, integrators, mine) -> None:
    """One method of tmt and the integrators of MuJoCo that are the same scheme, from the same start with the same step."""
    tau, dt, every, n = scene.tau, scene.duration / steps, steps // scene.steps, len(scene.hinges)
    t, times, first = mine.t, mine.t[::every], None
    accelerations = engine.acceleration(*mine.states, np.broadcast_to(tau, mine.derivative.shape))
    for integrator in integrators:
        _, *theirs = engine.trajectory(*scene.start, tau, dt, steps, integrator)
        ends = {"TMT": mine.ended, "MuJoCo": motion.diverged_at(scene, t, *theirs)}
        count = judged(times, mine.width[:, :n].max(axis=1), ends)
        where = f"{scene.name}, {integrator}, {motion.step(scene, steps)}"
        until, required = float(times[count - 1]), scene.required(twin, dt)
        about = {"scene": scene.name, "engine_integrator": integrator, "twin": twin, "dt_s": dt}
        ending = {
            "judged_until_s": until, "required_s": required, "diverged_at_s": ends["MuJoCo"],
            "twin_diverged_at_s": ends["TMT"],
        }  # fmt: skip
        one = stack(*(path[:, 1] for path in engine.trajectory(*mine.states, tau, dt, 1, integrator)[1:]))
        apart = stack(*(a[::every][:count] - b[::every][:count] for a, b in zip((mine.q, mine.qd), theirs)))
        alive = times[: len(mine.states[0])]
        for name, difference, bar, at in (
            ("derivative", mine.derivative - accelerations, mine.derivative_bar[:, None], alive),
            ("one step", mine.stepped - one, mine.step_bar, alive),
            ("open loop", apart, mine.width[:count], times[:count]),
        ):
            level(result, where, about | {"level": name}, scene.hinges, difference, bar, at, ending)
        result.check(where, "time judged", until, required, "s", rule="at least")
        divergence(result, where, ends, dt, steps, mine.width[:, :n].max(axis=1))
        if scene.torque == "free":
            before = mine.t < min((end for end in ends.values() if end is not None), default=np.inf)
            movement(result, where, min(motion.farthest(path[before] - scene.start[0]) for path in (mine.q, theirs[0])))
        if first is None:
            first = theirs
            result.curves[(scene.name, twin, steps)] = {
                "integrator": integrator, "t": t, "every": every, "tmt": [mine.q, mine.qd], "mujoco": theirs,
                "band": mine.width[:, :n].max(axis=1), "ulp": mine.ulp, "judged_until_s": until, "ended": ends,
                "left": {"TMT": motion.departure(t, mine.q), "MuJoCo": motion.departure(t, theirs[0])},
            }  # fmt: skip
        else:
            same_bits(result, where, integrators[0], first, theirs)


def stack(q, qd) -> np.ndarray:
    """Angles and rates side by side, (..., 2n)."""
    return np.concatenate([q, qd], axis=-1)


# the rules of a run


def judged(times, width, ends) -> int:
    """How many of the recorded states are judged: all before the band is wide or a run has diverged; the start always is."""
    alive = times < min((end for end in ends.values() if end is not None), default=np.inf)
    return max(1, int(np.argmin(np.append((width < NARROW) & alive, False))))


def divergence(result, where, ends, dt, steps, width) -> None:
    """Both diverge at the same step, if one does while the band (recorded,) is narrow: then rounding decides nothing."""
    known = [end for end in ends.values() if end is not None]
    if not known:
        return
    every = steps // (len(width) - 1)
    if width[int(round(min(known) / dt) / every)] < NARROW:
        ours, theirs = (steps + 1 if end is None else round(end / dt) for end in (ends["TMT"], ends["MuJoCo"]))
        note = f"{steps + 1}: never" if steps + 1 in (ours, theirs) else ""
        result.check(where, "step of divergence, MuJoCo's, is TMT's", theirs, ours, "", note, rule="equal")


def movement(result, where, moved) -> None:
    """A free run moves: one that stays shows nothing."""
    result.check(where, "movement", moved, MOVES, "rad", rule="at least")


def same_bits(result, where, integrator, first, other) -> None:
    """Integrators that are one scheme here give the same bits: q and qd of both."""
    differ = sum(not np.array_equal(a, b, equal_nan=True) for a, b in zip(first, other))
    result.check(where, f"the same bits as {integrator}", differ, 0.0, "arrays that differ", rule="equal")


def level(result, where, about, hinges, difference, bar, times, ending) -> None:
    """A row and a check: the component and state of the recorded ones that come closest to their tolerance."""
    name, n = about["level"], len(hinges)
    difference = np.abs(difference)
    bar = np.broadcast_to(bar, difference.shape)
    ratio = np.divide(difference, bar, out=np.where(difference == 0.0, 0.0, np.inf), where=bar > 0)
    k, i = np.unravel_index(np.argmax(ratio), ratio.shape)  # NaN counts as the largest
    unit, largest_unit = ("rad/s2",) * 2 if name == "derivative" else (("rad", "rad/s")[i // n], "rad")
    place = f"{hinges[i % n]} at t = {times[k]:.3f} s"
    check = result.check(where, f"{name}, TMT to MuJoCo", difference[k, i], bar[k, i], unit, place, True)
    result.rows.append(
        about
        | {
            "largest_difference": None if check.value is None else difference[:, :n].max(),
            "unit": largest_unit,
            "worst_difference": check.value,
            "band": check.tolerance,
            "worst_unit": unit,
            "difference_over_band": check.over_bar,
            "worst_place": place,
        }
        | ending
    )


def figures(result):
    """The assignment's Figures 2 and 3, one figure for each scene, drift, and the growth of errors."""
    from . import draw_motion  # matplotlib is for the processes that draw

    yield partial(draw_motion.held, result, "ball catch, held", "assignment_figure_2")
    yield partial(draw_motion.held, result, "bent, held", "assignment_figure_3")
    names = {name for name, *_ in result.curves["runs"]}
    grown = "growth" in result.curves  # else the held scenes are in the two figures above
    for scene in SCENES:
        if scene.name in names and (grown or scene.torque != "hold"):
            yield partial(draw_motion.run, result, scene)
    yield partial(draw_motion.drift, result)
    if grown:
        yield partial(draw_motion.growth, result)
