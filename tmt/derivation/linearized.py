"""How Mbar qdd + h changes with tangent vectors and speeds: in closed form, in world axes as in articulated.py.

A step along the direction S_k = (axis, shift) of a speed takes all that its joint carries along as one
body, and so turns velocity and acceleration of what is carried, less those of the frame before (omega, u of
its point at O, omegad, ud). What is left are two motions, with x the product of motions, (omega, u) x (axis,
shift) = (omega x axis, omega x shift + u x axis):

    Y_k = v x S_k        Z_k = a x S_k + v x Y_k        v, a of the frame before, a with -g.

A motion X that is added to the velocity changes force and moment of a mass distribution by I X + B X alone:
the mass at a point r feels 2 X_omega x its velocity, so that

    B X = (K X_omega, 2 X_omega x p),   K = 2 (tr(G) 1 - G'),   G = integral of r rd' dm,   p its momentum.

With I, B and the force F of all that the joint carries, and Y + W = v x S + v_own x S, its moment and force
change by

    I Z + B Y + S x* F  with the tangent        I (Y + W) + B S  with the speed,

along each direction inward; of the torque at joints outward by I Z + B Y and I (Y + W) + B S, with their own
I and B. Sums of this kind, over six coordinates: Singh, Russell, Wensing, IEEE Robotics and Automation
Letters 7 (2022), 1784.
"""

from typing import NamedTuple

from .articulated import STILL, Frame, Rigid, Screw, gathered, outward
from .composite import Round
from .mechanism import Mechanism
from .vectors import ZERO, Matrix, Rows, Scalars, Vector, combined, outer


class Momentum(NamedTuple):
    K: Matrix
    p: Vector

    def force(self, angular: Vector) -> Screw:
        return Screw(self.K @ angular, angular.cross(self.p * 2.0))

    def along(self, direction: Screw) -> Vector:
        return self.K.transposed @ direction.angular + (self.p * 2.0).cross(direction.linear)


def momentum(body: Rigid, omega: Vector, u: Vector) -> Momentum:
    (xx, yy, zz), (yz, xz, xy) = body.J
    half, (x, y, z) = (xx + yy + zz) * 0.5, omega
    second = Matrix([[half - xx, -xy, -xz], [-xy, half - yy, -yz], [-xz, -yz, half - zz]])
    spin = Matrix([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    G, doubled = outer(u, body.s) + spin @ second, 2.0 * u.dot(body.s)
    K = Matrix([[doubled, 0.0, 0.0], [0.0, doubled, 0.0], [0.0, 0.0, doubled]]) - Matrix(
        [row * 2.0 for row in G]
    )
    return Momentum(K, u * body.m + omega.cross(body.s))


def velocities(tree: Mechanism, frames: list[Frame], qd: Scalars) -> list[Screw]:
    result: list[Screw] = []
    for i, joint in enumerate(tree.coordinates.joints):
        v = result[tree.parent[i]] if tree.parent[i] >= 0 else STILL
        shift = sum((d.linear * rate for d, rate in zip(frames[i].directions, qd[joint.qd])), v.linear)
        result.append(Screw(frames[i].omega, shift))
    return result


def rates(tree: Mechanism, q: Scalars, qd: Scalars, qdd: Scalars, number: Round = float) -> tuple[Rows, Rows]:
    """Derivatives of Mbar qdd + h by tangent vectors of q (of a ball turns in its axes) and qd, (nv, nv) each."""
    n, joints = len(qd), tree.coordinates.joints
    frames, own = outward(tree, q, qd, qdd, number)
    rigid, v = gathered(tree, own), velocities(tree, frames, qd)
    B = gathered(tree, [momentum(body, *motion) for body, motion in zip(own, v)])
    S = [direction for frame in frames for direction in frame.directions]
    Y: list[Screw] = []
    Z: list[Screw] = []
    YW: list[Screw] = []
    for i, joint in enumerate(joints):
        before, v0, a0 = tree.parent[i], STILL, Screw(ZERO, Vector(*tree.gravity) * -1.0)
        if before >= 0:  # of a point in space, not of one that moves with the frame
            v0 = v[before]
            a0 = Screw(frames[before].omegad, frames[before].a - v0.angular.cross(v0.linear))
        for k in joint.speeds:
            Y.append(v0.times(S[k]))
            Z.append(combined(a0.times(S[k]), v0.times(Y[k])))
            YW.append(combined(Y[k], v[i].times(S[k])))
    by_tangent: Rows = [[0.0] * n for _ in range(n)]
    by_speed: Rows = [[0.0] * n for _ in range(n)]
    for i, body in enumerate(rigid):
        path = [k for inward in tree.path(tree.parent[i]) for k in joints[inward].speeds]
        for k in joints[i].speeds:
            by_turn = B[i].along(S[k])
            inertia = body.accelerated(S[k])  # I S, I being symmetric
            moved = combined(body.accelerated(Z[k]), B[i].force(Y[k].angular))
            sped = combined(body.accelerated(YW[k]), B[i].force(S[k].angular))
            for other in joints[i].speeds:
                by_tangent[other][k] = moved.dot(S[other])
                by_speed[other][k] = sped.dot(S[other])
            (axis, shift), (moment, force) = S[k], body.force
            turned = Screw(axis.cross(moment) + shift.cross(force), axis.cross(force))
            moved = combined(moved, turned)
            for other in path:
                by_tangent[other][k] = moved.dot(S[other])
                by_speed[other][k] = sped.dot(S[other])
                by_tangent[k][other] = inertia.dot(Z[other]) + by_turn.dot(Y[other].angular)
                by_speed[k][other] = inertia.dot(YW[other]) + by_turn.dot(S[other].angular)
    return by_tangent, by_speed
