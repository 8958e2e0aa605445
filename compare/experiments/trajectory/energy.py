"""Energy along free runs: its drift falls with the step at the order of the method."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tmt import literal

from ...core.check import About, Result
from ...core.rows import Row, column
from ...engines import LABELS, Dynamics, Engine, compared, one_of_each_scheme, same_scheme
from ...judge.order import ORDER_MARGIN, measured_order
from ...judge.run import number_or_none
from ...judge.scale import EPS, FACTOR, gravity_scale
from ...robots import Robot
from ...robots.case import Case

DURATION = 1.0  # s: short enough to measure the order, long enough to move
STEPS = {1: (4096, 8192), 4: (512, 1024)}  # by the order of the method
FEW_STEPS = STEPS | {1: (1024, 2048)}
ROUNDED = 10 * FACTOR * EPS  # of the terms of the energy: a smaller drift may be rounding


@dataclass
class EnergyRow(Row):
    """The drift of the energy in a free run of a second."""

    scene: str
    integrator: str
    dt: float = column("s", digits=5)
    engine: str = ""
    drift: float | None = column("J", default=None)
    order: float | None = None


def measure_energy(robot: Robot, engines: Mapping[str, Engine], steps: Mapping[int, Sequence[int]]) -> Result:
    """The drift of the energy in free, undamped runs. steps: two counts by order, the second twice the first."""
    result = Result("trajectory")
    rows = result.tables["energy"] = []
    # in a scene of a user's own the order may not show in a second
    free = [case for case in robot.cases if case.is_free and "own" not in case.scene.tags]
    for case in [case for case in free if not any(case.tree.damping)]:
        for method in one_of_each_scheme(engines["mujoco"]):
            order, drifts = method.order or 0, {}
            counts = steps[order]
            for engine, dynamics in compared(engines, case).items():
                name = method.name if engine == method.engine else same_scheme(engines, method, engine).name
                drifts[engine] = [largest_drift(case, dynamics, name, count) for count in counts]
            orders = check_order(result, case, f"{case.name}, {method.name}", order, drifts)
            for engine, (_, drift) in drifts.items():
                numbers = number_or_none(drift), orders.get(engine)
                rows.append(EnergyRow(case.name, method.name, DURATION / counts[-1], engine, *numbers))
    return result


def largest_drift(case: Case, dynamics: Dynamics, method: str, count: int) -> float:
    """The largest change of the energy in a second, J; NaN if the run has diverged."""
    motion = dynamics.run(*case.start, case.tau, DURATION / count, count, method)
    if not np.isfinite(motion.states).all():
        return np.nan
    energy = literal.energy(motion.q, motion.v, case.tree)
    return float(np.abs(energy - energy[0]).max())


def rounding(case: Case) -> float:
    """The largest drift of the energy that may be rounding, J."""
    speed, springs = np.abs(case.v), 0.0
    if case.tree.has_springs:
        stretch = case.coordinates.difference(case.q, np.array(case.tree.rest))
        springs = literal.spring_torque(case.q, case.tree) @ stretch / 2.0
    kinetic = speed @ np.abs(literal.mass_matrix(case.q, case.tree)) @ speed / 2.0
    return ROUNDED * (gravity_scale(case.tree, case.q) + kinetic + springs)


def check_order(
    result: Result, case: Case, where: str, order: int, drifts: Mapping[str, Sequence[float]]
) -> dict[str, float | None]:
    """The measured order of each engine, at least the method's; {} where both drift by rounding alone."""
    if all(finer <= rounding(case) for _, finer in drifts.values()):
        return {}
    orders: dict[str, float | None] = {}  # None: a run has diverged, or does not drift
    least, name = order - ORDER_MARGIN, "order of the drift of energy"
    for engine, of_engine in drifts.items():
        measured = measured_order((2.0, 1.0), of_engine)
        orders[engine] = number_or_none(measured and measured.order)
        place = f"{where}, {LABELS[engine]}, {DURATION:g} s"
        result.check(place, name, orders[engine], least, "", rule="at least", about=About.PREDICTION)
    return orders
