"""Both engines compared with an exact motion: the swing of a single free hinge, a physical pendulum."""

from collections.abc import Sequence

import numpy as np

from ...core.check import About, Result
from ...engines import LABELS
from ...judge.run import MOVES, ORDER_MARGIN
from ...robots.case import Case
from ...truth.pendulum import pendulum, swing
from ..setup import Setup
from .times import rk4_of

SWING_STEPS = (4, 8, 16, 32, 64, 128)  # multiples of the case's own steps
IN_TABLE = 16  # the one of these whose error is in the table
ROUNDED = 1e-11  # rad: smaller errors contain rounding


def pendulums(cases: Sequence[Case]) -> list[Case]:
    """The cases in which one hinge is free and only gravity acts."""
    return [
        case
        for case in cases
        if (
            len(case.joints) == 1
            and case.coordinates.all_kinds == ("hinge",)
            and case.is_free
            and case.scene.gravity
        )
        and not (any(case.tree.damping) or case.tree.has_springs)
    ]


def compare_swing(result: Result, setup: Setup, case: Case) -> None:
    """Errors of RK4 against the elliptic function fall at its order; not where the hinge turns over or hardly moves."""
    (q,), (v,), t = *case.start, np.linspace(0.0, case.duration, SWING_STEPS[0] * case.steps + 1)
    hanging, frequency = pendulum(case.tree)
    exact = swing(t, q, v, hanging, frequency) if frequency else np.full_like(t, np.nan)
    if not np.ptp(exact) >= MOVES:  # NaN where it turns over
        return
    errors = {}
    for engine, dynamics in setup.compared(case).items():
        method = rk4_of(setup.engines, engine).name
        for finer in SWING_STEPS:
            steps = finer * case.steps
            path = dynamics.run(*case.start, case.tau, case.duration / steps, steps, method).q
            error = float(np.abs(path[:: finer // SWING_STEPS[0], 0] - exact).max())
            errors.setdefault(engine, []).append(error)
            if finer == IN_TABLE:
                result.curves["apart"][case.name, engine] = error
    orders = check_falling(result, case.name, errors, setup.engines["mujoco"].methods["RK4"].order)
    dt = case.duration / case.steps / np.array(SWING_STEPS)
    result.curves["swings"][case.name] = {"dt": dt, "errors": errors, "orders": orders}


def check_falling(
    result: Result, scene: str, errors: dict[str, Sequence[float]], order: int
) -> dict[str, float]:
    """Errors fall at the method's order; the measured orders. errors: {engine: rad, each step half the last}.

    Measured between the last two errors above 1e-11 rad; with fewer than two there is no check.
    """
    orders = {}
    for engine, values in errors.items():
        clear = np.argmin(
            [*(not value <= ROUNDED for value in values), False]
        )  # above rounding, from the first on
        if clear < 2:
            continue
        with np.errstate(divide="ignore", invalid="ignore"):
            orders[engine] = float(np.log2(np.divide(values[clear - 2], values[clear - 1])))
        name = f"deviation from order {order}: error from the elliptic function"
        off = abs(orders[engine] - order)
        result.check(f"{scene}, RK4, {LABELS[engine]}", name, off, ORDER_MARGIN, "", about=About.PREDICTION)
    return orders
