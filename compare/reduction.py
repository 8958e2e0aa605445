"""What each scene needs of the model: the fewest hinges, an integrator at all; and what the rest costs."""

from itertools import combinations

import numpy as np

import tmt
from tmt.kernels import slope_source, stepper
from tmt.methods import METHODS

from . import engine_cost, known_motion
from .agreement import EPS, FACTOR, SEED, Result, bias_scale, mass_scale
from .band import NARROW, band
from .cost import costs, fastest
from .scenes import HINGES, SCENES, posture
from .smallest import needed, reduced

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
METHOD_OF = {"rk4": "RK4", "semi_implicit_euler": "Euler"}  # of tmt: of MuJoCo
STEPS = 1024  # of a run that is timed and compared
EVERY = 16  # steps, at which the band is taken
ROUNDS, QUICK_ROUNDS = 25, 3  # of the timing
MOVES = 0.1  # rad: a run without a torque that holds shows nothing if it moves less
SHOWN = ["scene", "hinges", "engine", "method", "nv", "operations", "ns_per_step", "speedup", "max_difference_rad"]


def rows(setup, scenes=SCENES) -> Result:
    """Sub-blocks for every subset; for each scene what it needs, runs and times; exact solutions; costs in MuJoCo."""
    result = Result("reduction", shown=SHOWN)
    quick = len(setup.steps) == 1
    subsets(result, setup.engine, angles=3 if quick else 10)
    models = [model for scene in scenes for model in of_scene(result, scene, setup.engine)]
    known_motion.swings(result, setup.engine)
    known_motion.small_oscillations(result, setup.engine)
    setup.quiet()
    timed(result, models, QUICK_ROUNDS if quick else ROUNDS)
    costs(result, setup)
    return result


def subsets(result, engine, angles, states=20) -> None:
    """Every subset of hinges locked at random angles: Mbar and bias of what is left against the whole model's."""
    table = result.tables["reduction_subsets"] = []
    rng = np.random.default_rng(SEED)
    for locked in (names for count in (1, 2) for names in combinations(HINGES, count)):
        free = [i for i, name in enumerate(HINGES) if name not in locked]
        block = np.ix_(range(states), free, free)
        found = {}  # (parties, quantity): a pair of arrays, difference and bar of each state, for each choice of angles
        for _ in range(angles):
            q, qd = rng.uniform(-np.pi, np.pi, (states, 3)), rng.uniform(-10.0, 10.0, (states, 3))
            at = dict(zip(HINGES, q[0]))
            for i in set(range(3)) - set(free):
                q[:, i], qd[:, i] = q[0, i], 0.0
            tree = tmt.ARM.lock({name: at[name] for name in locked})
            smaller = engine.lock({name: at[name] for name in locked})
            state = q[:, free], qd[:, free]
            mass = tmt.mass_matrix(state[0], tree), smaller.mass_matrix(state[0])
            bias = tmt.bias(*state, tree), smaller.bias(*state)
            for quantity, (ours, theirs), whole, scale in (
                ("Mbar", mass, (tmt.mass_matrix(q)[block], engine.mass_matrix(q)[block]), mass_scale(q)),
                ("bias", bias, (tmt.bias(q, qd)[:, free], engine.bias(q, qd)[:, free]), bias_scale(q, qd)),
            ):
                pairs = {
                    "TMT, reduced to whole": (ours, whole[0]),
                    "MuJoCo, reduced to whole": (theirs, whole[1]),
                    "reduced, TMT to MuJoCo": (ours, theirs),
                }
                for parties, (a, b) in pairs.items():
                    apart = np.abs(a - b).reshape(states, -1).max(axis=1)
                    found.setdefault((parties, quantity), []).append((apart, FACTOR * EPS * scale))
        at_zero = slope_source(tmt.ARM.lock(dict.fromkeys(locked, 0.0)), "rk4")[1]
        at_angles = slope_source(tree, "rk4")[1]
        for (parties, quantity), pairs in found.items():
            apart, bar = np.concatenate(pairs, axis=1)
            worst = int(np.argmax(apart / bar))
            unit = {"Mbar": "kg m2", "bias": "N m"}[quantity]
            where = f"{' and '.join(locked)} locked"
            check = result.check(where, f"{quantity}, {parties}", apart[worst], bar[worst], unit, rounding=True)
            table.append(
                {
                    "locked": " ".join(locked), "parties": parties, "quantity": quantity, "states": len(apart),
                    "largest_difference": float(apart.max()), "unit": unit, "difference_over_bar": check.over_bar,
                    "operations_locked_at_zero": at_zero, "operations_locked_at_angles": at_angles,
                    "operations_whole": slope_source(tmt.ARM, "rk4")[1],
                }
            )  # fmt: skip


