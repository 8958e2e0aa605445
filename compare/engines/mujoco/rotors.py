"""Rotor inertia of actuators: what it adds to the diagonal of the mass matrix."""

import mujoco
import numpy as np

from .joints import own_name

AT_JOINTS = {int(mujoco.mjtTrn.mjTRN_JOINT), int(mujoco.mjtTrn.mjTRN_JOINTINPARENT)}


def output_of(model: mujoco.MjModel, i: int) -> int:
    """Where the length, the gear and the moment of an actuator stand: some have several outputs."""
    return int(model.actuator_outadr[i]) if hasattr(model, "actuator_outadr") else i


def rotors(model: mujoco.MjModel) -> np.ndarray:
    """Armature of actuators times gear squared, (nv,), kg m2 or kg; ValueError, by name, where it is not that of a joint.

    MuJoCo takes the first number of the gear for every speed of the joint.
    """
    found = np.zeros(model.nv)
    for i in map(int, np.flatnonzero(getattr(model, "actuator_armature", np.zeros(0)))):
        if int(model.actuator_trntype[i]) not in AT_JOINTS:
            name = own_name(model.actuator(i).name, "actuator", i)
            raise ValueError(
                f"actuator {name!r} has armature and acts on no joint; only the armature of joints is compared"
            )
        found[model.dof_jntid == model.actuator_trnid[i, 0]] += (
            model.actuator_armature[i] * model.actuator_gear[output_of(model, i), 0] ** 2
        )
    return found
