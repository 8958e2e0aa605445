"""What touches, where contacts are in force."""

from typing import NamedTuple, cast

import numpy as np

from ...engines.mujoco.dynamics import MujocoDynamics
from ..setup import Setup

FINER = 8  # steps in one of the scene, in which contacts are looked for


class Touch(NamedTuple):
    """Two geoms that touch."""

    geoms: tuple[str, str]
    scene: str  # "": at a random state alone
    time: float  # s, the first in that scene
    q: list[float]  # rad


def touches(setup: Setup, dynamics: MujocoDynamics) -> list[Touch]:
    """The pairs of geoms that touch, each where it first does: in a scene by MuJoCo, at a random state."""
    if not dynamics.may_touch:
        return []
    found: dict[tuple[str, str], Touch] = {}
    for case in setup.robot.cases_of_torque:
        acting = cast(MujocoDynamics, setup.engines["mujoco"].of(case))
        motion = acting.run(case.q, case.v, case.tau, case.scene.dt / FINER, case.steps * FINER, "RK4")
        q = motion.q[np.isfinite(motion.q).all(axis=1)]
        for time, state, pairs in zip(motion.t.tolist(), q, acting.touching(q)):
            for pair in pairs - found.keys():
                found[pair] = Touch(pair, case.name, time, case.positions_of_all(state).tolist())
    for state, pairs in zip(setup.random.q, dynamics.touching(setup.random.q)):
        for pair in pairs - found.keys():
            found[pair] = Touch(pair, "", 0.0, state.tolist())
    return list(found.values())
