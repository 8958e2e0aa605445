"""Energy and momentum along runs: what should be constant drifts with the step at the method's order."""

from functools import partial

import numpy as np

import tmt
from tmt.methods import METHODS

from .motion import ORDER_MARGIN, TWINS
from .scenes import SCENES

DURATION = 1.0  # s: short enough for the order to show, long enough to move
STEPS = {"Euler": (2048, 4096, 8192), "implicit": (2048, 4096, 8192), "RK4": (256, 512, 1024)}
FEW_STEPS = STEPS | {"Euler": (512, 1024, 2048), "implicit": (512, 1024, 2048)}
OF_EULER = 1e-3  # of Euler's drift: RK4's is below, with fewer steps


def drift(result, engine, steps) -> None:
    """Energy and, without gravity, alpha-momentum along runs of so many steps, {integrator: three numbers}."""
    drifts = {}  # (scene, quantity, unit): integrator: engine: a value for each of the steps
    for scene in (scene for scene in SCENES if scene.torque == "free" and not scene.damping):
        run_of = {"TMT": tmt_run, "MuJoCo": partial(mujoco_run, scene.engine(engine))}
        quantities = {("energy", "J"): partial(tmt.energy, model=scene.model)}
        if not scene.gravity and "alpha" in scene.hinges:
            quantities["alpha-momentum", "N m s"] = partial(alpha_momentum, scene.model)
        for integrator, counts in steps.items():
            for name, run in run_of.items():
                paths = [run(scene, integrator, DURATION / count, count) for count in counts]
                for quantity, value in quantities.items():
                    of_scene = drifts.setdefault((scene.name, *quantity), {}).setdefault(integrator, {})
                    of_scene[name] = [largest(value, path) for path in paths]
    judge(result, drifts)
    result.curves["drift"] = {"drifts": drifts, "steps": steps}


def judge(result, drifts) -> None:
    """The drift halves with the step as the order says; RK4's is far below that of Euler, which takes more steps."""
    for (scene, quantity, _), of_scene in drifts.items():
        for integrator, engines in of_scene.items():
            for engine, values in engines.items():
                where = f"{scene}, {integrator}, {engine}, {DURATION:g} s"
                order = METHODS[TWINS[integrator]].order
                off = abs(found_order(values) - order)
                result.check(where, f"order of the drift of {quantity}, from {order}", off, ORDER_MARGIN, "")
                if integrator == "RK4":
                    share = over(values[-1], of_scene["Euler"][engine][-1])
                    result.check(where, f"drift of {quantity} over that of Euler", share, OF_EULER, "")


def largest(quantity, path) -> float:
    """How far a quantity of the state goes from its start along a run; NaN if the run has diverged."""
    if not np.isfinite(path).all():
        return np.nan
    values = quantity(*path)
    return float(np.abs(values - values[0]).max())


def found_order(values) -> float:
    """The order at which the last two drifts fall, the last with half the step; NaN where nothing drifts."""
    ratio = over(values[-2], values[-1])
    return float(np.log2(ratio)) if ratio > 0.0 else np.nan


def over(one, other) -> float:
    """One drift over another; NaN if that is zero, or a run has diverged."""
    return one / other if other > 0.0 else np.nan


def tmt_run(scene, integrator, dt, steps) -> list:
    """q and qd of the same scheme in tmt."""
    return tmt.simulate(*scene.start, scene.tau, dt, steps, TWINS[integrator], scene.model)[1:]


def mujoco_run(engine, scene, integrator, dt, steps) -> list:
    """q and qd of MuJoCo."""
    return engine.trajectory(*scene.start, scene.tau, dt, steps, integrator)[1:]


def alpha_momentum(model, q, qd) -> np.ndarray:
    """Angular momentum about the first hinge along a run, N m s."""
    return np.einsum("sj,sj->s", tmt.mass_matrix(q, model)[:, 0], qd)
