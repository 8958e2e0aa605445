"""What follows from errors and times: checks of orders, same schemes and rounding; the cheapest settings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby, product

import numpy as np

from ...core.rows import MOVEMENT, MovementRow, Row, column
from ...engines import RECORDS
from ...judge.order import LEAST_ORDER, MeasuredOrder, check_order, is_higher, measured_order
from ...judge.scale import EPS, FACTOR
from .runs import EARLY, RunRow, SceneRuns, SpeedResult, same_scheme

REGULAR = 3e-2  # rad: a smaller error up to EARLY falls with the order of the method
SMALL_ERROR = 0.1  # rad: a smaller error is changed by rounding by no more than a small difference grows
CLEAR = 2e-12  # rad: an error up to EARLY above this is far above rounding
CLEAR_EPS = 100.0  # the same of an engine in another precision, its eps, and an eps of each step
NEAR_ROUNDING = 30  # a smaller multiple of the error of rounding counts as rounding
TARGETS = (1e-3, 1e-6, 1e-9)  # rad or m, worst error of a run
TARGET = 1e-6  # rad or m: the error for which the first screen has the cheapest settings
OF_RUN = (  # fields of a UseRow that are those of a RunRow
    "method", "dt", "tolerance", "steps", "extrapolated", "evaluations", "worst_error", "energy_error",
)  # fmt: skip
NOT_SOLVED = 1.0  # rad or m: a run with a larger error is none


@dataclass
class OrderRow(Row):
    scene: str
    engine: str
    method: str
    order: int
    measured_order: float
    from_dt: float = column("s", digits=5)
    to_dt: float = column("s", digits=5)


def check_orders(result: SpeedResult, scenes: Sequence[SceneRuns], engines: Sequence[str]) -> list[OrderRow]:
    """Rows and checks: the stated and the measured order of each method of fixed step of these engines."""
    table = []
    for scene in scenes:
        orders: list[tuple[RunRow, MeasuredOrder]] = []
        higher: list[OrderRow] = []  # with the same order as tmt's
        for _, group in groupby(scene.rows, key=lambda row: (row.engine, row.method)):
            rows = [row for row in group if row.order and row.engine in engines]
            if rows and (measured := order_in(scene, rows)):
                orders.append((rows[0], measured))
        by_tmt = {row.scheme: measured.order for row, measured in orders if row.engine == "tmt"}
        tried = {row.scheme for row in scene.rows if row.engine == "tmt" and scene.case.robot.is_read}
        # where tmt's same scheme has not settled at finer steps, one has not settled at coarse ones
        unsettled = tried - by_tmt.keys() if "tmt" in engines else set()
        for row, measured in orders:
            if row.scheme in unsettled:
                continue
            where, note = f"{scene.case.name}, {row.engine} {row.method}", f"{measured.order:.2f}"
            twin, order = by_tmt.get(row.scheme) if row.engine != "tmt" else None, row.order or 0
            check = check_order(result, where, order, measured.order, note=note, twin=twin)
            table.append(OrderRow(scene.case.name, row.engine, row.method, order, *measured))
            if check.passed and order not in LEAST_ORDER and is_higher(measured.order, order):
                higher.append(table[-1])
        if higher:
            result.find("higher", scene=scene.case.name, rows=higher)
    return table


def order_in(scene: SceneRuns, rows: Sequence[RunRow]) -> MeasuredOrder | None:
    """The order of a method where its errors are regular; where they are less well known, one that has settled."""
    record, clear, least_runs = RECORDS[rows[0].engine], CLEAR, 2
    if scene.case.robot.is_read:  # the error of rounding, or of the reference, differs from robot to robot
        clear, least_runs = max(CLEAR, NEAR_ROUNDING * scene.floor), 3
    if record.reads_file:
        least_runs = 4
    if rows[0].order in LEAST_ORDER:
        least_runs = 2
    known = [(row.dt, row.early_error, clear) for row in rows if row.dt and row.early_error is not None]
    if record.eps > EPS:
        known = [(dt, error, max(clear, max(CLEAR_EPS, EARLY / dt) * record.eps)) for dt, error, _ in known]
    regular = [(dt, error) for dt, error, least in known if least < error < REGULAR]
    return measured_order([dt for dt, _ in regular], [error for _, error in regular], least_runs)


def check_same_schemes(result: SpeedResult, scene: SceneRuns) -> None:
    """MuJoCo's integrators and the same schemes in tmt make the same error, up to half an eps a step."""
    for row in [row for row in scene.rows if row.engine == "mujoco"]:
        twin = same_scheme(scene.rows, row)
        if twin and min(row.largest_error, twin.largest_error) < SMALL_ERROR:
            difference = abs(row.largest_error - twin.largest_error)
            where = f"{scene.case.name}, {row.method}, dt = {row.dt:.3g} s"
            quantity = f"the same error as tmt's {twin.method}"
            tolerance = max(FACTOR, (row.steps or 0) / 2.0) * scene.floor
            result.check(where, quantity, difference, tolerance, result.unit, rounding=True)


