"""Stability: where each method fails, predicted from one step of it and shown in runs, with all joints together."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import partial
from itertools import chain, product
from typing import Any, NamedTuple

from ...core.finding import Finding
from ...judge.run import leaves_no_digits
from ...robots import Robot
from ...stability import push
from ...stability.equilibrium import equilibrium
from .. import Drawing
from ..setup import Setup
from . import claims, departure, limits, of_file
from .subjects import DAMPINGS, SCHEMES, coarsest_case, methods_of, subjects_of, unit_of_movements
from .tables import LimitRow, StabilityResult

FINE_STEPS = (1e-2, 1e-3)  # s, of departures, in addition to the coarsest step


def skipped(robot: Robot) -> Finding | None:
    """A file that MuJoCo runs as it is needs no digits of TMT."""
    return None if robot.is_read else leaves_no_digits(robot)


def claim_values(robot: Robot) -> dict[str, Any]:
    """The numbers of the definition, for its text."""
    names = "USUAL WAYS LASTS STILL STILLER AS_FAST FAST GROWS ELSEWHERE BY_CHANCE"
    numbers = {name.lower(): getattr(push, name) for name in names.split()}
    return numbers | {"unit": unit_of_movements(robot), "longest": push.LONGEST, "within": push.WITHIN}


class Runs(NamedTuple):
    """Runs that have begun, each a list of rows, and what judges the rows of all."""

    rows: Iterable[list[Any]]
    judge: Callable[[StabilityResult, list[Any]], None]


class Work(NamedTuple):
    """What `begin` starts: of a file, or of a robot whose numbers are stated."""

    of_file: of_file.Work | None
    of_stated: Sequence[Runs]


def begin(setup: Setup) -> Work:
    """Start the runs."""
    if setup.reading is None:
        return Work(None, begin_of_stated(setup))
    return Work(of_file.begin(setup, setup.reading), ())


def begin_of_stated(setup: Setup) -> list[Runs]:
    """A quick run takes fewer methods and scenes, and no fine steps."""
    engines, of = setup.engines, setup.of
    robot, centres, saddles = subjects_of(setup.robot)
    few = methods_of(engines, robot, SCHEMES)
    methods = of(methods_of(engines, robot), few, few)
    dampings = of(DAMPINGS, DAMPINGS[:1], DAMPINGS[:2])
    steps = of(limits.GROWTH_STEPS, limits.GROWTH_STEPS, limits.GROWTH_STEPS // 2)
    dts = [coarsest_case(robot).scene.dt, *of(FINE_STEPS, (), FINE_STEPS[:1])]
    if setup.size != "full":
        centres, saddles = centres[:1], saddles[:1]
    at = [equilibrium(robot, *place) for place in (*product(centres, dampings), *product(saddles, (0.0,)))]

    def start(function: Callable[..., Any], items: Iterable[Any], **more: Any) -> Iterable[Any]:
        return setup.map(partial(function, engines=engines, **more), items)

    begun = [
        Runs(start(limits.limit_rows, at, methods=methods, steps=steps), limits.check_limits),
    ]
    if saddles:
        runs = start(departure.departures, dts, at=equilibrium(robot, saddles[0]), methods=few)
        begun.append(Runs(runs, departure.check_departures))
    if robot.claims:
        runs = start(claims.holding_torques, [robot])
        begun.append(Runs(runs, partial(claims.check_torques, robot=robot)))
    if robot.claims and not setup.is_quick:
        runs = start(claims.finer_steps, [robot], counts=of(claims.STEP_COUNTS, (), (32, 64, 128, 4096)))
        begun.append(Runs(runs, partial(claims.check_finer_steps, robot=robot)))
        ends = partial(claims.check_kept, robot=robot, ends=claims.accelerations_at_end(robot, engines))
        begun.append(Runs(start(claims.kept, [robot]), ends))
    return begun


def rows(setup: Setup, work: Work | None = None) -> StabilityResult:
    """Of a file: its own runs, the limits of its steps. Else: limits; departures; the claims; a failure without a warning."""
    result = StabilityResult("stability")
    work = begin(setup) if work is None else work
    if work.of_file:
        of_file.add(result, work.of_file)
    if work.of_stated:
        add_of_stated(result, setup, work.of_stated)
    result.tables = {name: table for name, table in result.tables.items() if table}
    return result


def add_of_stated(result: StabilityResult, setup: Setup, work: Sequence[Runs]) -> None:
    robot, result.centres, saddles = subjects_of(setup.robot)
    result.schemes = {
        (method.engine, method.name): method.scheme for method in methods_of(setup.engines, robot)
    }
    for runs in work:
        runs.judge(result, list(chain.from_iterable(runs.rows)))
    result.find(
        "examined", noun=robot.noun, centres=result.centres, saddles=saddles,
        names=[*robot.postures], departures=bool(result.tables.get("departure")),
    )  # fmt: skip


def limits_shown(result: StabilityResult) -> list[LimitRow]:
    """The rows of the limits, at stable postures if there are any."""
    return [row for row in result.rows if not result.centres or row.scene in result.centres]


def headline(result: StabilityResult) -> Finding | None:
    """How many limits of the step are as predicted; of a file, whether its step is stable."""
    if "step_limits" in result.tables:
        return of_file.headline(result)
    counts = limits.summary(limits_shown(result))
    return result.finding("headline", **counts) if counts["known"] or counts["wrong"] else None


def figures(result: StabilityResult, robot: Robot) -> Iterator[Drawing]:
    # matplotlib is for the process that draws
    from . import figures_of_file
    from . import figures_stability as drawing

    if "step_limits" in result.tables:
        first = result.tables["step_limits"][0]
        if first.stable_at_file_dt is not None and first.of == "step":
            pushes = {row.push_rad_per_s for row in result.tables["stability_runs"]}
            yield partial(
                figures_of_file.draw_steps if len(pushes) > 1 else figures_of_file.draw_bars, result
            )
        return
    rows = limits_shown(result)
    if result.centres and any(row.predicted_dt or row.observed_dt for row in rows):
        yield partial(drawing.draw_limits, result, robot, rows)
    if "departure" in result.tables:
        yield partial(drawing.draw_departure, result, robot)
    if "stability_claims" in result.tables:
        yield partial(drawing.draw_claims, result, robot)


def overview(results: Mapping[str, StabilityResult], robot: Robot) -> Iterator[Drawing]:
    from .figures_stability import draw_overview  # matplotlib is for the process that draws

    result = results["stability"]
    rows = limits_shown(result)
    if any(row.predicted_dt or row.observed_dt or row.passed is False for row in rows):
        yield partial(draw_overview, result, robot, rows)
