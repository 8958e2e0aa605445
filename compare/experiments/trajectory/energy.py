"""Energy along free runs: its drift falls with the step at the order of the method."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt import literal

from ...core.check import About, Result
from ...engines import LABELS, Dynamics, Engine, compared, one_of_each_scheme, same_scheme
from ...judge.run import ORDER_MARGIN, number_or_none
from ...judge.scale import EPS, FACTOR, gravity_scale
from ...robots import Robot
from ...robots.case import Case

DURATION = 1.0  # s: short enough to measure the order, long enough to move
STEPS = {1: (4096, 8192), 4: (512, 1024)}  # by the order of the method
FEW_STEPS = STEPS | {1: (1024, 2048)}
ROUNDED = 10 * FACTOR * EPS  # of the terms of the energy: a smaller drift may be rounding


def measure_energy(robot: Robot, engines: Mapping[str, Engine], steps: Mapping[int, tuple]) -> Result:
    """The drift of the energy along free, undamped runs of a second. steps: two counts by the order, one twice the other."""
    result = Result("trajectory")
    rows = result.tables["energy"] = []
    for case in robot.cases:
        # in a scene of a user's own the order may not show in a second
        if not case.is_free or any(case.tree.damping) or "own" in case.scene.tags:
            continue
        for method in one_of_each_scheme(engines["mujoco"]):
            counts, drifts = steps[method.order], {}
            for engine, dynamics in compared(engines, case).items():
                name = method.name if engine == method.engine else same_scheme(engines, method, engine).name
                drifts[engine] = [largest_drift(case, dynamics, name, count) for count in counts]
            orders = check_order(result, case, f"{case.name}, {method.name}", method.order, drifts)
            about = {"scene": case.name, "integrator": method.name, "dt_s": DURATION / counts[-1]}
            for engine, (_, drift) in drifts.items():
                rows.append(
                    about | {"engine": engine, "drift_J": number_or_none(drift), "order": orders.get(engine)}
                )
    return result


def largest_drift(case: Case, dynamics: Dynamics, method: str, count: int) -> float:
    """The largest change of the energy in a second, J; NaN if the run has diverged."""
    _, q, v, *_ = dynamics.run(*case.start, case.tau, DURATION / count, count, method)
    if not (np.isfinite(q).all() and np.isfinite(v).all()):
        return np.nan
    energy = literal.energy(q, v, case.tree)
    return float(np.abs(energy - energy[0]).max())


def rounding(case: Case) -> float:
    """The largest drift of the energy that may be rounding, J."""
    speed, springs = np.abs(case.v), 0.0
    if case.tree.has_springs:
        off = case.coordinates.difference(case.q, np.array(case.tree.rest))
        springs = literal.spring_torque(case.q, case.tree) @ off / 2.0
    kinetic = speed @ np.abs(literal.mass_matrix(case.q, case.tree)) @ speed / 2.0
    return ROUNDED * (gravity_scale(case.tree, case.q) + kinetic + springs)


def check_order(
    result: Result, case: Case, where: str, order: int, drifts: Mapping[str, Sequence[float]]
) -> dict[str, float | None]:
    """The measured order of each engine, at least the method's; not checked, and {}, where both drift by rounding alone.

    drifts: J, with a step and with half of it.
    """
    if all(finer <= rounding(case) for _, finer in drifts.values()):
        return {}
    orders = {}  # None: a run has diverged, or does not drift
    for engine, (coarser, finer) in drifts.items():
        orders[engine] = float(np.log2(coarser / finer)) if coarser > 0.0 and finer > 0.0 else None
        of_engine, name = f"{where}, {LABELS[engine]}, {DURATION:g} s", "order of the drift of energy"
        result.check(
            of_engine, name, orders[engine], order - ORDER_MARGIN, "", rule="at least", about=About.PREDICTION
        )
    return orders