def check_smallest_errors(result: SpeedResult, scene: SceneRuns) -> None:
    """Errors that stop falling are rounding; MuJoCo's RK4 is as exact as tmt's with the same steps."""
    rounding = FACTOR * scene.floor
    rk4 = check_stopped(result, scene, "mujoco", "RK4", rounding)
    rk4_of_tmt = check_stopped(result, scene, "tmt", "rk4", rounding)
    check_stopped(result, scene, "tmt", "dopri8", rounding)
    least, finest = min(rk4.values(), default=np.inf), min(rk4, default=np.inf)
    least_of_tmt = min((error for dt, error in rk4_of_tmt.items() if dt >= finest), default=np.inf)
    if np.isfinite([least, least_of_tmt]).any() and rk4_of_tmt:
        tolerance = rounding + (2.0 * least_of_tmt if np.isfinite(least_of_tmt) else 0.0)
        quantity = "smallest error of MuJoCo's RK4, compared with tmt's rk4"
        result.check(scene.case.name, quantity, least, tolerance, result.unit)


def check_stopped(
    result: SpeedResult, scene: SceneRuns, engine: str, method: str, rounding: float
) -> dict[float, float]:
    """The errors of a method by its step. Checks the smallest one, if finer steps gain nothing."""
    rows = [row for row in scene.rows if (row.engine, row.method) == (engine, method)]
    errors = {row.dt: row.largest_error for row in rows if row.dt}
    least = min(errors.values(), default=np.inf)
    if np.isfinite(least) and [*errors.values()].index(least) < len(errors) - 1:
        quantity = f"smallest error of {engine}'s {method}, where smaller steps gain nothing"
        result.check(scene.case.name, quantity, least, rounding, result.unit, rounding=True)
    return errors


@dataclass(kw_only=True)
class UseRow(MovementRow):
    """The cheapest setting of an engine for an error in a scene; without a method: no setting reaches it."""

    scene: str
    target: float = column(MOVEMENT)
    engine: str
    method: str | None = None
    dt: float | None = column("s", digits=5, default=None)
    tolerance: float | None = None
    steps: int | None = None
    ms: float | None = None
    extrapolated: bool | None = None  # from the time of the first steps
    evaluations: int | None = None
    worst_error: float | None = column(MOVEMENT, default=None)
    energy_error: float | None = column("J", default=None)
    over_cheapest: float | None = None  # its time over that of the cheapest engine
    over_same_scheme: float | None = None  # its time over that of tmt's same scheme with the same step


def cheapest(rows: Sequence[RunRow], target: float = math.inf, **where: object) -> RunRow | None:
    """The run with an error of at most `target`, rad or m, that takes the least time. where: fields of its row."""
    timed = (row for row in rows if row.largest_error <= target and row.time < math.inf)
    fit = [row for row in timed if all(getattr(row, name) == value for name, value in where.items())]
    return min(fit, key=lambda row: row.time, default=None)


def what_to_use(result: SpeedResult) -> list[UseRow]:
    """For each scene and error the cheapest setting of each engine that has runs there, the cheapest engine first."""
    table = []
    for scene, target in product(result.floors, TARGETS):
        rows = [row for row in result.rows if row.scene == scene and row.why_not is None]
        engines = dict.fromkeys(row.engine for row in rows)
        uses = [UseRow(scene=scene, target=target, engine=name, unit=result.unit) for name in engines]
        best = [cheapest(rows, target, engine=use.engine) for use in uses]
        least = min((row.time for row in best if row), default=math.inf)
        for use, row in zip(uses, best):
            if row is None:
                continue
            for name in OF_RUN:
                setattr(use, name, getattr(row, name))
            twin = same_scheme(rows, row)
            use.ms, use.over_cheapest = 1e3 * row.time, row.time / least
            use.over_same_scheme = row.time / twin.time if twin else None
        table += sorted(uses, key=lambda use: math.inf if use.ms is None else use.ms)
    return table


def front(rows: Sequence[RunRow]) -> list[RunRow]:
    """The rows than which no other is both faster and more exact, from the fastest to the most exact."""
    best: list[RunRow] = []
    least = NOT_SOLVED
    for row in sorted(rows, key=lambda row: (row.time, row.largest_error)):
        if row.largest_error < least and row.time < math.inf:
            best, least = [*best, row], row.largest_error
    return best
