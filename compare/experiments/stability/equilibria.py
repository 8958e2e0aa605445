"""What each held posture is, and what one step of each method does there."""

from itertools import product

import numpy as np

from tmt.methods import METHODS

from ...core.check import Result
from ...engines import one_of_each_scheme
from ...engines.mujoco.differences import NUDGE, transition
from ...judge.scale import EPS, FACTOR
from ...stability.held import held, posture_names
from ...stability.linear_step import is_runge_kutta
from ..setup import Setup
from .subjects import DAMPINGS, coarsest_case, mujoco_of, subjects_of

FINE_STEP, FINE_DAMPED_STEP = (
    1e-2,
    5e-4,
)  # s, of steps whose amplification is compared; the second with much damping
MOST_OF_A_STEP = 100.0  # fold: later stages are too far away for a difference quotient
SLOW = 1e-3  # 1/s: slower rates are not reported


def check_equilibria(result: Result, setup: Setup) -> None:
    """The kind of each held posture; TMT's amplification of a step compared with MuJoCo's."""
    mujoco, robot = setup.engines["mujoco"], subjects_of(setup.robot).robot
    usual = (FINE_STEP, coarsest_case(robot).scene.dt)
    for name in posture_names(robot):
        at = held(robot, name)
        values = at.modes[0]
        grows = [float(v.real) for v in values if v.real > SLOW and v.imag >= 0.0]
        swings = [float(v) for v in values.imag if v > SLOW]
        result.find("posture", name=name, equilibrium=at.kind, grows=grows, swings=swings)
        for damping, steps in zip(DAMPINGS, (usual, usual, (FINE_DAMPED_STEP,))):
            at = held(robot, name, damping)
            for method, dt in product(one_of_each_scheme(mujoco), steps):
                stepping = METHODS[method.scheme]
                if is_runge_kutta(stepping) and at.growth(method.scheme, dt) > MOST_OF_A_STEP:
                    continue
                theirs = transition(mujoco_of(setup.engines, at.case), at.q, at.tau, dt, method.name)
                where = f"{name}, {method.name}, dt = {dt:.4g} s, damping {damping:g}"
                check_amplification(result, where, at.sizes, at.step(method.scheme, dt), theirs)


def check_amplification(
    result: Result, where: str, q: np.ndarray, ours: np.ndarray, theirs: np.ndarray
) -> None:
    """The check of one amplification: within what rounding does to a difference quotient."""
    allowed = FACTOR * EPS * (1.0 + np.abs(q).max()) * np.abs(ours).max() / NUDGE
    quantity = "amplification of one step, TMT to MuJoCo"
    result.check(where, quantity, np.abs(ours - theirs).max(), allowed, "", rounding=True)
