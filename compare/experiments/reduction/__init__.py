"""What each scene needs of the model: the fewest hinges, an integrator at all; and what the rest costs."""

import dataclasses
from functools import partial

import numpy as np

import tmt
from tmt.kernels import stepper
from tmt.methods import METHODS
from tmt.reference import DIGITS

from . import known_motion, sub_blocks
from .agreement import FACTOR, LOCKABLE, Result
from .band import NARROW, band
from .clock import fastest
from .cost import INTEGRATORS, TIMED, costs
from .engine_file import ModelError
from .motion import TWINS, farthest, step
from .scenes import HINGES, SCENES
from .smallest import needed, reduced
from .sub_blocks import operations

TITLE = "Reduction: no more model than a scene needs"
CLAIM = (
    "A hinge may be locked if, with it at its start value and at rest, its acceleration vanishes for all values of the other "
    "hinges. The program finds these hinges on the expressions of the traced method, which fold to the number 0, and confirms "
    f"them with {DIGITS} digits at random states. The model without them has the same motion, in both engines. A held posture "
    "needs no integrator: it stays. A single free hinge is a physical pendulum, whose angle is an elliptic function of time. "
    "And whatever else is added in MuJoCo costs time, and changes nothing unless something is touched."
)
BAR = (
    f"Sub-blocks of Mbar and bias: {FACTOR} eps x the largest entry of Mbar, and {FACTOR} eps x the sum of the absolute terms of "
    "the bias, of the whole model. Runs of the smaller and the whole model, by the same method: the band of rounding of the "
    f"whole one (see trajectory), judged while it is below {NARROW:g} rad, for as long as the scene states. Errors against an "
    "exact solution fall with the step at the method's order, and with the square of the amplitude where the solution is "
    "linear. Additions that exert no force leave the same bits. Timings are no checks."
)
FINER = 16  # times as fine as a scene's own step: runs that are compared, judged at the scene's own
TIMED_TMT = 1024  # steps of a timed run in tmt
LEAST = ("zero, free", "elbow swing")  # the scenes of a run without timings
MOVES = 0.1  # rad: a run without a torque that holds shows nothing if it moves less


def rows(setup, scenes=None, timed=True) -> Result:
    """Sub-blocks for every subset; for each scene what it needs, runs and times; exact solutions; costs in MuJoCo.

    timed=False: one choice of angles, one scene with a smaller model, and the exact solutions, in a few tenths of a second:
    enough to see a wrong model.
    """
    result = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}})
    scenes = scenes or [scene for scene in SCENES if timed or scene.name in LEAST]
    try:
        fill(result, setup, scenes, timed)
    except ModelError as error:  # another model, with something that cannot be taken out with its hinge
        result.check("every subset", LOCKABLE, 0, 1, "models", str(error), rule="equal")
    return result


def fill(result, setup, scenes, timed) -> None:
    """All parts of `rows`, one after the other."""
    sub_blocks.compare(result, setup.engine, angles=setup.of(10, 3, 1) if timed else 1)
    integrators = INTEGRATORS if timed else INTEGRATORS[-1:]
    models = [model for scene in scenes for model in of_scene(result, scene, setup.engine, integrators)]
    known_motion.swings(result, setup.engine, scenes)
    few = () if timed else (known_motion.AMPLITUDES[-2:], known_motion.LESS_FINE)
    known_motion.small_oscillations(result, setup.engine, *few)
    if timed:
        setup.quiet()
        rounds = setup.of(160, 16, 2)
        times(result, models, setup.engine, rounds)
        costs(result, setup.engine, rounds)


def of_scene(result, scene, engine, integrators=INTEGRATORS) -> list:
    """What the scene needs, in words; runs of it and of a smaller model; the models to be timed, None for none at all."""
    need = needed(scene)
    smaller = reduced(scene, need)
    stays = len(need.stays) == len(scene.hinges)
    models = [(scene.name, dataclasses.replace(scene, locked=()))]
    if smaller or scene.locked or stays:
        models.append((scene.name, None if stays else smaller or scene))
    result.curves["needs"][scene.name] = {"locked": scene.locked, "stays": need.stays}
    result.notes.append(told(scene, need))
    if smaller or stays:
        for integrator in integrators:
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
            f"0 with {DIGITS} digits: the exact solution stays."
        )
    declared = f" ({' and '.join(scene.locked)} declared locked)" if scene.locked else ""
    if not need.stays:
        count = "the one hinge that is free" if len(names) == 1 else f"all {len(names)} hinges"
        return f"{scene.name}: {count}{declared}. {why}."
    left = " and ".join(name for name in names if name not in need.stays)
    return (
        f"{scene.name}: {left}{declared}. {' and '.join(need.stays).capitalize()} never moves: at its start and at rest its "
        f"acceleration folds to 0 for all values of the others, and is 0 with {DIGITS} digits at random ones. {why}."
    )


