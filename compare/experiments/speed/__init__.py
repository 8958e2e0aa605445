"""Time against error: all integrators of MuJoCo, all methods of tmt, SciPy and heyoka, all useful steps."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from ...core import timing
from ...core.finding import Finding
from ...engines import GRID, IN_QUICK_RUNS, LABELS
from ...judge.run import leaves_no_digits, movement_unit
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...truth.reference import LOST, has_no_reference
from .. import Experiment
from ..setup import Setup, different_first
from . import conclusions, evaluations
from .runs import FIRST_STEPS, SceneRuns, SpeedResult, SpeedRow, prepared, runs_of, scene_runs, take_times
from .settings import followed, left_out, regular_of, scenes_of

EXPERIMENT = Experiment(order=90, serves_own=False, options=("--scenes",), timed=True, overview="times")


def claim_values(robot: Robot) -> dict[str, str | float]:
    return {"unit": movement_unit(robot.coordinates), "times": GRID + 1, "eps": FACTOR, "lost": LOST}


def skipped(robot: Robot) -> Finding | None:
    if not scenes_of(robot):
        return Finding("speed", "no_scene", {"noun": robot.noun})
    return leaves_no_digits(robot) or has_no_reference(robot)


def begin(setup: Setup) -> Iterable[SceneRuns]:
    """Start measuring the errors of MuJoCo and tmt, in parallel with other work: they are timed later."""
    cases = followed(setup.robot, setup.size)
    return setup.map(partial(scene_runs, engines=setup.engines, size=setup.size), different_first(cases))


def rows(setup: Setup, work: Iterable[SceneRuns] | None = None) -> SpeedResult:
    """Errors, times, orders, the error of rounding, and the cheapest settings."""
    names = [case.name for case in setup.robot.cases]
    scenes = sorted(begin(setup) if work is None else work, key=lambda scene: names.index(scene.case.name))
    loops = evaluations.loops(setup)
    add_times(setup, scenes)
    result = judged(setup, scenes)
    cheapest = conclusions.cheapest_settings(result)
    if cheapest["settings"]:
        result.headline = result.finding("headline", **cheapest)
    result.tables["what_should_i_use"] = conclusions.advice(result)
    result.find("columns")
    setup.progress("speed: one evaluation")
    result.tables["evaluations"] = evaluations.costs(loops, setup.of(12, 5, 2))
    result.find("timing", once=timing.TIMED_ENOUGH, first_steps=FIRST_STEPS)
    add_absent(result, setup)
    return result


def judged(setup: Setup, scenes: Sequence[SceneRuns]) -> SpeedResult:
    """The rows of the scenes, and checks of their errors and orders."""
    regular = regular_of(setup.robot)
    result = SpeedResult("speed", shown=[], rows=[run.row for scene in scenes for run in scene.runs])
    result.floors = {scene.case.name: scene.floor for scene in scenes}
    result.regular, result.unit = regular.name, movement_unit(setup.robot.coordinates)
    result.servos_off = bool(setup.robot.drive and setup.robot.drive.feeds_back) and not regular.controller
    # where servos act a fast mode decays first, and an order shows only with short steps
    falling, engines = [scene for scene in scenes if not scene.case.controller], tuple(setup.engines)
    if setup.size != "full":  # errors are regular in one scene only, and other engines have too few settings
        falling, engines = [scene for scene in scenes if scene.case.name == regular.name], IN_QUICK_RUNS
    result.tables["speed_orders"] = conclusions.check_orders(result, falling, engines)
    for check in (conclusions.check_same_schemes, conclusions.check_smallest_errors):
        for scene in scenes:
            check(result, scene)
    references = [
        {"scene": scene.case.name, "steps": scene.reference.steps, "why": scene.reference.why,
         "apart": scene.reference.apart, "floor": scene.floor, "expected": LOST * scene.floor / EPS}
        for scene in scenes
    ]  # fmt: skip
    result.find("references", runs=references, unit=result.unit)
    return result


def add_times(setup: Setup, scenes: Sequence[SceneRuns]) -> None:
    """Add the runs of engines that are called; set the seconds of all."""
    calls_of_scenes = [prepared(scene.case, scene.runs, setup.engines) for scene in scenes]
    setup.quiet()  # nothing else may run while times are taken
    for scene, calls in zip(scenes, calls_of_scenes):
        setup.progress(f"speed: timing {scene.case.name}")
        called = runs_of(scene, setup.engines, setup.size, compiled=False)
        again = [run for run in called if run.row.time < timing.TIMED_ENOUGH]
        take_times(scene.runs + again, calls + prepared(scene.case, again, setup.engines))
        scene.runs += called


def add_absent(result: SpeedResult, setup: Setup) -> None:
    """Rows and findings: engines that do not run, or not with all methods."""
    groups: dict[tuple[str, str], list[str]] = {}
    for (engine, method), reason in left_out(setup.engines, setup.size, setup.robot).items():
        groups.setdefault((engine, reason), []).append(method)
    for (engine, reason), names in groups.items():
        methods = [] if len(names) == len(setup.engines[engine].methods) else names
        result.find("absent", engine=LABELS.get(engine, engine), methods=methods, reason=reason)
        for scene in result.floors:
            result.rows.append(SpeedRow(scene, engine, ", ".join(names), why_not=reason, unit=result.unit))


def figures(result: SpeedResult, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_speed  # matplotlib is for the process that draws

    if "what_should_i_use" not in result.tables:  # nothing was timed
        return
    for scene in result.floors:
        yield partial(figures_speed.draw_times, result, scene, beginning=robot.scene_begins(scene))


def overview(results: Mapping[str, SpeedResult], robot: Robot) -> Iterator[partial[Any]]:
    from .figures_speed import draw_overview  # matplotlib is for the process that draws

    if conclusions.best_rows(results["speed"]):
        yield partial(draw_overview, results["speed"])
