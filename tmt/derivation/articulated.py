"""The sums of method.py regrouped for large trees: in world axes about one point, with articulated bodies; any scalar.

Frames are walked outward, in the axes of the world about a point O: the origin of the first joint that turns. A frame's motion at
qdd = 0 is omega, omegad and the acceleration a of its point at O; another of its points, x, accelerates by a + P x,
P = [omegad]x + [omega]x[omega]x. What a joint carries itself has mass m, first moment s and inertia J about O; moment and force
about O are

    n = J omegad + omega x J omega + s x a        f = m a + P s.

Forward dynamics, from the tips inward (articulated bodies: Featherstone, Rigid Body Dynamics Algorithms, 2008, chapter 7): a
speed has the direction S = (axis, r x axis), of a slide (0, axis). It gives way to what acts along it: its parent meets
I - U U'/D and p + U u/D, where I = [J H; H' M] and p = (n, f) are those of all that is carried, U = I S,
D = S'U + armature, u = Q - S'p. Mbar, of composite bodies: a row is the moment and force of S along the directions inward.
The number of operations of the accelerations grows with n, that of Mbar with n times the length of the paths to the world.
"""

from typing import NamedTuple

from .composite import outer, rounded_once, turning
from .method import reduced_force
from .vectors import IDENTITY, ZERO, Matrix, Vector, rotation, turn_of


class Symmetric(NamedTuple):
    """A symmetric 3 x 3 matrix."""

    diagonal: Vector
    off: Vector  # yz, xz, xy

    def times(self, v) -> Vector:
        (xx, yy, zz), (yz, xz, xy) = self
        return Matrix([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]]) @ v

    def plus(self, other) -> "Symmetric":
        return Symmetric(self.diagonal + other.diagonal, self.off + other.off)

    def less_outer(self, a, b) -> "Symmetric":
        """The matrix less a b', a along b."""
        off = Vector(a.y * b.z, a.x * b.z, a.x * b.y)
        return Symmetric(self.diagonal - Vector(a.x * b.x, a.y * b.y, a.z * b.z), self.off - off)


class Frame(NamedTuple):
    """A joint's frame and its motion at qdd = 0, about O."""

    turn: Matrix
    r: Vector  # of its origin
    omega: Vector
    omegad: Vector
    a: Vector  # of its point at O
    directions: list  # of its speeds: (axis, velocity of the point at O)


class Carried(NamedTuple):
    """What a joint carries, rigid or giving way: moment and force about O at qdd = 0, and its inertia [J H; H' M]."""

    n: Vector
    f: Vector
    J: Symmetric
    H: Matrix
    M: Symmetric

    def plus(self, other) -> "Carried":
        return Carried(
            self.n + other.n, self.f + other.f, self.J.plus(other.J), self.H + other.H, self.M.plus(other.M)
        )


class Rigid(NamedTuple):
    """The same of rigid bodies: H = [s]x, M = m."""

    n: Vector
    f: Vector
    J: Symmetric
    s: Vector
    m: object

    def plus(self, other) -> "Rigid":
        return Rigid(
            self.n + other.n, self.f + other.f, self.J.plus(other.J), self.s + other.s, self.m + other.m
        )

    @property
    def carried(self) -> Carried:
        (x, y, z), m = self.s, self.m
        H = Matrix([[0.0, z * -1.0, y], [z, 0.0, x * -1.0], [y * -1.0, x, 0.0]])
        return Carried(self.n, self.f, self.J, H, Symmetric(Vector(m, m, m), ZERO))


def acceleration(tree, q, qd, force, armature=()) -> list:
    """qdd (nv,) from Mbar qdd = force - h; force: all but the bias (nv,); armature: in place of the tree's."""
    frames, rigid = outward(tree, q, qd)
    armature = armature or tree.armature
    joints, bodies = tree.coordinates.joints, [body.carried for body in rigid]
    shares = [None] * len(qd)  # of each speed: U / D and u / D
    for i in reversed(range(len(joints))):
        body, by = bodies[i], range(*joints[i].qd.indices(len(qd)))
        for k in reversed(by):
            axis, shift = frames[i].directions[k - by.start]
            y = body.J.times(axis) + body.H @ shift
            x = body.M.times(shift) + body.H.transposed @ axis
            inverse = 1.0 / (axis.dot(y) + shift.dot(x) + armature[k])
            u = (force[k] - (axis.dot(body.n) + shift.dot(body.f))) * inverse
            y_share, x_share = y * inverse, x * inverse
            shares[k] = y_share, x_share, u
            body = Carried(
                body.n + y * u,
                body.f + x * u,
                body.J.less_outer(y_share, y),
                body.H - outer(y_share, x),
                body.M.less_outer(x_share, x),
            )
        if tree.parent[i] >= 0:
            bodies[tree.parent[i]] = bodies[tree.parent[i]].plus(body)
    result, moved = [None] * len(qd), []
    for i, joint in enumerate(joints):
        turn, shift = moved[tree.parent[i]] if tree.parent[i] >= 0 else (ZERO, ZERO)
        for k, (axis, along) in zip(range(*joint.qd.indices(len(qd))), frames[i].directions):
            y, x, u = shares[k]
            result[k] = u - (y.dot(turn) + x.dot(shift))
            turn, shift = turn + axis * result[k], shift + along * result[k]
        moved.append((turn, shift))
    return result


