"""Equations of motion of rigid bodies on hinges, slides and balls by the TMT method, and their integration.

The first argument of every function is the model, a Tree; `tmt.ARM` is the assignment's arm. States have any
leading batch shape, one array for each, which broadcast. ValueError, in one line, for wrong shapes, values
that are not finite, unknown names, a singular Mbar and results beyond the largest double. No physics engine
is needed.

Shapes: q (..., nq), qd and tau (..., nv). Of a hinge or slide one number each, of a ball four (a quaternion
w, x, y, z of length 1) and three (angular velocity in its own axes, and torque).

Units: rad, s, kg, m, N m, J; of a slide m and N. Frames: the inertial frame, of the arm at the shoulder, x
north, y west, z up; "body axes" are those that coincide with it at q = 0. Signs: Mbar qdd + h = tau - D qd,
with h = `bias` (MuJoCo's qfrc_bias) and D the joint damping; `gravity_balance` is +dV/dq. In MuJoCo's names
tau is qfrc_applied, qdd is qacc, and joint damping and springs are in qfrc_passive.

    import numpy as np, tmt

    arm = tmt.ARM  # alpha turns about y, beta about x, gamma, the elbow, about y
    q, qd, tau = np.radians([30.0, 20.0, 60.0]), np.zeros(3), np.zeros(3)
    tmt.mass_matrix(arm, q)  # Mbar, kg m2; any leading batch shape: q may be (1000, 3)
    tmt.gravity_balance(arm, q)  # the torque that holds the arm, N m
    tmt.acceleration(arm, q, qd, tau)  # qdd, rad/s2
    t, q, qd = tmt.simulate(arm, q, qd, tau, dt=5 / 64, steps=64)  # RK4; (..., 3): many runs

To check a mass matrix of your own: np.abs(mine(q) - tmt.mass_matrix(arm, q)).max() should be about 1e-16;
1e-3 is a wrong term. `dataclasses.replace(arm, mass=(2.0, 1.5))` is the arm with another mass,
`tmt.Tree.from_joints` makes any tree of hinges, slides, balls and free joints.

Methods of `simulate`: "rk4"; "semi_implicit_euler", "implicit", "implicitfast" and "discrete" (MuJoCo's);
"explicit_euler"; "dopri8" (Dormand and Prince, order 8: the best for many digits) and "dopri8_adaptive" (with
steps of its own); "implicit_midpoint" and "gauss_legendre_4", which no linear motion can make unstable; and
"taylor", the true motion.

NumPy answers calls of up to 500 states, compiled code larger ones and, after `prepare`, all calls of a model,
which suits loops over single states. Both differ in the last bits. Compiled code is kept on disk, see
compiled/store.py. Without MuJoCo, `pip install numpy llvmlite mpmath && pip install --no-deps .` is enough.
"""

from tmt.answers import prepare
from tmt.arm import ARM
from tmt.dynamics import (
    acceleration,
    bias,
    coriolis_matrix,
    energy,
    gravity_balance,
    inverse_dynamics,
    inverse_mass_matrix,
    mass_matrix,
    potential_energy,
    regressor,
    spring_torque,
)
from tmt.export import equations
from tmt.kinematics import (
    Frame as Frame,
)
from tmt.kinematics import (
    angular_velocities,
    centroidal_momentum_matrix,
    com,
    com_jacobian,
    com_positions,
    convective_terms,
    frame,
    jacobians,
)
from tmt.linear import Derivatives as Derivatives
from tmt.linear import derivatives, inverse_dynamics_derivatives, step_derivatives
from tmt.methods import METHODS
from tmt.model.joint import Joint
from tmt.model.tree import Tree
from tmt.simulation import Motion as Motion
from tmt.simulation import simulate

__all__ = [
    "ARM", "METHODS", "Joint", "Tree", "acceleration", "angular_velocities", "bias",
    "centroidal_momentum_matrix", "com", "com_jacobian", "com_positions", "convective_terms",
    "coriolis_matrix", "derivatives", "energy", "equations", "frame", "gravity_balance", "inverse_dynamics",
    "inverse_dynamics_derivatives", "inverse_mass_matrix", "jacobians", "mass_matrix", "potential_energy",
    "prepare", "regressor", "simulate", "spring_torque", "step_derivatives",
]  # fmt: skip
