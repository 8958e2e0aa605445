"""Time against error: every integrator of MuJoCo, every method of tmt, SciPy and heyoka, over all useful steps."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

from ...core import timing
from ...core.check import Result
from ...core.finding import Finding
from ...core.units import renamed
from ...engines import GRID, IN_QUICK_RUNS, LABELS, RECORDS, methods_in
from ...judge.run import leaves_no_digits, movement_unit
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.case import Case
from ...truth.reference import LOST, has_no_reference
from .. import Experiment
from ..setup import Setup
from . import accuracy, advice, evaluations
from .first_screen import best_rows, cheapest, target
from .runs import FIRST_STEPS, measured, prepared, rows_of_scene, take_times
from .settings import followed, left_out, regular_of, scenes_of

EXPERIMENT = Experiment(order=90, serves_own=False, options=("--scenes",), timed=True, overview="times")
COLUMNS = ["scene", "engine", "method", "dt_s", "tolerance", "steps", "timed_steps", "evaluations", "seconds", "error_rad",
           "worst_error_rad", "energy_error_J", "diverged", "why_not"]  # fmt: skip


def claim_values(robot: Robot) -> dict:
    return {"unit": movement_unit(robot.coordinates), "times": GRID + 1, "eps": FACTOR, "lost": LOST}


def skipped(robot: Robot) -> Finding | str | None:
    if not scenes_of(robot):
        return Finding("speed", "no_scene", {"noun": robot.noun})
    return leaves_no_digits(robot) or has_no_reference(robot)


def begin(setup: Setup) -> tuple:
    """Start measuring the errors of MuJoCo and tmt, in parallel with other work: they are timed later."""
    return measured(setup, followed(setup.robot, setup.size))


def rows(setup: Setup, work: tuple | None = None) -> Result:
    """Errors, times, orders, the error of rounding, and the cheapest settings."""
    cases, scenes = begin(setup) if work is None else work
    by_scene = {name: parts for name, *parts in scenes}
    references, floors, rows_of = ({case.name: by_scene[case.name][k] for case in cases} for k in range(3))
    compiled, failed = add_times(setup, cases, references, floors, rows_of)
    result = judged(setup, cases, references, floors, rows_of)
    add_advice(result, setup, compiled)
    add_absent(result, setup)
    unit, table = result.curves["unit"], result.rows + failed
    result.rows = renamed([{name: row.get(name) for name in COLUMNS} for row in table], unit)
    return result


def judged(setup: Setup, cases: Sequence[Case], references, floors, rows_of) -> Result:
    """The rows of the scenes, and checks of their errors and orders."""
    regular, unit = regular_of(setup.robot), movement_unit(setup.robot.coordinates)
    servos_off = setup.robot.drive.feeds_back and not regular.controller
    curves = {"floors": floors, "regular": regular.name, "unit": unit, "servos_off": servos_off}
    rows = [row for of_scene in rows_of.values() for row in of_scene]
    result = Result("speed", shown=[], rows=rows, curves=curves | {"of_file": setup.robot.is_read})
    # with the coarse steps of a quick run errors are regular in this scene only, and other engines have too few settings
    whole, mujoco = setup.size == "full", setup.engines["mujoco"]
    ran = {(row["engine"], row["method"]): row["run"][1] for row in result.rows}
    fixed = [m for m in ran.values() if not m.adaptive and (whole or m.engine in IN_QUICK_RUNS)]
    # where servos act a fast mode decays first, and an order shows only with short steps
    falling = [case.name for case in cases if not case.controller] if whole else [regular.name]
    result.tables["speed_orders"] = accuracy.check_orders(result, falling, fixed)
    schemes = {c.name: {m.name: m.scheme for m in methods_in(mujoco, c).values()} for c in cases}
    accuracy.check_same_schemes(result, floors, schemes, unit)
    accuracy.check_smallest_errors(result, floors, unit)
    runs = [
        {"scene": scene, "floor": floors[scene], "expected": LOST * floors[scene] / EPS}
        | {"apart": reference.apart, "steps": reference.steps, "why": reference.why}
        for scene, reference in references.items()
    ]
    result.find("references", runs=runs, unit=unit)
    return result


def add_times(
    setup: Setup, cases: Sequence[Case], references, floors, rows_of
) -> tuple[evaluations.Evaluations, list]:
    """The seconds of all rows, the rows of engines that are called, and what `evaluations.costs` times; rows that fail."""
    compiled, failed = evaluations.compiled_evaluations(setup), []
    runs = [prepared(rows_of[case.name], setup) for case in cases]
    setup.quiet()  # nothing else may run while times are taken
    for case, its_runs in zip(cases, runs):
        setup.progress(f"speed: timing {case.name}")
        name, of_scene = case.name, rows_of[case.name]
        called = rows_of_scene(case, setup.engines, references[name], floors[name], setup.size, "called")
        failed += [row for row in called if row.get("why_not")]
        called = [row for row in called if not row.get("why_not")]
        short = [row for row in called if row["seconds"] < timing.TIMED_ENOUGH]
        again = [row for row in short if not RECORDS[row["engine"]].reads_file]
        take_times(of_scene + again, its_runs + prepared(again, setup), setup)
        of_scene += called
    return compiled, failed


def add_advice(result: Result, setup: Setup, compiled: evaluations.Evaluations) -> None:
    """The cheapest settings, and the cost of one evaluation."""
    if settings := cheapest(best_rows(result)):
        result.headline = result.finding("headline", settings=settings, **target(result))
        result.top.append(result.finding("answer", settings=settings, **target(result)))
    table = advice.advice(result.rows, list(result.curves["floors"]))
    result.tables["what_should_i_use"] = renamed(table, result.curves["unit"])
    result.find("columns")
    setup.progress("speed: one evaluation")
    result.tables["evaluations"] = evaluations.costs(setup, compiled)
    result.find("timing", once=timing.TIMED_ENOUGH, first_steps=FIRST_STEPS)


def add_absent(result: Result, setup: Setup) -> None:
    """A row for each scene and engine that does not run, or not with all methods, and a finding for each engine."""
    groups = {}
    for (engine, method), reason in left_out(setup.engines, setup.size, setup.robot).items():
        groups.setdefault((engine, reason), []).append(method)
    for (engine, reason), names in groups.items():
        whole = len(names) == len(setup.engines[engine].methods)
        result.find(
            "absent", engine=LABELS.get(engine, engine), methods=[] if whole else names, reason=reason
        )
        row = {"engine": engine, "method": ", ".join(names), "why_not": reason}
        result.rows += [{"scene": scene} | row for scene in result.curves["floors"]]


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from . import figures_speed  # matplotlib is for the process that draws

    if "what_should_i_use" not in result.tables:  # nothing was timed
        return
    for scene in result.curves["floors"]:
        yield partial(figures_speed.draw_times, result, scene, beginning=robot.scene_begins(scene))


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_speed import draw_overview  # matplotlib is for the process that draws

    if best_rows(results["speed"]):
        yield partial(draw_overview, results["speed"])
