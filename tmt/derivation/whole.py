"""What follows from the bodies for the whole robot: centre of mass, momentum; and the equations as linear forms.

Mbar qdd + h = Y theta is linear in the ten inertial numbers of each body, and the velocity part of h is C qd.
"""

from collections.abc import Sequence
from itertools import combinations

from .mechanism import Mechanism
from .method import WORLD, Body, columns, joint_frames, with_diagonal
from .vectors import IDENTITY, ZERO, Rows, Scalars, Vector, outer, total


def coriolis_matrix(tree: Mechanism, qd: Scalars, M: Sequence[Scalars], rates: Sequence[Scalars]) -> Rows:
    """C (nv rows of nv, N m s/rad) of Christoffel symbols, from M = Mbar and rates = dh/dqd.

    C = (dh/dqd + Mbar A) / 2, where A u is the bracket of the speeds qd and u: omega x u of a ball, whose
    speeds are about axes that turn with it, and 0 of hinges and slides. So C qd is the velocity part of h and
    Mbard - 2 C is skew.
    """
    C = [[0.5 * x for x in row] for row in rates]
    of_bodies = with_diagonal(M, [x * -1.0 for x in tree.armature])  # rotors do not turn with a ball
    for joint in tree.coordinates.balls:
        (i, j, k), (x, y, z) = joint.speeds, (0.5 * rate for rate in qd[joint.qd])
        for row, of_row in zip(C, of_bodies):
            row[i] = row[i] + (z * of_row[j] - y * of_row[k])
            row[j] = row[j] + (x * of_row[k] - z * of_row[i])
            row[k] = row[k] + (y * of_row[i] - x * of_row[j])
    return C


def centre_of_mass(parts: Sequence[Body]) -> tuple[Vector, Rows]:
    """The centre of mass of all bodies, m, and its Jacobian (3 rows of nv), m/rad."""
    share = 1.0 / total(b.mass for b in parts)
    x = sum((b.x * (b.mass * share) for b in parts), ZERO)
    T = [sum((b.T[k] * (b.mass * share) for b in parts), ZERO) for k in range(len(parts[0].T))]
    return x, [list(row) for row in zip(*T)]


def centroidal_momentum(parts: Sequence[Body]) -> Rows:
    """Linear momentum, and angular about the centre of mass of all bodies, for unit speeds: 6 rows of nv."""
    x, _ = centre_of_mass(parts)
    result: Rows = []
    for k in range(len(parts[0].T)):
        linear = sum((b.T[k] * b.mass for b in parts), ZERO)
        angular = (
            (b.x - x).cross(b.T[k] * b.mass) + b.rotation @ (b.inertia @ b.B[k])
            for b in parts
            if b.T[k] is not ZERO
        )
        result.append([*linear, *sum(angular, ZERO)])
    return [list(row) for row in zip(*result)]


def regressor(tree: Mechanism, q: Scalars, qd: Scalars, qdd: Scalars) -> Rows:
    """Y (nv rows of 10 m): Y theta is the part of Mbar qdd + h that the bodies have, without the armature.

    theta: of each body its mass m, first moment s and inertia J about the origin of its joint's frame, in its
    axes. Force and moment about that origin, which accelerates by a, gravity as an acceleration of the world,
    are f = m a + omegad x s + omega x (omega x s) and n = s x a + J omegad + omega x J omega.
    """
    frames = joint_frames(tree, q, qd, qdd)
    units = IDENTITY.rows
    tensors = [outer(u, u) for u in units] + [outer(u, v) + outer(v, u) for u, v in combinations(units, 2)]
    Y: Rows = [[] for _ in tree.axis]
    for joint in tree.body_joint:
        frame = frames[joint] if joint >= 0 else WORLD
        to_body = frame.rotation.transposed
        omega, omegad = to_body @ frame.omega, to_body @ frame.omega_conv
        a = to_body @ (frame.origin_conv - Vector(*tree.gravity))
        forces = [a, *(omegad.cross(u) + omega.cross(omega.cross(u)) for u in units)]
        moments = [u.cross(a) for u in units]
        moments += [J @ omegad + omega.cross(J @ omega) for J in tensors]
        for row, (T, B) in zip(Y, columns(tree, frames, joint, frame.origin, to_body)):
            if T is ZERO:
                row += [0.0] * 10
                continue
            T = to_body @ T
            row.append(T.dot(forces[0]))
            row += [T.dot(force) + B.dot(moment) for force, moment in zip(forces[1:], moments)]
            row += [B.dot(moment) for moment in moments[3:]]
    return Y
