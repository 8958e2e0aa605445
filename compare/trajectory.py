"""Five seconds of motion by the same method on both sides: a twin for every integrator of MuJoCo."""

from functools import partial
from itertools import groupby

import numpy as np

import tmt
from tmt.methods import METHODS

from . import motion
from .agreement import Result
from .band import NARROW, band, slope_rounding, step_rounding
from .engine import INTEGRATORS
from .scenes import SCENES

TITLE = "Trajectories: a twin for every integrator of MuJoCo"
CLAIM = (
    "For every integrator of MuJoCo the same scheme stands on the TMT side (Euler, implicitfast and discrete are one scheme "
    "here, and give the same bits; implicit takes the exact derivative of the bias, which is MuJoCo's qDeriv; RK4 is the "
    "assignment's). Twins agree in the derivative at every recorded state, in one step from every recorded state, and in "
    "the open-loop run as long as rounding allows."
)
BAR = (
    "Derivative and one step: the rounding of a solve with the method's own matrix A, |A^-1| (64 eps |A| |a| + 64 eps S), S "
    "the sum of the absolute terms of the force, and 8 eps of the sums of the step. Open loop: a band computed along the "
    "run, the sum over all earlier steps of that bound, carried to the present by the exact Jacobians of the method's own "
    "steps. Judged at 65 recorded states while the band of the angles is below 1e-3 rad and no run has diverged; each scene "
    "states how long that must be. A free run must move by 0.1 rad, and the parties must not give the same bits. A run has "
    "diverged if it stops, is not finite, or has gained more energy than its bound: the arm's whole potential range and "
    "the kinetic energy at the start. Parties that diverge while the band is narrow must do so at the same step."
)
RECORDED = 64  # steps of the grid on which a run is judged
MOVES = 0.1  # rad: a free run that moves less shows nothing
QUICK = ("ball catch, free", "bent, free", "ball catch, held", "bent, held")  # the scenes of a quick run
EXACT_SCENES = ("bent, free", "ball catch, free")  # held against a run of the same scheme with many digits


def begin(setup) -> None:
    """Set the long work going, side by side, while other experiments compute.

    A quick run takes fewer scenes, and leaves out many digits and the growth of errors.
    """
    quick = len(setup.steps) == 1
    scenes = [scene for scene in SCENES if scene.name in QUICK or not quick]
    exact = [scene for scene in scenes if scene.name in EXACT_SCENES and not quick]
    grown = [] if quick else scenes
    setup.background["scenes"] = setup.map(partial(follow, engine=setup.engine, steps=setup.steps), scenes)
    setup.background["exact"] = exact, setup.map(motion.exact_runs, exact)
    setup.background["growth"] = grown, setup.map(motion.grown, grown)


def rows(setup) -> Result:
    """Each scene, integrator and step: three levels of agreement; then drift, growth of errors, many digits."""
    result = Result("trajectory", shown=[
        "scene", "engine_integrator", "dt_s", "level", "largest_difference", "unit", "difference_over_band",
        "judged_until_s", "required_s", "diverged_at_s", "twin_diverged_at_s",
    ])  # fmt: skip
    if "scenes" not in setup.background:
        begin(setup)
    motion.derivative(result, setup.engine)
    motion.drift(result, setup.engine)
    result.curves["runs"] = {}
    for part in setup.background.pop("scenes"):
        result.rows += part.rows
        result.checks += part.checks
        result.curves["runs"] |= part.curves
    motion.many_digits(result, setup.engine, *setup.background.pop("exact"))
    motion.growth_of_errors(result, *setup.background.pop("growth"))
    result.notes = motion.published_claims(result) + result.notes
    return result


def follow(scene, engine, steps) -> Result:
    """One scene with every twin and step size."""
    result = Result("trajectory")
    engine = engine.variant(scene.model.gravity, scene.damping)
    with np.errstate(over="ignore", invalid="ignore"):  # runs that diverge do so on both sides
        for count in steps:
            for twin, integrators in groupby(INTEGRATORS, motion.TWINS.get):
                pair(result, scene, engine, count, twin, list(integrators))
    return result


