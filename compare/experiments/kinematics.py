"""Positions, angular velocities, Jacobians and convective terms."""

from ..core.check import Result
from ..core.finding import Finding
from ..robots import Robot
from . import Experiment
from .quantities import QUANTITIES, compared, headline
from .setup import Setup

__all__ = ["EXPERIMENT", "claim_values", "headline", "rows", "skipped"]
EXPERIMENT = Experiment(order=30, asks_of_own=("com_positions", "jacobians"), options=("--joints",))


def quantities(robot: Robot) -> list[str]:
    """The quantities that tmt's equations, or a user's own, give."""
    names = ("x_b", "omega_b", "T_b", "B_b", "v_conv", "w_conv")
    return [name for name in names if not robot.own or QUANTITIES[name].function in robot.own]


def skipped(robot: Robot) -> Finding | None:
    return None if quantities(robot) else Finding("kinematics", "nothing_given")


def claim_values(robot: Robot) -> dict[str, list[str]]:
    return {"quantities": quantities(robot)}


def rows(setup: Setup) -> Result:
    return compared(setup, "kinematics", *quantities(setup.robot))[0]
