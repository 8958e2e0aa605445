"""Stability: where each method fails, predicted from one step of it and shown in runs, with all joints together."""

from collections.abc import Iterator, Mapping
from functools import partial
from itertools import product

from ...core.check import Result
from ...core.finding import Finding
from ...judge.run import leaves_no_digits
from ...robots import Robot
from ...robots.case import Case
from ...truth.linear import held
from .. import Experiment
from ..setup import Setup
from . import claims, departure, failure, limits, own_run, servos
from .equilibria import check_equilibria
from .subjects import DAMPINGS, SCHEMES, Subjects, coarsest_case, methods_of, subjects_of, unit_of_movements

EXPERIMENT = Experiment(order=100, serves_own=False, options=("--dt", "--integrator"), overview="limits")
MOST_SPEEDS = 60  # of a file's robot: with more there are no runs without servos
FINE_STEPS = (1e-2, 1e-3)  # s, of departures, in addition to the coarsest step
skipped = leaves_no_digits


def claim_values(robot: Robot) -> dict:
    return {
        "unit": unit_of_movements(robot),
        "servos": servos.TOLERANCES if robot.drive.actuators else None,
        "most": limits.MOST_TOLERANCE,
        "run": {"push": own_run.PUSH, "calm": own_run.CALM, "faster": own_run.FASTER, "finer": own_run.FINER},
    }


def reset_case(subjects: Subjects) -> Case | None:
    """The free motion that MuJoCo may reset, from the first centre; None: of a file's robot, and without a centre."""
    robot, centres = subjects.robot, subjects.centres
    return None if robot.is_read or not centres else robot.case(f"{centres[0]}, free", posture=centres[0])


def begin(setup: Setup) -> dict:
    """Start the runs. A quick run takes fewer methods and scenes, and no fine steps."""
    own = {"own run": own_run.begin(setup), "servos": servos.begin(setup)}
    if is_large(setup.robot):
        return own
    engines, of, subjects = setup.engines, setup.of, subjects_of(setup.robot)
    robot, centres, saddles = subjects
    few = methods_of(engines, robot, SCHEMES)
    methods, dampings = of(methods_of(engines, robot), few, few), DAMPINGS[:1]
    steps, coarse = limits.GROWTH_STEPS // 2, coarsest_case(robot).scene.dt
    dts = [coarse]
    if not robot.is_read:
        dampings, steps = of(DAMPINGS, DAMPINGS[:1], DAMPINGS[:2]), of(2 * steps, 2 * steps, steps)
        dts += of(FINE_STEPS, (), FINE_STEPS[:1])
    if setup.size != "full":
        centres, saddles = centres[:1], saddles[:1]
    at = [held(robot, *place) for place in (*product(centres, dampings), *product(saddles, (0.0,)))]
    saddle = held(robot, saddles[0]) if saddles else None
    claimed, free = [robot] if robot.claims else [], [reset_case(subjects)] if reset_case(subjects) else []
    slow = [] if setup.is_quick else claimed

    def start(function, items, **more):
        return setup.map(partial(function, engines=engines, **more), items)

    return own | {
        "limits": start(limits.limit_rows, at, methods=methods, steps=steps),
        "departure": start(departure.departures, dts if saddles else (), at=saddle, methods=few),
        "torques": start(claims.holding_torques, claimed),
        "finer": start(claims.finer_steps, slow, counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096))),
        "kept": start(claims.kept, slow),
        "reset": start(failure.own_reset, free),
    }


def rows(setup: Setup, work: dict | None = None) -> Result:
    """Step limits; departures; the claims; a failure without a warning."""
    result = Result("stability")
    work = begin(setup) if work is None else work
    own_run.add(result, work["own run"])
    if work["servos"]:
        servos.add(result, setup, work["servos"])
    if is_large(setup.robot):
        result.top.append(result.finding("large", speeds=setup.robot.coordinates.nv, most=MOST_SPEEDS))
        return result
    subjects = subjects_of(setup.robot)
    robot = subjects.robot
    methods = methods_of(setup.engines, robot)
    result.curves |= {"centres": subjects.centres, "schemes": {(m.engine, m.name): m.scheme for m in methods}}
    limits.check_limits(result, [row for part in work["limits"] for row in part])
    check_equilibria(result, setup)
    departure.check_departures(result, [row for part in work["departure"] for row in part])
    checks = {"torques": claims.check_torques, "finer": claims.check_finer_steps, "kept": claims.check_kept}
    for name, check in checks.items():
        for runs in work[name]:
            check(result, robot, runs)
    for run in work["reset"]:
        failure.check_reset(result, reset_case(subjects), run)
    result.find(
        "examined", noun=robot.noun, is_read=robot.is_read, centres=subjects.centres, saddles=subjects.saddles,
        names=[*robot.postures, *robot.positions], has_actuators=bool(robot.drive.actuators),
        moving=setup.reading is not None and bool(setup.reading.model.key_qvel.any()),
        departures=bool(result.tables.get("departure")),
    )  # fmt: skip
    result.tables = {name: table for name, table in result.tables.items() if table}
    return result


def is_large(robot: Robot) -> bool:
    """Whether compiling the equations of a file's robot takes minutes, since it has many speeds."""
    return robot.is_read and robot.coordinates.nv > MOST_SPEEDS


def limits_shown(result: Result) -> list[dict]:
    """The rows of the limits, at stable postures if there are any."""
    centres = result.curves.get("centres")
    return [
        row for row in result.rows if "predicted_dt_s" in row and (not centres or row["scene"] in centres)
    ]


def headline(result: Result) -> Finding | None:
    """How many limits of the step are as predicted, and the largest relative difference."""
    counts = limits.summary(limits_shown(result))
    return result.finding("headline", **counts) if counts["known"] or counts["wrong"] else None


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    # matplotlib is for the process that draws
    from . import figures_stability as drawing
    from .servos.figures_step import draw_step_response

    rows = limits_shown(result)
    if any(result.curves.get("step response", {"lines": {}})["lines"].values()):
        yield partial(draw_step_response, result, robot)
    if result.curves.get("centres") and any(row["predicted_dt_s"] or row["observed_dt_s"] for row in rows):
        yield partial(drawing.draw_limits, result, robot, rows)
    if "departure" in result.tables:
        yield partial(drawing.draw_departure, result, robot)
    if "stability_claims" in result.tables:
        yield partial(drawing.draw_claims, result, robot)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[partial]:
    from .figures_stability import draw_overview  # matplotlib is for the process that draws

    driven = servos.limits_in_use(results["stability"].tables.get("step_limits", ()))
    rows = driven if robot.drive.feeds_back and driven else limits_shown(results["stability"])
    if any(row["predicted_dt_s"] or row["observed_dt_s"] or row["passed"] is False for row in rows):
        yield partial(draw_overview, results["stability"], robot, rows)
