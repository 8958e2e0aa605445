"""Time against error: every integrator of MuJoCo, every method of tmt, SciPy and heyoka, over all useful steps."""

from collections.abc import Iterator, Mapping
from functools import partial

from ...engines import COMPARED, GRID
from ...judge.check import Result
from ...judge.run import leaves_no_digits, movement_unit
from ...judge.scale import FACTOR
from ...judge.units import renamed, said
from ...judge.words import scene_begins
from ...robots import Robot
from ...truth.reference import has_no_reference
from .. import Experiment
from ..setup import Setup
from . import accuracy, advice, evaluations, tumbling
from .accuracy import reference_in_words
from .first_screen import best_curves, choice
from .first_screen import headline as headline
from .runs import measured
from .settings import (
    absent_in_words,
    coarsest_steps,
    followed,
    methods_following,
    regular_of,
    scenes_of,
    schemes_in,
    unavailable,
)
from .times import fill_in, prepared, spread_in_words, take_times

EXPERIMENT = Experiment(order=90, serves_own=False, options=("--scenes",), timed=True, overview="times")
PARTS = (
    "In the table of what to use, mujoco, tmt and of_all are the cheapest settings whose worst error is at most target_rad. "
    "ratio is MuJoCo's time over tmt's: the product of integrator_part (MuJoCo's cheapest over its RK4), kernel_part (MuJoCo's "
    "RK4 over tmt's with the same step) and method_part (that over tmt's cheapest). Timed are compiled loops that fill memory."
)
COLUMNS = ["scene", "engine", "method", "dt_s", "tolerance", "steps", "evaluations", "seconds", "error_rad", "worst_error_rad",
           "energy_error_J", "diverged", "why_not"]  # fmt: skip


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    return (
        "Every integrator of MuJoCo and every method of tmt, SciPy and (where it is installed) heyoka comes to the same motion "
        "as its step falls, at its own order and down to rounding; so errors can be set against time, and the cheapest setting "
        "for so many digits be named. What is compared is code made for this one model (tmt, SciPy, heyoka) against an engine "
        "made for any model (MuJoCo): the ratios say what that costs, not that one is better. Timings make no checks."
    )


def tolerance(robot: Robot) -> str:
    """What errors are, and how they are judged."""
    what = "angles" if movement_unit(robot.coordinates) == "rad" else f"movements ({movement_unit(robot.coordinates)})"
    return (
        f"Errors are the largest of the {what} on a grid of {GRID + 1} times, against {reference_in_words(robot)}. Checked: "
        "that each method of fixed step has its order in the error of the first second, which falls "
        "regularly (of order 8 only the least, for rounding comes before its error has settled; the tests show it in many "
        f"digits); that MuJoCo and the same scheme in tmt make the same error except for rounding, {FACTOR} eps times the growth "
        "of a small difference along the scene; that MuJoCo's RK4 comes as near to the reference as tmt's; and that errors which "
        "have stopped falling are of that same size of rounding. So a model with other numbers fails: its motion is another."
    )


def skipped(robot: Robot) -> str | None:
    """Why it cannot serve a robot, or None."""
    if not scenes_of(robot):
        return f"the {robot.noun} has no scene that every method follows"
    return leaves_no_digits(robot) or has_no_reference(robot)


def begin(setup: Setup) -> None:
    """Measure all errors beside other work: they are no timings."""
    setup.background["speed"] = measured(setup, followed(setup.robot, setup.size))


