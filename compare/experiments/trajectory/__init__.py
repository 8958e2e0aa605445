"""Motion by the same scheme on both sides: a method of tmt for every integrator of MuJoCo."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from ...core.check import Result, largest_known
from ...core.finding import Finding
from ...engines import LABELS, Engine
from ...engines.mujoco.names import INTEGRATORS
from ...judge.rounding import NARROW
from ...judge.run import LEFT, MOVES, deviation, leaves_no_digits, movement_unit, number_or_none
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import RECORDS, Reference, reference
from ..setup import Setup, different_first
from .pairs import SCHEMES_OF_RK4, TrajectoryResult, recorded
from .runs import compare_case

SECONDS_OF_OWN = {"full": 20.0, "quick": 4.0, "small": 2.0}  # of all runs of a user's own equations, about
OVERHEAD_OF_OWN = 1e-4  # s of an evaluation in a run, about, beyond the equations themselves
STAGES_OF_RK4 = 4  # evaluations in a step of RK4
SHOWN = ["scene", "engine_integrator", "dt_s", "level", "largest_difference", "unit", "difference_over_band",
         "judged_until_s", "required_s", "diverged_at_s", "twin_diverged_at_s"]  # fmt: skip
skipped = leaves_no_digits


# what begin starts: of each scene the comparison; the scenes whose true motion is computed, with it; and the
# scenes that are left out, with the seconds that they would take, None: there is no method
Work = tuple[Iterable[TrajectoryResult], Iterable[tuple[str, Reference]], Mapping[str, float | None]]


def claim_values(robot: Robot) -> dict[str, str | float]:
    return {"narrow": NARROW, "moves": MOVES, "unit": movement_unit(robot.coordinates)}


def begin(setup: Setup) -> Work:
    """Start the long work, in parallel, while other experiments compute. A quick run takes fewer scenes."""
    robot, engines = setup.robot, setup.engines
    cases = [case for case in robot.cases if not (setup.is_quick and "full only" in case.scene.tags)]
    spread = map if robot.own else setup.map  # a user's equations stay in this process
    finer = setup.finer[:1] if robot.own else setup.finer
    left_out = cases_left_out(setup, cases)
    cases = [case for case in cases if case.name not in left_out]
    # a file's robot has scenes with steps of their own
    fast = [] if robot.is_read else [case for case in cases if "speed" in case.scene.tags]
    true = [case for case in fast if case.steps == RECORDS]
    runs = spread(partial(compare_case, engines=engines, finer=finer), different_first(cases))
    return runs, zip([case.name for case in true], spread(reference, true)), left_out


def cases_left_out(setup: Setup, cases: Sequence[Case]) -> dict[str, float | None]:
    """Scenes that a user's own equations do not have or cannot follow in time, in the order of the scenes."""
    left_out: dict[str, float | None] = {}
    if not setup.own:
        return left_out
    equations, left = setup.own.equations, SECONDS_OF_OWN[setup.size]
    parts = ("acceleration",) if equations.has("acceleration") else ("mass_matrix", "bias")
    of_evaluation = OVERHEAD_OF_OWN + sum(equations.times[part] for part in parts)
    for case in cases:
        is_able = setup.own.methods_in(case) and case.scene.gravity
        seconds = of_evaluation * STAGES_OF_RK4 * (case.steps + recorded(case)) if is_able else None
        left -= seconds or 0.0
        if seconds is None or left < 0.0:
            left_out[case.name] = seconds
    return left_out


def rows(setup: Setup, work: Work | None = None) -> TrajectoryResult:
    """Single steps and open loops of each scene, integrator and step; departures and errors."""
    robot, (parts, true, left_out) = setup.robot, begin(setup) if work is None else work
    result = TrajectoryResult("trajectory", label=LABELS[robot.compared[0]], shown=SHOWN)
    for part in parts:
        result.rows += part.rows
        result.checks += part.checks
        result.pairs += part.pairs
    find_errors(result, robot, dict(true))
    find_schemes(result, robot, setup.engines["mujoco"])
    if rows := [row for row in result.of_beginnings if row.level == "open loop"]:
        result.find("beginnings", rows=rows)
    if left_out:
        result.find("left_out", scenes=left_out)
    return result


