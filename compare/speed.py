"""Time against error: every integrator of MuJoCo, every method of tmt, SciPy and heyoka, over all useful steps."""

from functools import partial

import numpy as np

import tmt
from tmt.methods import METHODS

from . import clock, evaluations, machine
from .advice import EARLY, advice, orders
from .agreement import EPS, FACTOR, Result
from .band import growth
from .competitors import Setting, competitors
from .motion import TWINS, diverged_at
from .reference import references
from .scenes import HINGES, SCENES
from .smallest import reduced
from .targets import targets

TITLE = "Speed against accuracy"
CLAIM = (
    "Every integrator of MuJoCo and every method of tmt, SciPy and (where it is installed) heyoka comes to the same motion as "
    "its step falls, at its own order and down to rounding; so errors can be set against time, and the cheapest setting for "
    "so many digits be named. What is compared is code made for this one model (tmt, SciPy, heyoka) against an engine made "
    "for any model (MuJoCo): the ratios say what that costs, not that one is better. Timings make no checks."
)
BAR = (
    "Errors are the largest of the angles on the grid of 65 times, against runs with more than 20 digits (shown by halving "
    "their step). Checked: those digits; that each method of fixed step has its order, within 0.15, in the error of the first "
    "second, which falls regularly (order 8: at least 7, for rounding comes before its error has settled; the tests show it in "
    "50 digits); that MuJoCo and its twin make "
    "the same error but for rounding, 64 eps times the growth of a small difference along the scene; that MuJoCo's RK4 comes "
    "as near to the reference as tmt's; and that the smallest errors are of that same size of rounding."
)
NEAR = 30  # times the error of rounding: an error below has come to it
PARTS = (
    "In the table of what to use, mujoco, tmt and of_all are the cheapest settings whose worst error is below target_rad. "
    "ratio is MuJoCo's time over tmt's: the product of integrator_part (MuJoCo's cheapest over its RK4), kernel_part (MuJoCo's "
    "RK4 over tmt's with the same step) and method_part (that over tmt's cheapest). Timed are compiled loops that fill memory."
)
GOOD_DIGITS = 1e-20  # rad, rad/s
NEAR_ENOUGH = 0.1  # rad: an error below is a small deviation, which rounding changes no more than the growth says
# who follows the smaller model of a scene too, where there is one
SMALLER, SMALLER_STEPS = (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")), 1024
QUICK_SCENES = ("bent, free",)
COLUMNS = ["scene", "engine", "method", "dt_s", "tolerance", "steps", "evaluations", "seconds", "error_rad", "worst_error_rad",
           "energy_error_J", "diverged"]  # fmt: skip


def begin(setup) -> None:
    """Measure all errors beside other work: they are no timings."""
    known = references(setup.map, setup.tell)
    scenes = [scene for scene in SCENES if scene.name in known and (scene.name in QUICK_SCENES or not setup.is_quick)]
    measured = setup.map(partial(judge, engine=setup.engine, known=known, quick=setup.is_quick), scenes)
    setup.background["speed"] = known, scenes, measured


def rows(setup) -> Result:
    """Errors, times, orders, floors, and what follows for a choice."""
    if "speed" not in setup.background:
        begin(setup)
    known, scenes, measured = setup.background.pop("speed")
    result = Result("speed", shown=[])
    floors = {}
    found = []
    for scene, (of_scene, floors[scene.name]) in zip(scenes, measured):
        found.append(of_scene)
        result.rows += of_scene
        digits = known[scene.name].halving
        note = "as it was made; the tests make a part of it anew"
        result.check(scene.name, "reference, from half as many steps", digits, GOOD_DIGITS, "rad or rad/s", note)
    setup.quiet()  # nothing else may run beside a timing
    spread = []
    for scene, of_scene in zip(scenes, found):
        setup.tell(f"speed: timing {scene.name}")
        spread += take_times(of_scene, setup)
    fixed = [(c.engine, c.method, c.order) for c in competitors(setup.engine, setup.is_quick) if c.order]
    measured = orders(result, [s.name for s in scenes], fixed, not setup.is_quick)
    twins(result, floors)
    rounding(result, floors)
    result.tables["what_should_i_use"] = advice(result.rows, [s.name for s in scenes], floors)
    result.tables["speed_orders"] = measured
    setup.tell("speed: one evaluation")
    result.tables["evaluations"], told = evaluations.costs(setup.engine, setup.is_quick)
    result.notes += told
    result.notes.append(
        "Each time is the least of up to five runs (one, if it takes longer than 0.1 s), in turns with all of its scene; where "
        f"there are more than one, their median is {np.median(spread) - 1:.1%} above the least, for one setting in ten more "
        f"than {np.quantile(spread, 0.9) - 1:.0%}. Errors come from runs of their own."
    )
    result.notes += [PARTS, *first_order(result.rows, floors)]
    result.tables["speed_targets"] = targets(result, floors, machine.vectors())
    result.curves["floors"] = floors
    result.notes += smaller_models(result.rows)
    result.rows = [{name: row[name] for name in COLUMNS} for row in result.rows]
    return result


def judge(scene, engine, known, quick) -> tuple[list[dict], float]:
    """The rows of one scene without times; and the error that rounding leaves in it, rad."""
    reference = known[scene.name]
    found, field, left = [], competitors(engine, quick), floor(scene)
    for place, competitor in enumerate(field):
        best, last = np.inf, 0
        for setting in competitor.settings:
            found.append(judged(scene, scene, competitor, setting, reference) | {"place": (place, scene, setting)})
            # one more run that cost more and gained nothing shows that rounding has taken over
            error = np.inf if found[-1]["diverged"] else found[-1]["worst_error_rad"]
            work = found[-1]["evaluations"] or found[-1]["steps"]
            if best < NEAR * left and work > 1.2 * last and not error < 0.7 * best:
                break
            best, last = min(best, error), work
    smaller = reduced(scene)
    for place, competitor in enumerate(field if smaller else ()):
        if (competitor.engine, competitor.method) in SMALLER:
            setting = Setting(steps=SMALLER_STEPS)
            found.append(judged(smaller, scene, competitor, setting, reference) | {"place": (place, smaller, setting)})
    return found, left


def judged(scene, whole, competitor, setting, reference) -> dict:
    """A row: one run of a scene, or of the smaller model that has the motion of the whole one."""
    hinges = [HINGES.index(name) for name in scene.hinges]
    energy = tmt.energy(reference.high[:, :3], reference.high[:, 3:], whole.model)
    run, read = competitor.prepare(scene, setting)
    with np.errstate(all="ignore"):
        outcome = read(run())
        ended = diverged_at(scene, reference.t, outcome.q, outcome.qd) is not None
        error = reference.error(outcome.q, hinges)
        states = reference.high[:, :3].copy(), reference.high[:, 3:].copy()
        for state, part in zip(states, (outcome.q, outcome.qd)):
            state[:, hinges] = 0.0 if ended else part
        off = np.abs(tmt.energy(*states, whole.model) - energy).max()
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


def take_times(rows, setup) -> list[float]:
    """Fill in the seconds of one scene's rows, all settings in turns; the median of each over its least."""
    field = competitors(setup.engine, setup.is_quick)
    runs = [field[place].prepare(scene, setting)[0] for place, scene, setting in (row["place"] for row in rows)]
    times = clock.in_turns(runs, rounds=2 if setup.is_quick else 5)
    for row, of_row in zip(rows, times):
        row["seconds"] = min(of_row)
    return [float(np.median(of_row)) / min(of_row) for of_row in times if len(of_row) > 1]


def twins(result, floors) -> None:
    """MuJoCo's integrators and their twins make the same error, but for rounding; judged where the error is below 0.1 rad."""
    by_place = {(row["scene"], row["engine"], row["method"], row["dt_s"]): row for row in result.rows}
    for (scene, engine, method, dt), row in by_place.items():
        twin = by_place.get((scene, "tmt", TWINS.get(method), dt)) if engine == "mujoco" and scene in floors else None
        if twin and not row["diverged"] and not twin["diverged"] and twin["worst_error_rad"] < NEAR_ENOUGH:
            difference = abs(row["worst_error_rad"] - twin["worst_error_rad"])
            where = f"{scene}, {method}, dt = {dt:.3g} s"
            result.check(where, "error less that of the twin", difference, FACTOR * floors[scene], "rad", rounding=True)


def rounding(result, floors) -> None:
    """MuJoCo comes as near to the reference as tmt does; and where errors stop falling, they are of the size of rounding."""
    for scene, left in floors.items():
        least = {}
        for engine, method in (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")):
            errors = [
                np.inf if row["diverged"] else row["worst_error_rad"] for row in result.rows
                if (row["scene"], row["engine"], row["method"]) == (scene, engine, method)
            ]  # fmt: skip
            least[method] = min(errors)
            if errors.index(min(errors)) < len(errors) - 1:  # rounding took over before the steps ended
                result.check(
                    scene, f"smallest error of {engine}'s {method}", min(errors), FACTOR * left, "rad", rounding=True
                )
        bar = 2.0 * least["rk4"] + FACTOR * left
        result.check(scene, "smallest error of MuJoCo's RK4, beside that of its twin", least["RK4"], bar, "rad")
    told = "; ".join(f"{scene}: {left:.1e} rad" for scene, left in floors.items())
    result.notes.append(
        f"The size of what rounding leaves, eps times the growth of a small difference on the way: {told}. Where errors come "
        "near it they stop falling, and smaller steps only add roundings; a method of few steps gets some way below."
    )


def first_order(rows, scenes) -> list[str]:
    """How far MuJoCo's integrators of order 1 come, in words."""
    told = []
    for scene in scenes:
        runs = [row for row in rows if (row["scene"], row["engine"]) == (scene, "mujoco") and not row["diverged"]]
        first = [row for row in runs if row["method"] != "RK4"]
        if first:
            best = min(first, key=lambda row: row["worst_error_rad"])
            told.append(
                f"{scene}: {best['worst_error_rad']:.1e} rad in {1e3 * best['seconds']:.0f} ms ({best['method']})"
            )
    return [
        f"MuJoCo's integrators of order 1 come no nearer than this, with the finest steps tried: {'; '.join(told)}."
    ]


def smaller_models(rows) -> list[str]:
    """What the smaller model of a scene saves, in words."""
    told = []
    for row in rows:
        name = row["scene"].rsplit(", ", 1)[0]
        for whole in rows:
            same = all(whole[key] == row[key] for key in ("engine", "method", "dt_s", "tolerance"))
            if whole["scene"] == name and same and whole["seconds"] and row["seconds"]:
                gain = whole["seconds"] / row["seconds"]
                told.append(
                    f"{row['scene']} ({row['engine']} {row['method']}, {row['steps']} steps): the whole model takes {gain:.2f} "
                    f"times as long; {row['worst_error_rad']:.2e} rad off where that is {whole['worst_error_rad']:.2e}."
                )
    return told


def figures(result):
    """Error against time, against evaluations, and energy against time."""
    from . import draw_speed

    yield from draw_speed.times(result)
    yield draw_speed.evaluations(result)
    yield draw_speed.energy(result)
    yield draw_speed.cost_of_one(result)
