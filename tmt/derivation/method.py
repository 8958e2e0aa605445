"""The TMT method, as the assignment states it, for any tree of hinges and over any scalar.

The Newton and Euler equations of each body b,

    m_b xdd_b = f_b + constraint forces        I_b omegad_b + omega_b x I_b omega_b = constraint moments,

are reduced to the generalized coordinates q by the Jacobians T_b = dx_b/dq and B_b (omega_b = B_b qd,
in body axes). With xdd_b = T_b qdd + v_conv and omegad_b = B_b qdd + w_conv, virtual power gives
Mbar qdd = Qbar with

    Mbar = sum_b T_b' m_b T_b + B_b' I_b B_b
    Qbar = tau - D qd - k (q - rest) - P q - S qd - h
    h    = sum_b T_b' (m_b v_conv - f_b) + B_b' (I_b w_conv + omega_b x I_b omega_b),  f_b = m_b gravity

(assignment, part e; its h_b and g_b are v_conv and w_conv here). h is MuJoCo's qfrc_bias, D the joint damping, k the
stiffness of springs at the joints, P and S the gains of a linear controller (position_gain and speed_gain of a Tree);
armature is added to Mbar's diagonal. The arm has neither springs nor armature nor gains. Scalars may be floats, NumPy
arrays (one element per state), complex numbers, mpmath numbers, traced or symbolic expressions; q is a sequence of nq
of them, qd and tau of nv. Vectors are in the inertial frame unless they are said to be in body axes.
"""

from typing import NamedTuple

from tmt.derivation.dual import jacobian
from tmt.derivation.vectors import (
    IDENTITY,
    ZERO,
    Matrix,
    Vector,
    rotation,
    solve,
    total,
    total_vector,
    turn_of,
)


class Frame(NamedTuple):
    """A joint's frame and its motion, as if qdd were zero."""

    origin: Vector  # m
    turn: Matrix  # body axes -> inertial axes
    axes: list  # of its speeds, inertial axes
    slides: bool  # along its axis; else it turns about its axes
    omega: Vector  # rad/s
    origin_conv: Vector  # acceleration of the origin at qdd = 0, m/s2
    omega_conv: Vector  # angular acceleration at qdd = 0, rad/s2


class Body(NamedTuple):
    """What TMT needs of one body."""

    x: Vector  # CoM, m
    T: list  # nv columns, dx/dq, m/rad
    B: list  # nv columns, body axes
    omega: Vector  # body axes, rad/s
    v_conv: Vector  # d(T qd)/dq qd, m/s2
    w_conv: Vector  # d(B qd)/dq qd, body axes, rad/s2
    mass: float
    inertia: Matrix  # body axes


WORLD = Frame(ZERO, IDENTITY, [], False, ZERO, ZERO, ZERO)


def joint_frames(tree, q, qd=None) -> list[Frame]:
    """The n joints' frames at positions q (rad, m) and speeds qd (per s, default at rest), walked outward."""
    qd = [0.0] * len(tree.axis) if qd is None else qd
    frames = []
    for i, joint in enumerate(tree.coordinates.joints):
        p = frames[tree.parent[i]] if tree.parent[i] >= 0 else WORLD
        own = [Vector(*axis) for axis in tree.axis[joint.qd]]
        if joint.kind == "slide":
            axis = p.turn @ own[0]
            origin, origin_conv = carried(
                p, Vector(*tree.offset[i]) + own[0] * (q[joint.q.start] - tree.reference[i])
            )
            origin_conv = origin_conv + p.omega.cross(axis * (qd[joint.qd.start] * 2.0))  # Coriolis
            frames.append(Frame(origin, p.turn, [axis], True, p.omega, origin_conv, p.omega_conv))
            continue
        origin, origin_conv = carried(p, Vector(*tree.offset[i]))
        if joint.kind == "ball":  # its axes turn with it
            frame = Matrix(own)
            turn = p.turn @ (frame.transposed @ turn_of(q[joint.q]) @ frame)
            axes = [turn @ axis for axis in own]
        else:
            turn = p.turn @ rotation(tree.axis[joint.qd.start], q[joint.q.start] - tree.reference[i])
            axes = [p.turn @ own[0]]
        spin = total_vector(axis * rate for axis, rate in zip(axes, qd[joint.qd]))
        frames.append(
            Frame(origin, turn, axes, False, p.omega + spin, origin_conv, p.omega_conv + p.omega.cross(spin))
        )
    return frames


def carried(frame, point):
    """Position and acceleration at qdd = 0 of a point fixed in a frame, given in its axes (m)."""
    r = frame.turn @ point
    turning = frame.omega_conv.cross(r) + frame.omega.cross(frame.omega.cross(r))
    return frame.origin + r, frame.origin_conv + turning


