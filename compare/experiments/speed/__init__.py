"""Time against error: the integrators of MuJoCo, the methods of tmt, SciPy, heyoka and engines that read the file."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from typing import Any

from ...core import timing
from ...core.finding import Finding
from ...engines import GRID, IN_QUICK_RUNS, LABELS
from ...judge.run import leaves_no_digits, movement_unit
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...truth.reference import LOST, NoReference, has_no_reference
from .. import ALWAYS
from ..setup import Setup, different_first
from . import conclusions, evaluations
from .runs import FIRST_STEPS, RunRow, SceneRuns, SpeedResult, rows_of, scene_runs, take_times
from .settings import followed, left_out, regular_of, scenes_of


def claim_values(robot: Robot) -> dict[str, str | float]:
    return {"unit": movement_unit(robot.coordinates), "times": GRID + 1, "eps": FACTOR, "lost": LOST}


def skipped(robot: Robot) -> Finding | None:
    if not scenes_of(robot):
        return Finding("speed", "no_scene", {"noun": robot.noun})
    return leaves_no_digits(robot) or has_no_reference(robot)


def begin(setup: Setup) -> Iterable[SceneRuns | NoReference]:
    """Start measuring the errors of MuJoCo and tmt, in parallel with other work: they are timed later."""
    cases = followed(setup.robot, setup.size)
    return setup.map(partial(scene_runs, engines=setup.engines, size=setup.size), different_first(cases))


def rows(setup: Setup, work: Iterable[SceneRuns | NoReference] | None = None) -> SpeedResult:
    """Errors, times, orders, the error of rounding, and the cheapest settings. A scene without reference is not judged."""
    names, work = [case.name for case in setup.robot.cases], begin(setup) if work is None else work
    loops = evaluations.loops(setup)  # compiled here while workers measure errors
    found = [*work]
    known = [scene for scene in found if isinstance(scene, SceneRuns)]
    scenes = sorted(known, key=lambda scene: names.index(scene.case.name))
    without = [str(reason) for reason in found if isinstance(reason, NoReference)]
    if regular_of(setup.robot).name not in [scene.case.name for scene in scenes]:
        result = SpeedResult("speed", shown=[])
        for reason in without:
            result.not_judged("", "errors over time", reason)
        return result
    setup.quiet()  # nothing else may run while times are taken
    for scene in scenes:
        setup.progress(f"speed: timing {scene.case.name}")
        take_times(scene.case, scene.rows, setup.engines)
        called = rows_of(scene, setup.engines, setup.size, compiled=False)
        take_times(scene.case, [row for row in called if row.time < timing.TIMED_ENOUGH], setup.engines)
        scene.rows += called
    result = judged(setup, scenes)
    for reason in without:
        result.not_judged("", "errors over time", reason)
    result.tables["what_should_i_use"] = conclusions.what_to_use(result)
    result.headline = result.finding("headline", uses=uses(result))
    result.top.append(result.finding("answer", uses=uses(result)))
    result.find("columns")
    setup.progress("speed: one evaluation")
    result.tables["evaluations"] = evaluations.costs(loops, setup.of(12, 5, 2))
    prepared = compilation(result.rows)
    result.find("timing", once=timing.TIMED_ENOUGH, first_steps=FIRST_STEPS, prepared=prepared)
    add_absent(result, setup)
    return result


def judged(setup: Setup, scenes: Sequence[SceneRuns]) -> SpeedResult:
    """The rows of the scenes, and checks of their errors and orders."""
    regular = regular_of(setup.robot)
    result = SpeedResult("speed", shown=[], rows=[row for scene in scenes for row in scene.rows])
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


def uses(result: SpeedResult) -> dict[str, Any]:
    """What to use where errors are regular, of each engine by error; and the cheapest of all, of tmt and of MuJoCo."""
    table = [row for row in result.tables["what_should_i_use"] if row.scene == result.regular]
    first = [row for row in table if row.target == conclusions.TARGET]
    cheapest = [row for row in first if row.method and (row is first[0] or row.engine in ALWAYS)]
    return {
        "scene": result.regular, "unit": result.unit, "servos_off": result.servos_off,
        "target": conclusions.TARGET, "targets": conclusions.TARGETS, "first_steps": FIRST_STEPS,
        "engines": {LABELS[one.engine]: [row for row in table if row.engine == one.engine] for one in first},
        "cheapest": {LABELS[row.engine]: row for row in cheapest},
        "extrapolated": any(row.extrapolated for row in table),
    }  # fmt: skip


def compilation(rows: Sequence[RunRow]) -> dict[str, float]:
    """Seconds in which each engine has compiled, or loaded, what its methods run, where it took 10 ms."""
    methods: dict[tuple[str, str], float] = {}
    for row in rows:
        key = row.engine, row.method
        methods[key] = max(methods.get(key, 0.0), row.compile_seconds or 0.0)
    engines = dict.fromkeys(row.engine for row in rows)
    sums = {LABELS[name]: sum(of for key, of in methods.items() if key[0] == name) for name in engines}
    return {engine: seconds for engine, seconds in sums.items() if seconds >= 0.01}


def add_absent(result: SpeedResult, setup: Setup) -> None:
    """Rows and findings: engines that do not run, or not with all methods."""
    for (engine, method), reason in left_out(setup.engines, setup.size, setup.robot).items():
        about: dict[str, Any] = {"engine": engine, "method": method, "unit": result.unit, "why_not": reason}
        result.rows += [RunRow(scene=scene, **about) for scene in result.floors]
    groups: dict[tuple[str, str], dict[str, None]] = {}
    for row in result.rows:
        if row.why_not:
            groups.setdefault((row.engine, row.why_not), {})[row.method] = None
    for (engine, reason), names in groups.items():
        methods = [] if len(names) == len(setup.engines[engine].methods) else [*names]
        result.find("absent", engine=LABELS.get(engine, engine), methods=methods, reason=reason)


def figures(result: SpeedResult, robot: Robot) -> Iterator[partial[Any]]:
    from . import figures_speed  # matplotlib is for the process that draws

    if "what_should_i_use" not in result.tables:  # nothing was timed
        return
    for scene in result.floors:
        yield partial(figures_speed.draw_times, result, scene, beginning=robot.scene_begins(scene))


def overview(results: Mapping[str, SpeedResult], robot: Robot) -> Iterator[partial[Any]]:
    from .figures_speed import draw_overview  # matplotlib is for the process that draws

    result = results["speed"]
    if result.tables.get("what_should_i_use"):
        yield partial(draw_overview, result, uses(result))
