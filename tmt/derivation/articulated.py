"""The sums of method.py regrouped for large trees, in world axes about one point: articulated bodies.

Frames are walked outward, in the axes of the world about a point O: the origin of the first joint that turns.
A frame's motion at qdd = 0 is omega, omegad and the acceleration a of its point at O; another of its points,
x, accelerates by a + P x, P = [omegad]x + [omega]x[omega]x. What a joint carries itself has mass m, first
moment s and inertia J about O; moment and force about O are

    n = J omegad + omega x J omega + s x a        f = m a + P s.

Forward dynamics, from the tips inward (articulated bodies: Featherstone, Rigid Body Dynamics Algorithms,
2008, chapter 7): a speed has the direction S = (axis, r x axis), of a slide (0, axis). It gives way to what
acts along it: its parent meets I - U U'/D and p + U u/D, where I = [J H; H' M] and p = (n, f) are those of
all that is carried, U = I S, D = S'U + armature, u = Q - S'p. Mbar, of composite bodies: a row is the moment
and force of S along the directions inward. The number of operations of the accelerations grows with n, that
of Mbar with n times the length of the paths to the world.
"""

from typing import NamedTuple

from .composite import Distribution, Round, rounded, turning
from .mechanism import Mechanism, rotation_in_parent
from .method import with_diagonal, with_rotors
from .vectors import IDENTITY, ZERO, Matrix, Record, Rows, Scalar, Scalars, Values, Vector, combined, outer


class Symmetric(NamedTuple):
    diagonal: Vector
    off: Vector  # yz, xz, xy

    def times(self, v: Vector) -> Vector:
        (xx, yy, zz), (yz, xz, xy) = self
        return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ v

    def less_outer(self, a: Vector, b: Vector) -> "Symmetric":
        off = Vector(a.y * b.z, a.x * b.z, a.x * b.y)
        return Symmetric(self.diagonal - Vector(a.x * b.x, a.y * b.y, a.z * b.z), self.off - off)


class Screw(NamedTuple):
    """Angular velocity (or its rate) and velocity of the point at O; or moment and force about O."""

    angular: Vector
    linear: Vector

    def scaled(self, factor: Scalar) -> "Screw":
        return Screw(self.angular * factor, self.linear * factor)

    def dot(self, other: "Screw") -> Scalar:
        return self.angular.dot(other.angular) + self.linear.dot(other.linear)

    def times(self, other: "Screw") -> "Screw":
        """The product of two motions: how the first changes the second, which it takes along."""
        return Screw(
            self.angular.cross(other.angular),
            self.angular.cross(other.linear) + self.linear.cross(other.angular),
        )


STILL = Screw(ZERO, ZERO)


class Frame(NamedTuple):
    rotation: Matrix
    r: Vector  # of its origin
    omega: Vector
    omegad: Vector
    a: Vector  # of its point at O
    directions: list[Screw]  # for unit speeds, of each of its speeds


class Carried(NamedTuple):
    """What a joint carries and what gives way on it: force about O at qdd = 0, inertia [J H; H' M]."""

    force: Screw
    J: Symmetric
    H: Matrix
    M: Symmetric


class Rigid(NamedTuple):
    """What a joint carries as one rigid body: H = [s]x, M = m."""

    force: Screw
    J: Symmetric
    s: Vector
    m: Scalar

    def accelerated(self, motion: Screw) -> Screw:
        moment = self.J.times(motion.angular) + self.s.cross(motion.linear)
        return Screw(moment, motion.angular.cross(self.s) + motion.linear * self.m)

    @property
    def carried(self) -> Carried:
        (x, y, z), m = self.s, self.m
        H = Matrix([[0.0, z * -1.0, y], [z, 0.0, x * -1.0], [y * -1.0, x, 0.0]])
        return Carried(self.force, self.J, H, Symmetric(Vector(m, m, m), ZERO))


def acceleration(tree: Mechanism, q: Scalars, qd: Scalars, force: Scalars, armature: Scalars = ()) -> Values:
    """qdd (nv,) from Mbar qdd = force - h; force: all but the bias; armature: in place of the tree's."""
    frames, rigid = outward(tree, q, qd)
    armature = armature or tree.armature
    joints, bodies = tree.coordinates.joints, [body.carried for body in rigid]
    shares: dict[int, tuple[Screw, Scalar]] = {}  # how a speed gives way: U / D and u / D
    for i in reversed(range(len(joints))):
        body = bodies[i]
        for k, direction in reversed(list(zip(joints[i].speeds, frames[i].directions))):
            moment = body.J.times(direction.angular) + body.H @ direction.linear
            U = Screw(moment, body.M.times(direction.linear) + body.H.transposed @ direction.angular)
            inverse = 1.0 / (direction.dot(U) + armature[k])
            u = (force[k] - direction.dot(body.force)) * inverse
            share = U.scaled(inverse)
            shares[k] = share, u
            J, M = body.J.less_outer(share.angular, U.angular), body.M.less_outer(share.linear, U.linear)
            body = Carried(combined(body.force, U.scaled(u)), J, body.H - outer(share.angular, U.linear), M)
        if tree.parent[i] >= 0:
            bodies[tree.parent[i]] = combined(bodies[tree.parent[i]], body)
    result: Values = []
    motions: list[Screw] = []
    for i, joint in enumerate(joints):
        motion = motions[tree.parent[i]] if tree.parent[i] >= 0 else STILL
        for k, direction in zip(joint.speeds, frames[i].directions):
            share, u = shares[k]
            result.append(u - share.dot(motion))
            motion = combined(motion, direction.scaled(result[-1]))
        motions.append(motion)
    return result


