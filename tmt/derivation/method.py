"""The TMT method, as the assignment states it, for any tree of joints and over any scalar.

The Newton and Euler equations of each body b,

    m_b xdd_b = f_b + constraint forces        I_b omegad_b + omega_b x I_b omega_b = constraint moments,

are reduced to the generalized coordinates q by the Jacobians T_b = dx_b/dq and B_b (omega_b = B_b qd,
in body axes). With xdd_b = T_b qdd + v_conv and omegad_b = B_b qdd + w_conv, virtual power gives
Mbar qdd = Qbar with

    Mbar = sum_b T_b' m_b T_b + B_b' I_b B_b
    Qbar = tau - D qd - k (q - rest) - P q - S qd - h
    h    = sum_b T_b' (m_b v_conv - f_b) + B_b' (I_b w_conv + omega_b x I_b omega_b),  f_b = m_b gravity

(assignment, part e; its h_b and g_b are v_conv and w_conv here). h is MuJoCo's qfrc_bias, D the joint
damping, k the stiffness of springs at the joints, P and S the gains of a linear controller (position_gain and
speed_gain of a Tree); armature is added to Mbar's diagonal. The arm has neither springs nor armature nor
gains. Scalars may be floats, NumPy arrays (one element per state), complex numbers, mpmath numbers, traced or
symbolic expressions; q is a sequence of nq of them, qd and tau of nv. Vectors are in the inertial frame
unless they are said to be in body axes.
"""

from collections.abc import Callable, Iterable, Sequence
from typing import NamedTuple

from .dual import jacobian
from .mechanism import Mechanism, origin_in_parent, rotation_in_parent
from .vectors import (
    IDENTITY,
    ZERO,
    Factors,
    Matrix,
    Rows,
    Scalar,
    Scalars,
    Values,
    Vector,
    minus,
    total,
    weighted,
)

Terms = Callable[[Mechanism, Scalars, Scalars], tuple[Rows, Values]]  # Mbar and h


class Frame(NamedTuple):
    origin: Vector  # m
    rotation: Matrix  # body axes -> inertial axes
    axes: list[Vector]  # of its speeds, inertial axes
    slides: bool  # along its axis; else it turns about its axes
    omega: Vector  # rad/s
    origin_conv: Vector  # acceleration of the origin at qdd = 0, m/s2
    omega_conv: Vector  # angular acceleration at qdd = 0, rad/s2

    def column(self, axis: Vector, point: Vector, to_body: Matrix) -> tuple[Vector, Vector]:
        """Velocity of a point (inertial axes), angular velocity (body axes) for a unit speed of an axis."""
        if self.slides:
            return axis, ZERO
        return axis.cross(point - self.origin), to_body @ axis


class Body(NamedTuple):
    x: Vector  # CoM, m
    T: list[Vector]  # nv columns, dx/dq, m/rad
    B: list[Vector]  # nv columns, body axes
    omega: Vector  # body axes, rad/s
    v_conv: Vector  # d(T qd)/dq qd, m/s2
    w_conv: Vector  # d(B qd)/dq qd, body axes, rad/s2
    mass: Scalar
    inertia: Matrix  # body axes
    rotation: Matrix  # body axes -> inertial axes


WORLD = Frame(ZERO, IDENTITY, [], False, ZERO, ZERO, ZERO)


def joint_frames(tree: Mechanism, q: Scalars, qd: Scalars | None = None, qdd: Scalars = ()) -> list[Frame]:
    """The n joints' frames at positions q (rad, m) and speeds qd (per s, default at rest), walked outward.

    With qdd (per s2) origin_conv and omega_conv are the accelerations themselves.
    """
    qd = [0.0] * len(tree.axis) if qd is None else qd
    frames: list[Frame] = []
    for i, joint in enumerate(tree.coordinates.joints):
        parent = frames[tree.parent[i]] if tree.parent[i] >= 0 else WORLD
        origin, origin_conv = carried(parent, origin_in_parent(tree, i, q))
        axes = [Vector(*axis) for axis in tree.axis[joint.qd]]
        if joint.kind == "slide":
            axis = parent.rotation @ axes[0]
            origin_conv = origin_conv + parent.omega.cross(axis * (qd[joint.qd.start] * 2.0))  # Coriolis
            origin_conv = origin_conv + axis * qdd[joint.qd.start] if qdd else origin_conv
            moved = parent._replace(origin=origin, axes=[axis], slides=True, origin_conv=origin_conv)
            frames.append(moved)
            continue
        rotation = parent.rotation @ rotation_in_parent(tree, i, q)
        carrier = rotation if joint.kind == "ball" else parent.rotation  # the axes of a ball turn with it
        axes = [carrier @ axis for axis in axes]
        spin = sum((axis * rate for axis, rate in zip(axes, qd[joint.qd])), ZERO)
        omega, omega_conv = parent.omega + spin, parent.omega_conv + parent.omega.cross(spin)
        omega_conv = sum((axis * rate for axis, rate in zip(axes, qdd[joint.qd])), omega_conv)
        frames.append(Frame(origin, rotation, axes, False, omega, origin_conv, omega_conv))
    return frames


