"""The derivative of the bias by the rates, which the implicit integrator uses."""

from collections.abc import Mapping

import numpy as np

from tmt import Tree
from tmt.method import bias_rates

from ...engines import Engine
from ...engines.mujoco.linear import implicit_derivative
from ...judge.check import Result, closest
from ...judge.scale import EPS, FACTOR, mass_scale
from ...robots import Robot

ADDED_DAMPING = 0.5  # N m s/rad: its derivative is part of it
RATES_ASKED = 20  # random states


def compare_derivatives(result: Result, robot: Robot, engines: Mapping[str, Engine]) -> None:
    """TMT's dual numbers beside MuJoCo's qDeriv, with joint damping added."""
    case = robot.case("damped", damping=ADDED_DAMPING)
    states = np.random.default_rng(0).uniform(-3.0, 3.0, (RATES_ASKED, 2, len(case.joints)))
    mujoco, damping = engines["mujoco"].of(case), np.diag(case.tree.damping)
    ours = [np.array(bias_rates(case.tree, list(q), list(v))) + damping for q, v in states]
    theirs = [-implicit_derivative(mujoco, q, v) for q, v in states]
    check_derivative(result, case.tree, *states.transpose(1, 0, 2), np.array(ours), np.array(theirs))


def check_derivative(
    result: Result, tree: Tree, q: np.ndarray, v: np.ndarray, ours: np.ndarray, theirs: np.ndarray
) -> None:
    """The state that comes closest to 64 eps x (the largest entry of Mbar x the sum of |rates| + the largest damping).

    q, v: (states, n); ours, theirs: (states, n, n) N m s/rad.
    """
    tolerance = FACTOR * EPS * (mass_scale(tree, q) * np.abs(v).sum(axis=1) + max(tree.damping))
    off = np.abs(ours - theirs).max(axis=(1, 2))
    (k,) = closest(off, tolerance)
    where = f"{len(q)} random states"
    result.check(where, "dh/dqd + D, TMT to MuJoCo's -qDeriv", off[k], tolerance[k], "N m s/rad", rounding=True)