def mass_matrix_and_bias(tree: Mechanism, q: Scalars, qd: Scalars) -> tuple[Rows, Values]:
    frames, own = outward(tree, q, qd)
    rigid, joints = gathered(tree, own), tree.coordinates.joints
    M: Rows = [[0.0] * len(qd) for _ in qd]
    for i, body in enumerate(rigid):
        for k, direction in zip(joints[i].speeds, frames[i].directions):
            force = body.accelerated(direction)
            for inward in tree.path(i):
                for other, along in zip(joints[inward].speeds, frames[inward].directions):
                    if other <= k:
                        M[k][other] = M[other][k] = along.dot(force)
    return with_diagonal(M, tree.armature), along_speeds(frames, rigid)


def generalized_force(tree: Mechanism, q: Scalars, qd: Scalars, qdd: Scalars) -> Values:
    frames, own = outward(tree, q, qd, qdd)
    return with_rotors(tree, along_speeds(frames, gathered(tree, own)), qdd)


def along_speeds(frames: list[Frame], rigid: list[Rigid]) -> Values:
    return [d.dot(body.force) for frame, body in zip(frames, rigid) for d in frame.directions]


def gathered(tree: Mechanism, own: list[Record]) -> list[Record]:
    result = list(own)
    for i in reversed(range(len(result))):
        if tree.parent[i] >= 0:
            result[tree.parent[i]] = combined(result[tree.parent[i]], result[i])
    return result


def outward(
    tree: Mechanism, q: Scalars, qd: Scalars, qdd: Scalars = (), number: Round = float
) -> tuple[list[Frame], list[Rigid]]:
    """The frames of all joints, and what each carries itself; qdd: (), none."""
    distributions = rounded(tree, number)[0]
    frames: list[Frame] = []
    rigid: list[Rigid] = []
    world = Frame(IDENTITY, ZERO, ZERO, ZERO, Vector(*tree.gravity) * -1.0, [])
    only_slides = {-1: True}
    for i, joint in enumerate(tree.coordinates.joints):
        p = frames[tree.parent[i]] if tree.parent[i] >= 0 else world
        # what only slides carry: the point O of all that hangs on it moves with it
        still = only_slides[tree.parent[i]]
        only_slides[i] = still and joint.kind == "slide"
        r = ZERO if still else p.r + p.rotation @ Vector(*tree.offset[i])
        axes = [Vector(*axis) for axis in tree.axis[joint.qd]]
        if joint.kind == "slide":
            axis = p.rotation @ axes[0]
            r = r if still else r + axis * (q[joint.q.start] - tree.reference[i])
            a = p.a + p.omega.cross(axis) * (2.0 * qd[joint.qd.start])  # Coriolis
            a = a + axis * qdd[joint.qd.start] if qdd else a
            frame = Frame(p.rotation, r, p.omega, p.omegad, a, [Screw(ZERO, axis)])
        else:
            rotation = p.rotation @ rotation_in_parent(tree, i, q)
            carrier = rotation if joint.kind == "ball" else p.rotation
            axes = [carrier @ axis for axis in axes]
            spin = sum((axis * rate for axis, rate in zip(axes, qd[joint.qd])), ZERO)
            omega, omegad = p.omega + spin, p.omegad + p.omega.cross(spin)
            omegad = sum((axis * rate for axis, rate in zip(axes, qdd[joint.qd])), omegad)
            # the acceleration is handed on where the joint is
            a = p.a + turning(p.omega, p.omegad) @ r - turning(omega, omegad) @ r
            frame = Frame(rotation, r, omega, omegad, a, [Screw(axis, r.cross(axis)) for axis in axes])
        frames.append(frame)
        rigid.append(about_point(distributions[i], frame))
    return frames, rigid


def about_point(own: Distribution, frame: Frame) -> Rigid:
    m, r, omega, omegad, a = own.mass, frame.r, frame.omega, frame.omegad, frame.a
    turned = frame.rotation @ own.moment
    s = turned + r * m
    (x, xy, xz), (_, y, yz), (_, _, z) = outer(r, turned) + outer(s, r)
    (A, D, E), (_, B, F), (_, _, C) = frame.rotation @ own.inertia @ frame.rotation.transposed
    J = Symmetric(Vector(A + (y + z), B + (x + z), C + (x + y)), Vector(F - yz, E - xz, D - xy))
    n = J.times(omegad) + omega.cross(J.times(omega)) + s.cross(a)
    return Rigid(Screw(n, a * m + turning(omega, omegad) @ s), J, s, m)