def carried(frame: Frame, point: Vector) -> tuple[Vector, Vector]:
    """Position and acceleration at qdd = 0 of a point fixed in a frame, given in its axes (m)."""
    r = frame.rotation @ point
    turning = frame.omega_conv.cross(r) + frame.omega.cross(frame.omega.cross(r))
    return frame.origin + r, frame.origin_conv + turning


def bodies(tree: Mechanism, q: Scalars, qd: Scalars | None = None, qdd: Scalars = ()) -> list[Body]:
    """T_b, B_b and the convective terms of every body, at positions q and speeds qd (default at rest).

    With qdd v_conv and w_conv are the accelerations themselves: the bias of such bodies is Mbar qdd + h
    without the armature.
    """
    frames = joint_frames(tree, q, qd, qdd)
    result = []
    for b, joint in enumerate(tree.body_joint):
        frame = frames[joint] if joint >= 0 else WORLD
        x, v_conv = carried(frame, Vector(*tree.com[b]))
        to_body = frame.rotation.transposed
        T, B = map(list, zip(*columns(tree, frames, joint, x, to_body)))
        omega, w_conv = to_body @ frame.omega, to_body @ frame.omega_conv
        inertia = Matrix(tree.inertia[b])
        result.append(Body(x, T, B, omega, v_conv, w_conv, tree.mass[b], inertia, frame.rotation))
    return result


def columns(
    tree: Mechanism, frames: Sequence[Frame], joint: int, point: Vector, to_body: Matrix
) -> list[tuple[Vector, Vector]]:
    """Frame.column of each speed (nv,), zero where it does not move what is fixed to a joint."""
    path, result = tree.path(joint), list[tuple[Vector, Vector]]()
    for i, mover in enumerate(frames):
        result += [mover.column(axis, point, to_body) if i in path else (ZERO, ZERO) for axis in mover.axes]
    return result


def placed_frame(
    tree: Mechanism, name: str, q: Scalars, qd: Scalars | None = None
) -> tuple[Rows, Rows, Values]:
    """A site of a tree, or the frame of the joint of a body, in the inertial frame.

    pose (3, 4): its axes as columns, and its origin, m; jacobian (6, nv): velocity of the origin, m/s, and
    angular velocity, rad/s, for unit speeds; convective (6,): d(J qd)/dq qd, m/s2 and rad/s2.
    """
    frames, site = joint_frames(tree, q, qd), tree.site_of(name)
    carrier = frames[site.joint] if site.joint >= 0 else WORLD
    x, x_conv = carried(carrier, Vector(*site.offset))
    rotation = carrier.rotation @ Matrix(site.rotation)
    moving = columns(tree, frames, site.joint, x, IDENTITY)
    jacobian = [list(row) for row in zip(*([*linear, *angular] for linear, angular in moving))]
    pose = [[*row, component] for row, component in zip(rotation, x)]
    return pose, jacobian, [*x_conv, *carrier.omega_conv]


def mass_matrix(parts: Sequence[Body], armature: Scalars = ()) -> Rows:
    """Mbar (nv rows of nv, kg m2) of the bodies: sum_b T' m T + B' I B, and the armature on its diagonal."""
    n = len(parts[0].T)
    M: Rows = [[0.0] * n for _ in range(n)]
    for b in parts:
        moving = [k for k in range(n) if b.T[k] is not ZERO]  # the columns of all other joints are zero
        for count, j in enumerate(moving, 1):
            force, moment = b.mass * b.T[j], b.inertia @ b.B[j]
            for i in moving[:count]:  # the other half is the same, to the bit
                M[i][j] = M[j][i] = M[i][j] + (b.T[i].dot(force) + b.B[i].dot(moment))
    return with_diagonal(M, armature)


def bias(parts: Sequence[Body], gravity: Iterable[Scalar]) -> Values:
    """h (nv, N m) of the bodies: Mbar qdd + h = tau - D qd; at rest the torque that holds them."""
    g = Vector(*gravity)
    newton = [b.mass * (b.v_conv - g) for b in parts]
    euler = [b.inertia @ b.w_conv + b.omega.cross(b.inertia @ b.omega) for b in parts]
    h = []
    for i in range(len(parts[0].T)):
        terms = zip(parts, newton, euler)
        h.append(total(b.T[i].dot(f) + b.B[i].dot(m) for b, f, m in terms if b.T[i] is not ZERO))
    return h


