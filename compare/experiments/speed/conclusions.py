"""What follows from errors and times: checks of orders, same schemes and rounding; the cheapest settings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np

from ...core.rows import MOVEMENT, MovementRow, Row, column
from ...engines import Method
from ...judge.order import LEAST_ORDER, MeasuredOrder, check_order, is_higher, measured_order
from ...judge.scale import FACTOR
from ..followed import REGULAR
from .runs import NEAR_ROUNDING, Run, SceneRuns, SpeedResult, SpeedRow

SMALL_ERROR = 0.1  # rad: a smaller error is changed by rounding by no more than a small difference grows
CLEAR = 2e-12  # rad: an error up to EARLY above this is far above rounding
TARGETS = (1e-2, 1e-3, 1e-6, 1e-9, 1e-12)  # rad or m, worst error of a run
TARGET = 1e-6  # rad or m: the error for which the first screen has the cheapest setting
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
    rows = []
    for scene in scenes:
        orders: list[tuple[Method, int, MeasuredOrder]] = []
        higher: list[OrderRow] = []  # with the same order as tmt's
        for method, runs in groupby(scene.runs, key=lambda run: run.method):
            measured = order_in(scene, list(runs)) if method.order and method.engine in engines else None
            if method.order and measured:
                orders.append((method, method.order, measured))
        by_tmt = {method.scheme: measured.order for method, _, measured in orders if method.engine == "tmt"}
        for method, order, measured in orders:
            where, note = f"{scene.case.name}, {method.engine} {method.name}", f"{measured.order:.2f}"
            twin = by_tmt.get(method.scheme) if method.engine != "tmt" else None
            check = check_order(result, where, order, measured.order, note=note, twin=twin)
            rows.append(OrderRow(scene.case.name, method.engine, method.name, order, *measured))
            if check.passed and order not in LEAST_ORDER and is_higher(measured.order, order):
                higher.append(rows[-1])
        if higher:
            result.find("higher", scene=scene.case.name, rows=higher)
    return rows


def order_in(scene: SceneRuns, runs: Sequence[Run]) -> MeasuredOrder | None:
    """The order of a method where its errors are regular; of a robot from a file, one that has settled."""
    clear, least_runs = CLEAR, 2
    if scene.case.robot.is_read:  # the error of rounding, or of the reference, differs from robot to robot
        clear, least_runs = max(CLEAR, NEAR_ROUNDING * scene.floor), 3
    regular = [run for run in runs if clear < run.early < REGULAR]
    least_runs = 2 if runs[0].method.order in LEAST_ORDER else least_runs
    return measured_order([run.dt for run in regular], [run.early for run in regular], least_runs)


def check_same_schemes(result: SpeedResult, scene: SceneRuns) -> None:
    """MuJoCo's integrators and the same schemes in tmt make the same error, up to half an eps a step."""
    by_tmt = {(run.method.name, run.row.dt): run.row for run in scene.runs if run.method.engine == "tmt"}
    for run in scene.runs:
        mujoco, twin = run.row, by_tmt.get((run.method.scheme, run.row.dt))
        if mujoco.engine == "mujoco" and twin and min(mujoco.largest_error, twin.largest_error) < SMALL_ERROR:
            difference = abs(mujoco.largest_error - twin.largest_error)
            where = f"{scene.case.name}, {mujoco.method}, dt = {run.dt:.3g} s"
            quantity = f"the same error as tmt's {twin.method}"
            tolerance = max(FACTOR, (mujoco.steps or 0) / 2.0) * scene.floor
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
    runs = [run for run in scene.runs if (run.method.engine, run.method.name) == (engine, method)]
    errors = {run.dt: run.row.largest_error for run in runs}
    least = min(errors.values(), default=np.inf)
    if np.isfinite(least) and [*errors.values()].index(least) < len(errors) - 1:
        quantity = f"smallest error of {engine}'s {method}, where smaller steps gain nothing"
        result.check(scene.case.name, quantity, least, rounding, result.unit, rounding=True)
    return errors


