"""Time against error: every integrator of MuJoCo, every method of tmt, SciPy and heyoka, over all useful steps."""

from collections.abc import Iterator, Mapping, Sequence
from functools import partial

import numpy as np

from tmt import literal

from ...case import Case
from ...engines import COMPARED, GRID, Engine, Method, Setting
from ...judge import timing
from ...judge.check import Result
from ...judge.run import diverged_at, leaves_no_digits, movement_unit
from ...judge.scale import FACTOR
from ...judge.units import renamed, said
from ...judge.words import scene_begins
from ...robots import Robot
from ...setup import Setup
from ...truth.reference import Reference, has_no_reference, references
from ...truth.smallest import reduced
from . import accuracy, advice, evaluations, growth, targets, tumbling
from .accuracy import fill_in, reference_in_words, spread_in_words
from .affordable import forms_in_words
from .floors import floor
from .settings import (
    absent_in_words,
    coarsest_steps,
    followed,
    methods,
    methods_following,
    regular_of,
    scenes_of,
    schemes_in,
    settings_of,
    too_long_next,
    unavailable,
)

TITLE = "Speed against accuracy"
PARTS = (
    "In the table of what to use, mujoco, tmt and of_all are the cheapest settings whose worst error is at most target_rad. "
    "ratio is MuJoCo's time over tmt's: the product of integrator_part (MuJoCo's cheapest over its RK4), kernel_part (MuJoCo's "
    "RK4 over tmt's with the same step) and method_part (that over tmt's cheapest). Timed are compiled loops that fill memory."
)
# who follows the smaller model of a scene too, where there is one
SMALLER, SMALLER_STEPS = (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")), 1024
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
        f"digits); that MuJoCo and the same scheme in tmt make the same error but for rounding, {FACTOR} eps times the growth of "
        "a small difference along the scene; that MuJoCo's RK4 comes as near to the reference as tmt's; and that errors which "
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


def measured(setup: Setup, cases: Sequence[Case], which: str = "all") -> tuple:
    """The scenes, their references, and for each scene, as it comes, its rows without times and its rounding."""
    known = references(cases, setup.map, setup.progress)
    follow = partial(rows_of_scene, engines=setup.engines, known=known, size=setup.size, which=which)
    return cases, known, setup.map(follow, cases)


def rows(setup: Setup, timed: bool = True) -> Result:
    """Errors, times, orders, floors, and what follows for a choice.

    timed=False: only the errors of one scene by MuJoCo's integrators and the same schemes in tmt, and their checks, in a
    tenth of a second: enough to see a wrong model.
    """
    result = Result("speed", shown=[])
    if timed and "speed" not in setup.background:
        begin(setup)
    which, regular = "all" if timed else "same schemes", regular_of(setup.robot)
    cases, known, found = setup.background.pop("speed") if timed else measured(setup, [regular], which)
    of_scenes, lefts = zip(*found)
    result.rows += [row for of_scene in of_scenes for row in of_scene]
    names = [case.name for case in cases]
    floors = dict(zip(names, lefts))
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
    followed = forms_in_words(cases, [method.name for method in taking if method.engine == "tmt"])
    result.notes += [followed] * bool(followed)
    if timed:
        add_times(result, setup, names, of_scenes)
    result.notes += accuracy.first_order_in_words(result.rows, floors)
    if timed:
        absent = unavailable(setup, names)
        result.rows += absent
        result.notes += dict.fromkeys(absent_in_words(row, setup.engines) for row in absent)
    result.rows = renamed([{name: row.get(name) for name in COLUMNS} for row in result.rows], unit)
    result.notes = [said(note, unit) for note in result.notes]
    if timed:
        result.tables["what_should_i_use"] = renamed(result.tables["what_should_i_use"], unit)
    return result


def add_times(result: Result, setup: Setup, names: Sequence[str], of_scenes: Sequence[list[dict]]) -> None:
    """The seconds of all rows, what one evaluation costs, and what follows: what to use, and which aims are met."""
    setup.quiet()  # nothing else may run beside a timing
    spread = []
    for name, of_scene in zip(names, of_scenes):
        setup.progress(f"speed: timing {name}")
        spread += fill_in(of_scene, take_times(of_scene, setup))
    floors = result.curves["floors"]
    result.tables["what_should_i_use"] = advice.advice(result.rows, list(floors), floors)
    driven = [case.name for case in setup.robot.cases if case.controller]
    result.notes += advice.step_response_in_words(result.tables["what_should_i_use"], driven)
    setup.progress("speed: one evaluation")
    result.tables["evaluations"], sentences = evaluations.costs(setup)
    result.notes += [*sentences, *spread_in_words(spread), PARTS]
    growth.add_growth(result, setup)
    if not setup.robot.is_read:  # of a file nothing was aimed at
        aims = targets.targets(result, floors, timing.vectors(), setup.robot.aims)
        result.tables["speed_targets"] = aims
        result.notes += targets.aims_in_words(aims)
    result.notes += accuracy.smaller_models_in_words(result.rows)


def rows_of_scene(
    case: Case, engines: Mapping[str, Engine], known: Mapping[str, Reference], size: str, which: str
) -> tuple[list[dict], float]:
    """The rows of one scene without times; and the error that rounding leaves in it, rad."""
    reference = known[case.name]
    # beyond the digits of the reference nothing is known
    found, left = [], max(floor(case, engines["tmt"].of(case)), reference.apart)
    taking, energy = methods(engines, size, which, case.robot, case), true_energy(case, reference)
    for method in taking:
        best, last = np.inf, 0
        for setting in settings_of(method, case, size, which):
            found.append(row_of_run(case, case, engines, method, setting, reference, left, energy))
            now, work = accuracy.error(found[-1]), found[-1]["evaluations"] or found[-1]["steps"]
            if accuracy.gained_nothing(now, work, best, last, left) or too_long_next(method, case, work, size):
                break
            best, last = min(best, now), work
    smaller = None if case.robot.is_read else reduced(case)
    few = [method for method in taking if smaller and (method.engine, method.name) in SMALLER]
    setting = Setting(case.duration, SMALLER_STEPS)
    runs = [row_of_run(smaller, case, engines, method, setting, reference, energy=energy) for method in few]
    return found + runs, left


def true_energy(case: Case, reference: Reference) -> np.ndarray:
    """The energy of the reference of a scene at its times, J, (times,)."""
    nq = case.coordinates.nq
    return literal.energy(reference.high[:, :nq], reference.high[:, nq:], case.tree)


def row_of_run(
    case: Case,
    whole: Case,
    engines: Mapping[str, Engine],
    method: Method,
    setting: Setting,
    reference: Reference,
    left: float = 0.0,
    energy: np.ndarray | None = None,
) -> dict:
    """A row: one run of a scene, or of the smaller model that has the motion of the whole one.

    left: the least error that a reference in doubles shows; a smaller one is not known, and has this value. energy: that of the
    reference, J, (times,), where it is known.
    """
    joints, tree = [whole.joints.index(name) for name in case.joints], whole.tree
    places, nq = whole.coordinates.places, whole.coordinates.nq
    free = [[k for i in joints for k in range(*getattr(places.joints[i], part).indices(size))]
            for part, size in (("q", nq), ("qd", places.nv))]  # fmt: skip
    true = reference.high[:, :nq], reference.high[:, nq:]
    energy = true_energy(whole, reference) if energy is None else energy
    run, read = engines[method.engine].of(case).prepare(*case.start, case.tau, setting, method.name)
    with np.errstate(all="ignore"):
        motion = read(run())
        ended = diverged_at(case, reference.t, motion.q, motion.v) is not None
        error = reference.error(motion.q, joints)
        error = np.maximum(error, left) if reference.why else error
        states = [part.copy() for part in true]
        for state, part, own in zip(states, (motion.q, motion.v), free):
            state[:, own] = 0.0 if ended else part
        off = np.abs(literal.energy(*states, tree) - energy).max()
    return {
        "scene": case.name, "engine": method.engine, "method": method.name,
        "dt_s": setting.duration / setting.steps if setting.steps else None, "tolerance": setting.tolerance,
        "steps": motion.steps, "evaluations": motion.evaluations, "seconds": None,
        "error_rad": None if ended else float(error[-1]), "worst_error_rad": None if ended else float(error.max()),
        "energy_error_J": None if ended else float(off), "diverged": ended,
        "early": float(error[reference.t <= advice.EARLY].max()), "run": (case, method, setting),
        "whole": None if case is whole else whole.name,
    }  # fmt: skip


def take_times(rows: list[dict], setup: Setup) -> list[list[float]]:
    """Seconds of the runs of one scene's rows, all settings in turns."""
    runs = []
    for case, method, setting in (row["run"] for row in rows):
        dynamics = setup.engines[method.engine].of(case)
        runs.append(dynamics.prepare(*case.start, case.tau, setting, method.name)[0])
    return timing.in_turns(runs, rounds=setup.of(5, 2, 2))


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """Error against time, against evaluations, energy against time: calls that draw one figure each."""
    # matplotlib is for the process that draws
    from . import figures_evaluations, figures_growth, figures_panels, figures_times

    if "what_should_i_use" not in result.tables:  # nothing was timed
        return
    for scene in figures_times.scenes(result):
        yield partial(figures_times.draw_times, result, scene, beginning=scene_begins(scene, robot))
    yield partial(figures_panels.draw_evaluations, result)
    yield partial(figures_panels.draw_energy, result)
    yield partial(figures_evaluations.draw_cost, result, robot.name)
    if "growth" in result.tables:
        yield partial(figures_growth.draw_chain, result)
