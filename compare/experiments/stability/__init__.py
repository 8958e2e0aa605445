"""Stability: where each method fails, predicted from one step of it and shown in runs, with all joints together."""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import product

import numpy as np

from ...engines import same_scheme
from ...judge.check import Result
from ...judge.run import leaves_no_digits
from ...robots import Robot
from ...truth.linear import held
from .. import Experiment
from ..setup import Setup
from . import beyond, choice, claims, departure, failure, falling, growth, limits, long_runs, servos
from .choice import dampings_of
from .claims_judged import check_claims
from .equilibria import check_equilibria, planes
from .first_screen import headline as headline
from .first_screen import limits_of
from .limits_judged import check_limits
from .subjects import MANY, places, subjects_of

EXPERIMENT = Experiment(order=100, serves_own=False, options=("--dt", "--integrator"), overview="limits")
FINE_DEPARTURES = (1e-2, 1e-3)  # s, beside the coarsest step
MAP_STEPS = np.geomspace(0.03, 1.0, 100)  # s
SMALL_RESONANCE = failure.RESONANCE + np.array([-0.01, -0.005, 0.0, 0.005])  # of a small run


def claim(robot: Robot) -> str:
    """What is examined."""
    return (
        "Every method fails somewhere, and where can be said beforehand. The equations of motion are linearised about "
        "each held posture by exact derivatives; what one step of a method does to a small deviation there, its "
        "amplification, gives its limit of dt, its growth per step and the time at which an unstable posture is left. "
        "Runs of both engines do as predicted"
        + (", and the assignment's observations follow from the same numbers." if robot.claims else ".")
        + servos.claim_of_servos(robot)
    )


def tolerance(robot: Robot) -> str:
    """How far apart what is compared may be."""
    run, sought = "2000 steps, or more until a quarter holds a swing of the slowest mode", "without the prediction"
    near, unit = "", choice.unit_of_movements(robot)
    if robot.is_read:
        run = f"{limits.GROWTH_STEPS} steps, 1000 of a quick run or with more than {MANY} speeds"
        sought = "among steps about the predicted one"
        near = (
            f", or from where such a run shows the growth, if that is more, up to {100 * limits.MOST_TOLERANCE:g} %: a limit "
            "that shows later is not asked of runs; the notes say of which"
        )
    return (
        "Amplification: that of TMT's method against MuJoCo's own derivative of its step (mjd_transitionFD; central "
        f"differences for RK4, which it refuses), within the rounding of a difference quotient, 64 eps (1 + |q|) "
        "max|J| / 1e-6. Limits: the largest dt at which no mode of the equations of motion grows by more than 0.1 % from the "
        f"second to the last quarter of a run from 1e-6 {unit} ({run}), found by bisection {sought}, within 0.1 % of the "
        f"predicted dt{near}. Growth: 0.1 % over all steps. Departure (a {choice.joint_of(robot)} 0.1 {unit} away): "
        "within one step or 0.03 s"
        + (", and what forces that are not linear may add," if robot.is_read else "")
        + " of the first crossing of the method's linear map, whose angles are rounded to doubles at each step; where the map "
        "stays, the run stays." + servos.tolerance_of_servos(robot)
    )


def skipped(robot: Robot) -> str | None:
    """Why it cannot serve a robot, or None."""
    return leaves_no_digits(robot)


def methods_of(setup: Setup) -> tuple:
    """The methods that a run of this size takes."""
    few = choice.of_schemes(setup.engines, choice.FEW_SCHEMES)
    methods = setup.of(choice.all_methods(setup.engines), few, few + choice.of_schemes(setup.engines, ("implicit",)))
    return choice.explicit(methods) if setup.robot.is_read else methods


