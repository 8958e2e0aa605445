"""What each scene needs of the model: the fewest hinges, an integrator at all; and what the rest costs."""

import dataclasses

import numpy as np

import tmt
from tmt.kernels import stepper
from tmt.methods import METHODS

from . import known_motion, sub_blocks
from .agreement import Result
from .band import NARROW, band
from .clock import fastest
from .cost import INTEGRATORS, QUICK_ROUNDS, ROUNDS, TIMED, costs
from .engine_file import ModelError
from .motion import TWINS, farthest, step
from .scenes import HINGES, SCENES
from .smallest import needed, reduced
from .sub_blocks import operations

TITLE = "Reduction: no more model than a scene needs"
CLAIM = (
    "A hinge may be locked if, with it at its start value and at rest, its acceleration vanishes for all values of the other "
    "hinges. The program finds these hinges on the expressions of the traced method, which fold to the number 0, and confirms "
    "them with 50 digits at random states. The model without them has the same motion, in both engines. A held posture needs "
    "no integrator: it stays. A single free hinge is a physical pendulum, whose angle is an elliptic function of time. And "
    "whatever else is added in MuJoCo costs time, and changes nothing unless something is touched."
)
BAR = (
    "Sub-blocks of Mbar and bias: 64 eps x the largest entry of Mbar, and 64 eps x the sum of the absolute terms of the bias, "
    "of the whole model. Runs of the smaller and the whole model, by the same method: the band of rounding of the whole one "
    "(see trajectory), judged while it is below 1e-3 rad, for as long as the scene states. Errors against an exact solution "
    "fall with the step at the method's order, and with the square of the amplitude where the solution is linear. Additions "
    "that exert no force leave the same bits. Timings are no checks."
)
FINER = 16  # times as fine as a scene's own step: runs that are compared, judged at the scene's own
TIMED_TMT = 1024  # steps of a timed run in tmt
MOVES = 0.1  # rad: a run without a torque that holds shows nothing if it moves less


def rows(setup, scenes=SCENES) -> Result:
    """Sub-blocks for every subset; for each scene what it needs, runs and times; exact solutions; costs in MuJoCo."""
    result = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}})
    try:
        fill(result, setup, scenes)
    except ModelError as error:  # another model, with something that cannot be taken out with its hinge
        result.check("every subset", f"cannot be locked: {error}", 1.0, 0.0, "models")
    return result


def fill(result, setup, scenes) -> None:
    """All parts of `rows`, one after the other."""
    quick = setup.is_quick
    sub_blocks.compare(result, setup.engine, angles=3 if quick else 10)
    models = [model for scene in scenes for model in of_scene(result, scene, setup.engine)]
    known_motion.swings(result, setup.engine, scenes)
    known_motion.small_oscillations(result, setup.engine)
    setup.quiet()
    timed(result, models, setup.engine, QUICK_ROUNDS if quick else ROUNDS)
    costs(result, setup)


def of_scene(result, scene, engine) -> list:
    """What the scene needs, in words; runs of it and of a smaller model; the models to be timed, None for none at all."""
    need, smaller = needed(scene), reduced(scene)
    stays = len(need.stays) == len(scene.hinges)
    models = [(scene.name, dataclasses.replace(scene, locked=()))]
    if smaller or scene.locked or stays:
        models.append((scene.name, None if stays else smaller or scene))
    result.curves["needs"][scene.name] = {"locked": scene.locked, "stays": need.stays}
    result.notes.append(told(scene, need))
    if smaller or stays:
        for integrator in INTEGRATORS:
            runs(result, scene, smaller, engine, integrator)
    return models


def told(scene, need) -> str:
    """What a scene needs and why, in a sentence."""
    names = scene.hinges
    why = "; ".join(need.moves.values())
    if need.undecided:
        why += f"; of {', '.join(need.undecided)} it is not decided: the acceleration does not fold to 0"
    why = why[:1].upper() + why[1:]
    if len(need.stays) == len(names):
        torque = " under the exact torque that holds" if scene.torque == "hold" else ""
        return (
            f"{scene.name}: no hinge and no integrator. At the start and at rest every acceleration folds to 0{torque}, and is "
            "0 with 50 digits: the exact solution stays."
        )
    declared = f" ({' and '.join(scene.locked)} declared locked)" if scene.locked else ""
    if not need.stays:
        count = {1: "the one hinge that is free", 2: "both free hinges", 3: "all three hinges"}[len(names)]
        return f"{scene.name}: {count}{declared}. {why}."
    left = " and ".join(name for name in names if name not in need.stays)
    return (
        f"{scene.name}: {left}{declared}. {' and '.join(need.stays).capitalize()} never moves: at its start and at rest its "
        f"acceleration folds to 0 for all values of the others, and is 0 with 50 digits at random ones. {why}."
    )


