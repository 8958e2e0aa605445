"""Checks of errors: the order of each method, MuJoCo against the same scheme in tmt, rounding."""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby

import numpy as np

from ...core.rows import Row, column
from ...judge.order import LEAST_ORDER, MeasuredOrder, check_order, measured_order
from ...judge.scale import FACTOR
from ..followed import REGULAR
from .runs import NEAR_ROUNDING, Run, SceneRuns, SpeedResult

SMALL_ERROR = 0.1  # rad: a smaller error is changed by rounding by no more than a small difference grows
CLEAR = 2e-12  # rad: an error up to EARLY above this is far above rounding


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
        for method, runs in groupby(scene.runs, key=lambda run: run.method):
            measured = order_in(scene, list(runs)) if method.order and method.engine in engines else None
            if measured:
                where, note = f"{scene.case.name}, {method.engine} {method.name}", f"{measured.order:.2f}"
                check_order(result, where, method.order, measured.order, note=note)
                rows.append(OrderRow(scene.case.name, method.engine, method.name, method.order, *measured))
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
    """MuJoCo's integrators and the same schemes in tmt make the same error, except for rounding."""
    by_tmt = {(run.method.name, run.row.dt): run.row for run in scene.runs if run.method.engine == "tmt"}
    for run in scene.runs:
        mujoco, twin = run.row, by_tmt.get((run.method.scheme, run.row.dt))
        if mujoco.engine == "mujoco" and twin and min(mujoco.largest_error, twin.largest_error) < SMALL_ERROR:
            difference = abs(mujoco.largest_error - twin.largest_error)
            where = f"{scene.case.name}, {mujoco.method}, dt = {run.dt:.3g} s"
            quantity = f"the same error as tmt's {twin.method}"
            result.check(where, quantity, difference, FACTOR * scene.floor, result.unit, rounding=True)


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