def pair(result, scene, engine, steps, twin, integrators) -> None:
    """One method of tmt and the integrators of MuJoCo whose twin it is, from the same start with the same step."""
    model, tau, dt = scene.model, scene.tau, scene.duration / steps
    stepping = METHODS[twin]
    every = steps // RECORDED
    t, *ours = tmt.simulate(*scene.start, tau, dt, steps, twin, model)
    width = band(stepping, model, *ours, tau, dt, every)
    ours_end = motion.diverged_at(scene, t, *ours)
    recorded = [path[::every] for path in ours]
    alive = t[::every] < (np.inf if ours_end is None else ours_end)
    states = [path[alive] for path in recorded]
    derivative = tmt.acceleration(*states, tau, model)
    derivative_bar = slope_rounding(METHODS["rk4"], model, *states, tau, dt)[2]
    derivative_apart = derivative - engine.acceleration(*states, np.broadcast_to(tau, derivative.shape))
    stepped = stack(*(path[:, 1] for path in tmt.simulate(*states, tau, dt, 1, twin, model)[1:]))
    step_bar = step_rounding(stepping, model, *states, tau, dt)

    first = None
    for integrator in integrators:
        _, *theirs = engine.trajectory(*scene.start, tau, dt, steps, integrator)
        theirs_end = motion.diverged_at(scene, t, *theirs)
        ends = [end for end in (ours_end, theirs_end) if end is not None]
        judged = (width[:, :3].max(axis=1) < NARROW) & (t[::every] < min(ends, default=np.inf))
        judged = np.cumsum(~judged) == 0
        until = float(t[::every][judged][-1])
        required = scene.required(twin, dt)
        where = f"{scene.name}, {integrator}, dt = 5/{steps} s"
        about = {
            "scene": scene.name, "engine_integrator": integrator, "twin": twin, "dt_s": dt,
        }  # fmt: skip
        ending = {
            "judged_until_s": until, "required_s": required, "diverged_at_s": theirs_end, "twin_diverged_at_s": ours_end,
        }  # fmt: skip
        one = stack(*(path[:, 1] for path in engine.trajectory(*states, tau, dt, 1, integrator)[1:]))
        apart = stack(*(a[::every][judged] - b[::every][judged] for a, b in zip(ours, theirs)))
        times = t[::every]
        level(result, where, about, "derivative", derivative_apart, derivative_bar[:, None], times[alive], ending)
        level(result, where, about, "one step", stepped - one, step_bar, times[alive], ending)
        level(result, where, about, "open loop", apart, width[judged], times[judged], ending)

        result.check(where, f"judged for less than {required:g} s", max(0.0, required - until), 0.0, "s missing")
        if ends and width[min(int(min(ends) / dt / every), RECORDED), :3].max() < NARROW:
            apart_steps = abs((ours_end or np.inf) - (theirs_end or np.inf)) / dt
            result.check(where, "diverged at another step than its twin", round(min(apart_steps, steps)), 0.0, "steps")
        if scene.torque == "free":
            moved = min(motion.farthest(path[0] - scene.start[0]) for path in (ours, theirs))
            result.check(where, f"moves less than {MOVES} rad", max(0.0, MOVES - moved), 0.0, "rad missing")
            same = all(np.array_equal(a, b, equal_nan=True) for a, b in zip(ours, theirs))
            result.check(where, "both parties give the same bits", same, 0.0, "runs")
        if first is None:
            first = theirs
            result.curves[(scene.name, twin, steps)] = {
                "integrator": integrator, "t": t, "every": every, "tmt": ours, "mujoco": theirs, "band": width[:, :3].max(axis=1),
                "ulp": motion.one_ulp(scene, twin, dt, steps), "judged_until_s": until, "left": {
                    "TMT": motion.departure(t, ours[0]), "MuJoCo": motion.departure(t, theirs[0])},
            }  # fmt: skip
        else:
            other = sum(not np.array_equal(a, b, equal_nan=True) for a, b in zip(first, theirs))
            result.check(where, f"{integrator} and {integrators[0]}: not the same bits", other, 0.0, "arrays")


def stack(q, qd) -> np.ndarray:
    """Angles and rates side by side, (..., 2n)."""
    return np.concatenate([q, qd], axis=-1)


def level(result, where, about, name, difference, bar, times, ending) -> None:
    """A row and a check: the component and state of the recorded ones that come closest to their bar."""
    difference = np.abs(difference)
    bar = np.broadcast_to(bar, difference.shape)
    ratio = np.divide(difference, bar, out=np.zeros_like(difference), where=bar > 0)
    k, i = np.unravel_index(np.argmax(ratio), ratio.shape)  # NaN counts as the largest
    unit, largest_unit = ("rad/s2",) * 2 if name == "derivative" else (("rad", "rad/s")[i // 3], "rad")
    place = f"{tmt.ARM.hinge_names[i % 3]} at t = {times[k]:.3f} s"
    check = result.check(where, f"{name}, TMT to MuJoCo", difference[k, i], bar[k, i], unit, place, True)
    result.rows.append(
        about
        | {
            "level": name,
            "largest_difference": None if check.value is None else difference[:, :3].max(),
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
    """The assignment's Figures 2 and 3, one figure for each scene, and the growth of errors."""
    from . import draw_motion  # matplotlib is for the processes that draw

    yield draw_motion.held(result, "ball catch, held", "assignment_figure_2")
    yield draw_motion.held(result, "bent, held", "assignment_figure_3")
    names = {name for name, *_ in result.curves["runs"]}
    quick = len(names) < len(SCENES)  # then the held scenes are in the two figures above
    for scene in SCENES:
        if scene.name in names and not (quick and scene.torque == "hold"):
            yield draw_motion.run(result, scene)
    yield draw_motion.drift(result)
    if not quick:
        yield draw_motion.growth(result)