def begin(setup: Setup) -> None:
    """Set the runs going side by side. A quick run takes fewer methods and scenes, and no map, minute or fine step."""
    engines, of, seen = setup.engines, setup.of, subjects_of(setup.robot)
    robot, every, added = seen.robot, not setup.robot.is_read, dampings_of(setup.robot)
    methods, each, coarse = methods_of(setup), choice.of_schemes(engines), choice.coarsest_case(robot).scene.dt
    points = of(
        places(seen.centres, seen.saddles, added),
        places(seen.centres[:1], seen.saddles[:1], added[:1]),
        places(seen.centres[:1], seen.saddles[:1], added[:2]),
    )
    leaving = of(choice.of_schemes(engines, departure.DEPARTURE_SCHEMES), methods, methods)
    leaving_dts = tuple(dict.fromkeys(of((coarse, *FINE_DEPARTURES), (coarse,), (coarse, *FINE_DEPARTURES[:1]))))
    if not every:
        leaving, leaving_dts = choice.explicit(leaving), (coarse,)
    rk4, edges = claims.of_claims(engines), tuple(engines["tmt"].methods[name] for name in failure.EDGE_SCHEMES)
    near = edges + tuple(same_scheme(engines, method, "mujoco") for method in edges)
    implicit = choice.implicit_methods(engines)
    few = not every and robot.coordinates.nv > MANY
    steps = of(1000 if few else limits.GROWTH_STEPS, limits.GROWTH_STEPS if every else 1000, 1000)
    maps = {
        "map": {"x": of(MAP_STEPS, MAP_STEPS, MAP_STEPS[::20]), "steps": steps, "allowed": limits.GROWTH_ALLOWED},
        "edge": {"x": of(failure.EDGE_SWINGS, failure.EDGE_SWINGS, failure.EDGE_SWINGS[::50]), "steps": steps,
                 "y": of(failure.EDGE_SIZES, failure.EDGE_SIZES, failure.EDGE_SIZES[::5])},
        "near": {"x": of(failure.RESONANT_SWINGS, failure.RESONANT_SWINGS, SMALL_RESONANCE), "steps": limits.GROWTH_STEPS},
    }  # fmt: skip

    def ask(function, *items, **more):
        return setup.map(partial(function, engines=engines, **more), *items)

    def about(subject, items):
        """These items, if the robot has such a subject."""
        return items if subject else ()

    def claimed(function, full=True, **more):
        """What becomes of the claims, if there are any; what is not part of a quick run is left out there."""
        robots = about(robot.claims and (full or not setup.is_quick), (robot,))
        return setup.map(partial(function, engines, **more), robots)

    let_go = about(seen.free and (every or not setup.is_quick), (seen.free,))
    mapped = about(every and seen.centre, of(each, (), each[:3]))
    minutes = list(product(about(every and seen.free, of(each, (), methods)), (coarse, long_runs.FINE_STEP)))
    resonant = about(every and seen.swinging, of(near, near[:2], near))
    tongues = about(every and seen.swinging, of(edges, (), edges))
    setup.background["stability"] = {
        "subjects": seen,
        "servos": servos.begin(setup),
        "limits": ask(limits.limits_and_growths, [held(robot, *point) for point in points], methods=methods, steps=steps,
                      growth_dts=tuple(dict.fromkeys((*FINE_DEPARTURES[::-1], coarse)))),
        "departure": ask(departure.departures, about(seen.saddle, leaving_dts), at=seen.saddle, methods=leaving),
        "not led": departure.not_led_in_words(seen.saddle, leaving, leaving_dts) if seen.saddle else [],
        "falls": ask(falling.fall, about(seen.marginal, of(rk4, rk4[:1], rk4)), at=seen.marginal,
                     sizes=of(falling.FALL_SIZES, falling.FALL_SIZES, (1e-2, *falling.FALL_SIZES[4:6]))),
        "torques": claimed(claims.holding_torques),
        "finer": claimed(claims.finer_steps, full=False, counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096))),
        "printed": claimed(claims.printed_torque, counts=of(claims.PRINTED_COUNTS, claims.PRINTED_COUNTS, (64, 256))),
        "kept": claimed(beyond.kept, full=False, counts=of(beyond.COUNTS_WITHIN, (), beyond.COUNTS_WITHIN[::7])),
        "reset": ask(failure.own_reset, let_go),
        "gain": ask(failure.silent_gain, let_go),
        "maps": maps,
        "map": (mapped, ask(growth.map_of_growth, mapped, at=seen.centre, dts=maps["map"]["x"], steps=steps)),
        "near": (resonant, ask(failure.edge_growth, resonant, at=seen.centre, swings=maps["near"]["x"],
                               sizes=[growth.LINEAR_DEVIATION, failure.LARGE_DEVIATION])),
        "edge": (tongues, ask(failure.edge_growth, tongues, at=seen.centre, sizes=maps["edge"]["y"], swings=maps["edge"]["x"],
                              steps=steps)),
        "minutes": ask(long_runs.long_run, *([pair[k] for pair in minutes] for k in (0, 1)), case=seen.free,
                       duration=of(long_runs.MINUTE, long_runs.MINUTE, 10.0)),
        "newton": ask(long_runs.newton, about(every and seen.centre, of(implicit, (), implicit)), at=seen.centre,
                      dts=of(long_runs.NEWTON_STEPS, (), (0.1, 1.0, 100.0)),
                      steps=of(limits.GROWTH_STEPS, limits.GROWTH_STEPS, 200)),
    }  # fmt: skip


