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

from collections.abc import Callable
from typing import NamedTuple

from .composite import Distribution, rounded, turning
from .mechanism import AnyTree, turn_in_parent
from .method import reduced_force, with_rotors
from .vectors import IDENTITY, ZERO, Matrix, Scalar, Scalars, Values, Vector, outer


class Symmetric(NamedTuple):
    """A symmetric 3 x 3 matrix."""

    diagonal: Vector
    off: Vector  # yz, xz, xy

    def times(self, v: Vector) -> Vector:
        (xx, yy, zz), (yz, xz, xy) = self
        return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ v

    def plus(self, other: "Symmetric") -> "Symmetric":
        return Symmetric(self.diagonal + other.diagonal, self.off + other.off)

    def less_outer(self, a: Vector, b: Vector) -> "Symmetric":
        """The matrix less a b', a along b."""
        off = Vector(a.y * b.z, a.x * b.z, a.x * b.y)
        return Symmetric(self.diagonal - Vector(a.x * b.x, a.y * b.y, a.z * b.z), self.off - off)


class Direction(NamedTuple):
    """The motion for a unit speed."""

    axis: Vector
    shift: Vector  # velocity of the point at O

    def power(self, moment: Vector, force: Vector) -> Scalar:
        """That of a moment and a force about O."""
        return self.axis.dot(moment) + self.shift.dot(force)


class Frame(NamedTuple):
    """A joint's frame and its motion at qdd = 0, about O."""

    turn: Matrix
    r: Vector  # of its origin
    omega: Vector
    omegad: Vector
    a: Vector  # of its point at O
    directions: list[Direction]  # of its speeds


class Carried(NamedTuple):
    """What a joint carries, rigid or giving way: moment and force about O at qdd = 0, inertia [J H; H' M]."""

    n: Vector
    f: Vector
    J: Symmetric
    H: Matrix
    M: Symmetric

    def plus(self, other: "Carried") -> "Carried":
        n, f, J = self.n + other.n, self.f + other.f, self.J.plus(other.J)
        return Carried(n, f, J, self.H + other.H, self.M.plus(other.M))


class Rigid(NamedTuple):
    """The same of rigid bodies: H = [s]x, M = m."""

    n: Vector
    f: Vector
    J: Symmetric
    s: Vector
    m: Scalar

    def plus(self, other: "Rigid") -> "Rigid":
        n, f, J = self.n + other.n, self.f + other.f, self.J.plus(other.J)
        return Rigid(n, f, J, self.s + other.s, self.m + other.m)

    @property
    def carried(self) -> Carried:
        (x, y, z), m = self.s, self.m
        H = Matrix([[0.0, z * -1.0, y], [z, 0.0, x * -1.0], [y * -1.0, x, 0.0]])
        return Carried(self.n, self.f, self.J, H, Symmetric(Vector(m, m, m), ZERO))


class Share(NamedTuple):
    """How a speed gives way: U / D by moment and force, and u / D."""

    moment: Vector
    force: Vector
    u: Scalar


def acceleration(tree: AnyTree, q: Scalars, qd: Scalars, force: Scalars, armature: Scalars = ()) -> Values:
    """qdd (nv,) from Mbar qdd = force - h; force: all but the bias; armature: in place of the tree's."""
    frames, rigid = outward(tree, q, qd)
    armature = armature or tree.armature
    joints, bodies = tree.coordinates.joints, [body.carried for body in rigid]
    shares: dict[int, Share] = {}
    for i in reversed(range(len(joints))):
        body = bodies[i]
        for k, direction in reversed(list(zip(joints[i].speeds, frames[i].directions))):
            y = body.J.times(direction.axis) + body.H @ direction.shift
            x = body.M.times(direction.shift) + body.H.transposed @ direction.axis
            inverse = 1.0 / (direction.power(y, x) + armature[k])
            u = (force[k] - direction.power(body.n, body.f)) * inverse
            shares[k] = Share(y * inverse, x * inverse, u)
            n, f, J = body.n + y * u, body.f + x * u, body.J.less_outer(shares[k].moment, y)
            H, M = body.H - outer(shares[k].moment, x), body.M.less_outer(shares[k].force, x)
            body = Carried(n, f, J, H, M)
        if tree.parent[i] >= 0:
            bodies[tree.parent[i]] = bodies[tree.parent[i]].plus(body)
    result: list[Scalar] = []
    motions: list[tuple[Vector, Vector]] = []  # angular acceleration, and that of the point at O
    for i, joint in enumerate(joints):
        turn, shift = motions[tree.parent[i]] if tree.parent[i] >= 0 else (ZERO, ZERO)
        for k, direction in zip(joint.speeds, frames[i].directions):
            share = shares[k]
            qdd = share.u - (share.moment.dot(turn) + share.force.dot(shift))
            turn, shift = turn + direction.axis * qdd, shift + direction.shift * qdd
            result.append(qdd)
        motions.append((turn, shift))
    return result


def forward_dynamics(tree: AnyTree, q: Scalars, qd: Scalars, tau: Scalars) -> list[Scalar]:
    """qdd (nv,) from Mbar qdd = tau - D qd - k (q - rest) - P q - S qd - h."""
    return acceleration(tree, q, qd, reduced_force(tree, [0.0] * len(qd), q, qd, tau))


