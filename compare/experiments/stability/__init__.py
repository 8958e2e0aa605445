"""Stability: where each method fails, predicted from one step of it and shown in runs, on the full three-hinge arm."""

from functools import partial
from itertools import product

import numpy as np

from . import beyond, claims, departure, failure, limits, long_runs
from .agreement import EPS, Result
from .engine_linear import NUDGE, transition
from .linear import held, region
from .motion import SCHEMES, TWINS
from .parties import FEW, PARTIES, Party
from .scenes import POSTURES, posture

TITLE = "Stability: where methods fail"
CLAIM = (
    "Every method fails somewhere, and where can be said beforehand. The equations of motion are linearised about "
    "each held posture by exact derivatives; what one step of a method does to a small deviation there, its "
    "amplification, gives its limit of dt, its growth per step and the time at which an unstable posture is left. "
    "Runs of both engines do as predicted, and the assignment's observations follow from the same numbers."
)
BAR = (
    "Amplification: that of TMT's method against MuJoCo's own derivative of its step (mjd_transitionFD; central "
    "differences for RK4, which it refuses), within the rounding of a difference quotient, 64 eps (1 rad + |q|) "
    "max|J| / 1e-6. Limits: the largest dt at which no mode of the equations of motion grows by more than 0.1 % from the "
    "second to the last quarter of a run from 1e-6 rad (2000 steps, or more until a quarter holds a swing of the slowest "
    "mode), found by bisection without the prediction, within 0.1 % of the predicted dt. Growth: 0.1 % over all steps. "
    "Departure (a hinge 0.1 rad away): within one step or 0.03 s of the first crossing of the method's linear map, whose "
    "angles are rounded to doubles at each step; where the map stays, the run stays."
)
CENTRES, SADDLES, DAMPINGS = ("bent", "hanging"), ("ball catch", "upright"), (0.0, 0.5, 50.0)
DEPARTURE_STEPS = (5 / 64, 1e-2, 1e-3)  # s
MAP_STEPS = np.geomspace(0.03, 1.0, 100)  # s
CHECKED_STEPS = {0.0: (1e-2, 5 / 64), 0.5: (1e-2, 5 / 64), 50.0: (5e-4,)}  # damping: dt, of the amplification
NEAR_METHODS = {"TMT": ("implicit", "semi_implicit_euler"), "MuJoCo": ("implicit", "Euler")}
LESS = FEW + (Party("TMT", "implicit"), Party("MuJoCo", "implicit"))  # of a small run
SMALL_NEAR = failure.RESONANCE + np.array([-0.01, -0.005, 0.0, 0.005])


def begin(setup) -> None:
    """Set the runs going side by side. A quick run takes fewer methods and scenes, and no map, minute or fine step."""
    of = setup.of
    parties = of(PARTIES, FEW, LESS)
    centres = [*product(CENTRES, DAMPINGS), *((name, 0.0) for name in SADDLES)]
    scenes = of(centres, [("bent", 0.0), ("ball catch", 0.0)], [("bent", 0.0), ("bent", 0.5), ("ball catch", 0.0)])
    mapped = tuple(p for p in PARTIES if p.engine == "TMT" or p.method in SCHEMES)
    mapped = of(mapped, (), mapped[:3])
    near = tuple(Party(engine, name) for engine in ("TMT", "MuJoCo") for name in NEAR_METHODS[engine])
    near = of(near, near[:2], near)
    long = [party for party in PARTIES if party.engine == "TMT" or party.method in SCHEMES]
    minute = list(product(of(long, [], [p for p in LESS if p in long]), (failure.COARSE, long_runs.FINE)))
    edges = of(failure.EDGES, (), failure.EDGES)
    steps = of(limits.STEPS, limits.STEPS, 1000)
    engine = [setup.engine]
    beside = of(engine, [], engine)  # what a quick run leaves out

    def ask(function, *items, **more):
        return setup.map(partial(function, mujoco=setup.engine, **more), *items)

    maps = {
        "map": {"x": of(MAP_STEPS, MAP_STEPS, MAP_STEPS[::20]), "steps": steps, "allowed": limits.ALLOWED},
        "edge": {"x": of(failure.EDGE, failure.EDGE, failure.EDGE[::50]), "steps": steps,
                 "y": of(failure.EDGE_SIZES, failure.EDGE_SIZES, failure.EDGE_SIZES[::5])},
        "near": {"x": of(failure.NEAR, failure.NEAR, SMALL_NEAR), "steps": limits.STEPS},
    }  # fmt: skip
    setup.background["stability"] = {
        "limits": ask(limits.examine, scenes, parties=parties, steps=steps),
        "departure": ask(
            departure.examine,
            of(DEPARTURE_STEPS, DEPARTURE_STEPS[:1], DEPARTURE_STEPS[:2]),
            parties=of(departure.SCHEMES, FEW, LESS),
        ),
        "zero": ask(
            departure.zero_law,
            [party for party in claims.PAIR if party.engine == "TMT" or not setup.is_quick],
            sizes=of(departure.ZERO_SIZES, departure.ZERO_SIZES, (1e-2, *departure.ZERO_SIZES[4:6])),
        ),
        "torques": setup.map(claims.holding_torques, engine),
        "finer": setup.map(partial(claims.finer_steps, counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096))), beside),
        "printed": setup.map(
            partial(claims.four_decimals, counts=of(claims.PRINTED_COUNTS, claims.PRINTED_COUNTS, (64, 256))), engine
        ),
        "bent": setup.map(partial(beyond.bent, counts=of(beyond.COUNTS, (), beyond.COUNTS[::7])), beside),
        "reset": setup.map(failure.own_reset, engine),
        "gain": setup.map(failure.silent_gain, engine),
        "maps": maps,
        "map": (mapped, ask(limits.map_of_growth, mapped, dts=maps["map"]["x"], steps=steps)),
        "near": (near, ask(failure.edge, near, sizes=[failure.SMALL, failure.LARGE], swings=maps["near"]["x"])),
        "edge": (edges, ask(failure.edge, edges, sizes=maps["edge"]["y"], swings=maps["edge"]["x"], steps=steps)),
        "minutes": ask(
            long_runs.long_run, *(zip(*minute) if minute else ((), ())), duration=of(long_runs.LONG, 0.0, 10.0)
        ),
        "newton": setup.map(
            partial(
                long_runs.newton,
                dts=of(long_runs.NEWTON, (), (0.1, 1.0, 100.0)),
                steps=of(limits.STEPS, limits.STEPS, 200),
            ),
            of(long_runs.IMPLICIT, (), long_runs.IMPLICIT),
        ),
    }