def mass_matrix_and_bias(tree: Mechanism, q: Scalars, qd: Scalars) -> tuple[Rows, Values]:
    parts = bodies(tree, q, qd)
    return mass_matrix(parts, tree.armature), bias(parts, tree.gravity)


def generalized_force(tree: Mechanism, q: Scalars, qd: Scalars, qdd: Scalars) -> Values:
    return with_rotors(tree, bias(bodies(tree, q, qd, qdd), tree.gravity), qdd)


def with_rotors(tree: Mechanism, force: Scalars, qdd: Scalars) -> Values:
    return [f + rotor * a if rotor else f for f, rotor, a in zip(force, tree.armature, qdd)]


def inverse_dynamics(tree: Mechanism, q: Scalars, qd: Scalars, force: Scalars) -> Values:
    """tau = Mbar qdd + h + D qd + k (q - rest) + P q + S qd (nv, N m), from force = Mbar qdd + h."""
    return [x * -1.0 for x in reduced_force(tree, force, q, qd, [0.0] * len(qd))]


def bias_rates(tree: Mechanism, q: Scalars, qd: Scalars, terms: Terms = mass_matrix_and_bias) -> Rows:
    """dh/dqd (nv rows of nv, N m s/rad): the exact derivative of the bias by the speeds, by dual numbers."""
    return jacobian(lambda rates: terms(tree, q, rates)[1], qd)


def from_rest(tree: Mechanism, q: Scalars) -> list[tuple[Scalar, Scalar]]:
    tangent = tree.coordinates.difference(q, tree.rest)
    joints = zip(tree.stiffness, tree.coordinates.joints)
    return [(stiffness, tangent[k]) for stiffness, joint in joints for k in joint.speeds]


def spring_torque(tree: Mechanism, q: Scalars) -> Values:
    """k (q - rest) (nv, N m or N), which springs take off; of a ball k times the tangent from its rest."""
    if not tree.has_springs:
        return [0.0] * len(tree.axis)
    return [stiffness * x for stiffness, x in from_rest(tree, q)]


def with_diagonal(matrix: Sequence[Scalars], diagonal: Scalars) -> Rows:
    rows = [list(row) for row in matrix] or [[0.0] * len(diagonal) for _ in diagonal]
    for i, x in enumerate(diagonal):
        if x:
            rows[i][i] = rows[i][i] + x
    return rows


def reduced_force(tree: Mechanism, h: Scalars, q: Scalars, qd: Scalars, tau: Scalars) -> Values:
    """Qbar = tau - D qd - k (q - rest) - P q - S qd - h (nv, N m)."""
    Qbar = [t - d * v - hi for t, d, v, hi in zip(tau, tree.damping, qd, h)]
    if tree.has_springs:
        Qbar = minus(Qbar, spring_torque(tree, q))
    positions = [q[i] for i in tree.coordinates.first_positions]  # no entry of P is that of a ball
    for gain, values in ((tree.position_gain, positions), (tree.speed_gain, qd)):
        Qbar = minus(Qbar, [weighted(row, values) for row in gain]) if gain else Qbar
    return Qbar


def acceleration(
    tree: Mechanism, q: Scalars, qd: Scalars, tau: Scalars, terms: Terms = mass_matrix_and_bias
) -> Values:
    """qdd (nv, rad/s2) from Mbar qdd = Qbar, see the head of this file."""
    M, h = terms(tree, q, qd)
    return Factors(M).solve(reduced_force(tree, h, q, qd, tau))


def potential(parts: Sequence[Body], gravity: Iterable[Scalar]) -> Scalar:
    """Potential energy in J, zero with every centre of mass at the height of the origin."""
    return total(b.mass * (Vector(*gravity) * -1.0).dot(b.x) for b in parts)


def spring_energy(tree: Mechanism, q: Scalars) -> Scalar:
    if not tree.has_springs:
        return 0.0
    return total(0.5 * stiffness * (x * x) for stiffness, x in from_rest(tree, q) if stiffness)


def kinetic(parts: Sequence[Body], qd: Scalars, armature: Scalars = ()) -> Scalar:
    """Kinetic energy in J: of translation with v = T qd, of rotation with omega in body axes, of rotors."""
    result = total(0.5 * rotor * (rate * rate) for rotor, rate in zip(armature, qd) if rotor)
    for b in parts:
        v = sum((column * rate for column, rate in zip(b.T, qd)), ZERO)
        result = result + 0.5 * (b.mass * v.dot(v) + b.omega.dot(b.inertia @ b.omega))
    return result
