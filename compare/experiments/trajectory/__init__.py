"""Motion by the same scheme on both sides: a method of tmt for every integrator of MuJoCo."""

from collections.abc import Iterator, Mapping
from functools import partial

from ...engines import LABELS, one_of_each_scheme
from ...judge.check import Result
from ...judge.rounding import NARROW
from ...judge.run import MOVES, leaves_no_digits, movement_unit
from ...robots import Robot
from ...truth.reference import reference
from .. import Experiment
from ..setup import Setup
from . import drift, errors, horizon, leaving, motion, sentences
from .derivative import compare_derivatives
from .first_screen import headline as headline
from .motion_frames import follow_and_draw, in_order
from .own_runs import within_time
from .runs import FEW_ENTRIES, MOST_ENTRIES

EXPERIMENT = Experiment(order=70, options=("--joints", "--scenes"), diagnosed=True, overview="scenes")
FEW_EXACT_STEPS = 8  # with many digits, in a small run


def claim(robot: Robot) -> str:
    """What is claimed."""
    if robot.own:
        return (
            "Your equations, integrated by this project's RK4, agree with MuJoCo by its RK4: in the accelerations at recorded "
            "states, in one step from each of them, and in the open-loop run as long as rounding allows."
        )
    if robot.is_read:
        return (
            "For every integrator of MuJoCo the same scheme stands on the TMT side, as the notes say; integrators that are one "
            "scheme here give the same bits. implicit takes the exact derivative of the bias, which is MuJoCo's qDeriv; RK4 is "
            "the classical one. The two agree in the derivative at recorded states, in one step from each of them, and in the "
            "open-loop run as long as rounding allows."
        )
    of_rk4 = "the assignment's" if robot.claims else "the classical one"
    return (
        "For every integrator of MuJoCo the same scheme stands on the TMT side (Euler, implicitfast and discrete are one "
        "scheme here, and give the same bits; implicit takes the exact derivative of the bias, which is MuJoCo's qDeriv; RK4 "
        f"is {of_rk4}). The two agree in the derivative at every recorded state, in one step from every recorded state, and in "
        "the open-loop run as long as rounding allows. A scene that does not need all hinges (see reduction) runs once more, by "
        "RK4, without those."
    )


def tolerance(robot: Robot) -> str:
    """What the differences are compared with."""
    if robot.is_read:
        return tolerance_of_file(robot)
    return (
        "Derivative and one step: the rounding of a solve with the method's own matrix A, |A^-1| (64 eps |A| |a| + 64 eps S), S "
        "the sum of the absolute terms of the force, and 8 eps of the sums of the step. Open loop: a band computed along the "
        "run, the sum over all earlier steps of that bound, carried to the present by the exact Jacobians of the method's own "
        f"steps. Judged at the states of the coarsest step while the band of the angles is below {NARROW:g} rad and no run has "
        f"diverged; each scene states how long that must be. A free run must move by {MOVES:g} rad. A run has diverged if it "
        f"stops, is not finite, or has gained more energy than the stated {robot.noun}'s whole potential range and the kinetic "
        "energy at the start. Where one diverges while the band is narrow, the other must do so at the same step."
    )


def tolerance_of_file(robot: Robot) -> str:
    """The same for a robot from a file."""
    unit = movement_unit(robot.coordinates)
    ball = "; of a ball 32 eps of a turn, as quaternions are multiplied" if robot.coordinates.has_balls else ""
    return (
        "Derivative and one step: the rounding of a solve with the method's own matrix A, |A^-1| (64 eps |A| |a| + 64 eps S), S "
        f"the sum of the absolute terms of the force, and 8 eps of the sums of the step{ball}. Open loop: a band computed along "
        "the run, the sum over all earlier steps of that bound, carried to the present by the exact Jacobians of the method's "
        f"own steps. Judged while the band of the positions is below {NARROW:g} {unit} and no run has diverged. A run has "
        f"diverged if it stops, is not finite, or has gained more energy than the {robot.noun}'s motion can have exchanged: "
        "the whole potential range with the energy of speeds, springs and servos at the start, or, where that is more, the work "
        "of the torque and of the weight along slides. Where one diverges while the band is narrow, the other must do so at the "
        "same step."
    )


def skipped(robot: Robot) -> str | None:
    """Why it cannot serve a robot, or None."""
    return leaves_no_digits(robot)


def entries(setup: Setup) -> int:
    """Of the Jacobians of a run, so many at most."""
    return setup.of(MOST_ENTRIES, MOST_ENTRIES, FEW_ENTRIES)