def rows(setup) -> Result:
    """Equilibria; step limits and growth per step; departures; the published claims; failures beyond the linear ones."""
    result = Result("stability")
    if "stability" not in setup.background:
        begin(setup)
    work = setup.background.pop("stability")
    equilibria(result, setup)
    limits.judge(result, list(work["limits"]))
    falls = [row for part in work["zero"] for row in part]
    departure.judge(result, [row for part in work["departure"] for row in part] + falls, falls)
    claims.judge(result, *(next(iter(work[name]), None) for name in ("torques", "finer", "printed")))
    for found in work["bent"]:
        beyond.judge(result, found)
    for name, axes in work["maps"].items():
        result.curves[name] = {**axes, "grown": dict(zip(*work[name]))}
    failure.judge_near(result, result.curves["near"])
    failure.judge_silent(result, *work["reset"], *work["gain"])
    long_runs.judge_minutes(result, list(work["minutes"]))
    long_runs.judge_newton(result, list(work["newton"]))
    result.tables = {name: table for name, table in result.tables.items() if table}
    planes(result, tuple(dict.fromkeys(party.scheme for party in setup.of(PARTIES, FEW, LESS))))
    return result


def planes(result, schemes) -> None:
    """The stability region of each method in the plane of eigenvalue times dt, and where the postures are in it."""
    x, y = np.linspace(-7.2, 1.8, 226), np.linspace(-0.6, 6.4, 176)
    z = x[None, :] + 1j * y[:, None]
    grown = {name: region(name, z) for name in schemes}
    alike = {name: next(other for other in grown if np.array_equal(grown[other], grown[name])) for name in schemes}
    result.curves["regions"] = {  # methods that do the same at rest share one
        tuple(name for name in schemes if alike[name] == first): (x, y, grown[first])
        for first in dict.fromkeys(alike.values())
    }
    result.curves["points"] = {
        (name, damping): held(name, posture(name), damping).modes[0]
        for name, damping in (("bent", 0.0), ("bent", 0.5), ("ball catch", 0.0))
    }


def equilibria(result, setup, names=tuple(POSTURES)) -> None:
    """What each held posture is, and TMT's amplification of a step against MuJoCo's."""
    table = []
    for name in names:
        at = held(name, posture(name))
        values = at.modes[0]
        table += [
            {"scene": name, "kind": at.kind, "mode": k, "real_per_s": float(v.real), "imaginary_per_s": float(v.imag)}
            for k, v in enumerate(values)
        ]
        swings = [f"{v.imag:.3f} rad/s" for v in values if v.imag > 1e-3]
        grows = [f"{v.real:.3f} per second" for v in values if v.real > 1e-3]
        told = [f"grows by {' and '.join(grows)}"] * bool(grows) + [f"swings at {', '.join(swings)}"] * bool(swings)
        kind = at.kind if at.kind == "marginal" else f"a {at.kind}"
        result.notes.append(f"{name[0].upper()}{name[1:]}, held, is {kind}: {'; '.join(told)}.")
        for damping, steps in CHECKED_STEPS.items():
            engine, at = setup.engine.variant(damping=damping), held(name, posture(name), damping)
            for integrator, dt in product(SCHEMES, steps):
                where = f"{name}, {integrator}, dt = {dt:.4g} s, damping {damping:g}"
                theirs = transition(engine, at.q, at.tau, dt, integrator)
                amplification(result, where, at.q, at.step(TWINS[integrator], dt), theirs)
    result.tables["stability_modes"] = table


def amplification(result, where, q, ours, theirs) -> None:
    """The check of one amplification: within what rounding does to a difference quotient."""
    bar = 64 * EPS * (1.0 + np.abs(q).max()) * np.abs(ours).max() / NUDGE
    quantity = "amplification of one step, TMT to MuJoCo"
    result.check(where, quantity, np.abs(ours - theirs).max(), bar, "", rounding=True)


def figures(result):
    """Limits, the map of growth, regions, the nonlinear edge; departures; the claims; silent failure; a minute."""
    from . import draw_departure, draw_failure, draw_stability  # matplotlib is for the processes that draw

    drawn = [
        draw_stability.limits,
        draw_stability.regions,
        draw_departure.times,
        draw_departure.torques,
        draw_failure.silent,
    ]
    if result.curves["map"]["grown"]:  # all but a quick run
        drawn += [draw_stability.growth_map, draw_failure.edge, draw_departure.finer, draw_departure.bent]
        drawn += [draw_departure.zero, draw_failure.minutes]
    for figure in drawn:
        yield partial(figure, result)