def find_errors(result: TrajectoryResult, robot: Robot, references: Mapping[str, Reference]) -> None:
    """The largest errors of RK4 with the coarsest step: of a held scene from rest, else from its reference.

    Of a held scene also when each engine leaves the posture. A run that has diverged has no number.
    """
    scenes, unit = [], movement_unit(robot.coordinates)
    claims = robot.claims.of_scenes if robot.claims else {}
    for case in sorted(robot.cases, key=lambda case: not case.is_held):
        pair, reference = result.pair_of(case, *SCHEMES_OF_RK4), references.get(case.name)
        if not pair or not (case.is_held or reference):
            continue
        engines, largest = list[dict[str, Any]](), list[float | None]()
        for engine, run in pair.runs.items():
            error = deviation(run.q, run.q[0], case.coordinates)
            if reference and not case.is_held:
                error = reference.error(run.q).max()
            largest.append(number_or_none(error))
            engines.append({"label": LABELS[engine], "left": run.left, "farthest": largest[-1]})
        result.errors[case.name] = tuple(largest)
        scenes.append({"scene": case.name, "engines": engines, "difference": pair.apart.max(), "unit": unit})
        if case.is_held:
            result.find("held", scene=robot.scene_begins(case.name), engines=engines, claim=claims.get(case.name),
                        limit=LEFT, duration=case.duration, unit=unit, stated=robot.compared[0] == "tmt")  # fmt: skip
    if result.errors:
        counts = {case.steps for case in robot.cases if case.name in result.errors}
        steps = counts.pop() if len(counts) == 1 else None
        result.answer = result.finding("answer", errors=result.errors, steps=steps, unit=unit)
    if any(name in references for name in result.errors):  # held scenes have their own findings
        result.find("errors", scenes=scenes)


def find_schemes(result: TrajectoryResult, robot: Robot, mujoco: Engine) -> None:
    """Which integrators are which scheme, which have none, and which actuators are left out."""
    schemes: dict[str, list[str]] = {}
    for method in mujoco.methods.values():
        schemes.setdefault(method.scheme, []).append(method.name)
    missing = [] if robot.own else [name for name in INTEGRATORS if name not in mujoco.methods]
    result.find("schemes", own=robot.own, schemes=schemes, missing=missing, noun=robot.noun)
    driven = {case.name: case.controller for case in cases_run(result, robot) if case.controller}
    if driven:
        scenes, left_out = [*driven], next(iter(driven.values())).left_out
        result.find("servos", noun=robot.noun, scenes=scenes, left_out=left_out)


def cases_run(result: TrajectoryResult, robot: Robot) -> list[Case]:
    names = {pair.case.name for pair in result.pairs}
    return [case for case in robot.cases if case.name in names]


def headline(result: Result) -> Finding | None:
    """The largest share of the band of rounding, and the number of scenes; None if a check fails."""
    share = largest_known([row.difference_over_band for row in result.rows])
    scenes = len({row.scene for row in result.rows})
    if share is None or any(check.failed for check in result.checks):
        return None
    return result.finding("headline", scenes=scenes, share=share)


def figures(result: TrajectoryResult, robot: Robot) -> Iterator[partial[Any]]:
    """The assignment's figures of held postures, one figure for each scene, and the motion."""
    from . import figures_motion_gif, figures_runs  # matplotlib is for the process that draws

    cases = cases_run(result, robot)
    numbers = robot.claims.figures if robot.claims else {}
    for case in cases:
        pair = result.pair_of(case, "rk4") if case.is_held else None
        if pair and case.name in numbers:
            yield partial(figures_runs.draw_held, result, pair, numbers[case.name])
    for case in cases:
        yield partial(figures_runs.draw_run, result, case)
    if drawn := figures_motion_gif.drawn_pairs(robot, result.pairs):
        yield partial(figures_motion_gif.draw_motion, drawn, result.label)


def overview(results: Mapping[str, TrajectoryResult], robot: Robot) -> Iterator[partial[Any]]:
    from .figures_runs import draw_scenes  # matplotlib is for the process that draws

    if results["trajectory"].rows:
        yield partial(draw_scenes, results["trajectory"], robot)
