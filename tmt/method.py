"""The TMT method, as the assignment states it, for any tree of hinges and over any scalar.

The Newton and Euler equations of each body b,

    m_b xdd_b = f_b + constraint forces        I_b omegad_b + omega_b x I_b omega_b = constraint moments,

are reduced to the generalized coordinates q by the Jacobians T_b = dx_b/dq and B_b (omega_b = B_b qd,
in body axes). With xdd_b = T_b qdd + v_conv and omegad_b = B_b qdd + w_conv, virtual power gives
Mbar qdd = Qbar with

    Mbar = sum_b T_b' m_b T_b + B_b' I_b B_b
    Qbar = tau - D qd - h
    h    = sum_b T_b' (m_b v_conv - f_b) + B_b' (I_b w_conv + omega_b x I_b omega_b),  f_b = m_b gravity

(assignment, part e; its h_b and g_b are v_conv and w_conv here). h is MuJoCo's qfrc_bias, D the joint
damping. Scalars may be floats, NumPy arrays (one element per state), complex numbers, mpmath numbers,
traced or symbolic expressions; q, qd and tau are sequences of n of them. Vectors are in the inertial
frame unless they are said to be in body axes.
"""

from typing import NamedTuple

from .dual import jacobian
from .space import IDENTITY, ZERO, Matrix, Vector, rotation, solve, total


class Frame(NamedTuple):
    """A hinge's frame and its motion, as if qdd were zero."""

    origin: Vector  # m
    turn: Matrix  # body axes -> inertial axes
    axis: Vector  # of the hinge, inertial axes
    omega: Vector  # rad/s
    origin_conv: Vector  # acceleration of the origin at qdd = 0, m/s2
    omega_conv: Vector  # angular acceleration at qdd = 0, rad/s2


class Body(NamedTuple):
    """What TMT needs of one body."""

    x: Vector  # CoM, m
    T: list  # n columns, dx/dq, m/rad
    B: list  # n columns, body axes
    omega: Vector  # body axes, rad/s
    v_conv: Vector  # d(T qd)/dq qd, m/s2
    w_conv: Vector  # d(B qd)/dq qd, body axes, rad/s2
    mass: float
    inertia: Matrix  # body axes


WORLD = Frame(ZERO, IDENTITY, ZERO, ZERO, ZERO, ZERO)


def hinge_frames(tree, q, qd=None) -> list[Frame]:
    """The n hinge frames at angles q (rad) and rates qd (rad/s, default at rest), walked outward."""
    qd = [0.0] * len(q) if qd is None else qd
    frames = []
    for i, parent in enumerate(tree.parent):
        p = frames[parent] if parent >= 0 else WORLD
        origin, origin_conv = carried(p, Vector(*tree.offset[i]))
        axis = p.turn @ Vector(*tree.axis[i])
        spin = axis * qd[i]
        frames.append(
            Frame(
                origin,
                p.turn @ rotation(tree.axis[i], q[i]),
                axis,
                p.omega + spin,
                origin_conv,
                p.omega_conv + p.omega.cross(spin),
            )
        )
    return frames


def carried(frame, point):
    """Position and acceleration at qdd = 0 of a point fixed in a frame, given in its axes (m)."""
    r = frame.turn @ point
    turning = frame.omega_conv.cross(r) + frame.omega.cross(frame.omega.cross(r))
    return frame.origin + r, frame.origin_conv + turning


def bodies(tree, q, qd=None) -> list[Body]:
    """T_b, B_b and the convective terms of every body, at angles q and rates qd (default at rest)."""
    frames = hinge_frames(tree, q, qd)
    result = []
    for b, hinge in enumerate(tree.body_hinge):
        frame = frames[hinge] if hinge >= 0 else WORLD
        x, v_conv = carried(frame, Vector(*tree.com[b]))
        to_body = frame.turn.transposed
        moved_by = list(zip(frames, tree.moves(b)))
        result.append(
            Body(
                x,
                [f.axis.cross(x - f.origin) if moved else ZERO for f, moved in moved_by],
                [to_body @ f.axis if moved else ZERO for f, moved in moved_by],
                to_body @ frame.omega,
                v_conv,
                to_body @ frame.omega_conv,
                tree.mass[b],
                Matrix(tree.inertia[b]),
            )
        )
    return result


def mass_matrix(parts) -> list:
    """Mbar (n rows of n, kg m2) of the bodies: sum_b T' m T + B' I B."""
    n = len(parts[0].T)
    return [
        [total(b.T[i].dot(b.mass * b.T[j]) + b.B[i].dot(b.inertia @ b.B[j]) for b in parts) for j in range(n)]
        for i in range(n)
    ]


def bias(parts, gravity) -> list:
    """h (n, N m) of the bodies: Mbar qdd + h = tau - D qd; at rest the torque that holds them."""
    g = Vector(*gravity)
    n = len(parts[0].T)
    newton = [b.mass * (b.v_conv - g) for b in parts]
    euler = [b.inertia @ b.w_conv + b.omega.cross(b.inertia @ b.omega) for b in parts]
    return [total(b.T[i].dot(f) + b.B[i].dot(m) for b, f, m in zip(parts, newton, euler)) for i in range(n)]


def mass_matrix_and_bias(tree, q, qd) -> tuple[list, list]:
    """Mbar and h at angles q and rates qd."""
    parts = bodies(tree, q, qd)
    return mass_matrix(parts), bias(parts, tree.gravity)


def bias_rates(tree, q, qd, terms=mass_matrix_and_bias) -> list:
    """dh/dqd (n rows of n, N m s/rad): the exact derivative of the bias by the rates, by dual numbers."""
    return jacobian(lambda rates: terms(tree, q, rates)[1], qd)


def reduced_force(tree, h, qd, tau) -> list:
    """Qbar = tau - D qd - h (n, N m)."""
    return [t - d * v - hi for t, d, v, hi in zip(tau, tree.damping, qd, h)]


def acceleration(tree, q, qd, tau, terms=mass_matrix_and_bias) -> list:
    """qdd (n, rad/s2) from Mbar qdd = Qbar = tau - D qd - h."""
    M, h = terms(tree, q, qd)
    return solve(M, reduced_force(tree, h, qd, tau))


def potential(parts, gravity):
    """Potential energy in J, zero with every centre of mass at the height of the origin."""
    return total(b.mass * (Vector(*gravity) * -1.0).dot(b.x) for b in parts)


def kinetic(parts, qd):
    """Kinetic energy in J: of translation with v = T qd, of rotation with omega in body axes."""
    result = 0.0
    for b in parts:
        v = sum((column * rate for column, rate in zip(b.T, qd)), ZERO)
        result = result + 0.5 * (b.mass * v.dot(v) + b.omega.dot(b.inertia @ b.omega))
    return result
