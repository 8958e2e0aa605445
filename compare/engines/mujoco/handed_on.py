"""The compiled model for other engines that step it: with all that a Tree does not have taken away or switched off."""

import mujoco

from .inventory import switch_off
from .names import bit, rotors
from .source import Source


def bare_model(source: Source, rotors_in_joints: bool) -> mujoco.MjModel:
    """A compiled model of a file without forces, contacts and actuators that a Tree does not have.

    rotors_in_joints: the armature of actuators is that of their joints.
    """
    m = source.without({}, bare=True)
    switch_off(m)
    # MuJoCo Warp refuses the first; with the second its implicitfast is explicit in the damping
    m.opt.disableflags &= ~bit("AUTORESET", "ACTUATION")
    m.opt.disableflags |= bit("WARMSTART")  # its solver starts from the unconstrained acceleration
    m.opt.solver = mujoco.mjtSolver.mjSOL_NEWTON  # of constraints, which are off; both refuse PGS
    m.opt.iterations = m.opt.noslip_iterations = 0
    if rotors_in_joints and hasattr(m, "actuator_armature"):
        m.dof_armature += rotors(m)
        m.actuator_armature[:] = 0.0
    m.actuator_gainprm[:] = m.actuator_biasprm[:] = 0.0  # those with armature are still there
    m.geom_contype[:] = m.geom_conaffinity[:] = 0  # MJX refuses pairs even if there are no contacts
    return m
