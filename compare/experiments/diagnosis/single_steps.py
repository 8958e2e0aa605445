"""One step of each integrator of MuJoCo from many states beside the same scheme in tmt, where M, h and accelerations agree."""

from typing import NamedTuple

import numpy as np

from ...diagnosis.steps import Steps, diagnose_steps
from ...diagnosis.words import Cause
from ..setup import Setup

DAMPING_ADDED = 0.5  # N m s/rad, so that it is seen how damping enters
MOST_SPEEDS_STEPPED = 12
LONGEST_DT = 0.01  # s


class Stepped(NamedTuple):
    """What single steps of one integrator say."""

    integrator: str
    scheme: str  # of tmt, that it is said to be
    ratio: float  # of a difference to its tolerance, the largest
    causes: tuple[Cause, ...]

    @property
    def sentence(self) -> str:
        """The finding."""
        if self.ratio <= 1.0:
            return ""
        if self.causes:
            return "; or ".join(cause.text for cause in self.causes)
        return f"no scheme of tmt, no dt and no implicit term explains the steps of {self.integrator}"


def steps_of_integrators(setup: Setup, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> list[Stepped]:
    """Of every integrator of MuJoCo, with damping added; q, qd, tau: states. [] of a robot with many joints."""
    case, found = setup.robot.case("damped", damping=DAMPING_ADDED), []
    if setup.robot.coordinates.nv > MOST_SPEEDS_STEPPED:
        return found
    dynamics = setup.engines["mujoco"].of(case)
    dt = min(LONGEST_DT, *(one.scene.dt for one in setup.robot.cases_of_torque))
    for name, method in setup.engines["mujoco"].methods.items():
        motion = dynamics.run(q, qd, tau, dt, 1, name)
        steps = Steps(q, qd, tau, dt, motion.q[..., 1, :], motion.v[..., 1, :])
        ratio, causes = diagnose_steps(case.tree, steps, method.scheme)
        text = [cause._replace(what=f"{name}: {cause.what}") for cause in causes]
        found.append(Stepped(name, method.scheme, ratio, tuple(text)))
    return found
