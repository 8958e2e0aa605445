"""Flags and integrators by their names, as far as the installed MuJoCo has them."""

from collections.abc import Sequence
from difflib import get_close_matches

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


def integrator_by_name(name: str) -> str:
    """An integrator of the installed MuJoCo by its name. ValueError, in one line, for another name: which are expected."""
    if name in INTEGRATORS:
        return name
    if name in NAMES:
        raise ValueError(f"MuJoCo {mujoco.__version__} has no {name}; {', '.join(INTEGRATORS)} are expected")
    alike = {known.casefold(): known for known in INTEGRATORS}
    near = get_close_matches(name.casefold(), alike, 1)
    hint = f"; did you mean {alike[near[0]]}?" if near else ";"
    raise ValueError(f"{name!r} is no integrator of MuJoCo{hint} {', '.join(INTEGRATORS)} are expected")


def on(m: mujoco.MjModel, stage: str) -> bool:
    """Whether a stage is on that a disable flag of this name would switch off."""
    return not m.opt.disableflags & bit((stage,))


def enabling(flag: str) -> int:
    """The bit of an enable flag; 0 if the installed MuJoCo has none of this name."""
    return int(getattr(mujoco.mjtEnableBit, f"mjENBL_{flag}", 0))
