"""Stability: where each method fails, predicted from one step of it and shown in runs, with all joints together."""

from collections.abc import Iterator, Mapping
from functools import partial

from ...judge.check import Result
from ...judge.run import leaves_no_digits
from ...robots import Robot
from ...truth.linear import held
from .. import Experiment
from ..setup import Setup
from . import claims, claims_checks, departure, failure, limits, servos, subjects
from .equilibria import check_equilibria
from .first_screen import headline as headline
from .first_screen import limits_of
from .subjects import MANY_SPEEDS, coarsest_case, dampings_of, explicit, of_schemes, places, subjects_of

EXPERIMENT = Experiment(order=100, serves_own=False, options=("--dt", "--integrator"), overview="limits")
FINE_STEPS = (1e-2, 1e-3)  # s, of departures, in addition to the coarsest step


def claim_values(robot: Robot) -> dict:
    """What the claim and the tolerance need in addition to the robot."""
    return {
        "unit": subjects.unit_of_movements(robot),
        "servos": servos.TOLERANCES if robot.drive.actuators else None,
        "steps": limits.GROWTH_STEPS,
        "most": limits.MOST_TOLERANCE,
        "many": MANY_SPEEDS,
    }


def skipped(robot: Robot) -> str | None:
    """Why it does not apply to a robot, or None."""
    return leaves_no_digits(robot)


def methods_of(setup: Setup) -> tuple:
    """The methods that a run of this size takes."""
    few = of_schemes(setup.engines, subjects.QUICK_SCHEMES)
    methods = setup.of(subjects.all_methods(setup.engines), few, few + of_schemes(setup.engines, ("implicit",)))
    return explicit(methods) if setup.robot.is_read else methods


def begin(setup: Setup) -> None:
    """Start the runs. A quick run takes fewer methods and scenes, and no fine steps."""
    engines, of, chosen = setup.engines, setup.of, subjects_of(setup.robot)
    robot, stated, added = chosen.robot, not setup.robot.is_read, dampings_of(setup.robot)
    methods, coarse = methods_of(setup), coarsest_case(robot).scene.dt
    points = of(
        places(chosen.centres, chosen.saddles, added),
        places(chosen.centres[:1], chosen.saddles[:1], added[:1]),
        places(chosen.centres[:1], chosen.saddles[:1], added[:2]),
    )
    leaving = of(of_schemes(engines, departure.DEPARTURE_SCHEMES), methods, methods)
    leaving_dts = tuple(dict.fromkeys(of((coarse, *FINE_STEPS), (coarse,), (coarse, *FINE_STEPS[:1]))))
    if not stated:
        leaving, leaving_dts = explicit(leaving), (coarse,)
    few = not stated and robot.coordinates.nv > MANY_SPEEDS
    steps = of(1000 if few else limits.GROWTH_STEPS, limits.GROWTH_STEPS if stated else 1000, 1000)

    def start(function, *items, **more):
        return setup.map(partial(function, engines=engines, **more), *items)

    def start_claim(function, full=True, **more):
        """Runs of a claim, if there are any; full=False: not in a quick run."""
        robots = (robot,) if robot.claims and (full or not setup.is_quick) else ()
        return setup.map(partial(function, engines, **more), robots)

    free = (chosen.free,) if chosen.free and (stated or not setup.is_quick) else ()
    at = [held(robot, *point) for point in points]
    saddle, dts = (chosen.saddle, leaving_dts) if chosen.saddle else (None, ())
    setup.background["stability"] = {
        "servos": servos.begin(setup),
        "limits": start(limits.limit_rows, at, methods=methods, steps=steps),
        "departure": start(departure.departures, dts, at=saddle, methods=leaving),
        "not led": departure.not_led(saddle, leaving, dts),
        "torques": start_claim(claims.holding_torques),
        "finer": start_claim(claims.finer_steps, full=False, counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096))),
        "printed": start_claim(claims.printed_torque, counts=claims.PRINTED_COUNTS[: of(4, 4, 2)]),
        "kept": start_claim(claims.kept, full=False, counts=of(claims.COUNTS_WITHIN, (), claims.COUNTS_WITHIN[::7])),
        "reset": start(failure.own_reset, free),
        "gain": start(failure.silent_gain, free),
    }


def rows(setup: Setup) -> Result:
    """Step limits; departures; the claims; failures without a warning."""
    result = Result("stability")
    if "stability" not in setup.background:
        begin(setup)
    work, chosen, methods = setup.background.pop("stability"), subjects_of(setup.robot), methods_of(setup)
    robot, saddle = chosen.robot, chosen.saddle
    result.curves["looked at"] = {"centres": chosen.centres, "saddle": saddle and saddle.name}
    result.curves["rate at saddle"] = saddle and float(saddle.modes[0].real.max())
    result.curves["schemes"] = {(method.engine, method.name): method.scheme for method in methods}
    if work["servos"]:
        servos.add(result, setup, work["servos"])
    limits.check_limits(result, [row for part in work["limits"] for row in part])
    check_equilibria(result, setup)
    departure.check_departures(result, [row for part in work["departure"] for row in part])
    for name, check in (
        ("torques", claims_checks.check_torques),
        ("finer", claims_checks.check_finer_steps),
        ("printed", claims_checks.check_printed_torque),
        ("kept", claims_checks.check_kept),
    ):
        for runs in work[name]:
            check(result, robot, runs)
    for reset, gain in zip(work["reset"], work["gain"]):
        failure.check_silent(result, chosen.free, reset, gain)
    if work["not led"]:
        result.find("not_led", posture=saddle.name, left_out=work["not led"])
    result.notes += chosen.left_out
    result.tables = {name: table for name, table in result.tables.items() if table}
    return result


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    # matplotlib is for the process that draws
    from . import figures_stability as drawing
    from .servos.figures_step import draw_step_response

    curves, centres = result.curves, result.curves["looked at"]["centres"]
    saddle = curves["looked at"]["saddle"]
    drawn = {
        draw_step_response: any(curves.get("step response", {"lines": {}})["lines"].values()),
        drawing.draw_limits: any(
            row["predicted_dt_s"] or row["observed_dt_s"] for row in result.rows if row["scene"] in centres
        ),
        drawing.draw_departure: any(row["scene"] == saddle for row in result.tables.get("departure", ())),
        drawing.draw_claims: "stability_claims" in result.tables,
    }
    for figure, has_data in drawn.items():
        if has_data:
            yield partial(figure, result, robot)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_overview import draw_limits  # matplotlib is for the process that draws

    if any(limit.predicted or limit.observed or not limit.passed for limit in limits_of(results["stability"])):
        yield partial(draw_limits, results["stability"], robot)