def of_scene(result, scene, engine) -> list:
    """What the scene needs, in words; its runs in the whole and the smaller model compared; the models to be timed."""
    need = needed(scene)
    smaller = reduced(scene)
    whole = scene.__class__(**{**vars(scene), "locked": ()})
    models = [(scene.name, whole, engine)]
    stays = len(need.stays) == len(scene.hinges)
    if smaller or scene.locked or stays:
        models.append((scene.name, None if stays else smaller or scene, engine))
    result.notes.append(told(scene, need))
    result.curves.setdefault("needs", {})[scene.name] = {
        "locked": scene.locked, "stays": need.stays, "operations": 0 if stays else operations(smaller or scene),
    }  # fmt: skip
    for method in METHOD_OF:
        if smaller or stays:
            compare(result, scene, smaller, engine, method)
    return models


def told(scene, need) -> str:
    """What a scene needs and why, in a sentence."""
    names = scene.hinges
    why = "; ".join(need.moves.values())
    if need.undecided:
        why += f"; of {', '.join(need.undecided)} it is not decided: the acceleration does not fold to 0"
    if len(need.stays) == len(names):
        return (
            f"{scene.name}: no hinge and no integrator. Under the torque that holds, every acceleration folds to 0 and is 0 "
            "with 50 digits: the exact solution stays. What a run moves is the rounding of the torque, grown."
        )
    declared = f" ({', '.join(scene.locked)} declared locked)" if scene.locked else ""
    if not need.stays:
        count = {1: "the one hinge that is free", 2: "both free hinges", 3: "all three hinges"}[len(names)]
        return f"{scene.name}: {count}{declared}. {why[0].upper()}{why[1:]}."
    left = " and ".join(name for name in names if name not in need.stays)
    return (
        f"{scene.name}: {left}{declared}. {' and '.join(need.stays).capitalize()} never moves: at its start and at rest its "
        f"acceleration folds to 0 for all values of the others, and is 0 with 50 digits at random ones. But {why}."
    )


def operations(scene) -> int:
    """Operations of one evaluation of the accelerations, of the scene's model under RK4."""
    return slope_source(scene.model, "rk4")[1]


