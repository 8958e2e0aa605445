"""Flags and integrators by their names, as far as the installed MuJoCo has them."""

from collections.abc import Sequence

import mujoco

# by MuJoCo's names, as far as the installed version has them (discrete: from 3.13)
NAMES = {"Euler": "EULER", "implicitfast": "IMPLICITFAST", "discrete": "DISCRETE", "implicit": "IMPLICIT", "RK4": "RK4"}
INTEGRATORS = {
    name: getattr(mujoco.mjtIntegrator, f"mjINT_{member}")
    for name, member in NAMES.items()
    if hasattr(mujoco.mjtIntegrator, f"mjINT_{member}")
}
EVALUATIONS = dict.fromkeys(INTEGRATORS, 1) | {"RK4": 4}  # of the dynamics, in a step
FLAGS = {
    "contact": mujoco.mjtDisableBit.mjDSBL_CONTACT,
    "constraint": mujoco.mjtDisableBit.mjDSBL_CONSTRAINT,
    "gravity": mujoco.mjtDisableBit.mjDSBL_GRAVITY,
    "autoreset": mujoco.mjtDisableBit.mjDSBL_AUTORESET,
}


def bit(members: Sequence[str]) -> int:
    """The bit of the first of these disable flags that the installed MuJoCo has; 0 if it has none of them."""
    for member in members:
        if hasattr(mujoco.mjtDisableBit, f"mjDSBL_{member}"):
            return int(getattr(mujoco.mjtDisableBit, f"mjDSBL_{member}"))
    return 0


def on(m: mujoco.MjModel, stage: str) -> bool:
    """Whether a stage is on that a disable flag of this name would switch off."""
    return not m.opt.disableflags & bit((stage,))


def enabling(flag: str) -> int:
    """The bit of an enable flag; 0 if the installed MuJoCo has none of this name."""
    return int(getattr(mujoco.mjtEnableBit, f"mjENBL_{flag}", 0))