def mass_matrix_and_bias(tree: AnyTree, q: Scalars, qd: Scalars) -> tuple[list[list[Scalar]], list[Scalar]]:
    """Mbar (nv rows of nv, kg m2) and h (nv, N m), as in method.py."""
    frames, rigid = carried(tree, q, qd)
    n, joints = len(qd), tree.coordinates.joints
    M: list[list[Scalar]] = [[0.0] * n for _ in range(n)]
    for i, body in enumerate(rigid):
        for k, (axis, shift) in zip(joints[i].speeds, frames[i].directions):
            moment = body.J.times(axis) + body.s.cross(shift)
            push = axis.cross(body.s) + shift * body.m
            inward = i
            while inward >= 0:
                for other, direction in zip(joints[inward].speeds, frames[inward].directions):
                    if other <= k:
                        M[k][other] = M[other][k] = direction.power(moment, push)
                inward = tree.parent[inward]
            if tree.armature[k]:
                M[k][k] = M[k][k] + tree.armature[k]
    return M, along(frames, rigid)


def bias(tree: AnyTree, q: Scalars, qd: Scalars) -> list[Scalar]:
    return along(*carried(tree, q, qd))


def generalized_force(tree: AnyTree, q: Scalars, qd: Scalars, qdd: Scalars) -> list[Scalar]:
    """Mbar qdd + h (nv, N m), as in method.py."""
    return with_rotors(tree, along(*carried(tree, q, qd, qdd)), qdd)


def along(frames: list[Frame], rigid: list[Rigid]) -> list[Scalar]:
    """h: moment and force of what is carried along each speed's direction."""
    directions = [(direction, body) for frame, body in zip(frames, rigid) for direction in frame.directions]
    return [direction.power(body.n, body.f) for direction, body in directions]


def carried(tree: AnyTree, q: Scalars, qd: Scalars, qdd: Scalars = ()) -> tuple[list[Frame], list[Rigid]]:
    """The frames of all joints, and all that each carries."""
    frames, rigid = outward(tree, q, qd, qdd)
    return frames, gathered(tree, rigid)


def gathered(tree: AnyTree, own: list[Rigid]) -> list[Rigid]:
    """All that each joint carries, from what it carries itself."""
    rigid = list(own)
    for i in reversed(range(len(rigid))):
        if tree.parent[i] >= 0:
            rigid[tree.parent[i]] = rigid[tree.parent[i]].plus(rigid[i])
    return rigid


def outward(
    tree: AnyTree, q: Scalars, qd: Scalars, qdd: Scalars = (), number: Callable[..., Scalar] = float
) -> tuple[list[Frame], list[Rigid]]:
    """The frames of all joints, and what each carries itself; qdd: (), none; number: as in composite.py."""
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
        r = ZERO if still else p.r + p.turn @ Vector(*tree.offset[i])
        axes = [Vector(*axis) for axis in tree.axis[joint.qd]]
        if joint.kind == "slide":
            axis = p.turn @ axes[0]
            r = r if still else r + axis * (q[joint.q.start] - tree.reference[i])
            a = p.a + p.omega.cross(axis) * (2.0 * qd[joint.qd.start])  # Coriolis
            a = a + axis * qdd[joint.qd.start] if qdd else a
            frame = Frame(p.turn, r, p.omega, p.omegad, a, [Direction(ZERO, axis)])
        else:
            turn = p.turn @ turn_in_parent(tree, i, q)
            carrier = turn if joint.kind == "ball" else p.turn
            axes = [carrier @ axis for axis in axes]
            spin = sum((axis * rate for axis, rate in zip(axes, qd[joint.qd])), ZERO)
            omega, omegad = p.omega + spin, p.omegad + p.omega.cross(spin)
            omegad = sum((axis * rate for axis, rate in zip(axes, qdd[joint.qd])), omegad)
            # the acceleration is handed on where the joint is
            a = p.a + turning(p.omega, p.omegad) @ r - turning(omega, omegad) @ r
            frame = Frame(turn, r, omega, omegad, a, [Direction(axis, r.cross(axis)) for axis in axes])
        frames.append(frame)
        rigid.append(about_point(distributions[i], frame))
    return frames, rigid


def about_point(own: Distribution, frame: Frame) -> Rigid:
    """What a joint carries itself, about O."""
    m, r, omega, omegad, a = own.mass, frame.r, frame.omega, frame.omegad, frame.a
    turned = frame.turn @ own.moment
    s = turned + r * m
    (x, xy, xz), (_, y, yz), (_, _, z) = outer(r, turned) + outer(s, r)
    (A, D, E), (_, B, F), (_, _, C) = frame.turn @ own.inertia @ frame.turn.transposed
    J = Symmetric(Vector(A + (y + z), B + (x + z), C + (x + y)), Vector(F - yz, E - xz, D - xy))
    n = J.times(omegad) + omega.cross(J.times(omega)) + s.cross(a)
    return Rigid(n, a * m + turning(omega, omegad) @ s, J, s, m)
