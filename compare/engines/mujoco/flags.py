"""Flags of a model by their names, as far as the installed MuJoCo has them."""

from collections.abc import Sequence

import mujoco


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