def rows(setup: Setup) -> Result:
    """Equilibria; step limits and growth per step; departures; what is claimed; failures beyond the linear ones."""
    result = Result("stability")
    if "stability" not in setup.background:
        begin(setup)
    work = setup.background.pop("stability")
    seen, methods = work["subjects"], methods_of(setup)
    robot = seen.robot
    result.curves["looked at"] = seen.names
    result.curves["schemes"] = {(method.engine, method.name): method.scheme for method in methods}
    said = servos.add(result, setup, work["servos"]) if work["servos"] else []
    check_equilibria(result, setup)
    check_limits(result, robot, list(work["limits"]))
    falls = [row for part in work["falls"] for row in part]
    departure.check_departures(result, [row for part in work["departure"] for row in part] + falls)
    falling.check_falls(result, falls)
    if robot.claims:
        check_claims(result, robot, *(next(iter(work[name]), None) for name in ("torques", "finer", "printed")))
    for found in work["kept"]:
        beyond.check_kept(result, robot, found)
    for name, axes in work["maps"].items():
        result.curves[name] = {**axes, "grown": dict(zip(*work[name]))}
    if result.curves["near"]["grown"]:
        failure.check_near(result, robot, seen.centre.name, result.curves["near"])
    for reset, gain in zip(work["reset"], work["gain"]):
        failure.check_silent(result, reset, gain)
    long_runs.check_minutes(result, list(work["minutes"]))
    if seen.centre:
        long_runs.check_newton(result, seen.centre.name, list(work["newton"]))
    result.tables = {name: table for name, table in result.tables.items() if table}
    result.notes = [*said, *result.notes, *work["not led"], *seen.left_out]
    planes(result, robot, seen, tuple(dict.fromkeys(method.scheme for method in methods)))
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    """Limits, the map of growth, regions, the nonlinear edge; departures; the claims; silent failure; a minute."""
    # matplotlib is for the process that draws
    from . import figures_claims, figures_departure, figures_failure, figures_limits
    from .servos import figures_step

    tables, curves, looked_at = result.tables, result.curves, result.curves["looked at"]
    falls = [row for row in tables.get("departure", ()) if row["scene"] == looked_at["marginal"]]
    left = any(row["scene"] == looked_at["saddle"] for row in tables.get("departure", ()))
    drawn = {
        figures_step.draw_step_response: any(curves.get("step response", {"lines": {}})["lines"].values()),
        figures_limits.draw_limits: any(
            row["predicted_dt_s"] or row["observed_dt_s"] for row in result.rows if row["scene"] in looked_at["centres"]
        ),
        figures_limits.draw_regions: bool(curves["points"]),
        figures_departure.draw_departure: left,
        figures_claims.draw_torques: "stability_torques" in tables,
        figures_failure.draw_silent: "silent" in curves and (not robot.is_read or failure.is_silent(curves["silent"])),
        figures_limits.draw_growth_map: curves["map"]["grown"],
        figures_failure.draw_edge: curves["edge"]["grown"],
        figures_claims.draw_finer_steps: "stability_finer_steps" in tables,
        figures_claims.draw_kept: "kept" in curves,
        figures_departure.draw_falls: len({row["engine"] for row in falls}) > 1,  # all but a quick run
        figures_failure.draw_minutes: curves["minutes"],
    }
    for figure, has_data in drawn.items():
        if has_data:
            yield partial(figure, result, robot)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import draw_limits  # matplotlib is for the process that draws

    if any(limit.predicted or limit.observed or not limit.passed for limit in limits_of(results["stability"])):
        yield partial(draw_limits, results["stability"], robot)
