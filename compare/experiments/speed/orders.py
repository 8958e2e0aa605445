"""The order of each method of fixed step, measured where its errors fall regularly."""

from collections.abc import Sequence

import numpy as np

from ...engines import Method
from ...judge.check import About, Result
from ...judge.run import ORDER_MARGIN
from .accuracy import NEAR_ROUNDING, rows_of_method

EARLY = 1.0  # s: until then chaos has not grown, and errors fall regularly
REGULAR, CLEAR = 3e-2, 2e-12  # rad: an error up to EARLY between these falls with its order, far above rounding
LEAST_ORDER = {8: 7.0}  # a bound only: with order 8 rounding comes before the measured order settles


def orders(result: Result, scenes: Sequence[str], methods: Sequence[Method], complete: bool = True) -> list[dict]:
    """Rows and checks: the stated and the measured order of each method of fixed step.

    complete: every method must show its order in at least one scene (coarse steps of a quick run do not allow that), unless
    its coarsest steps are already near rounding. For a robot from a file only an order that has settled is checked.
    """
    table, unsettled, of_file = [], [], result.curves.get("of_file")
    for scene in scenes:
        # the error of rounding, or of a reference in doubles, differs from robot to robot
        clear = max(CLEAR, NEAR_ROUNDING * result.curves["floors"][scene]) if of_file else CLEAR
        for method in methods:
            runs = rows_of_method(result.rows, scene, method.engine, method.name)
            regular = [row for row in runs if clear < row["early"] < REGULAR]
            if len(regular) < 2:
                continue
            if of_file and method.order not in LEAST_ORDER and not has_settled(regular):
                unsettled.append(f"{scene}, {method.engine} {method.name}")
                continue
            coarse, fine = regular[-2:]  # theory applies best to the finest
            order = order_between(coarse, fine)
            check_order(result, f"{scene}, {method.engine} {method.name}", method.order, order)
            row = {"scene": scene, "engine": method.engine, "method": method.name, "order": method.order}
            table.append(row | {"measured_order": order, "from_dt_s": coarse["dt_s"], "to_dt_s": fine["dt_s"]})
    if unsettled:
        result.find("orders_not_settled", runs=unsettled, margin=ORDER_MARGIN)
    for method in methods if complete else ():
        shown = sum((row["engine"], row["method"]) == (method.engine, method.name) for row in table)
        if shown or not near_rounding(result, scenes, method):
            name, where = "scenes that show its order", f"{method.engine} {method.name}"
            result.check(where, name, shown, 1, "scenes", rule="at least", about=About.PREDICTION)
    return table


def order_between(coarse: dict, fine: dict) -> float:
    """The order by which the error falls from one row to a finer one."""
    return float(np.log(coarse["early"] / fine["early"]) / np.log(coarse["dt_s"] / fine["dt_s"]))


def has_settled(rows: Sequence[dict]) -> bool:
    """Whether the last two measured orders of these rows, from coarse to fine, differ by at most ORDER_MARGIN.

    An error C dt^p (1 + c dt) gives a measured order that differs from p by c dt / ln 4, half as much with half the step: the
    last change of the order is its distance from p.
    """
    return len(rows) > 2 and abs(order_between(*rows[-3:-1]) - order_between(*rows[-2:])) <= ORDER_MARGIN


def near_rounding(result: Result, scenes: Sequence[str], method: Method) -> bool:
    """Whether half the coarsest steps of a method would already show rounding."""
    runs = (rows_of_method(result.rows, scene, method.engine, method.name) for scene in scenes)
    firsts = [of_scene[0]["early"] for of_scene in runs if of_scene]
    return bool(firsts) and all(first < CLEAR * 2.0**method.order for first in firsts)


def check_order(result: Result, where: str, order: int, measured: float) -> None:
    """The measured order is the method's; of order 8 it is at least 7."""
    least = LEAST_ORDER.get(order)
    if least is None:
        name, note = f"deviation from order {order}: error", f"{measured:.2f}"
        result.check(where, name, abs(measured - order), ORDER_MARGIN, "", note, about=About.PREDICTION)
    else:
        result.check(
            where, f"measured order, nominal {order}", measured, least, "", rule="at least", about=About.PREDICTION
        )