def begin(setup: Setup) -> None:
    """Set the long work going, side by side, while other experiments compute.

    A quick run takes fewer scenes, and leaves out many digits and the growth of errors.
    """
    cases = [case for case in setup.robot.cases if not (setup.is_quick and "full only" in case.scene.tags)]
    exact = [case for case in cases if "digits" in case.scene.tags]
    exact = setup.of(exact, [], exact[-1:])
    spread, finer, left_out = setup.map, setup.finer, []
    if setup.robot.own:  # which stay in this process
        spread, exact = map, []
        cases, finer, left_out = within_time(setup, cases, entries(setup))
    schemes = [method.scheme for method in one_of_each_scheme(setup.engines["mujoco"])]
    digits = setup.of(horizon.MOST_EXACT_STEPS, 0, FEW_EXACT_STEPS)
    grown = [] if setup.robot.own else setup.of(cases, [], cases)
    grown = [case for case in grown if not case.controller]
    true = [case for case in cases if errors.is_followed(case)]
    drift_steps = setup.of(drift.DRIFT_STEPS, drift.DRIFT_STEPS, drift.FEW_DRIFT_STEPS)
    duration, steps = horizon.growth_run(setup.robot, grown, setup.size == "small")
    of_growth = partial(horizon.grown, engines=setup.engines, duration=duration, steps=steps)
    setup.background["trajectory"] = {
        "runs": spread(partial(follow_and_draw, engines=setup.engines, finer=finer, entries=entries(setup)), cases),
        "drift": spread(partial(drift.drifts_alone, engines=setup.engines, steps=drift_steps), [setup.robot]),
        "true": ([case.name for case in true], spread(reference, true)),
        "finer": finer,
        "left_out": left_out,
        "exact": (exact, setup.map(partial(horizon.exact_runs, schemes=schemes, most=digits), exact)),
        "growth": (
            grown,
            setup.map(of_growth, grown),
            duration,
            steps,
        ),
    }


def rows(setup: Setup) -> Result:
    """Each scene, integrator and step: three levels of agreement; then drift, growth of errors, many digits."""
    result = Result("trajectory", label=LABELS[setup.robot.compared[0]], shown=[
        "scene", "engine_integrator", "dt_s", "level", "largest_difference", "unit", "difference_over_band",
        "judged_until_s", "required_s", "diverged_at_s", "twin_diverged_at_s",
    ])  # fmt: skip
    if "trajectory" not in setup.background:
        begin(setup)
    work = setup.background.pop("trajectory")
    if not setup.robot.own:
        compare_derivatives(result, setup.robot, setup.engines)
    (drifts,) = work["drift"]
    result.checks, result.notes = [*result.checks, *drifts.checks], [*result.notes, *drifts.notes]
    result.curves |= drifts.curves | {"runs": {}, "drawn": []}
    for part, drawn in work["runs"]:
        result.rows += part.rows
        result.checks += part.checks
        result.notes += part.notes
        result.curves["runs"] |= part.curves
        result.curves["drawn"] += [drawn] if drawn else []
    result.curves["drawn"] = in_order(result.curves["drawn"], setup.robot)
    motion.tabulate_motion(result, setup.robot)
    horizon.many_digits(result, *work["exact"])
    if not (work["exact"][0] or setup.is_quick or setup.robot.own):
        result.notes.append(
            f"No scene of this {setup.robot.noun} is marked to be compared with many digits of its own scheme."
        )
    if work["growth"][0]:
        horizon.growth_of_errors(result, *work["growth"])
    known = dict(zip(*work["true"]))
    result.curves["errors"] = errors.errors_when_held(result, setup.robot) | errors.errors_when_free(
        result, setup.robot, known
    )
    robot, ran = setup.robot, {name for name, *_ in result.curves["runs"]}
    numbers = robot.claims.figures if robot.claims else {}
    result.curves["leaving"] = {
        case.name: leaving.leaving(case, setup.engines)
        for case in robot.cases
        if case.is_held and case.name in ran and case.name in numbers
    }
    said = sentences.notes(result, setup.robot, setup.engines, work["finer"], entries(setup))
    result.notes = said + work["left_out"] + result.notes
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """Those of the assignment that show a held posture, one for each scene, drift, and the growth of errors."""
    from . import figures_drift, figures_motion_gif, figures_runs  # matplotlib is for the process that draws

    names = {name for name, *_ in result.curves["runs"]}
    cases = [case for case in robot.cases if case.name in names]
    numbers = robot.claims.figures if robot.claims else {}
    numbered = [case for case in cases if case.is_held and case.name in numbers]
    for case in numbered:
        yield partial(figures_runs.draw_held, result, case, numbers[case.name])
    grown = "growth" in result.curves
    for case in cases:
        if grown or case not in numbered:  # a quick run has nothing more to show of those
            yield partial(figures_runs.draw_run, result, case)
    if result.curves["drift"]["drifts"]:
        yield partial(figures_drift.draw_drift, result)
    if grown:
        yield partial(figures_drift.draw_growth, result)
    if result.curves.get("drawn"):
        yield partial(figures_motion_gif.draw_motion, result)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import draw_scenes  # matplotlib is for the process that draws

    if results["trajectory"].rows:
        yield partial(draw_scenes, results["trajectory"], robot)