def bodies(tree, q, qd=None) -> list[Body]:
    """T_b, B_b and the convective terms of every body, at positions q and speeds qd (default at rest)."""
    frames = joint_frames(tree, q, qd)
    result = []
    for b, joint in enumerate(tree.body_joint):
        frame = frames[joint] if joint >= 0 else WORLD
        x, v_conv = carried(frame, Vector(*tree.com[b]))
        to_body = frame.turn.transposed
        T, B = [], []
        for f, moved in zip(frames, tree.moves(b)):
            for axis in f.axes:
                T.append(ZERO if not moved else axis if f.slides else axis.cross(x - f.origin))
                B.append(ZERO if not moved or f.slides else to_body @ axis)
        result.append(
            Body(
                x,
                T,
                B,
                to_body @ frame.omega,
                v_conv,
                to_body @ frame.omega_conv,
                tree.mass[b],
                Matrix(tree.inertia[b]),
            )
        )
    return result


def mass_matrix(parts, armature=()) -> list:
    """Mbar (nv rows of nv, kg m2) of the bodies: sum_b T' m T + B' I B, and the armature on its diagonal."""
    n = len(parts[0].T)
    M = [[0.0] * n for _ in range(n)]
    for b in parts:
        moving = [k for k in range(n) if b.T[k] is not ZERO]  # the columns of all other joints are zero
        for j in moving:
            force, moment = b.mass * b.T[j], b.inertia @ b.B[j]
            for i in moving:
                M[i][j] = M[i][j] + (b.T[i].dot(force) + b.B[i].dot(moment))
    for i, rotor in enumerate(armature):
        M[i][i] = M[i][i] + rotor if rotor else M[i][i]
    return M


def bias(parts, gravity) -> list:
    """h (nv, N m) of the bodies: Mbar qdd + h = tau - D qd; at rest the torque that holds them."""
    g = Vector(*gravity)
    n = len(parts[0].T)
    newton = [b.mass * (b.v_conv - g) for b in parts]
    euler = [b.inertia @ b.w_conv + b.omega.cross(b.inertia @ b.omega) for b in parts]
    return [
        total(b.T[i].dot(f) + b.B[i].dot(m) for b, f, m in zip(parts, newton, euler) if b.T[i] is not ZERO)
        for i in range(n)
    ]


def mass_matrix_and_bias(tree, q, qd) -> tuple[list, list]:
    """Mbar and h at positions q and speeds qd."""
    parts = bodies(tree, q, qd)
    return mass_matrix(parts, tree.armature), bias(parts, tree.gravity)


def bias_rates(tree, q, qd, terms=mass_matrix_and_bias) -> list:
    """dh/dqd (nv rows of nv, N m s/rad): the exact derivative of the bias by the speeds, by dual numbers."""
    own = getattr(terms, "bias_rates", None)
    return own(tree, q, qd) if own else jacobian(lambda rates: terms(tree, q, rates)[1], qd)


def spring_torque(tree, q) -> list:
    """k (q - rest) (nv, N m or N), which springs take off the force; of a ball k times the movement from its rest."""
    off = tree.coordinates.difference(q, tree.rest) if tree.has_springs else [0.0] * len(tree.axis)
    return [k * x for k, joint in zip(tree.stiffness, tree.coordinates.joints) for x in off[joint.qd]]


def fed_back(tree, q, qd) -> list:
    """P q + S qd (nv, N m or N), which a linear controller takes off the force; no entry of P is that of a ball."""
    positions = [q[i] for i in tree.coordinates.first_positions]
    terms = [[] for _ in qd]
    for gain, values in ((tree.position_gain, positions), (tree.speed_gain, qd)):
        for own, row in zip(terms, gain):
            own += [g * x for g, x in zip(row, values) if g]
    return [total(own) for own in terms]


def reduced_force(tree, h, q, qd, tau) -> list:
    """Qbar = tau - D qd - k (q - rest) - P q - S qd - h (nv, N m)."""
    Qbar = [t - d * v - hi for t, d, v, hi in zip(tau, tree.damping, qd, h)]
    if tree.has_springs:
        Qbar = [Q - s for Q, s in zip(Qbar, spring_torque(tree, q))]
    return [Q - f for Q, f in zip(Qbar, fed_back(tree, q, qd))] if tree.has_gains else Qbar


def acceleration(tree, q, qd, tau, terms=mass_matrix_and_bias) -> list:
    """qdd (nv, rad/s2) from Mbar qdd = Qbar = tau - D qd - k (q - rest) - h."""
    M, h = terms(tree, q, qd)
    return solve(M, reduced_force(tree, h, q, qd, tau))


def potential(parts, gravity):
    """Potential energy in J, zero with every centre of mass at the height of the origin."""
    return total(b.mass * (Vector(*gravity) * -1.0).dot(b.x) for b in parts)


def spring_energy(tree, q):
    """Energy of the springs in J."""
    if not tree.has_springs:
        return 0.0
    off = tree.coordinates.difference(q, tree.rest)
    return total(
        0.5 * k * (x * x)
        for k, joint in zip(tree.stiffness, tree.coordinates.joints)
        for x in off[joint.qd]
        if k
    )


def kinetic(parts, qd, armature=()):
    """Kinetic energy in J: of translation with v = T qd, of rotation with omega in body axes, of rotors."""
    result = total(0.5 * rotor * (rate * rate) for rotor, rate in zip(armature, qd) if rotor)
    for b in parts:
        v = sum((column * rate for column, rate in zip(b.T, qd)), ZERO)
        result = result + 0.5 * (b.mass * v.dot(v) + b.omega.dot(b.inertia @ b.omega))
    return result
