"""Equations of motion of rigid bodies on hinges, slides and balls by the TMT method, and their integration.

Stands alone: needs NumPy, llvmlite and mpmath, and knows nothing of any physics engine. Every function takes
states of any leading batch shape, one array for each, which broadcast, and a further argument `model`:
another Tree than the assignment's arm. It raises ValueError for wrong shapes, values that are not finite,
unknown names, a singular Mbar and results beyond the largest double.

Shapes: q (..., nq), qd and tau (..., nv). Of a hinge or slide one number each, of a ball four (a quaternion
w, x, y, z of length 1) and three (angular velocity in its own axes, and torque): nq = nv = n, the number of
joints, where no joint is a ball.

Units: rad, s, kg, m, N m, J; of a slide m and N. Frames: inertial frame at the shoulder, x north, y west, z
up; "body axes" are those that coincide with it at q = 0. Signs: Mbar qdd + h = tau - D qd, with h = `bias`
(MuJoCo's qfrc_bias) and D the joint damping; `gravity_balance` is +dV/dq, the torque that holds the arm at
rest where no springs act.

In MuJoCo's names tau is qfrc_applied, qdd is qacc, and joint damping and springs are in qfrc_passive. The
arm's alpha turns about y, then beta about x, then, at the elbow, gamma about y, all right-handed; with all
angles zero the upper arm points along -z, the forearm along +x.

    import numpy as np, tmt

    q, qd, tau = np.radians([30.0, 20.0, 60.0]), np.zeros(3), np.zeros(3)
    tmt.mass_matrix(q)  # Mbar, kg m2; any leading batch shape: q may be (1000, 3)
    tmt.gravity_balance(q)  # the torque that holds the arm, N m
    tmt.acceleration(q, qd, tau)  # qdd, rad/s2
    t, q, qd = tmt.simulate(q, qd, tau, dt=5 / 64, steps=64)  # RK4, constant tau; (..., 3): many runs

To check a mass matrix of your own: np.abs(mine(q) - tmt.mass_matrix(q)).max() should be about 1e-16; 1e-3 is
a wrong term. `dataclasses.replace(tmt.ARM, mass=(2.0, 1.5))` is the arm with another mass, `tmt.Tree` any
tree of hinges, slides and balls (a free joint is three slides and a ball), with damping, armature, springs
and the gains of a linear controller.

Methods of `simulate`: "rk4"; "semi_implicit_euler", "implicit", "implicitfast" and "discrete" (MuJoCo's);
"explicit_euler"; "dopri8" (Dormand and Prince, order 8: the best for many digits) and "dopri8_adaptive" (with
steps of its own); "implicit_midpoint" and "gauss_legendre_4", which no linear motion can make unstable; and
"taylor", the true motion.

NumPy (literal.py) answers calls of up to 500 states, compiled code larger ones and, after `prepare`, all
calls of a model, which suits loops over single states; see answers.py. Both differ in the last bits, and say
what is wrong in the same words. Compiled code is kept on disk, see compiled/store.py. Without MuJoCo,
`pip install numpy llvmlite mpmath && pip install --no-deps .` is enough.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered as _answered
from tmt.answers import prepare
from tmt.arm import ARM
from tmt.export import equations
from tmt.linear import Derivatives, Frame, derivatives, frame, inverse_dynamics_derivatives, step_derivatives
from tmt.methods import METHODS
from tmt.model.tree import Tree
from tmt.simulation import Motion, simulate

__all__ = [
    "ARM", "METHODS", "Derivatives", "Frame", "Motion", "Tree", "acceleration", "angular_velocities", "bias",
    "com_positions", "convective_terms", "derivatives", "energy", "equations", "frame", "gravity_balance",
    "inverse_dynamics", "inverse_dynamics_derivatives", "inverse_mass_matrix", "jacobians", "mass_matrix",
    "potential_energy", "prepare", "simulate", "spring_torque", "step_derivatives",
]  # fmt: skip


def com_positions(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Positions x_b of the centres of mass in the inertial frame, m, shape (..., m, 3).

    Assignment, part b, equation (1).
    q (..., nq): positions, rad.

    >>> print(tmt.com_positions([0.0, 0.0, 0.0]) + 0.0)  # the upper arm hangs, the forearm points ahead
    [[ 0.    0.   -0.15]
     [ 0.15  0.   -0.3 ]]
    """
    return _answered("com_positions", model, q)


