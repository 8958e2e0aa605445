"""Stability: where each method fails, predicted from one step of it and shown in runs, on the full three-hinge arm."""

from functools import partial
from itertools import product

import numpy as np

from . import beyond, claims, departure, failure, limits
from .agreement import EPS, Result
from .engine import INTEGRATORS
from .engine_linear import NUDGE, transition
from .linear import held, region
from .motion import TWINS
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
    "max|J| / 1e-6. Limits: the largest dt at which a perturbation of 1e-6 rad grows less than 100-fold in 2000 "
    "steps, found by bisection without the prediction, within 0.2 % of the dt at which the linear map of the method "
    "does so, and within 0.2 % (damped: 0.5 %) of the dt at which growth begins. Growth: 0.1 % over all steps. "
    "Departure (a hinge 0.1 rad away): within one step or 0.03 s of the first crossing of the method's linear map, "
    "more only by the time for which dt qd is below half an ulp of every angle."
)
CENTRES, SADDLES, DAMPINGS = ("bent", "hanging"), ("ball catch", "upright"), (0.0, 0.5, 50.0)
DEPARTURE_STEPS = (5 / 64, 1e-2, 1e-3)  # s
MAP_STEPS = np.geomspace(0.03, 1.0, 100)  # s
CHECKED_STEPS = {0.0: (1e-2, 5 / 64), 0.5: (1e-2, 5 / 64), 50.0: (5e-4,)}  # damping: dt, of the amplification


def begin(setup) -> None:
    """Set the runs going side by side. A quick run takes fewer methods and scenes, and no map, minute or fine step."""
    quick = setup.is_quick
    parties = FEW if quick else PARTIES
    scenes = [*product(CENTRES, DAMPINGS), *((name, 0.0) for name in SADDLES)]
    scenes = [("bent", 0.0), ("ball catch", 0.0)] if quick else scenes
    schemes = FEW if quick else departure.SCHEMES
    mapped = () if quick else tuple(p for p in PARTIES if p.engine == "TMT" or p.method in ("Euler", "implicit", "RK4"))
    near = (Party("TMT", "implicit"), Party("TMT", "semi_implicit_euler"))
    near += () if quick else (Party("MuJoCo", "implicit"), Party("MuJoCo", "Euler"))
    minute = [] if quick else list(product(PARTIES, (failure.COARSE, failure.FINE)))
    edges = () if quick else failure.EDGES

    def ask(function, *items, **more):
        return setup.map(partial(function, mujoco=setup.engine, **more), *items)

    engine = [setup.engine]
    setup.background["stability"] = {
        "limits": ask(limits.examine, scenes, parties=parties),
        "departure": ask(departure.examine, DEPARTURE_STEPS[:1] if quick else DEPARTURE_STEPS, parties=schemes),
        "zero": ask(departure.zero_law, [party for party in claims.PAIR if party.engine == "TMT" or not quick]),
        "torques": setup.map(claims.holding_torques, engine),
        "finer": setup.map(claims.finer_steps, [] if quick else engine),
        "printed": setup.map(claims.four_decimals, engine),
        "bent": setup.map(beyond.bent, [] if quick else engine),
        "map": (mapped, ask(limits.map_of_growth, mapped, steps=MAP_STEPS)),
        "near": (near, ask(failure.edge, near, sizes=[failure.SMALL, failure.LARGE], swings=failure.NEAR)),
        "edge": (edges, ask(failure.edge, edges, sizes=failure.EDGE_SIZES, swings=failure.EDGE)),
        "minutes": ask(failure.long_run, *(zip(*minute) if minute else ((), ()))),
        "newton": setup.map(failure.newton, () if quick else failure.IMPLICIT),
    }


def rows(setup) -> Result:
    """Equilibria; step limits and growth per step; departures; the published claims; failures beyond the linear ones."""
    result = Result("stability")
    if "stability" not in setup.background:
        begin(setup)
    work = setup.background.pop("stability")
    equilibria(result, setup)
    first = result.notes
    result.notes = []
    limits.judge(result, list(work["limits"]))
    falls = [row for part in work["zero"] for row in part]
    departure.judge(result, [row for part in work["departure"] for row in part] + falls, falls)
    claims.judge(result, *(next(iter(work[name]), None) for name in ("torques", "finer", "printed")))
    for found in work["bent"]:
        beyond.judge(result, found)
    near = dict(zip(work["near"][0], work["near"][1]))
    failure.judge(result, setup.engine, near, list(work["minutes"]), list(work["newton"]))
    for name in ("map", "edge"):
        result.curves[name] = dict(zip(*work[name]))
    result.notes = first + result.notes
    result.tables = {name: table for name, table in result.tables.items() if table}
    planes(result, tuple(dict.fromkeys(party.scheme for party in (FEW if setup.is_quick else PARTIES))))
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


def equilibria(result, setup) -> None:
    """What each held posture is, and TMT's amplification of a step against MuJoCo's."""
    table = []
    for name in POSTURES:
        at = held(name, posture(name))
        values = at.modes[0]
        table += [
            {"scene": name, "kind": at.kind, "mode": k, "real_per_s": float(v.real), "imaginary_per_s": float(v.imag)}
            for k, v in enumerate(values)
        ]
        swings = [f"{v.imag:.3f} rad/s" for v in values if v.imag > 1e-3]
        grows = [f"{v.real:.3f} per second" for v in values if v.real > 1e-3]
        told = [f"grows by {' and '.join(grows)}"] * bool(grows) + [f"swings at {', '.join(swings)}"] * bool(swings)
        result.notes.append(
            f"{name[0].upper()}{name[1:]}, held, is a {at.kind}: {'; '.join(told)}.".replace("a marg", "marg")
        )
        for damping, steps in CHECKED_STEPS.items():
            engine, at = setup.engine.variant(damping=damping), held(name, posture(name), damping)
            predicted = {scheme: at.step(scheme, np.array(steps)) for scheme in {TWINS[name] for name in INTEGRATORS}}
            for (k, dt), integrator in product(enumerate(steps), INTEGRATORS):
                ours = predicted[TWINS[integrator]][k]
                theirs = transition(engine, at.q, at.tau, dt, integrator)
                bar = 64 * EPS * (1.0 + np.abs(at.q).max()) * np.abs(ours).max() / NUDGE
                where = f"{name}, {integrator}, dt = {dt:.4g} s, damping {damping:g}"
                result.check(where, "amplification of one step, TMT to MuJoCo", np.abs(ours - theirs).max(), bar, "")
    result.tables["stability_modes"] = table


def figures(result):
    """Limits, the map of growth, regions, the nonlinear edge; departures; the claims; silent failure; a minute."""
    from . import draw_departure, draw_failure, draw_stability  # matplotlib is for the processes that draw

    yield draw_stability.limits(result)
    yield draw_stability.regions(result)
    yield draw_departure.times(result)
    yield draw_departure.torques(result)
    yield draw_failure.silent(result)
    if result.curves["map"]:  # all but a quick run
        yield draw_stability.growth_map(result)
        yield draw_failure.edge(result)
        yield draw_departure.finer(result)
        yield draw_departure.bent(result)
        yield draw_departure.zero(result)
        yield draw_failure.minutes(result)
