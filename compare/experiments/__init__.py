"""The experiments, one file or folder for each word of the command line.

Each is the module of its name, whose docstring is its help. `rows(setup)` computes, `figures(result, robot)` yields calls that
draw; TITLE, `claim(robot)` and `tolerance(robot)` say what is asked. It may have `begin(setup)`, which sets long work going, and
`skipped(robot)`, which says why it cannot serve a robot.
"""

import importlib
from types import ModuleType
from typing import TYPE_CHECKING

if TYPE_CHECKING:  # for who asks for help, the words are enough
    from ..robots import Robot

EXPERIMENTS = {
    "parameters": "MuJoCo's compiled model read back beside the stated numbers, and what is switched off",
    "published": "every number that the assignment prints",
    "kinematics": "positions, angular velocities, Jacobians, convective terms",
    "mass": "the mass matrix",
    "gravity": "the torque that holds each posture",
    "acceleration": "bias in motion, forward and inverse dynamics, energy, power",
    "trajectory": "motion in each scene, by every integrator of MuJoCo and the same scheme in tmt",
    "diagnosis": "what explains a difference: one number, one term, a convention; alone, without a file: made faults",
    "speed": "time against error: every method, every step, and what to use",
    "stability": "step limits, also under a robot's own servos; departure from unstable postures; where methods fail",
    "reduction": "what each scene needs of the model, and what the rest costs",
}


def module(name: str) -> ModuleType:
    """An experiment's module."""
    return importlib.import_module(f".{name}", __package__)


NOT_OF_OWN = {  # why an experiment has nothing to do with equations of a user's own
    "parameters": "your equations are functions, and have no numbers to read back beside MuJoCo's",
    "published": "it compares tmt's numbers with printed ones, not yours",
    "speed": "its methods integrate tmt's equations, not yours",
    "stability": "its limits are predicted from exact derivatives of the equations, which yours do not give",
    "reduction": "it takes joints out of the equations, which cannot be done with yours",
}


def skipped(name: str, robot: "Robot") -> str | None:
    """Why an experiment cannot serve a robot, or None."""
    if robot.own and name in NOT_OF_OWN:
        return NOT_OF_OWN[name]
    why = getattr(module(name), "skipped", None)
    return why(robot) if why else None
