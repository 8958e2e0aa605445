"""Stability: where each method fails, predicted from one step of it and shown in runs, with all joints together."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, product
from typing import Any, NamedTuple

from ...core.finding import Finding
from ...judge.run import leaves_no_digits
from ...robots import Robot
from ...robots.case import Case
from ...stability.held import held
from ...stability.limits import LONGEST
from .. import Drawing, Experiment
from ..setup import Setup
from . import claims, departure, failure, limits, of_file, own_run
from .claims import KeptRuns
from .equilibria import check_equilibria
from .failure import OwnReset
from .limits import Observed
from .own_run import OwnRuns
from .subjects import DAMPINGS, SCHEMES, Subjects, coarsest_case, methods_of, subjects_of, unit_of_movements
from .tables import DepartureRow, FinerRow, LimitRow, StabilityResult, TorqueRow

EXPERIMENT = Experiment(
    order=100,
    serves_own=False,
    options=(
        "--dt",
        "--integrator",
        "--posture",
        "--control-period",
        "--delay",
        "--kp",
        "--kv",
        "--at-speed",
    ),
    overview="limits",
)
FINE_STEPS = (1e-2, 1e-3)  # s, of departures, in addition to the coarsest step


def skipped(robot: Robot) -> Finding | None:
    """A file that MuJoCo runs as it is needs no digits of TMT."""
    return None if robot.is_read else leaves_no_digits(robot)


def claim_values(robot: Robot) -> dict[str, Any]:
    return {
        "unit": unit_of_movements(robot),
        "radii": of_file.RADII_WITHIN,
        "push": of_file.USUAL_PUSH,
        "up_to": LONGEST,
        "run": {"push": own_run.PUSH, "calm": own_run.CALM, "faster": own_run.FASTER, "finer": own_run.FINER},
    }


def reset_case(subjects: Subjects) -> Case | None:
    """The free motion that MuJoCo may reset, from the first centre; None: there is no centre."""
    robot, centres = subjects.robot, subjects.centres
    return robot.case(f"{centres[0]}, free", posture=centres[0]) if centres else None


class OfStated(NamedTuple):
    """Runs of a robot whose numbers are stated, held at its postures."""

    limits: Iterable[list[Observed]]
    departures: Iterable[list[DepartureRow]]
    torques: Iterable[list[TorqueRow]]
    finer: Iterable[list[FinerRow]]
    kept: Iterable[KeptRuns]
    resets: Iterable[OwnReset]


class Work(NamedTuple):
    """What `begin` starts: of a file, or of a robot whose numbers are stated."""

    own_runs: Sequence[OwnRuns]
    of_file: of_file.Work | None
    of_stated: OfStated | None


def begin(setup: Setup) -> Work:
    """Start the runs."""
    if setup.reading is None:
        return Work([], None, begin_of_stated(setup))
    return Work(own_run.begin(setup), of_file.begin(setup), None)


def begin_of_stated(setup: Setup) -> OfStated:
    """A quick run takes fewer methods and scenes, and no fine steps."""
    engines, of, subjects = setup.engines, setup.of, subjects_of(setup.robot)
    robot, centres, saddles = subjects
    few = methods_of(engines, robot, SCHEMES)
    methods = of(methods_of(engines, robot), few, few)
    dampings = of(DAMPINGS, DAMPINGS[:1], DAMPINGS[:2])
    steps = of(limits.GROWTH_STEPS, limits.GROWTH_STEPS, limits.GROWTH_STEPS // 2)
    dts = [coarsest_case(robot).scene.dt, *of(FINE_STEPS, (), FINE_STEPS[:1])]
    if setup.size != "full":
        centres, saddles = centres[:1], saddles[:1]
    at = [held(robot, *place) for place in (*product(centres, dampings), *product(saddles, (0.0,)))]
    saddle = held(robot, saddles[0]) if saddles else None
    claimed, free = [robot] if robot.claims else [], [reset_case(subjects)] if reset_case(subjects) else []
    slow = [] if setup.is_quick else claimed

    def start(function: Callable[..., Any], items: Iterable[Any], **more: Any) -> Iterable[Any]:
        return setup.map(partial(function, engines=engines, **more), items)

    return OfStated(
        limits=start(limits.limit_rows, at, methods=methods, steps=steps),
        departures=start(departure.departures, dts if saddles else (), at=saddle, methods=few),
        torques=start(claims.holding_torques, claimed),
        finer=start(claims.finer_steps, slow, counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096))),
        kept=start(claims.kept, slow),
        resets=start(failure.own_reset, free),
    )


def rows(setup: Setup, work: Work | None = None) -> StabilityResult:
    """Of a file: its own runs, the limits of its steps. Else: limits; departures; the claims; a failure without a warning."""
    result = StabilityResult("stability")
    work = begin(setup) if work is None else work
    own_run.add(result, work.own_runs)
    if work.of_file:
        of_file.add(result, setup, work.of_file)
    if work.of_stated:
        add_of_stated(result, setup, work.of_stated)
    result.tables = {name: table for name, table in result.tables.items() if table}
    return result


def add_of_stated(result: StabilityResult, setup: Setup, work: OfStated) -> None:
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
        "examined", noun=robot.noun, centres=subjects.centres, saddles=subjects.saddles,
        names=[*robot.postures, *robot.positions], departures=bool(result.tables.get("departure")),
    )  # fmt: skip


def limits_shown(result: StabilityResult) -> list[LimitRow]:
    """The rows of the limits, at stable postures if there are any."""
    return [row for row in result.rows if not result.centres or row.scene in result.centres]


def headline(result: StabilityResult) -> Finding | None:
    """How many limits of the step are as predicted; of a file, whether its step is stable."""
    if "step_limits" in result.tables:
        table = result.tables["step_limits"]
        own = of_file.in_use(table, table[0].file_integrator)
        return (
            result.finding(
                "headline", of_file.OF, row=own[0], up_to=LONGEST, dt=own[0].file_dt, far=of_file.GIVES_WAY
            )
            if own
            else None
        )
    counts = limits.summary(limits_shown(result))
    return result.finding("headline", **counts) if counts["known"] or counts["wrong"] else None


def figures(result: StabilityResult, robot: Robot) -> Iterator[Drawing]:
    # matplotlib is for the process that draws
    from . import figures_growth
    from . import figures_stability as drawing

    rows = limits_shown(result)
    if result.growth:
        yield partial(figures_growth.draw_growth, result)
    if result.centres and any(row.predicted_dt or row.observed_dt for row in rows):
        yield partial(drawing.draw_limits, result, robot, rows)
    if "departure" in result.tables:
        yield partial(drawing.draw_departure, result, robot)
    if "stability_claims" in result.tables:
        yield partial(drawing.draw_claims, result, robot)


def overview(results: Mapping[str, StabilityResult], robot: Robot) -> Iterator[Drawing]:
    from .figures_stability import draw_overview  # matplotlib is for the process that draws

    result, file_dt = results["stability"], None
    rows = limits_shown(result)
    if table := result.tables.get("step_limits"):
        rows, file_dt = of_file.limits_in_use(table), table[0].file_dt
    if any(row.predicted_dt or row.observed_dt or row.passed is False for row in rows):
        yield partial(draw_overview, result, robot, rows, file_dt)