def forward_dynamics(tree, q, qd, tau) -> list:
    """qdd (nv,) from Mbar qdd = tau - D qd - k (q - rest) - P q - S qd - h."""
    return acceleration(tree, q, qd, reduced_force(tree, [0.0] * len(qd), q, qd, tau))


def mass_matrix_and_bias(tree, q, qd) -> tuple[list, list]:
    """Mbar (nv rows of nv, kg m2) and h (nv, N m), as in method.py."""
    frames, rigid = carried(tree, q, qd)
    n, joints = len(qd), tree.coordinates.joints
    M = [[0.0] * n for _ in range(n)]
    for i, body in enumerate(rigid):
        by = range(*joints[i].qd.indices(n))
        for k in by:
            axis, shift = frames[i].directions[k - by.start]
            moment = body.J.times(axis) + body.s.cross(shift)
            push = axis.cross(body.s) + shift * body.m
            inward, before = i, range(by.start, k + 1)
            while inward >= 0:
                for other in before:
                    axis, shift = frames[inward].directions[other - joints[inward].qd.start]
                    M[k][other] = M[other][k] = axis.dot(moment) + shift.dot(push)
                inward = tree.parent[inward]
                before = range(*joints[inward].qd.indices(n)) if inward >= 0 else ()
            M[k][k] = M[k][k] + tree.armature[k] if tree.armature[k] else M[k][k]
    return M, along(frames, rigid)


def bias(tree, q, qd) -> list:
    """h (nv, N m) alone."""
    return along(*carried(tree, q, qd))


def along(frames, rigid) -> list:
    """h: moment and force of what is carried along each speed's direction."""
    along = [(direction, body) for frame, body in zip(frames, rigid) for direction in frame.directions]
    return [axis.dot(body.n) + shift.dot(body.f) for (axis, shift), body in along]


def carried(tree, q, qd) -> tuple[list[Frame], list[Rigid]]:
    """The frames of all joints, and all that each carries."""
    frames, rigid = outward(tree, q, qd)
    for i in reversed(range(len(rigid))):
        if tree.parent[i] >= 0:
            rigid[tree.parent[i]] = rigid[tree.parent[i]].plus(rigid[i])
    return frames, rigid


def outward(tree, q, qd) -> tuple[list[Frame], list[Rigid]]:
    """The frames of all joints, and what each carries itself."""
    own = rounded_once(tree, float)[0]
    frames, rigid, only_slides = [], [], {-1: True}
    for i, joint in enumerate(tree.coordinates.joints):
        parent = tree.parent[i]
        p = (
            frames[parent]
            if parent >= 0
            else Frame(IDENTITY, ZERO, ZERO, ZERO, Vector(*tree.gravity) * -1.0, [])
        )
        # what only slides carry: the point O of all that hangs on it moves with it
        still = only_slides[parent]
        only_slides[i] = still and joint.kind == "slide"
        r = ZERO if still else p.r + p.turn @ Vector(*tree.offset[i])
        axes = [Vector(*axis) for axis in tree.axis[joint.qd]]
        if joint.kind == "slide":
            axis = p.turn @ axes[0]
            r = r if still else r + axis * (q[joint.q.start] - tree.reference[i])
            a = p.a + p.omega.cross(axis) * (2.0 * qd[joint.qd.start])  # Coriolis
            frame = Frame(p.turn, r, p.omega, p.omegad, a, [(ZERO, axis)])
        else:
            if joint.kind == "ball":
                to_own = Matrix(axes)
                turn = p.turn @ (to_own.transposed @ turn_of(q[joint.q]) @ to_own)
            else:
                turn = p.turn @ rotation(tree.axis[joint.qd.start], q[joint.q.start] - tree.reference[i])
            axes = [(turn if joint.kind == "ball" else p.turn) @ axis for axis in axes]
            spin = ZERO
            for axis, rate in zip(axes, qd[joint.qd]):
                spin = spin + axis * rate
            omega, omegad = p.omega + spin, p.omegad + p.omega.cross(spin)
            # the acceleration is handed on where the joint is
            a = p.a + turning(p.omega, p.omegad) @ r - turning(omega, omegad) @ r
            frame = Frame(turn, r, omega, omegad, a, [(axis, r.cross(axis)) for axis in axes])
        frames.append(frame)
        rigid.append(about_point(own[i], frame))
    return frames, rigid


def about_point(own, frame) -> Rigid:
    """What a joint carries itself, about O."""
    m, r, omega, omegad, a = own.mass, frame.r, frame.omega, frame.omegad, frame.a
    turned = frame.turn @ own.moment
    s = turned + r * m
    (x, xy, xz), (_, y, yz), (_, _, z) = outer(r, turned) + outer(s, r)
    (A, D, E), (_, B, F), (_, _, C) = frame.turn @ own.inertia @ frame.turn.transposed
    J = Symmetric(Vector(A + (y + z), B + (x + z), C + (x + y)), Vector(F - yz, E - xz, D - xy))
    n = J.times(omegad) + omega.cross(J.times(omega)) + s.cross(a)
    return Rigid(n, a * m + turning(omega, omegad) @ s, J, s, m)
