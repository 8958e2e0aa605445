"""Energy and momentum along runs: their drift falls with the step at the order of the method."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial

import numpy as np

import tmt
from tmt import literal

from ...engines import LABELS, Dynamics, Engine, Method, compared, one_of_each_scheme, same_scheme
from ...judge.check import About, Result
from ...judge.run import ORDER_MARGIN
from ...judge.scale import EPS, FACTOR, gravity_scale
from ...robots import Robot
from ...robots.case import Case

DRIFT_DURATION = 1.0  # s: short enough to measure the order, long enough to move
DRIFT_STEPS = {1: (2048, 4096, 8192), 4: (256, 512, 1024)}  # by the order of the method
FEW_DRIFT_STEPS = DRIFT_STEPS | {1: (512, 1024, 2048)}
OF_EULER = 1e-3  # of Euler's drift: RK4's is below, with fewer steps
DRIFT_ROUNDED = 10 * FACTOR * EPS  # of the terms of a quantity: a smaller drift may be rounding


def measure_drift(robot: Robot, engines: Mapping[str, Engine], steps: Mapping[int, tuple]) -> Result:
    """Energy and, without gravity, momentum of the first joint along free, undamped runs. steps: counts by the order."""
    result = Result("trajectory")
    drifts, rounding = {}, {}  # (scene, quantity, unit): method of MuJoCo: engine: a value for each of the steps
    methods = one_of_each_scheme(engines["mujoco"])
    # in a scene of a user's own the order may not show in a second
    cases = [case for case in robot.cases if case.is_free and "own" not in case.scene.tags]
    for case in (case for case in cases if not any(case.tree.damping)):
        dynamics, quantities = compared(engines, case), constants(case)
        rounding |= {(case.name, *key): bound for key, bound in zip(quantities, roundings(case))}
        for method in methods:
            for name, dynamics_of_case in dynamics.items():
                own = same_scheme(engines, method, name) if name != method.engine else method
                paths = [path_in(case, dynamics_of_case, own, count) for count in steps[method.order]]
                for quantity, value in quantities.items():
                    by_method = drifts.setdefault((case.name, *quantity), {}).setdefault(method, {})
                    by_method[name] = [largest_drift(value, path) for path in paths]
    check_drifts(result, drifts, rounding)
    result.curves["drift"] = {"drifts": drifts, "steps": {method: steps[method.order] for method in methods}}
    if not drifts:
        result.find("no_drift", noun=robot.noun)
    return result


def constants(case: Case) -> dict[tuple, Callable]:
    """The constants of a free case without damping, {(name, unit): a function of q and v along a run}.

    Energy, and without gravity the momentum of the first joint, if that is a hinge or a slide without a spring.
    """
    first, quantities = case.robot.joints[0], {("energy", "J"): partial(literal.energy, model=case.tree)}
    turns = case.robot.tree.kind[0] != "ball" and not case.robot.tree.stiffness[0]
    if not any(case.tree.gravity) and first in case.joints and turns:
        unit = {"hinge": "N m s", "slide": "N s"}[case.robot.tree.kind[0]]
        quantities[f"{first}-momentum", unit] = partial(momentum_along, case.tree)
    return quantities


def roundings(case: Case) -> tuple[float, float]:
    """The largest drift of the energy, J, and of the momentum of the first joint that may be rounding."""
    momenta, springs = np.abs(literal.mass_matrix(case.q, case.tree)) @ np.abs(case.v), 0.0
    if case.tree.has_springs:
        off = case.coordinates.difference(case.q, np.array(case.tree.rest))
        springs = literal.spring_torque(case.q, case.tree) @ off / 2.0
    return DRIFT_ROUNDED * (
        gravity_scale(case.tree, case.q) + momenta @ np.abs(case.v) / 2 + springs
    ), DRIFT_ROUNDED * momenta[0]


def path_in(case: Case, dynamics: Dynamics, method: Method, count: int) -> tuple:
    """q and v of a run of a second."""
    return dynamics.run(*case.start, case.tau, DRIFT_DURATION / count, count, method.name)[1:3]


def check_drifts(result: Result, drifts: dict, rounding: Mapping[tuple, float]) -> None:
    """The drift falls with the step at the method's order; RK4's is far below that of Euler, which takes more steps.

    rounding: the largest drift of each quantity that may be rounding. Nothing is checked where both engines drift by no more,
    and no order where the drift falls faster in both: in small swings that of RK4 is of order 5.
    """
    unchecked = []
    for (scene, quantity, unit), by_method in drifts.items():
        euler = next(method for method in by_method if method.scheme == "semi_implicit_euler")
        allowed = rounding.get((scene, quantity, unit))
        for method, engines in by_method.items():
            orders = {engine: drift_order(values) for engine, values in engines.items()}
            faster = all(ORDER_MARGIN < order - method.order <= 1.0 + ORDER_MARGIN for order in orders.values())
            has_order = not (faster or is_rounding(engines, allowed))
            if not has_order:
                rounded = is_rounding(engines, allowed)
                unchecked.append({"scene": scene, "integrator": method.name, "quantity": quantity, "rounding": rounded})
            for engine, values in engines.items():
                where = f"{scene}, {method.name}, {LABELS[engine]}, {DRIFT_DURATION:g} s"
                if has_order:
                    order, off = (
                        f"deviation from order {method.order}: drift of {quantity}",
                        orders[engine] - method.order,
                    )
                    result.check(where, order, abs(off), ORDER_MARGIN, "", about=About.PREDICTION)
                if method.scheme == "rk4" and not is_rounding(by_method[euler], allowed):
                    ratio = f"drift of {quantity} over that of Euler"
                    value = drift_ratio(values[-1], by_method[euler][engine][-1])
                    result.check(where, ratio, value, OF_EULER, "", about=About.PREDICTION)
    if unchecked:
        result.find("order_not_checked", drifts=unchecked)


def is_rounding(engines: dict, allowed: float | None) -> bool:
    """Whether the drift of both engines with the finest steps may be rounding. allowed: the largest such drift, None: unknown."""
    return allowed is not None and all(values[-1] <= allowed for values in engines.values())


def largest_drift(quantity: Callable, path: tuple) -> float:
    """The largest change of a quantity along a run; NaN if the run has diverged."""
    if not np.isfinite(path).all():
        return np.nan
    values = quantity(*path)
    return float(np.abs(values - values[0]).max())


def drift_order(values: Sequence[float]) -> float:
    """The order of the drift from the last two step sizes, the last with half the step; NaN if nothing drifts."""
    ratio = drift_ratio(values[-2], values[-1])
    return float(np.log2(ratio)) if ratio > 0.0 else np.nan


def drift_ratio(drift: float, other: float) -> float:
    """One drift over another; NaN if that is zero, or a run has diverged."""
    return drift / other if other > 0.0 else np.nan


def momentum_along(tree: tmt.Tree, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Momentum of the first joint, which connects to the world, along a run: N m s of a hinge, N s of a slide."""
    return np.einsum("sj,sj->s", literal.mass_matrix(q, tree)[:, 0], v)
