"""Checks of the errors of the runs: the order of each method, MuJoCo against the same scheme in tmt, rounding."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.check import About, Result
from ...engines import Method
from ...judge.run import ORDER_MARGIN
from ...judge.scale import FACTOR

Floors = Mapping[str, float]  # {scene: error that rounding leaves, rad}

NEAR_ROUNDING = 30  # a smaller multiple of the error of rounding counts as rounding
SMALL_ERROR = (
    0.1  # rad: rounding changes a smaller error by no more than the growth of a small difference predicts
)
EARLY = 1.0  # s: until then chaos has not grown, and errors fall regularly
REGULAR, CLEAR = (
    3e-2,
    2e-12,
)  # rad: an error up to EARLY between these falls with its order, far above rounding
LEAST_ORDER = {8: 7.0}  # a bound only: with order 8 rounding comes before the measured order settles


def check_orders(result: Result, scenes: Sequence[str], methods: Sequence[Method]) -> list[dict]:
    """Rows and checks: the stated and the measured order of each method of fixed step.

    For a robot from a file only an order that has settled is checked.
    """
    table, of_file = [], result.curves.get("of_file")
    for scene in scenes:
        # the error of rounding, or of a reference in doubles, differs from robot to robot
        clear = max(CLEAR, NEAR_ROUNDING * result.curves["floors"][scene]) if of_file else CLEAR
        for method in methods:
            runs = rows_of_method(result.rows, scene, method.engine, method.name)
            regular = [row for row in runs if clear < row["early"] < REGULAR]
            settled = not of_file or method.order in LEAST_ORDER or has_settled(regular)
            if len(regular) < 2 or not settled:
                continue
            coarse, fine = regular[-2:]  # theory applies best to the finest
            order = order_between(coarse, fine)
            check_order(result, f"{scene}, {method.engine} {method.name}", method.order, order)
            row = {"scene": scene, "engine": method.engine, "method": method.name, "order": method.order}
            table.append(
                row | {"measured_order": order, "from_dt_s": coarse["dt_s"], "to_dt_s": fine["dt_s"]}
            )
    return table


def order_between(coarse: dict, fine: dict) -> float:
    """The order by which the error falls from one row to a finer one."""
    return float(np.log(coarse["early"] / fine["early"]) / np.log(coarse["dt_s"] / fine["dt_s"]))


def has_settled(rows: Sequence[dict]) -> bool:
    """Whether the last two measured orders of these rows, from coarse to fine, differ by at most ORDER_MARGIN."""
    return len(rows) > 2 and abs(order_between(*rows[-3:-1]) - order_between(*rows[-2:])) <= ORDER_MARGIN


def check_order(result: Result, where: str, order: int, measured: float) -> None:
    """The measured order is the method's; of order 8 it is at least 7."""
    if least := LEAST_ORDER.get(order):
        result.check(
            where,
            f"measured order, nominal {order}",
            measured,
            least,
            "",
            rule="at least",
            about=About.PREDICTION,
        )
    else:
        name, note = f"deviation from order {order}: error", f"{measured:.2f}"
        result.check(where, name, abs(measured - order), ORDER_MARGIN, "", note, about=About.PREDICTION)


def check_same_schemes(
    result: Result, floors: Floors, schemes: Mapping[str, Mapping[str, str]], unit: str = "rad"
) -> None:
    """MuJoCo's integrators and the same schemes in tmt make the same error, except for rounding.

    Checked where at least one of the errors is below 0.1 rad; a diverged run has the error inf.
    schemes: for each scene {integrator of MuJoCo: method of tmt}.
    """
    by_place = {(row["scene"], row["engine"], row["method"], row["dt_s"]): row for row in result.rows}
    for (scene, engine, method, dt), row in by_place.items():
        scheme = schemes[scene].get(method) if engine == "mujoco" and scene in floors else None
        ours = by_place.get((scene, "tmt", scheme, dt)) if scheme else None
        if ours and min(error(row), error(ours)) < SMALL_ERROR:
            difference = abs(error(row) - error(ours))
            where = f"{scene}, {method}, dt = {dt:.3g} s"
            quantity = f"the same error as tmt's {ours['method']}"
            result.check(where, quantity, difference, FACTOR * floors[scene], unit, rounding=True)


def check_smallest_errors(result: Result, floors: Floors, unit: str = "rad") -> None:
    """Where errors stop falling they are of the size of rounding; MuJoCo's RK4 is as exact as tmt's with the same steps."""
    for scene, left in floors.items():
        by_method = {}
        for engine, method in (("mujoco", "RK4"), ("tmt", "rk4"), ("tmt", "dopri8")):
            runs = rows_of_method(result.rows, scene, engine, method)
            by_method[method] = {row["dt_s"]: error(row) for row in runs}
            errors = list(by_method[method].values())
            least = min(errors, default=np.inf)
            if np.isfinite(least) and errors.index(least) < len(errors) - 1:
                quantity = f"smallest error of {engine}'s {method}, where smaller steps gain nothing"
                result.check(scene, quantity, least, FACTOR * left, unit, rounding=True)
        theirs = min(by_method["RK4"].values(), default=np.inf)
        finest = min(by_method["RK4"], default=np.inf)
        ours = min((error for dt, error in by_method["rk4"].items() if dt >= finest), default=np.inf)
        if np.isfinite([theirs, ours]).any() and by_method["rk4"]:
            tolerance = FACTOR * left + (2.0 * ours if np.isfinite(ours) else 0.0)
            result.check(
                scene, "smallest error of MuJoCo's RK4, compared with tmt's rk4", theirs, tolerance, unit
            )


def gained_nothing(error: float, work: int, best: float, last: int, left: float) -> bool:
    """Whether a run that cost more than the last one is not more exact, when the best error is already near rounding."""
    return best < NEAR_ROUNDING * left and work > 1.2 * last and not error < 0.7 * best


def error(row: dict) -> float:
    """The worst error of a run, rad; inf if it diverged."""
    return np.inf if row["diverged"] else row["worst_error_rad"]


def rows_of_method(rows: list[dict], scene: str, engine: str, method: str) -> list[dict]:
    """The rows of a method in a scene, from coarse to fine."""
    return [row for row in rows if (row["scene"], row["engine"], row["method"]) == (scene, engine, method)]
