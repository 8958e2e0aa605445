"""Stability: which step of a file is stable; of the arm, where each method fails, predicted from one step and in runs."""

from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import partial
from itertools import product
from typing import Any

from ...core.check import Result
from ...core.finding import Finding
from ...robots import Robot
from ...stability import push
from ...stability import runs as of_runs
from ...stability.equilibrium import equilibrium
from .. import Drawing
from ..setup import Setup
from . import claims, departure, limits, of_file
from .tables import SCHEMES, LimitRow, Runs, methods_of

DAMPINGS = (0.0, 0.5, 50.0)  # N m s/rad, added
FINE_STEPS = (1e-2, 1e-3)  # s, of departures, in addition to that of the claims


def claim_values(robot: Robot) -> dict[str, Any]:
    """The numbers of the definition, for its text."""
    names = "USUAL WAYS LASTS STILL STILLER AS_FAST FAST GROWS LONGER ELSEWHERE BY_CHANCE LONGEST WITHIN"
    numbers = vars(of_runs) | vars(push)
    return {name.lower(): numbers[name] for name in names.split()}


def skipped(robot: Robot) -> Finding | None:
    return None if robot.is_read or robot.claims else Finding("stability", "no_claims", {"noun": robot.noun})


def begin(setup: Setup) -> list[Runs]:
    """Start the runs."""
    return of_file.begin(setup, setup.reading) if setup.reading else begin_of_arm(setup)


def postures_of(robot: Robot, kind: str) -> list[str]:
    """The postures at which all modes swing (centre) or one grows (saddle), the robot's example first."""
    names = [name for name in robot.postures if equilibrium(robot, name).kind == kind]
    return sorted(names, key=lambda name: name != robot.kinds[kind])


def begin_of_arm(setup: Setup) -> list[Runs]:
    """A quick run takes fewer methods and scenes, and no fine steps."""
    robot, engines, of, stated = setup.robot, setup.engines, setup.of, claims.claims_of(setup.robot)
    centres, saddles = (postures_of(robot, kind) for kind in ("centre", "saddle"))
    few = methods_of(engines, SCHEMES)
    dts = [stated.dt, *of(FINE_STEPS, (), FINE_STEPS[:1])]
    if setup.size != "full":
        centres, saddles = centres[:1], saddles[:1]
    places = *product(centres, of(DAMPINGS, DAMPINGS[:1], DAMPINGS[:2])), *product(saddles, (0.0,))

    def runs(function: Callable[..., Any], items: Iterable[Any], judge: Any, **more: Any) -> Runs:
        return Runs(setup.map(partial(function, engines=engines, **more), items), judge)

    methods = {"methods": of(methods_of(engines), few, few)}
    steps = {"steps": of(limits.GROWTH_STEPS, limits.GROWTH_STEPS, limits.GROWTH_STEPS // 2)}
    at = [equilibrium(robot, *place) for place in places]
    saddle = {"at": equilibrium(robot, saddles[0]), "methods": few}
    begun = [
        runs(limits.limit_rows, at, limits.check_limits, **methods, **steps),
        runs(departure.departures, dts, departure.check_departures, **saddle),
        runs(claims.holding_torques, [robot], partial(claims.check_torques, robot=robot)),
    ]
    if not setup.is_quick:
        counts, finer = (
            of(claims.STEP_COUNTS, (), (32, 64, 128, 4096)),
            partial(claims.check_finer_steps, robot=robot),
        )
        begun.append(runs(claims.finer_steps, [robot], finer, counts=counts))
        ends = partial(claims.check_kept, robot=robot, ends=claims.accelerations_at_end(robot, engines))
        begun.append(runs(claims.kept, [robot], ends))
    return begun


def rows(setup: Setup, work: list[Runs] | None = None) -> Result:
    """Of a file the limits of its steps; of the arm limits, departures and the claims."""
    result = Result("stability")
    for runs in begin(setup) if work is None else work:
        runs.judge(result, [row for found in runs.rows for row in found])
    if not setup.reading:
        centres, saddles = (postures_of(setup.robot, kind) for kind in ("centre", "saddle"))
        names = [*setup.robot.postures]
        result.find("examined", noun=setup.robot.noun, centres=centres, saddle=saddles[0], names=names)
    result.tables = {name: table for name, table in result.tables.items() if table}
    return result


def limits_shown(result: Result) -> list[LimitRow]:
    """The rows of the limits at stable postures: at the others every step fails."""
    stable = {row.scene for row in result.rows if row.limit != "always_fails"}
    return [row for row in result.rows if row.scene in stable]


def headline(result: Result) -> Finding | None:
    """How many limits of the step are as predicted; of a file, whether its step is stable."""
    if "step_limits" in result.tables:
        return of_file.headline(result)
    return result.finding("headline", **limits.summary(limits_shown(result))) if result.rows else None


def figures(result: Result, robot: Robot) -> Iterator[Drawing]:
    # matplotlib is for the process that draws
    from . import figures_of_file
    from . import figures_stability as drawing

    if "step_limits" in result.tables:
        first = result.tables["step_limits"][0]
        if first.stable_at_file_dt is not None and first.of == "step":
            is_alone = len({row.push_rad_per_s for row in result.tables["stability_runs"]}) > 1
            yield partial(figures_of_file.draw_steps if is_alone else figures_of_file.draw_bars, result)
    elif result.rows:
        yield partial(drawing.draw_limits, result, limits_shown(result))
        yield partial(drawing.draw_departure, result, robot)
        yield partial(drawing.draw_claims, result, robot)


def overview(results: Mapping[str, Result], robot: Robot) -> Iterator[Drawing]:
    from .figures_stability import draw_overview  # matplotlib is for the process that draws

    if rows := limits_shown(results["stability"]):
        yield partial(draw_overview, results["stability"], rows)