def angular_velocities(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Angular velocities omega_b = B_b qd in body axes, rad/s, shape (..., m, 3).

    Assignment, part d.
    q (..., nq), qd (..., nv): positions and speeds, rad and rad/s.

    >>> print(tmt.angular_velocities([0.0, 0.0, 0.0], [1.0, 0.0, 2.0]))  # alpha and gamma both turn about y
    [[0. 1. 0.]
     [0. 3. 0.]]
    """
    return _answered("angular_velocities", model, q, qd)


def jacobians(q: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """T_b = dx_b/dq, inertial frame, m/rad, and B_b with omega_b = B_b qd in body axes; both (..., m, 3, nv).

    B_b has unit 1. Assignment, parts d and e.
    q (..., nq): positions, rad.

    >>> T, B = tmt.jacobians([0.0, 0.0, 0.0])
    >>> print(T[1, :, 2], B[1, :, 2])  # gamma lowers the forearm, 0.15 m ahead of the elbow
    [ 0.    0.   -0.15] [0. 1. 0.]
    """
    return _answered("jacobians", model, q)


def convective_terms(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> tuple[np.ndarray, np.ndarray]:
    """v_conv = d(T_b qd)/dq qd, m/s2, inertial frame, and w_conv = d(B_b qd)/dq qd, rad/s2, body axes.

    Both (..., m, 3); h_b and g_b in the assignment, part e.
    q (..., nq), qd (..., nv): positions and speeds, rad and rad/s.

    >>> v_conv, w_conv = tmt.convective_terms([0.0, 0.0, 0.0], [0.0, 0.0, 2.0])
    >>> print(v_conv[1])  # towards the elbow: 0.15 m times (2 rad/s)^2
    [-0.6  0.   0. ]
    """
    return _answered("convective_terms", model, q, qd)


def mass_matrix(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Reduced mass matrix Mbar = sum T' m T + B' I B, kg m2, (..., nv, nv), symmetric positive definite.

    Assignment, part e.
    q (..., nq): positions, rad.

    >>> print(tmt.mass_matrix([0.0, 0.0, 0.0])[2, 2].round(9))  # of the elbow: 0.019 + 1.5 kg (0.15 m)^2
    0.05275
    """
    return _answered("mass_matrix", model, q)


def inverse_mass_matrix(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Inverse of `mass_matrix`, 1/(kg m2), shape (..., nv, nv): the accelerations for unit torques.

    q (..., nq): positions, rad.

    >>> q = np.array([0.5, 0.3, 1.0])
    >>> print((tmt.inverse_mass_matrix(q) @ tmt.mass_matrix(q)).round(9) + 0.0)
    [[1. 0. 0.]
     [0. 1. 0.]
     [0. 0. 1.]]
    """
    return _answered("inverse_mass_matrix", model, q)


def bias(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Bias h = Coriolis, centrifugal and gravity terms, N m, shape (..., nv): Mbar qdd + h = tau - D qd.

    It is -Qbar at tau = 0 (assignment, part e) without the joint damping D, and MuJoCo's qfrc_bias.
    q (..., nq), qd (..., nv): positions and speeds, rad and rad/s.

    >>> print(tmt.bias([0.0, 0.0, np.pi / 2], [0.0, 0.0, 5.0]).round(9) + 0.0)  # the elbow of a hanging arm
    [0. 0. 0.]
    """
    return _answered("bias", model, q, qd)


def gravity_balance(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque +dV/dq that holds the model at rest, N m, shape (..., nv).

    Assignment, parts c and h; MuJoCo's qfrc_bias at rest.
    q (..., nq): positions, rad.

    >>> print(tmt.gravity_balance([0.0, 0.0, np.pi / 2]).round(9) + 0.0)  # the arm hangs
    [0. 0. 0.]
    """
    return _answered("gravity_balance", model, q)


def spring_torque(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque k (q - rest) that holds the springs of the joints, N m, (..., nv); of a ball k times the turn.

    With `gravity_balance` it is the torque that holds the model at rest.
    q (..., nq): positions, rad.

    >>> sprung = dataclasses.replace(tmt.ARM, stiffness=(0.0, 0.0, 4.0))
    >>> print(tmt.spring_torque([0.0, 0.0, 0.5], sprung))
    [0. 0. 2.]
    """
    return _answered("spring_torque", model, q)


def acceleration(q: ArrayLike, qd: ArrayLike, tau: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Accelerations qdd from Mbar qdd = tau - D qd - k (q - rest) - P q - S qd - h, rad/s2, shape (..., nv).

    P and S: position_gain, speed_gain of the model. Assignment, parts e, f. ValueError if Mbar is singular.
    q (..., nq), qd (..., nv), tau (..., nv): positions, speeds and torques, rad, rad/s and N m.

    >>> q, rest = np.array([0.5, 0.3, 1.0]), np.zeros(3)
    >>> print(tmt.acceleration(q, rest, tmt.gravity_balance(q)).round(9) + 0.0)  # it is held
    [0. 0. 0.]
    """
    return _answered("acceleration", model, q, qd, tau)


def inverse_dynamics(q: ArrayLike, qd: ArrayLike, qdd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Torque tau = Mbar qdd + h + D qd + k (q - rest) + P q + S qd that gives qdd, N m, shape (..., nv).

    The inverse of `acceleration`; nothing else is added or taken off. With damping, springs and armature it
    is MuJoCo's qfrc_inverse without contacts, limits, friction and actuators. P, S: as in `acceleration`.
    q (..., nq), qd (..., nv), qdd (..., nv): positions, speeds and accelerations, rad, rad/s and rad/s2.

    >>> q, qd, tau = np.array([0.5, 0.3, 1.0]), np.ones(3), np.array([1.0, 2.0, 3.0])
    >>> print(tmt.inverse_dynamics(q, qd, tmt.acceleration(q, qd, tau)).round(9))
    [1. 2. 3.]
    """
    return _answered("inverse_dynamics", model, q, qd, qdd)


def potential_energy(q: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Potential energy V, J, shape (...); 0 with all centres of mass at the origin's height, springs at rest.

    q (..., nq): positions, rad.

    >>> print(tmt.potential_energy([0.0, 0.0, np.pi / 2]).round(9))  # -9.81 (1.9 0.15 + 1.5 (0.3 + 0.15))
    -9.4176
    """
    return _answered("potential_energy", model, q)


def energy(q: ArrayLike, qd: ArrayLike, model: Tree = ARM) -> np.ndarray:
    """Total energy, kinetic and potential, J, shape (...); infinite where it is beyond the largest double.

    Its zero is that of `potential_energy`; the model's position_gain adds nothing to it.
    q (..., nq), qd (..., nv): positions and speeds, rad and rad/s.

    >>> print(tmt.energy([0.0, 0.0, np.pi / 2], [0.0, 0.0, 2.0]).round(9))  # -9.4176 + 0.05275 2^2 / 2
    -9.3121
    """
    return _answered("energy", model, q, qd)