def runs(result, scene, smaller, engine, integrator) -> None:
    """Runs of the scene and of the smaller one (None: it stays), by the same method, within the band."""
    method, n, steps = TWINS[integrator], len(scene.hinges), FINER * scene.steps
    dt = scene.duration / steps
    paths = both(scene, engine, integrator)
    references = both(smaller, engine, integrator) if smaller else dict.fromkeys(paths)
    width = band(METHODS[method], scene.model, *np.split(paths["TMT"], 2, axis=1), scene.tau, dt, FINER)
    t = dt * FINER * np.arange(len(width))
    until = None
    for party, path in paths.items():
        where = f"{scene.name}, {party}, {integrator}, {step(scene, steps)}"
        reference = np.tile(np.concatenate(scene.start), (steps + 1, 1))
        if smaller:
            free = [scene.hinges.index(name) for name in smaller.hinges]
            reference[:, free + [n + i for i in free]] = references[party]
            judge_movement(result, where, path[:, :n])
        apart = np.abs(path - reference)[::FINER]
        until = judge_run(result, where, scene.hinges, t, apart, width, scene.required(method, dt))
        result.curves["apart"][scene.name, party, integrator] = float(apart[t <= until, :n].max())
    if not smaller:
        moved = {party: result.curves["apart"][scene.name, party, integrator] for party in paths}
        told = " and ".join(f"that of {party} by {m:.1e} rad" if np.isfinite(m) else f"{party} diverges"
                            for party, m in moved.items())  # fmt: skip
        result.notes.append(
            f"{scene.name}, {integrator}, with the torque in doubles: in the {until:.2f} s that are judged, the largest angle "
            f"moves: {told}."
        )


def judge_movement(result, where, q) -> None:
    """A check: a run without a torque that holds moves. q: (times, n) rad."""
    result.check(where, "movement", farthest(q - q[0]), MOVES, "rad", rule="at least")


def judge_run(result, where, hinges, t, apart, width, required) -> float:
    """Checks: the runs stay within the band of rounding while it is narrow, and that is long enough; until when, s.

    apart, width: (times, 2 n), rad and rad/s, the distance of the smaller model's run from the whole one's, and the band.
    """
    n = len(hinges)
    judged = np.cumsum(~(width[:, :n].max(axis=1) < NARROW)) == 0
    apart, width = apart[judged], width[judged]
    ratio = np.divide(apart, width, out=np.where(apart > 0, np.inf, apart), where=width > 0)
    k, i = np.unravel_index(np.argmax(ratio), ratio.shape)  # NaN counts as the largest
    place, unit = f"{hinges[i % n]} at t = {t[k]:.3f} s", ("rad", "rad/s")[i // n]
    result.check(where, "smallest model to whole", apart[k, i], width[k, i], unit, place, True)
    until = float(t[judged][-1])
    result.check(where, "time judged", until, required, "s", rule="at least")
    return until


def both(scene, engine, integrator) -> dict:
    """Angles and rates of the scene's hinges by party, each (steps + 1, 2 n)."""
    steps = FINER * scene.steps
    arguments = *scene.start, scene.tau, scene.duration / steps, steps
    return {
        "TMT": np.concatenate(tmt.simulate(*arguments, TWINS[integrator], scene.model)[1:], axis=1),
        "MuJoCo": np.concatenate(scene.engine(engine).trajectory(*arguments, integrator)[1:], axis=1),
    }


def times(result, models, engine, rounds) -> None:
    """The table: all models of all scenes, timed in turn, against the whole model of the same scene."""
    calls = {}
    for name, scene in models:
        for integrator in INTEGRATORS if scene else ():
            state = *scene.start, scene.tau, scene.duration / scene.steps / FINER
            calls[name, scene.hinges, "TMT", integrator] = tmt_run(scene.model, TWINS[integrator], *state)
            calls[name, scene.hinges, "MuJoCo", integrator] = scene.engine(engine).runner(*state, TIMED, integrator)[1]
    result.rows += table(models, fastest(calls, rounds), result.curves["apart"])


def table(models, seconds, apart) -> list[dict]:
    """The rows: models as (scene's name, Scene or None), seconds of a timed run by (name, hinges, engine, integrator)."""
    rows, steps = [], {"TMT": TIMED_TMT, "MuJoCo": TIMED}
    for name, scene in models:
        hinges = scene.hinges if scene else ()
        for party in ("TMT", "MuJoCo"):
            for integrator in INTEGRATORS:
                taken = seconds.get((name, hinges, party, integrator))
                count = operations(scene.model, TWINS[integrator]) if scene else 0
                rows.append(
                    {
                        "scene": name,
                        "hinges": " ".join(hinges) or "none",
                        "engine": party,
                        "nv": len(hinges),
                        "operations": count if party == "TMT" else None,
                        "ns_per_step": 1e9 * taken / steps[party] if taken else None,
                        "speedup": seconds[name, HINGES, party, integrator] / taken if taken else None,
                        "max_difference_rad": None if hinges == HINGES else apart.get((name, party, integrator)),
                        "integrator": integrator,
                    }
                )
    return rows


def tmt_run(model, method, q, qd, tau, dt):
    """A function that makes a run in tmt's compiled loop, without what surrounds it."""
    paths = [np.tile(start, (1, TIMED_TMT + 1, 1)) for start in (q, qd)]
    compiled, torque = stepper(model, method), tau[None].copy()
    return lambda: compiled(*paths, torque, dt)


def figures(result):
    """What each scene needs and how fast that is; the exact swing; small oscillations; costs: calls that draw one figure."""
    from . import draw_reduction  # matplotlib is for the process that draws

    if result.rows:  # none of a model that cannot be locked
        yield partial(draw_reduction.needs, result)
    for scene in result.curves["swings"]:
        yield partial(draw_reduction.swing, result, scene)
    if "small" in result.curves:
        yield partial(draw_reduction.small_oscillations, result)
    if "cost_in_mujoco" in result.tables:
        yield partial(draw_reduction.costs, result)
