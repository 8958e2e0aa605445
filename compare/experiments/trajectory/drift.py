"""Energy and momentum along runs: what should be constant drifts with the step at the method's order."""

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

DRIFT_DURATION = 1.0  # s: short enough for the order to show, long enough to move
DRIFT_STEPS = {1: (2048, 4096, 8192), 4: (256, 512, 1024)}  # by the order of the method
FEW_DRIFT_STEPS = DRIFT_STEPS | {1: (512, 1024, 2048)}
OF_EULER = 1e-3  # of Euler's drift: RK4's is below, with fewer steps
DRIFT_ROUNDED = 10 * FACTOR * EPS  # of the terms of a quantity: a drift below is not that of the method alone


def measure_drift(result: Result, robot: Robot, engines: Mapping[str, Engine], steps: Mapping[int, tuple]) -> None:
    """Energy and, without gravity, momentum of the first joint along free, undamped runs; steps: so many, by the order."""
    drifts, rounding = {}, {}  # (scene, quantity, unit): method of MuJoCo: engine: a value for each of the steps
    methods = one_of_each_scheme(engines["mujoco"])
    # in a scene of a user's own the order need not show in a second
    cases = [case for case in robot.cases if case.is_free and "own" not in case.scene.tags]
    for case in (case for case in cases if not any(case.tree.damping)):
        dynamics, quantities = compared(engines, case), constants(case)
        rounding |= {(case.name, *of): bound for of, bound in zip(quantities, roundings(case))}
        for method in methods:
            for name, of_case in dynamics.items():
                own = same_scheme(engines, method, name) if name != method.engine else method
                paths = [path_in(case, of_case, own, count) for count in steps[method.order]]
                for quantity, value in quantities.items():
                    of_scene = drifts.setdefault((case.name, *quantity), {}).setdefault(method, {})
                    of_scene[name] = [largest_drift(value, path) for path in paths]
    check_drifts(result, drifts, rounding)
    result.curves["drift"] = {"drifts": drifts, "steps": {method: steps[method.order] for method in methods}}
    if not drifts and robot.is_read:
        result.notes.append(f"Of the scenes of this {robot.noun} nothing is asked but agreement: no drift is measured.")
    elif not drifts:
        result.notes.append(f"No scene of this {robot.noun} is free and without damping: there is no drift to measure.")


def drifts_alone(robot: Robot, engines: Mapping[str, Engine], steps: Mapping[int, tuple]) -> Result:
    """What `measure_drift` adds to a result, by itself: it may be computed beside other work."""
    result = Result("trajectory")
    measure_drift(result, robot, engines, steps)
    return result


def constants(case: Case) -> dict[tuple, Callable]:
    """What stays constant in a free case without damping: (name, unit): a function of q and v along a run.

    Energy, and without gravity the momentum of the first joint, if that is a hinge or a slide without a spring.
    """
    first, found = case.robot.joints[0], {("energy", "J"): partial(literal.energy, model=case.tree)}
    turns = case.robot.tree.kind[0] != "ball" and not case.robot.tree.stiffness[0]
    if not any(case.tree.gravity) and first in case.joints and turns:
        unit = {"hinge": "N m s", "slide": "N s"}[case.robot.tree.kind[0]]
        found[f"{first}-momentum", unit] = partial(momentum_along, case.tree)
    return found


def roundings(case: Case) -> tuple[float, float]:
    """Up to where a drift of the energy, J, and of the momentum of the first joint may be rounding."""
    momenta, springs = np.abs(literal.mass_matrix(case.q, case.tree)) @ np.abs(case.v), 0.0
    if case.tree.has_springs:
        off = case.coordinates.difference(case.q, np.array(case.tree.rest))
        springs = literal.spring_torque(case.q, case.tree) @ off / 2.0
    return DRIFT_ROUNDED * (
        gravity_scale(case.tree, case.q) + momenta @ np.abs(case.v) / 2 + springs
    ), DRIFT_ROUNDED * momenta[0]


def path_in(case: Case, dynamics: Dynamics, method: Method, count: int) -> tuple:
    """q and v of a second in so many steps."""
    return dynamics.run(*case.start, case.tau, DRIFT_DURATION / count, count, method.name)[1:3]


def check_drifts(result: Result, drifts: dict, rounding: Mapping[tuple, float]) -> None:
    """The drift halves with the step as the order says; RK4's is far below that of Euler, which takes more steps.

    rounding: up to where a drift of each quantity may be rounding. Nothing is asked where both engines drift by no more, and no
    order where it falls faster in both: in small swings that of RK4 is of order 5.
    """
    for (scene, quantity, unit), of_scene in drifts.items():
        euler = next(method for method in of_scene if method.scheme == "semi_implicit_euler")
        allowed = rounding.get((scene, quantity, unit))
        for method, engines in of_scene.items():
            found = {engine: found_order(values) for engine, values in engines.items()}
            why = no_order(method, engines, found, allowed)
            if why:
                result.notes.append(
                    f"{scene}, {method.name}: no order is asked of the drift of {quantity}, which {why}."
                )
            for engine, values in engines.items():
                where = f"{scene}, {method.name}, {LABELS[engine]}, {DRIFT_DURATION:g} s"
                if not why:
                    off = abs(found[engine] - method.order)
                    result.check(
                        where,
                        f"order of the drift of {quantity}, from {method.order}",
                        off,
                        ORDER_MARGIN,
                        "",
                        about=About.PREDICTION,
                    )
                if method.scheme == "rk4" and not is_rounding(of_scene[euler], allowed):
                    share = drift_ratio(values[-1], of_scene[euler][engine][-1])
                    result.check(
                        where, f"drift of {quantity} over that of Euler", share, OF_EULER, "", about=About.PREDICTION
                    )


def no_order(method: Method, engines: dict, found: dict, allowed: float | None) -> str | None:
    """Why no order can be measured in the drifts of both engines, {engine: values}, or None; found: the orders."""
    if is_rounding(engines, allowed):
        return "may be rounding alone"
    if all(ORDER_MARGIN < order - method.order <= 1.0 + ORDER_MARGIN for order in found.values()):
        measured = " and ".join(f"{LABELS[engine]}'s by {order:.2f}" for engine, order in found.items())
        return f"falls faster than by the order {method.order}, {measured}"
    return None


def is_rounding(engines: dict, allowed: float | None) -> bool:
    """Whether the drift of both engines with the finest steps may be rounding; allowed: up to where, None: not known."""
    return allowed is not None and all(values[-1] <= allowed for values in engines.values())


def largest_drift(quantity: Callable, path: tuple) -> float:
    """How far a quantity of the state goes from its start along a run; NaN if the run has diverged."""
    if not np.isfinite(path).all():
        return np.nan
    values = quantity(*path)
    return float(np.abs(values - values[0]).max())


def found_order(values: Sequence[float]) -> float:
    """The order at which the last two drifts fall, the last with half the step; NaN where nothing drifts."""
    ratio = drift_ratio(values[-2], values[-1])
    return float(np.log2(ratio)) if ratio > 0.0 else np.nan


def drift_ratio(one: float, other: float) -> float:
    """One drift over another; NaN if that is zero, or a run has diverged."""
    return one / other if other > 0.0 else np.nan


def momentum_along(tree: tmt.Tree, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """Momentum of the first joint, which hangs on the world, along a run: N m s about a hinge, N s along a slide."""
    return np.einsum("sj,sj->s", literal.mass_matrix(q, tree)[:, 0], v)