def rows(setup: Setup, timed: bool = True) -> Result:
    """Errors, times, orders, floors, and what follows for a choice.

    timed=False: only the errors of one scene by MuJoCo's integrators and the same schemes in tmt, and their checks, in a
    tenth of a second: enough to see a wrong model.
    """
    result = Result("speed", shown=[])
    if timed and "speed" not in setup.background:
        begin(setup)
    which, regular = "all" if timed else "same schemes", regular_of(setup.robot)
    cases, found = setup.background.pop("speed") if timed else measured(setup, [regular], which)
    found, names = {name: parts for name, *parts in found}, [case.name for case in cases]
    known, of_scenes, floors = ({name: found[name][k] for name in names} for k in range(3))
    result.rows += [row for of_scene in of_scenes.values() for row in of_scene]
    unit = movement_unit(setup.robot.coordinates)
    result.curves |= {"floors": floors, "regular": regular.name, "unit": unit, "of_file": setup.robot.is_read}
    result.curves["doubles"] = [name for name in names if known[name].why]
    # with coarse steps errors are regular in this scene only, not all methods come near, and further engines take too few
    whole = setup.size == "full"
    taking = [method for method in methods_following(setup, cases, which) if whole or method.engine in COMPARED]
    fixed = [method for method in taking if not method.adaptive]
    # where servos act a fast mode decays first: an order is not seen before the steps are short beside it
    falling = [case.name for case in cases if not case.controller] if whole else [regular.name]
    # the steps of a robot of many joints may be too few for that
    complete = (whole or not timed) and not setup.robot.is_read
    result.tables["speed_orders"] = advice.orders(result, falling, fixed, complete)
    if timed and setup.robot.coordinates.has_balls:
        result.tables["speed_orders"] += tumbling.orders_on_a_body(result, setup.engines)
    accuracy.check_same_schemes(result, floors, schemes_in(setup, cases), unit)
    accuracy.check_smallest_errors(result, floors, unit)
    steps = {case.name: coarsest_steps(case) for case in cases}
    result.notes += accuracy.true_errors_in_words(result.rows, steps, setup.robot)
    result.notes += accuracy.references_in_words(known, floors)
    result.notes += accuracy.floors_in_words(result.rows, floors)
    if timed:
        add_times(result, setup, of_scenes)
    result.notes += accuracy.first_order_in_words(result.rows, floors)
    if timed:
        absent = unavailable(setup, names)
        result.rows += absent
        result.notes += dict.fromkeys(absent_in_words(row, setup.engines) for row in absent)
    result.rows = renamed([{name: row.get(name) for name in COLUMNS} for row in result.rows], unit)
    result.notes = [said(note, unit) for note in result.notes]
    if timed:
        result.tables["what_should_i_use"] = renamed(result.tables["what_should_i_use"], unit)
        result.curves["choice"] = choice(result)
    return result


def add_times(result: Result, setup: Setup, of_scenes: Mapping[str, list[dict]]) -> None:
    """The seconds of all rows, what one evaluation costs, and what follows: what to use."""
    ways = evaluations.made_ways(setup)
    runs = [prepared(of_scene, setup) for of_scene in of_scenes.values()]
    setup.quiet()  # nothing else may run beside a timing
    spread = []
    for (name, of_scene), its_runs in zip(of_scenes.items(), runs):
        setup.progress(f"speed: timing {name}")
        spread += fill_in(of_scene, take_times(its_runs, setup))
    floors = result.curves["floors"]
    result.tables["what_should_i_use"] = advice.advice(result.rows, list(floors), floors)
    driven = [case.name for case in setup.robot.cases if case.controller]
    result.notes += advice.step_response_in_words(result.tables["what_should_i_use"], driven)
    setup.progress("speed: one evaluation")
    result.tables["evaluations"], sentences = evaluations.costs(setup, ways)
    result.notes += [*sentences, *spread_in_words(spread), PARTS]
    result.notes += accuracy.smaller_models_in_words(result.rows)


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """Error against time, against evaluations, energy against time: calls that draw one figure each."""
    # matplotlib is for the process that draws
    from . import figures_evaluations, figures_panels, figures_times

    if "what_should_i_use" not in result.tables:  # nothing was timed
        return
    for scene in figures_times.scenes(result):
        yield partial(figures_times.draw_times, result, scene, beginning=scene_begins(scene, robot))
    yield partial(figures_panels.draw_evaluations, result)
    yield partial(figures_panels.draw_energy, result)
    yield partial(figures_evaluations.draw_cost, result, robot.name)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import draw_times  # matplotlib is for the process that draws

    if best_curves(results["speed"]):
        yield partial(draw_times, results["speed"])
