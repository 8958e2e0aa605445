"""What each held posture is, and what one step of each method does there."""

from itertools import product

import numpy as np

from tmt.methods import METHODS

from ...engines import one_of_each_scheme
from ...engines.mujoco.linear import NUDGE, transition
from ...judge.check import Result
from ...judge.rounding import step_rounding
from ...judge.scale import EPS, FACTOR
from ...truth.linear import Held, held
from ...truth.postures import posture_names
from ...truth.steps import beyond_limit, is_runge_kutta
from ..setup import Setup
from .subjects import coarsest_case, dampings_of, subjects_of

FINE_STEP, FINE_DAMPED_STEP = 1e-2, 5e-4  # s, of steps whose amplification is compared; the second with much damping
MOST_OF_A_STEP = 100.0  # fold: later stages are too far away for a difference quotient
SLOW = 1e-3  # 1/s: slower rates are not reported


def check_equilibria(result: Result, setup: Setup) -> None:
    """The kind of each held posture; TMT's amplification of a step compared with MuJoCo's."""
    robot, mujoco, too_long = subjects_of(setup.robot).robot, setup.engines["mujoco"], {}
    usual = (FINE_STEP, coarsest_case(robot).scene.dt)
    for name in posture_names(robot):
        result.find("posture", **posture_values(held(robot, name)))
        for damping, steps in zip(dampings_of(robot), (usual, usual, (FINE_DAMPED_STEP,))):
            at = held(robot, name, damping)
            for method, dt in product(one_of_each_scheme(mujoco), steps):
                where = f"{name}, {method.name}, dt = {dt:.4g} s, damping {damping:g}"
                if is_runge_kutta(METHODS[method.scheme]) and at.growth(method.scheme, dt) > MOST_OF_A_STEP:
                    too_long[where] = beyond_limit(at, method.scheme, dt)
                    continue
                theirs = transition(mujoco.of(at.case), at.q, at.tau, dt, method.name)
                rounded = rounding_of_step(at, method.scheme, dt) if robot.is_read else 0.0
                check_amplification(result, where, at.sizes, at.step(method.scheme, dt), theirs, rounded)
    if too_long:
        result.find("no_difference_quotient", places=too_long)


def posture_values(at: Held) -> dict:
    """What a held posture is, and the rates of its modes, 1/s or rad/s."""
    values = at.modes[0]
    decays = [-v.real for v in values if v.real < -SLOW]
    return {
        "name": at.name,
        "equilibrium": decaying(at) or at.kind,
        "grows": [float(v.real) for v in values if v.real > SLOW and v.imag >= 0.0],
        "swings": [float(v.imag) for v in values if v.imag > SLOW],
        "decays": (min(decays), max(decays)) if decays and any(at.tree.damping) else None,
        "zero": int(at.without_stiffness.sum()) if at.case.robot.is_read else 0,
    }


def decaying(at: Held) -> str | None:
    """A centre of which every mode decays: a stable focus if one swings, else a stable node; None: it is not."""
    values, small = at.modes[0], at.small
    if at.kind != "centre" or not (values.real < -small).all():
        return None
    return "stable focus" if (np.abs(values.imag) > small).any() else "stable node"


def rounding_of_step(at: Held, scheme: str, dt: float) -> float:
    """The bound of the rounding error of one step from a held posture: of movements or of speeds, whichever is more.

    By the scale of the forces, which has the reach: where an anchor is far away, that is more than the last digits of the angles.
    """
    rest = np.zeros((1, at.nv))
    return float(step_rounding(METHODS[scheme], at.tree, at.q[None], rest, at.tau, dt).max())


def check_amplification(
    result: Result, where: str, q: np.ndarray, ours: np.ndarray, theirs: np.ndarray, rounded: float = 0.0
) -> None:
    """The check of one amplification: within what rounding does to a difference quotient.

    rounded: the bound of the rounding of a step, where that may be more: a central quotient takes two steps, each so far off,
    over twice the nudge.
    """
    allowed = max(FACTOR * EPS * (1.0 + np.abs(q).max()) * np.abs(ours).max(), rounded) / NUDGE
    quantity = "amplification of one step, TMT to MuJoCo"
    result.check(where, quantity, np.abs(ours - theirs).max(), allowed, "", rounding=True)