@dataclass(kw_only=True)
class AdviceRow(MovementRow):
    """The cheapest settings for an error in a scene.

    ratio: MuJoCo's time over tmt's. It is the product of integrator_part (MuJoCo's cheapest over its RK4),
    kernel_part (MuJoCo's RK4 over tmt's with the same step) and method_part (that over tmt's cheapest).
    """

    scene: str
    target: float = column(MOVEMENT)
    ratio: float | None
    integrator_part: float | None
    kernel_part: float | None
    method_part: float | None
    mujoco: str
    mujoco_dt: float | None = column("s", digits=5)
    mujoco_ms: float | None
    mujoco_evaluations: int | None
    tmt: str
    tmt_dt: float | None = column("s", digits=5)
    tmt_ms: float | None
    tmt_evaluations: int | None
    of_all: str
    of_all_dt: float | None = column("s")
    of_all_ms: float | None
    of_all_evaluations: int | None


def advice(result: SpeedResult) -> list[AdviceRow]:
    """For each scene and error the cheapest setting of MuJoCo, of tmt and of all."""
    table = []
    for scene in result.floors:
        rows = [row for row in result.rows if row.scene == scene and not row.diverged]
        for target in TARGETS:
            reach = reaching(rows, target)
            mujoco, tmt = cheapest(reach, "mujoco"), cheapest(reach, "tmt")
            rk4 = cheapest(reach, "mujoco", "RK4")
            same_step = cheapest([row for row in rows if rk4 and row.dt == rk4.dt], "tmt", "rk4")
            ratios: dict[str, Any] = {"ratio": ratio(mujoco, tmt), "integrator_part": ratio(mujoco, rk4)}
            ratios |= {"kernel_part": ratio(rk4, same_step), "method_part": ratio(same_step, tmt)}
            settings = setting("mujoco", mujoco) | setting("tmt", tmt) | setting("of_all", cheapest(reach))
            table.append(AdviceRow(scene=scene, target=target, unit=result.unit, **ratios, **settings))
    return table


def setting(name: str, row: SpeedRow | None) -> dict[str, Any]:
    """The fields of an AdviceRow that describe a setting."""
    if row is None:
        return {name: "none", f"{name}_dt": None, f"{name}_ms": None, f"{name}_evaluations": None}
    steps = f"{row.steps} steps" if row.dt else f"tolerance {row.tolerance:.0e}"
    of_run = {f"{name}_dt": row.dt, f"{name}_ms": 1e3 * row.time, f"{name}_evaluations": row.evaluations}
    return {name: f"{row.engine} {row.method}, {steps}"} | of_run


def cheapest(rows: Sequence[SpeedRow], engine: str = "", method: str = "") -> SpeedRow | None:
    """The run that takes the least time, of all or of an engine or method."""
    fit = [row for row in rows if engine in ("", row.engine) and method in ("", row.method)]
    return min(fit, key=lambda row: row.time, default=None)


def ratio(slow: SpeedRow | None, fast: SpeedRow | None) -> float | None:
    return slow.time / fast.time if slow and fast else None


def front(rows: Sequence[SpeedRow]) -> list[SpeedRow]:
    """The rows than which no other is both faster and more exact, from the fastest to the most exact."""
    best: list[SpeedRow] = []
    least = NOT_SOLVED
    for row in sorted(rows, key=lambda row: (row.time, row.largest_error)):
        if row.largest_error < least:
            best.append(row)
            least = row.largest_error
    return best


def best_rows(result: SpeedResult) -> dict[str, list[SpeedRow]]:
    """The front of each engine that computed the scene in which errors are regular."""
    of_engine: dict[str, list[SpeedRow]] = {}
    for row in result.rows:
        if row.scene == result.regular and row.time < math.inf:
            of_engine.setdefault(row.engine, []).append(row)
    return {engine: best for engine, rows in of_engine.items() if (best := front(rows))}


def reaching(rows: Sequence[SpeedRow], target: float) -> list[SpeedRow]:
    return [row for row in rows if row.largest_error <= target]


def cheapest_settings(result: SpeedResult) -> dict[str, Any]:
    """For TARGET where errors are regular: the cheapest of all engines and of MuJoCo (else tmt)."""
    reach = reaching([row for row in result.rows if row.scene == result.regular], TARGET)
    first = cheapest(reach)
    other = "tmt" if first and first.engine == "mujoco" else "mujoco"
    about = {"scene": result.regular, "unit": result.unit, "servos_off": result.servos_off, "target": TARGET}
    return about | {"settings": [row for row in (first, cheapest(reach, other)) if row]}
