"""The order of a method, measured from the errors of runs with several steps, and its check."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.check import About, Check, Result

ORDER_MARGIN = 0.15  # of a measured order
LEAST_ORDER = {8: 7.0}  # a bound only: with order 8 rounding comes before the measured order settles


class MeasuredOrder(NamedTuple):
    """The order by which an error falls from a step to a finer one."""

    order: float  # not a number where an error is none; infinite where one is zero
    coarse: float  # s, the steps between which it is measured
    fine: float


def measured_order(
    steps: Sequence[float], errors: Sequence[float], least_runs: int = 2
) -> MeasuredOrder | None:
    """The order between the two finest of `least_runs` runs or more; None: fewer, or it has not settled.

    steps: s, from coarse to fine. errors: of these runs, without those in which it does not fall with the
    order. Where three runs or more are required, the order has settled if the last two orders differ by at
    most ORDER_MARGIN.
    """
    if len(steps) < least_runs:
        return None
    with np.errstate(divide="ignore", invalid="ignore"):
        orders = np.diff(np.log(errors)) / np.diff(np.log(steps))
    if least_runs > 2 and not abs(orders[-1] - orders[-2]) <= ORDER_MARGIN:
        return None
    return MeasuredOrder(float(orders[-1]), steps[-2], steps[-1])


def is_higher(measured: float, nominal: int) -> bool:
    """Whether an error falls faster than the method's order, as some do from a state without forces."""
    return measured > nominal + ORDER_MARGIN


def check_order(
    result: Result, where: str, nominal: int, measured: float, error: str = "error", note: str = "",
    twin: float | None = None,
) -> Check:  # fmt: skip
    """The order is at least the nominal one and that of a `twin`, tmt's same scheme: within ORDER_MARGIN.

    A higher order alone is no fault: the leading term of an error may vanish in a scene. Of order 8 it is at
    least 7.
    """
    if least := LEAST_ORDER.get(nominal):
        name = f"measured order, nominal {nominal}"
        return result.check(where, name, measured, least, "", rule="at least", about=About.PREDICTION)
    deviations = [max(nominal - measured, 0.0)]
    if twin is not None:
        deviations.append(abs(measured - twin))
        note = f"{measured:.2f}, tmt's same scheme {twin:.2f}"
    deviation = float(np.max(deviations)) if np.isfinite(measured) else np.nan  # not a number if one is none
    name = f"deviation from order {nominal}: {error}"
    return result.check(where, name, deviation, ORDER_MARGIN, "", note, about=About.PREDICTION)
