"""Time against error: every integrator of MuJoCo, every method of tmt, SciPy and heyoka, over all useful steps."""

from functools import partial

import numpy as np

import tmt
from tmt.methods import METHODS

from . import accuracy, clock, evaluations, machine, targets
from .advice import EARLY, advice, orders
from .agreement import EPS, FACTOR, Result
from .band import growth
from .competitors import GRID, Setting, competitors
from .motion import diverged_at
from .reference import references
from .scenes import HINGES, SCENES
from .smallest import reduced

TITLE = "Speed against accuracy"
CLAIM = (
    "Every integrator of MuJoCo and every method of tmt, SciPy and (where it is installed) heyoka comes to the same motion as "
    "its step falls, at its own order and down to rounding; so errors can be set against time, and the cheapest setting for "
    "so many digits be named. What is compared is code made for this one model (tmt, SciPy, heyoka) against an engine made "
    "for any model (MuJoCo): the ratios say what that costs, not that one is better. Timings make no checks."
)
BAR = (
    f"Errors are the largest of the angles on a grid of {GRID + 1} times, against runs with many digits (a table, made again in "
    "part by the tests). Checked: that each method of fixed step has its order in the error of the first second, which falls "
    "regularly (of order 8 only the least, for rounding comes before its error has settled; the tests show it in many digits); "
    f"that MuJoCo and the same scheme in tmt make the same error but for rounding, {FACTOR} eps times the growth of a small "
    "difference along the scene; that MuJoCo's RK4 comes as near to the reference as tmt's; and that errors which have "
    "stopped falling are of that same size of rounding. So a model with other numbers fails: its motion is another."
)
PARTS = (
    "In the table of what to use, mujoco, tmt and of_all are the cheapest settings whose worst error is at most target_rad. "
    "ratio is MuJoCo's time over tmt's: the product of integrator_part (MuJoCo's cheapest over its RK4), kernel_part (MuJoCo's "
    "RK4 over tmt's with the same step) and method_part (that over tmt's cheapest). Timed are compiled loops that fill memory."
)
# who follows the smaller model of a scene too, where there is one
SMALLER, SMALLER_STEPS = (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")), 1024
FEW = {"quick": ("bent, free",), "small": ("zero, free", "bent, free")}  # the scenes of a run that is not full
LEAST = "bent, free"  # the scene of a run without timings: errors fall regularly there from coarse steps on
COLUMNS = ["scene", "engine", "method", "dt_s", "tolerance", "steps", "evaluations", "seconds", "error_rad", "worst_error_rad",
           "energy_error_J", "diverged"]  # fmt: skip


def begin(setup) -> None:
    """Measure all errors beside other work: they are no timings."""
    setup.background["speed"] = measured(setup, FEW.get(setup.size))


def measured(setup, names=None, which="all") -> tuple:
    """Scenes by these names (all with a reference), and for each, as it comes, its rows without times and its rounding."""
    known = references(setup.map, setup.tell)
    scenes = [scene for scene in SCENES if scene.name in known and (names is None or scene.name in names)]
    follow = partial(errors, engine=setup.engine, known=known, size=setup.size, which=which)
    return scenes, setup.map(follow, scenes)


def rows(setup, timed=True) -> Result:
    """Errors, times, orders, floors, and what follows for a choice.

    timed=False: only the errors of one scene by MuJoCo's integrators and the same schemes in tmt, and their checks, in a
    tenth of a second: enough to see a wrong model.
    """
    result = Result("speed", shown=[])
    if timed and "speed" not in setup.background:
        begin(setup)
    which = "all" if timed else "same schemes"
    scenes, found = setup.background.pop("speed") if timed else measured(setup, (LEAST,), which)
    of_scenes, lefts = zip(*found)
    result.rows += [row for of_scene in of_scenes for row in of_scene]
    names = [scene.name for scene in scenes]
    floors = dict(zip(names, lefts))
    fixed = [(c.engine, c.method, c.order) for c in competitors(setup.engine, setup.size, which) if c.order]
    # with coarse steps errors are regular in this scene only, and not all methods come near
    whole = setup.size == "full"
    regular = names if whole else [LEAST]
    result.tables["speed_orders"] = orders(result, regular, fixed, complete=whole or not timed)
    accuracy.same_schemes(result, floors)
    accuracy.smallest_errors(result, floors)
    result.curves["floors"] = floors
    result.notes += [*accuracy.true_errors_told(result.rows), *accuracy.floors_told(result.rows, floors)]
    if timed:
        add_times(result, setup, scenes, of_scenes)
    result.notes += accuracy.first_order(result.rows, floors)
    result.rows = [{name: row[name] for name in COLUMNS} for row in result.rows]
    return result


def add_times(result, setup, scenes, of_scenes) -> None:
    """The seconds of all rows, what one evaluation costs, and what follows: what to use, and which aims are met."""
    setup.quiet()  # nothing else may run beside a timing
    spread = []
    for scene, of_scene in zip(scenes, of_scenes):
        setup.tell(f"speed: timing {scene.name}")
        spread += fill_in(of_scene, take_times(of_scene, setup))
    floors = result.curves["floors"]
    result.tables["what_should_i_use"] = advice(result.rows, list(floors), floors)
    setup.tell("speed: one evaluation")
    result.tables["evaluations"], told = evaluations.costs(setup)
    result.tables["speed_targets"] = targets.targets(result, floors, machine.vectors())
    result.notes += [*told, *spread_told(spread), PARTS, *targets.told(result.tables["speed_targets"])]
    result.notes += accuracy.smaller_models(result.rows)


def errors(scene, engine, known, size, which) -> tuple[list[dict], float]:
    """The rows of one scene without times; and the error that rounding leaves in it, rad."""
    reference = known[scene.name]
    found, field, left = [], competitors(engine, size, which), floor(scene)
    for place, competitor in enumerate(field):
        best, last = np.inf, 0
        for setting in competitor.settings:
            found.append(follow(scene, scene, competitor, setting, reference) | {"place": (place, scene, setting)})
            now, work = accuracy.error(found[-1]), found[-1]["evaluations"] or found[-1]["steps"]
            if accuracy.gained_nothing(now, work, best, last, left):
                break
            best, last = min(best, now), work
    smaller = reduced(scene)
    for place, competitor in enumerate(field if smaller else ()):
        if (competitor.engine, competitor.method) in SMALLER:
            setting = Setting(steps=SMALLER_STEPS)
            found.append(follow(smaller, scene, competitor, setting, reference) | {"place": (place, smaller, setting)})
    return found, left


def follow(scene, whole, competitor, setting, reference) -> dict:
    """A row: one run of a scene, or of the smaller model that has the motion of the whole one."""
    hinges, model = [HINGES.index(name) for name in scene.hinges], whole.model
    energy = tmt.energy(reference.high[:, :3], reference.high[:, 3:], model)
    run, read = competitor.prepare(scene, setting)
    with np.errstate(all="ignore"):
        outcome = read(run())
        ended = diverged_at(scene, reference.t, outcome.q, outcome.qd) is not None
        error = reference.error(outcome.q, hinges)
        states = reference.high[:, :3].copy(), reference.high[:, 3:].copy()
        for state, part in zip(states, (outcome.q, outcome.qd)):
            state[:, hinges] = 0.0 if ended else part
        off = np.abs(tmt.energy(*states, model) - energy).max()
    return {
        "scene": scene.name, "engine": competitor.engine, "method": competitor.method,
        "dt_s": scene.duration / setting.steps if setting.steps else None, "tolerance": setting.tolerance,
        "steps": outcome.steps, "evaluations": outcome.evaluations, "seconds": None,
        "error_rad": None if ended else float(error[-1]), "worst_error_rad": None if ended else float(error.max()),
        "energy_error_J": None if ended else float(off), "diverged": ended,
        "early": float(error[reference.t <= EARLY].max()),
    }  # fmt: skip


def floor(scene) -> float:
    """What rounding leaves of the angles: eps times the largest growth of a small difference up to each time, rad."""
    steps = 1024
    dt = scene.duration / steps
    _, q, qd = tmt.simulate(*scene.start, scene.tau, dt, steps, "rk4", scene.model)
    return float(
        EPS * 10.0 ** growth(METHODS["rk4"], scene.model, q, qd, scene.tau, dt, 16).max() * max(1.0, np.abs(q).max())
    )


def take_times(rows, setup) -> list[list[float]]:
    """Seconds of the runs of one scene's rows, all settings in turns."""
    field = competitors(setup.engine, setup.size)
    runs = [field[place].prepare(scene, setting)[0] for place, scene, setting in (row["place"] for row in rows)]
    return clock.in_turns(runs, rounds=setup.of(5, 2, 2))


def fill_in(rows, times) -> list[float]:
    """Give each row the least of its times; of those that have more than one, the median over the least."""
    for row, of_row in zip(rows, times):
        row["seconds"] = min(of_row)
    return [float(np.median(of_row)) / min(of_row) for of_row in times if len(of_row) > 1]


def spread_told(spread) -> list[str]:
    """How the times of one setting differ, in words."""
    if not spread:
        return ["Each time is that of one run."]
    return [
        f"Each time is the least of several runs (one, if it takes longer than {clock.LONG:g} s), in turns with all of its "
        f"scene; where there are more than one, their median is {np.median(spread) - 1:.1%} above the least, for one setting "
        f"in ten more than {np.quantile(spread, 0.9) - 1:.0%}. Errors come from runs of their own."
    ]


def figures(result):
    """Error against time, against evaluations, energy against time: calls that draw one figure each."""
    from . import draw_speed

    if "what_should_i_use" not in result.tables:  # nothing was timed
        return
    for scene in draw_speed.scenes(result):
        yield partial(draw_speed.times, result, scene)
    yield partial(draw_speed.evaluations, result)
    yield partial(draw_speed.energy, result)
    yield partial(draw_speed.cost_of_one, result)
