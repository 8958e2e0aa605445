"""Stability: where each method fails, predicted from one step of it and shown in runs, with all joints together."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, product
from typing import NamedTuple

from ...core.finding import Finding
from ...judge.run import leaves_no_digits
from ...robots import Robot
from ...robots.case import Case
from ...truth.linear import held
from .. import Experiment
from ..setup import Setup
from . import claims, departure, failure, limits, own_run, servos
from .claims import KeptRuns
from .equilibria import check_equilibria
from .failure import OwnReset
from .limits import Observed
from .own_run import OwnRuns
from .subjects import (
    DAMPINGS,
    MOST_POSTURES,
    SCHEMES,
    Subjects,
    coarsest_case,
    left_out,
    methods_of,
    subjects_of,
    unit_of_movements,
)
from .tables import DepartureRow, FinerRow, LimitRow, StabilityResult, TorqueRow

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


class Work(NamedTuple):
    """What `begin` starts: the runs of the whole file and with servos, and those of `rows` at postures without them."""

    own_runs: Sequence[OwnRuns]
    with_servos: servos.Work | None
    limits: Iterable[list[Observed]] = ()
    departures: Iterable[list[DepartureRow]] = ()
    torques: Iterable[list[TorqueRow]] = ()
    finer: Iterable[list[FinerRow]] = ()
    kept: Iterable[KeptRuns] = ()
    resets: Iterable[OwnReset] = ()


def begin(setup: Setup) -> Work:
    """Start the runs. A quick run takes fewer methods and scenes, and no fine steps."""
    work = Work(own_run.begin(setup), servos.begin(setup))
    if is_large(setup.robot):
        return work
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

    return work._replace(
        limits=start(limits.limit_rows, at, methods=methods, steps=steps),
        departures=start(departure.departures, dts if saddles else (), at=saddle, methods=few),
        torques=start(claims.holding_torques, claimed),
        finer=start(claims.finer_steps, slow, counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096))),
        kept=start(claims.kept, slow),
        resets=start(failure.own_reset, free),
    )


def rows(setup: Setup, work: Work | None = None) -> StabilityResult:
    """Step limits; departures; the claims; a failure without a warning."""
    result = StabilityResult("stability")
    work = begin(setup) if work is None else work
    own_run.add(result, work.own_runs)
    if work.with_servos:
        servos.add(result, setup, work.with_servos)
    if names := left_out(setup.robot):
        result.top.append(result.finding("left_out", most=MOST_POSTURES, names=names))
    if is_large(setup.robot):
        result.top.append(result.finding("large", speeds=setup.robot.coordinates.nv, most=MOST_SPEEDS))
        return result
    subjects = subjects_of(setup.robot)
    robot = subjects.robot
    methods = methods_of(setup.engines, robot)
    result.centres = subjects.centres
    result.schemes = {(method.engine, method.name): method.scheme for method in methods}
    limits.check_limits(result, list(chain.from_iterable(work.limits)))
    check_equilibria(result, setup)
    departure.check_departures(result, list(chain.from_iterable(work.departures)))
    for torques in work.torques:
        claims.check_torques(result, robot, torques)
    for finer in work.finer:
        claims.check_finer_steps(result, robot, finer)
    for kept in work.kept:
        claims.check_kept(result, robot, kept)
    for run in work.resets:
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


def limits_shown(result: StabilityResult) -> list[LimitRow]:
    """The rows of the limits, at stable postures if there are any."""
    return [row for row in result.rows if not result.centres or row.scene in result.centres]


def headline(result: StabilityResult) -> Finding | None:
    """How many limits of the step are as predicted, and the largest relative difference."""
    counts = limits.summary(limits_shown(result))
    return result.finding("headline", **counts) if counts["known"] or counts["wrong"] else None


def figures(result: StabilityResult, robot: Robot) -> Iterator[partial]:
    # matplotlib is for the process that draws
    from . import figures_stability as drawing
    from .servos.figures_step import draw_step_response

    rows = limits_shown(result)
    if result.step_response and any(result.step_response.lines.values()):
        yield partial(draw_step_response, result, robot)
    if result.centres and any(row.predicted_dt or row.observed_dt for row in rows):
        yield partial(drawing.draw_limits, result, robot, rows)
    if "departure" in result.tables:
        yield partial(drawing.draw_departure, result, robot)
    if "stability_claims" in result.tables:
        yield partial(drawing.draw_claims, result, robot)


def overview(results: Mapping[str, StabilityResult], robot: Robot) -> Iterator[partial]:
    from .figures_stability import draw_overview  # matplotlib is for the process that draws

    result, file_dt = results["stability"], None
    rows, driven = limits_shown(result), result.tables.get("step_limits", ())
    if robot.drive.feeds_back and servos.limits_in_use(driven):
        rows, file_dt = servos.limits_in_use(driven), driven[0].file_dt
    if any(row.predicted_dt or row.observed_dt or row.passed is False for row in rows):
        yield partial(draw_overview, result, robot, rows, file_dt)