def compare(result, scene, smaller, engine, method) -> None:
    """Runs of the whole scene and of the smaller one (None: it stays), by the same method, within the band."""
    dt = scene.duration / STEPS
    t, *ours = tmt.simulate(*scene.start, scene.tau, dt, STEPS, method, scene.model)
    _, *theirs = scene.engine(engine).trajectory(*scene.start, scene.tau, dt, STEPS, METHOD_OF[method])
    width = band(METHODS[method], scene.model, *ours, scene.tau, dt, EVERY)
    n = len(scene.hinges)
    judged = np.cumsum(~(width[:, :n].max(axis=1) < NARROW)) == 0
    until = float(t[::EVERY][judged][-1])
    required = min(scene.required(method, dt), scene.duration)
    for party, path in (("TMT", ours), ("MuJoCo", theirs)):
        reference = whole_path(scene, smaller, engine, method, party, dt)
        apart = np.abs(np.concatenate(path, axis=1) - reference)[::EVERY][judged]
        ratio = np.divide(apart, width[judged], out=np.zeros_like(apart), where=width[judged] > 0)
        k, i = np.unravel_index(np.argmax(ratio), ratio.shape)
        where = f"{scene.name}, {party}, {METHOD_OF[method]}, dt = {scene.duration:g}/{STEPS} s"
        place = f"{scene.hinges[i % n]} at t = {t[::EVERY][judged][k]:.3f} s"
        unit = ("rad", "rad/s")[i // n]
        result.check(where, "whole to smallest model", apart[k, i], width[judged][k, i], unit, place, True)
        result.check(where, f"judged for less than {required:g} s", max(0.0, required - until), 0.0, "s missing")
        moved = float(np.nanmax(np.abs(path[0] - path[0][0])))
        if smaller:
            result.check(where, f"moves less than {MOVES} rad", max(0.0, MOVES - moved), 0.0, "rad missing")
        result.curves.setdefault("apart", {})[scene.name, party, method] = float(apart[:, :n].max())


def whole_path(scene, smaller, engine, method, party, dt) -> np.ndarray:
    """Angles and rates of all hinges of the scene, (STEPS + 1, 2 n), from a run of the smaller model."""
    n = len(scene.hinges)
    path = np.tile(np.concatenate(scene.start), (STEPS + 1, 1))
    if smaller:
        free = [scene.hinges.index(name) for name in smaller.hinges]
        state, tau = smaller.start, smaller.tau
        if party == "TMT":
            _, q, qd = tmt.simulate(*state, tau, dt, STEPS, method, smaller.model)
        else:
            _, q, qd = smaller.engine(engine).trajectory(*state, tau, dt, STEPS, METHOD_OF[method])
        path[:, free], path[:, [n + i for i in free]] = q, qd
    return path


def timed(result, models, rounds) -> None:
    """The table: all models of all scenes, timed in turn, against the whole model of the same scene."""
    runs = {}
    for name, scene, engine in models:
        for method, integrator in METHOD_OF.items() if scene else ():
            dt = scene.duration / STEPS
            runs[name, scene.hinges, "TMT", method] = run(scene, method, dt)
            arguments = *scene.start, scene.tau, dt, STEPS, integrator
            runs[name, scene.hinges, "MuJoCo", method] = engine_cost.run(scene.engine(engine), *arguments)
    seconds = fastest(runs, rounds)
    for name, scene, _ in models:
        for engine in ("TMT", "MuJoCo"):
            for method, integrator in METHOD_OF.items():
                hinges = scene.hinges if scene else ()
                taken = seconds.get((name, hinges, engine, method))
                whole = scene is not None and not scene.locked
                result.rows.append(
                    {
                        "scene": name,
                        "hinges": " ".join(hinges) or "none",
                        "engine": engine,
                        "method": integrator,
                        "nv": len(hinges),
                        "operations": (slope_source(scene.model, method)[1] if scene else 0) if engine == "TMT" else None,
                        "ns_per_step": 1e9 * taken / STEPS if taken else None,
                        "speedup": seconds[name, HINGES, engine, method] / taken if taken else None,
                        "max_difference_rad": None if whole else result.curves["apart"].get((name, engine, method)),
                    }
                )


def run(scene, method, dt):
    """A function that makes the run of a scene's model in tmt's compiled loop, without what surrounds it."""
    q, qd = (np.tile(start, (1, STEPS + 1, 1)) for start in scene.start)
    compiled, tau = stepper(scene.model, method), scene.tau[None].copy()
    return lambda: compiled(q, qd, tau, dt)


def figures(result):
    """What each scene needs and how fast that is; the exact swing; small oscillations; costs in MuJoCo."""
    from . import draw_reduction  # matplotlib is for the process that draws

    yield draw_reduction.needs(result)
    yield draw_reduction.swings(result)
    yield draw_reduction.small_oscillations(result)
    yield draw_reduction.costs(result)
