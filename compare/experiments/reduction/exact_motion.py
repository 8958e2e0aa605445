"""Both engines compared with an exact motion: the swing of a single free hinge, a physical pendulum."""

import numpy as np

from ...core.check import Result
from ...engines import LABELS, same_scheme
from ...judge.order import check_order
from ...judge.run import MOVES
from ...robots.case import Case
from ...truth.pendulum import pendulum, swing
from ..setup import Setup

COARSE, FINE = 32, 64  # multiples of the steps of the case
ORDER = 4  # of RK4
ROUNDED = 1e-11  # rad: smaller errors contain rounding


def is_pendulum(case: Case) -> bool:
    """Whether one hinge is free and only gravity acts."""
    is_hinge = case.coordinates.all_kinds == ("hinge",)
    is_forced = any(case.tree.damping) or case.tree.has_springs
    return is_hinge and case.is_free and case.scene.gravity and not is_forced


def compare_swing(result: Result, setup: Setup, case: Case) -> None:
    """The error of RK4 falls at its order; not checked where the hinge turns over or hardly moves."""
    (q,), (v,), t = *case.start, np.linspace(0.0, case.duration, case.steps + 1)
    hanging, frequency = pendulum(case.tree)
    exact = swing(t, q, v, hanging, frequency) if frequency else np.full_like(t, np.nan)
    if not np.ptp(exact) >= MOVES:  # NaN where it turns over
        return
    engines: list[tuple[str, float | None, float]] = []
    twin: float | None = None
    for engine, dynamics in setup.compared(case).items():
        method = same_scheme(setup.engines, setup.engines["mujoco"].methods["RK4"], engine).name
        errors = []
        for finer in (COARSE, FINE):
            dt, steps = case.duration / case.steps / finer, finer * case.steps
            path = dynamics.run(*case.start, case.tau, dt, steps, method).q
            errors.append(float(np.abs(path[::finer, 0] - exact).max()))
        order = check_falling(result, f"{case.name}, RK4, {LABELS[engine]}", errors[0], errors[1], twin)
        if engine == "tmt":
            twin = order
        engines.append((LABELS[engine], order, errors[-1]))
    result.find("swing", scene=case.name, engines=engines)


def check_falling(
    result: Result, where: str, coarse: float, fine: float, twin: float | None = None
) -> float | None:
    """The order at which an error falls, rad, at half the step; None: it is rounding."""
    if fine <= ROUNDED:
        return None
    with np.errstate(divide="ignore"):
        order = float(np.log2(coarse / fine))
    check_order(result, where, ORDER, order, "error from the elliptic function", twin=twin)
    return order
