"""The derivative of the bias by the rates, which the implicit integrator uses."""

from collections.abc import Mapping

import numpy as np

from tmt import Tree
from tmt.equations import method
from tmt.equations.dual import seeded

from ...engines import Engine
from ...engines.mujoco.linear import implicit_derivative
from ...judge.check import Result, closest
from ...judge.run import movement_unit
from ...judge.scale import EPS, FACTOR, mass_scale
from ...robots import Robot

ADDED_DAMPING = 0.5  # N m s/rad: its derivative is part of it
RATES_ASKED = 20  # random states


def compare_derivatives(result: Result, robot: Robot, engines: Mapping[str, Engine]) -> None:
    """TMT's dual numbers beside MuJoCo's qDeriv, with joint damping added."""
    case = robot.case("damped", damping=ADDED_DAMPING)
    moved, v = np.random.default_rng(0).uniform(-3.0, 3.0, (RATES_ASKED, 2, case.coordinates.nv)).transpose(1, 0, 2)
    q = case.coordinates.move(np.array(case.tree.zero), moved)
    mujoco, damping = engines["mujoco"].of(case), np.diag(case.tree.damping)
    ours = [bias_rates(case.tree, *state) + damping for state in zip(q, v)]
    theirs = [-implicit_derivative(mujoco, *state) for state in zip(q, v)]
    unit = {"rad": "N m s/rad", "m": "N s/m"}
    units = " or ".join(unit[one] for one in movement_unit(case.coordinates).split(" or "))
    check_derivative(result, case.tree, q, v, np.array(ours), np.array(theirs), units)


def bias_rates(tree: Tree, q: np.ndarray, v: np.ndarray) -> np.ndarray:
    """dh/dqd at a state, (nv, nv) N m s/rad: as tmt.equations.method has it, in all directions at once."""
    h = method.bias(method.bodies(tree, list(q), seeded(list(v), np.eye(len(v)))), tree.gravity)
    return np.array([np.broadcast_to(getattr(row, "slope", 0.0), len(v)) for row in h])


def check_derivative(
    result: Result,
    tree: Tree,
    q: np.ndarray,
    v: np.ndarray,
    ours: np.ndarray,
    theirs: np.ndarray,
    unit: str = "N m s/rad",
) -> None:
    """The state that comes closest to 64 eps x (the largest entry of Mbar x the sum of |rates| + the largest damping).

    q, v: (states, nq), (states, nv); ours, theirs: (states, nv, nv) of this unit.
    """
    tolerance = FACTOR * EPS * (mass_scale(tree, q) * np.abs(v).sum(axis=1) + max(tree.damping))
    off = np.abs(ours - theirs).max(axis=(1, 2))
    (k,) = closest(off, tolerance)
    where = f"{len(q)} random states"
    result.check(where, "dh/dqd + D, TMT to MuJoCo's -qDeriv", off[k], tolerance[k], unit, rounding=True)