def runs(result, scene, smaller, engine, integrator) -> None:
    """Runs of the scene and of the smaller one (None: it stays), by the same method, within the band."""
    method, n, steps = TWINS[integrator], len(scene.hinges), FINER * scene.steps
    dt = scene.duration / steps
    paths = both(scene, engine, integrator)
    references = both(smaller, engine, integrator) if smaller else dict.fromkeys(paths)
    width = band(METHODS[method], scene.model, *np.split(paths["TMT"], 2, axis=1), scene.tau, dt, FINER)
    t = dt * FINER * np.arange(len(width))
    judged = np.cumsum(~(width[:, :n].max(axis=1) < NARROW)) == 0
    until, required = float(t[judged][-1]), scene.required(method, dt)
    for party, path in paths.items():
        where = f"{scene.name}, {party}, {integrator}, {step(scene, steps)}"
        reference = np.tile(np.concatenate(scene.start), (steps + 1, 1))
        if smaller:
            free = [scene.hinges.index(name) for name in smaller.hinges]
            reference[:, free + [n + i for i in free]] = references[party]
            moved = farthest(path[:, :n] - path[0, :n])
            result.check(where, f"moves less than {MOVES} rad", max(0.0, MOVES - moved), 0.0, "rad missing")
        apart = np.abs(path - reference)[::FINER][judged]
        ratio = np.divide(apart, width[judged], out=np.zeros_like(apart), where=width[judged] > 0)
        k, i = np.unravel_index(np.argmax(ratio), ratio.shape)  # NaN counts as the largest
        place, unit = f"{scene.hinges[i % n]} at t = {t[k]:.3f} s", ("rad", "rad/s")[i // n]
        result.check(where, "smallest model to whole", apart[k, i], width[k, i], unit, place, True)
        result.check(where, f"judged for less than {required:g} s", max(0.0, required - until), 0.0, "s missing")
        result.curves["apart"][scene.name, party, integrator] = float(apart[:, :n].max())
    if not smaller:
        result.notes.append(
            f"{scene.name}, {integrator}, with the torque in doubles: in the {until:.2f} s that are judged, the arm of TMT "
            f"moves by {result.curves['apart'][scene.name, 'TMT', integrator]:.1e} rad, that of MuJoCo by "
            f"{result.curves['apart'][scene.name, 'MuJoCo', integrator]:.1e} rad."
        )


def both(scene, engine, integrator) -> dict:
    """Angles and rates of the scene's hinges by party, each (steps + 1, 2 n)."""
    steps = FINER * scene.steps
    arguments = *scene.start, scene.tau, scene.duration / steps, steps
    return {
        "TMT": np.concatenate(tmt.simulate(*arguments, TWINS[integrator], scene.model)[1:], axis=1),
        "MuJoCo": np.concatenate(scene.engine(engine).trajectory(*arguments, integrator)[1:], axis=1),
    }


def timed(result, models, engine, rounds) -> None:
    """The table: all models of all scenes, timed in turn, against the whole model of the same scene."""
    calls, steps = {}, {"TMT": TIMED_TMT, "MuJoCo": TIMED}
    for name, scene in models:
        for integrator in INTEGRATORS if scene else ():
            state = *scene.start, scene.tau, scene.duration / scene.steps / FINER
            calls[name, scene.hinges, "TMT", integrator] = tmt_run(scene.model, TWINS[integrator], *state)
            calls[name, scene.hinges, "MuJoCo", integrator] = scene.engine(engine).runner(*state, TIMED, integrator)[1]
    seconds = {key: taken / steps[key[2]] for key, taken in fastest(calls, rounds).items()}
    for name, scene in models:
        hinges = scene.hinges if scene else ()
        for party in ("TMT", "MuJoCo"):
            for integrator in INTEGRATORS:
                taken = seconds.get((name, hinges, party, integrator))
                count = operations(scene.model, TWINS[integrator]) if scene else 0
                apart = None if hinges == HINGES else result.curves["apart"].get((name, party, integrator))
                result.rows.append(
                    {
                        "scene": name,
                        "hinges": " ".join(hinges) or "none",
                        "engine": party,
                        "nv": len(hinges),
                        "operations": count if party == "TMT" else None,
                        "ns_per_step": 1e9 * taken if taken else None,
                        "speedup": seconds[name, HINGES, party, integrator] / taken if taken else None,
                        "max_difference_rad": apart,
                        "integrator": integrator,
                    }
                )


def tmt_run(model, method, q, qd, tau, dt):
    """A function that makes a run in tmt's compiled loop, without what surrounds it."""
    paths = [np.tile(start, (1, TIMED_TMT + 1, 1)) for start in (q, qd)]
    compiled, torque = stepper(model, method), tau[None].copy()
    return lambda: compiled(*paths, torque, dt)


def figures(result):
    """What each scene needs and how fast that is; the exact swing; small oscillations; costs in MuJoCo."""
    from . import draw_reduction  # matplotlib is for the process that draws

    if not result.rows:  # a model that cannot be locked
        return
    yield draw_reduction.needs(result)
    for scene in result.curves["swings"]:
        yield draw_reduction.swing(result, scene)
    yield draw_reduction.small_oscillations(result)
    yield draw_reduction.costs(result)
