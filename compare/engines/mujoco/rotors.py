"""Rotor inertia of actuators: what it adds to the diagonal of the mass matrix."""

import mujoco
import numpy as np

from .joints import kind_of, own_name


def rotors(model: mujoco.MjModel) -> np.ndarray:
    """Armature of actuators times gear squared, (nv,), kg m2 or kg; ValueError where it is not on the diagonal alone."""
    found = np.zeros(model.nv)
    armature = getattr(model, "actuator_armature", np.zeros(0))
    for i in np.flatnonzero(armature):
        name = own_name(model.actuator(int(i)).name, "actuator", int(i))
        joint, gear = int(model.actuator_trnid[i, 0]), model.actuator_gear[i]
        start = model.jnt_dofadr[joint] if at_a_joint(model, i) else 0
        # of a turn in the parent's axes no number of the gear belongs to one speed
        kind = kind_of(model, joint) if at_a_joint(model, i) else ""
        own = model.actuator_trntype[i] == mujoco.mjtTrn.mjTRN_JOINT
        size = {"hinge": 1, "slide": 1, "ball": 3 * own, "free": 6 * own}.get(kind, 0)
        if not size or np.count_nonzero(gear[:size]) > 1:
            raise ValueError(f"the armature of {name!r} is not that of one joint's speed; only those are compared")
        found[start : start + size] += armature[i] * gear[:size] ** 2
    return found


def at_a_joint(model: mujoco.MjModel, actuator: int) -> bool:
    """Whether an actuator acts on a joint."""
    return model.actuator_trntype[actuator] in (mujoco.mjtTrn.mjTRN_JOINT, mujoco.mjtTrn.mjTRN_JOINTINPARENT)
