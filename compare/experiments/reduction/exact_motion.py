"""Both engines compared with an exact motion: the swing of a single free hinge, a physical pendulum."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt.exact.values import DIGITS, distance

from ...engines import LABELS
from ...judge.check import About, Result
from ...judge.run import MOVES, ORDER_MARGIN
from ...judge.scale import EPS, FACTOR
from ...robots.case import Case
from ...truth.pendulum import exact_swing, pendulum, swing
from ..setup import Setup
from .times import TWO_INTEGRATORS, method_of

SWING_STEPS = (4, 8, 16, 32, 64, 128)  # multiples of the case's own steps
IN_TABLE = 16  # the one of these whose error is in the table
MOST_SWING_STEPS = 2**20  # finer steps show rounding and no order
DIGITS_AT = 32  # equal times at which the elliptic function is compared with that of many digits
ROUNDED = 1e-11  # rad: smaller errors contain rounding
MUCH, NO_FORCE = 0.1, 1e-9  # shares of the largest torque of a swing: more, or less, at the start


def swings(result: Result, setup: Setup, cases: Sequence[Case]) -> None:
    """The errors of both engines against the elliptic function, for each case that is a physical pendulum."""
    for case in pendulums(cases):
        exact = elliptic(case)
        if reason := not_compared(case, exact):
            result.find("no_swing", scene=case.name, reason=reason, steps=case.steps, moved=float(np.ptp(exact)))
        else:
            compare_swing(result, setup, case, exact)


def pendulums(cases: Sequence[Case]) -> list[Case]:
    """The cases in which one hinge is free and only gravity acts."""
    return [
        case
        for case in cases
        if (len(case.joints) == 1 and case.coordinates.all_kinds == ("hinge",) and case.is_free and case.scene.gravity)
        and not (any(case.tree.damping) or case.tree.has_springs)
    ]


def times_of(case: Case) -> np.ndarray:
    """The times at which a pendulum is compared, s."""
    return np.linspace(0.0, case.duration, SWING_STEPS[0] * case.steps + 1)


def elliptic(case: Case) -> np.ndarray:
    """The exact angle at these times, rad; NaN if it turns over."""
    (q,), (v,), t = *case.start, times_of(case)
    hanging, frequency = pendulum(case.tree)
    return swing(t, q, v, hanging, frequency) if frequency else np.full_like(t, np.nan)


def not_compared(case: Case, exact: np.ndarray) -> str | None:
    """Why a pendulum with this exact motion (times,) rad is not compared with it, or None."""
    if not np.isfinite(exact).all():
        return "turns_over"
    if np.ptp(exact) < MOVES:
        return "hardly_moves"
    return "fine_steps" if SWING_STEPS[-1] * case.steps > MOST_SWING_STEPS else None


def compare_swing(result: Result, setup: Setup, case: Case, exact: np.ndarray) -> None:
    """Checks: errors fall at the method's order; the elliptic function in doubles is accurate."""
    (q,), (v,), t = *case.start, times_of(case)
    hanging, frequency = pendulum(case.tree)
    few = slice(None, None, len(t) // DIGITS_AT)
    off = distance(exact[few], exact_swing(t[few], q, v, hanging, frequency)).max()
    # rounding of the angle itself, and of the argument times the fastest rate
    check_function(result, case.name, off, np.abs(exact).max() + 2.0 * frequency * case.duration)
    engines, errors, stated = setup.compared(case), {}, {}
    for integrator in TWO_INTEGRATORS:
        stated[integrator] = order_from(setup.engines["mujoco"].methods[integrator].order, exact - hanging)
        for finer in SWING_STEPS:
            steps = finer * case.steps
            for engine, dynamics in engines.items():
                method = method_of(setup.engines, integrator, engine)
                path = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method).q
                error = float(np.abs(path[:: finer // SWING_STEPS[0], 0] - exact).max())
                errors.setdefault((engine, integrator), []).append(error)
                if finer == IN_TABLE:
                    result.curves["apart"][case.name, engine, integrator] = error
    orders = check_falling(result, case.name, errors, stated)
    dt = case.duration / case.steps / np.array(SWING_STEPS)
    result.curves["swings"][case.name] = {"dt": dt, "errors": errors, "orders": orders, "stated": stated}


def order_from(order: int, angles: np.ndarray) -> int | None:
    """The order of the error of a method of this order in a swing; angles: from where it hangs, (times,) rad.

    Semi-implicit Euler is leapfrog, of order 2, except for half a kick at the start: without force there, its error has order 2;
    with little force it has no order (None), since both parts are of the same size.
    """
    force = np.abs(np.sin(angles))
    if order > 1 or force[0] >= MUCH * force.max():
        return order
    return 2 if force[0] <= NO_FORCE * force.max() else None


def check_function(result: Result, scene: str, off: float, scale: float) -> None:
    """The elliptic function in doubles is that with 50 digits, except for rounding. off, scale: rad."""
    name = f"elliptic function, scipy to {DIGITS} digits"
    result.check(scene, name, off, FACTOR * EPS * scale, "rad", rounding=True, about=About.PREDICTION)


def check_falling(
    result: Result, scene: str, errors: Mapping[tuple, Sequence[float]], stated: Mapping[str, int | None]
) -> dict:
    """Errors fall at the method's order. errors: {(engine, integrator): rad, each step half the last}; measured orders.

    stated: the order of each integrator, or None. Measured between the last two errors above 1e-11 rad; with fewer than two no
    order can be measured.
    """
    orders = {}
    for (engine, integrator), values in errors.items():
        clear = np.argmin(
            [*(not value <= ROUNDED for value in values), False]
        )  # errors above rounding, from the first on
        where, order = f"{scene}, {integrator}, {LABELS[engine]}", stated[integrator]
        if order is None or clear < 2:
            result.find("no_order", where=where, has_none=order is None)
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            orders[engine, integrator] = float(np.log2(np.divide(values[clear - 2], values[clear - 1])))
        off = abs(orders[engine, integrator] - order)
        name = f"deviation from order {order}: error from the elliptic function"
        result.check(where, name, off, ORDER_MARGIN, "", about=About.PREDICTION)
    return orders
