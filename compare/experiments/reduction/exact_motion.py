"""Both engines compared with an exact motion: the swing of a single free hinge, a physical pendulum."""

from collections.abc import Mapping, Sequence

import numpy as np

from ...core.check import Result
from ...engines import LABELS, same_scheme
from ...judge.order import check_order, measured_order
from ...judge.run import MOVES
from ...robots.case import Case
from ...truth.pendulum import pendulum, swing
from ..setup import Setup
from .records import ReductionResult

SWING_STEPS = (4, 8, 16, 32, 64, 128)  # multiples of the case's own steps
ORDER = 4  # of RK4
ROUNDED = 1e-11  # rad: smaller errors contain rounding


def is_pendulum(case: Case) -> bool:
    """Whether one hinge is free and only gravity acts."""
    is_hinge = case.coordinates.all_kinds == ("hinge",)
    is_forced = any(case.tree.damping) or case.tree.has_springs
    return is_hinge and case.is_free and case.scene.gravity and not is_forced


def compare_swing(result: ReductionResult, setup: Setup, case: Case) -> None:
    """Errors of RK4 fall at its order; not checked where the hinge turns over or hardly moves."""
    (q,), (v,), t = *case.start, np.linspace(0.0, case.duration, SWING_STEPS[0] * case.steps + 1)
    hanging, frequency = pendulum(case.tree)
    exact = swing(t, q, v, hanging, frequency) if frequency else np.full_like(t, np.nan)
    if not np.ptp(exact) >= MOVES:  # NaN where it turns over
        return
    dt = [case.duration / case.steps / finer for finer in SWING_STEPS]
    errors: dict[str, list[float]] = {}
    for engine, dynamics in setup.compared(case).items():
        scheme = setup.engines["mujoco"].methods["RK4"]
        method, errors[engine] = same_scheme(setup.engines, scheme, engine).name, []
        for finer, step in zip(SWING_STEPS, dt):
            path = dynamics.run(*case.start, case.tau, step, finer * case.steps, method).q
            errors[engine].append(float(np.abs(path[:: finer // SWING_STEPS[0], 0] - exact).max()))
    orders = check_falling(result, case.name, dt, errors)
    engines = [(LABELS[name], orders.get(name), values[-1]) for name, values in errors.items()]
    result.find("swing", scene=case.name, engines=engines)


def check_falling(
    result: Result, scene: str, dt: Sequence[float], errors: Mapping[str, Sequence[float]]
) -> dict[str, float]:
    """The orders at which errors, rad, fall, and their checks: between the last two of at least ROUNDED."""
    orders = {}
    for engine, values in errors.items():
        is_rounded = [value <= ROUNDED for value in values]
        clear = [*is_rounded, True].index(True)  # the errors above rounding, from the first on
        measured = measured_order(dt[:clear], values[:clear])
        if measured:
            orders[engine] = measured.order
            where = f"{scene}, RK4, {LABELS[engine]}"
            check_order(result, where, ORDER, measured.order, "error from the elliptic function")
    return orders
