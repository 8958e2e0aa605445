"""Positions, angular velocities, Jacobians and convective terms."""

from ..core.check import Result
from ..robots import Robot
from . import Experiment
from .quantities import QUANTITIES, compared, headline
from .setup import Setup

__all__ = ["EXPERIMENT", "claim_values", "headline", "rows"]
EXPERIMENT = Experiment(order=30, asks_of_own=("com_positions", "jacobians"))


def quantities(robot: Robot) -> list[str]:
    """The quantities that tmt's equations, or a user's own, give."""
    names = ("x_b", "omega_b", "T_b", "B_b", "v_conv", "w_conv", "c", "dc/dq", "centroidal momentum matrix")
    return [name for name in names if not robot.own or QUANTITIES[name].function in robot.own]


def claim_values(robot: Robot) -> dict[str, list[str]]:
    return {"quantities": quantities(robot)}


def rows(setup: Setup) -> Result:
    return compared(setup, "kinematics", *quantities(setup.robot))[0]
