"""Equations of motion at a state: Mbar qdd + h = tau - D qd - k (q - rest) - P q - S qd, and energy."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike

from tmt.answers import answered, documented
from tmt.model.tree import Tree, checked_model
from tmt.model.values import real_numbers


@documented
def mass_matrix(model: Tree, q: ArrayLike) -> np.ndarray:
    """Reduced mass matrix Mbar = sum_b T_b' m_b T_b + B_b' I_b B_b, with the armature on its diagonal.

    Symmetric and positive definite; assignment, part e; MuJoCo's mj_fullM.
    Returns (..., nv, nv), kg m2; of slides kg, between a slide and a hinge kg m.

    >>> print(tmt.mass_matrix(tmt.ARM, [0.0, 0.0, 0.0])[2, 2].round(9))  # of the elbow: 0.019 + 1.5 kg (0.15 m)^2
    0.05275
    """
    return answered("mass_matrix", model, q)


@documented
def inverse_mass_matrix(model: Tree, q: ArrayLike) -> np.ndarray:
    """Inverse of `mass_matrix`: column j is the acceleration by a unit torque at speed j.

    Returns (..., nv, nv), 1/(kg m2); of slides 1/kg.

    >>> q = np.array([0.5, 0.3, 1.0])
    >>> print((tmt.inverse_mass_matrix(tmt.ARM, q) @ tmt.mass_matrix(tmt.ARM, q)).round(9)[0] + 0.0)
    [1. 0. 0.]
    """
    return answered("inverse_mass_matrix", model, q)


@documented
def bias(model: Tree, q: ArrayLike, qd: ArrayLike) -> np.ndarray:
    """Bias h = Coriolis, centrifugal and gravity terms: Mbar qdd + h = tau - D qd.

    It is -Qbar at tau = 0 without the joint damping D (assignment, part e), and MuJoCo's qfrc_bias.
    Returns (..., nv), N m; of slides N.

    >>> print(tmt.bias(tmt.ARM, [0.0, 0.0, np.pi / 2], [0.0, 0.0, 5.0]).round(9) + 0.0)  # the elbow of a hanging arm
    [0. 0. 0.]
    """
    return answered("bias", model, q, qd)


@documented
def coriolis_matrix(model: Tree, q: ArrayLike, qd: ArrayLike) -> np.ndarray:
    """Coriolis matrix C of Christoffel symbols: C qd is the velocity part of `bias`, dMbar/dt - 2 C is skew.

    C_ij = sum_k (dM_ij/dq_k + dM_ik/dq_j - dM_jk/dq_i) qd_k / 2; of balls, whose speeds are no rates of
    coordinates, with the brackets of these speeds (the Levi-Civita connection of Mbar).
    Returns (..., nv, nv), N m s/rad; of slides N s/m.

    >>> q, qd = np.array([0.5, 0.3, 1.0]), np.array([1.0, -2.0, 3.0])
    >>> moving = tmt.bias(tmt.ARM, q, qd) - tmt.gravity_balance(tmt.ARM, q)
    >>> print(np.abs(tmt.coriolis_matrix(tmt.ARM, q, qd) @ qd - moving).max() < 1e-14)
    True
    """
    return answered("coriolis_matrix", model, q, qd)


@documented
def gravity_balance(model: Tree, q: ArrayLike) -> np.ndarray:
    """Torque +dV/dq that holds the model at rest, without its springs.

    Assignment, parts c and h; MuJoCo's qfrc_bias at rest. Returns (..., nv), N m; of slides N.

    >>> print(tmt.gravity_balance(tmt.ARM, [0.0, 0.0, np.pi / 2]).round(9) + 0.0)  # the arm hangs
    [0. 0. 0.]
    """
    return answered("gravity_balance", model, q)


@documented
def spring_torque(model: Tree, q: ArrayLike) -> np.ndarray:
    """Torque k (q - rest) that holds the springs of the joints; of a ball k times the turn from its rest.

    With `gravity_balance` it is the torque that holds the model at rest; MuJoCo's -qfrc_spring.
    Returns (..., nv), N m; of slides N.

    >>> sprung = dataclasses.replace(tmt.ARM, stiffness=(0.0, 0.0, 4.0))
    >>> print(tmt.spring_torque(sprung, [0.0, 0.0, 0.5]))
    [0. 0. 2.]
    """
    return answered("spring_torque", model, q)


@documented
def acceleration(model: Tree, q: ArrayLike, qd: ArrayLike, tau: ArrayLike) -> np.ndarray:
    """Accelerations qdd from Mbar qdd = tau - D qd - k (q - rest) - P q - S qd - h.

    P and S: position_gain and speed_gain of the model. Assignment, parts e and f; MuJoCo's qacc without
    contacts, limits and dry friction. Returns (..., nv), rad/s2; of slides m/s2.

    >>> q, rest = np.array([0.5, 0.3, 1.0]), np.zeros(3)
    >>> print(tmt.acceleration(tmt.ARM, q, rest, tmt.gravity_balance(tmt.ARM, q)).round(9) + 0.0)  # it is held
    [0. 0. 0.]
    """
    return answered("acceleration", model, q, qd, tau)


@documented
def inverse_dynamics(model: Tree, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> np.ndarray:
    """Torque tau = Mbar qdd + h + D qd + k (q - rest) + P q + S qd that gives qdd.

    The inverse of `acceleration`; nothing else is added or taken off. With damping, springs and armature it
    is MuJoCo's qfrc_inverse without contacts, limits, friction and actuators. Returns (..., nv), N m; of
    slides N.

    >>> q, qd, tau = np.array([0.5, 0.3, 1.0]), np.ones(3), np.array([1.0, 2.0, 3.0])
    >>> print(tmt.inverse_dynamics(tmt.ARM, q, qd, tmt.acceleration(tmt.ARM, q, qd, tau)).round(9))
    [1. 2. 3.]
    """
    return answered("inverse_dynamics", model, q, qd, qdd)


@documented
def regressor(model: Tree, q: ArrayLike, qd: ArrayLike, qdd: ArrayLike) -> np.ndarray:
    """Matrix Y with Y theta = Mbar qdd + h, theta = model.inertial_parameters, for identification.

    Of each body ten columns: mass, mass times centre of mass (x y z), inertia about the origin of its joint's
    frame (xx yy zz xy xz yz), all in that frame. Without the armature, damping, springs and gains, which
    `inverse_dynamics` adds: those are linear in qdd, qd and q.
    Returns (..., nv, 10 m), N m per kg, kg m and kg m2; of slides N.

    >>> q, qd, qdd = np.array([0.5, 0.3, 1.0]), np.ones(3), np.array([1.0, 2.0, 3.0])
    >>> tau = tmt.regressor(tmt.ARM, q, qd, qdd) @ tmt.ARM.inertial_parameters
    >>> print(np.abs(tau - tmt.inverse_dynamics(tmt.ARM, q, qd, qdd)).max() < 1e-14)
    True
    """
    return answered("regressor", model, q, qd, qdd)


@documented
def potential_energy(model: Tree, q: ArrayLike) -> np.ndarray:
    """Potential energy V of gravity and springs.

    0 with all centres of mass at the origin's height and the springs at rest. Returns (...), J.

    >>> print(tmt.potential_energy(tmt.ARM, [0.0, 0.0, np.pi / 2]).round(9))  # -9.81 (1.9 0.15 + 1.5 (0.3 + 0.15))
    -9.4176
    """
    return answered("potential_energy", model, q)


@documented
def energy(model: Tree, q: ArrayLike, qd: ArrayLike) -> np.ndarray:
    """Total energy, kinetic and potential; infinite where it is beyond the largest double.

    Its zero is that of `potential_energy`; the model's position_gain adds nothing to it. NaN where all of q
    is NaN, as it is from where a run of `simulate` has ended early. Returns (...), J.

    >>> print(tmt.energy(tmt.ARM, [0.0, 0.0, np.pi / 2], [0.0, 0.0, 2.0]).round(9))  # -9.4176 + 0.05275 2^2 / 2
    -9.3121
    """
    positions = real_numbers(q)
    if positions is None or not positions.ndim or not np.isnan(positions).any():
        return answered("energy", model, q, qd)
    checked_model(model)
    ended = np.isnan(positions).all(axis=-1, keepdims=True)
    result = answered("energy", model, np.where(ended, model.zero, positions), np.where(ended, 0.0, qd))
    return np.where(np.squeeze(ended, -1), np.nan, result)
