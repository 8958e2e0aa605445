"""The sums of method.py regrouped for speed: in the frames of the joints, from the tips of the tree inward.

All that a joint carries is one mass distribution: mass m, first moment s and second moment S = integral of x x' dm about
the origin of its frame. Where that origin accelerates by a and the frame turns with P = [omegad]x + [omega]x[omega]x, the
point x accelerates by a + P x, and force and moment of the distribution are

    f = m a + P s        n = integral of x cross (a + P x) dm = vee(P S) + s cross a.

Virtual power asks for the component of n along each axis only: h_i = axis_i . n_i, with f and n summed over all that joint
i carries, gravity as an acceleration -g of the world; along a slide for that of f. Column i of Mbar is the same for
omegad = axis_i (of a slide a = axis_i), all else 0, and the distribution of the whole subtree. These are the sums of the
assignment's part e in another order.
"""

from fractions import Fraction
from functools import lru_cache
from typing import NamedTuple

import mpmath

from tmt.derivation.vectors import IDENTITY, ZERO, Matrix, Vector, rotation, total_vector, turn_of


class Distribution(NamedTuple):
    """Mass about the origin of a frame, in its axes."""

    mass: object  # kg
    moment: Vector  # kg m
    second: Matrix  # kg m2, symmetric

    def plus(self, other) -> "Distribution":
        return Distribution(self.mass + other.mass, self.moment + other.moment, self.second + other.second)

    def less(self, other) -> "Distribution":
        return Distribution(self.mass - other.mass, self.moment - other.moment, self.second - other.second)

    def moved(self, by) -> "Distribution":
        """The distribution about another origin, from which the old one is at `by` (m)."""
        moment = self.moment + self.mass * by
        return Distribution(self.mass, moment, self.second + outer(by, self.moment) + outer(moment, by))

    def turned(self, turn) -> "Distribution":
        """The distribution in other axes; `turn` takes components to them."""
        return Distribution(self.mass, turn @ self.moment, turn @ self.second @ turn.transposed)

    @property
    def inertia(self) -> Matrix:
        """I = tr(S) 1 - S, kg m2."""
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = self.second
        return Matrix([[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]])

    def on_line(self, axis) -> "Distribution":
        """Its part on a line through the origin: a hinge about that line cannot tell to which side it belongs."""
        along = self.moment.dot(axis)
        return Distribution(self.mass, axis * along, outer(axis, axis * axis.dot(self.second @ axis)))

    def even_about(self, axis) -> "Distribution":
        """A part u (1 - axis axis') of the second moment, which turning about the axis leaves as it is."""
        across = min((Vector(1, 0, 0), Vector(0, 1, 0), Vector(0, 0, 1)), key=lambda e: abs(e.dot(axis)))
        across = across - axis * axis.dot(across)
        u = across.dot(self.second @ across) / across.dot(across)
        return Distribution(
            0, Vector(0, 0, 0), Matrix([[u, 0, 0], [0, u, 0], [0, 0, u]]) - outer(axis, axis * u)
        )

    def rounded(self, number) -> "Distribution":
        """The distribution in another type of number, each rounded once; zeros stay plain."""

        def one(x):
            x = Fraction(x)
            return (
                (x.numerator / x.denominator if number is float else number(x.numerator) / x.denominator)
                if x
                else 0.0
            )

        vectors = [Vector(*map(one, v)) for v in (self.moment, *self.second)]
        return Distribution(one(self.mass), vectors[0], Matrix(vectors[1:]))


def fraction(x) -> Fraction:
    """A double, or a number of mpmath's, exactly."""
    if not isinstance(x, mpmath.mpf):
        return Fraction(x)
    sign, digits, power, _ = x._mpf_
    return (-1) ** sign * int(digits) * Fraction(2) ** int(power)


NOTHING = Distribution(0, Vector(0, 0, 0), Matrix([[0] * 3] * 3))


def outer(a, b) -> Matrix:
    """a b'."""
    return Matrix([b * component for component in a])


def carried_by_joint(tree) -> list[Distribution]:
    """The distribution that each joint carries itself, in exact fractions, as far inward as it can be handed.

    What lies on a hinge's axis (its mass, first moment and second moment along it) acts the same if it belongs to the
    parent, and so does the mass at a ball's centre, or the second moment alone of what slides. So it is handed over: many
    numbers of the outer bodies become zeros, and what reaches the world drops out.
    """
    joints = tree.coordinates.joints
    axes = [Vector(*map(fraction, tree.axis[joint.qd.start])) for joint in joints]
    offsets = [Vector(*map(fraction, v)) for v in tree.offset]
    own = [NOTHING] * len(axes)
    for b, joint in enumerate(tree.body_joint):
        if joint >= 0:
            mass, com = fraction(tree.mass[b]), Vector(*map(fraction, tree.com[b]))
            inertia = [[fraction(x) for x in row] for row in tree.inertia[b]]
            half = sum(inertia[i][i] for i in range(3)) / 2
            second = [
                [(half if i == j else 0) - (inertia[i][j] + inertia[j][i]) / 2 for j in range(3)]
                for i in range(3)
            ]
            own[joint] = own[joint].plus(Distribution(mass, Vector(0, 0, 0), Matrix(second)).moved(com))
    for i in reversed(range(len(axes))):
        none = Vector(0, 0, 0)
        if tree.kind[i] == "hinge":
            handed = own[i].on_line(axes[i])
        elif tree.kind[i] == "ball":
            handed = Distribution(own[i].mass, none, NOTHING.second)
        else:
            handed = Distribution(0, none, own[i].second)
        own[i] = own[i].less(handed)
        if tree.parent[i] >= 0:
            own[tree.parent[i]] = own[tree.parent[i]].plus(handed.moved(offsets[i]))
    return own


def mass_matrix_and_bias(tree, q, qd, number=float) -> tuple[list, list]:
    """Mbar (nv rows of nv, kg m2) and h (nv, N m), as in method.py; over any scalar.

    q (nq), qd (nv): sequences of scalars, rad and rad/s. number: the type of the model's numbers, float or mpmath.mpf; each
    is the exact value, rounded once.
    """
    n, joints = len(tree.axis), tree.coordinates.joints
    axes = [Vector(*v) for v in tree.axis]
    offsets, turns = zip(*(placed(tree, i, q) for i in range(len(joints))))
    # fractions take their time; other numbers than floats may be rounded to other digits from call to call
    parts = rounded_once if number is float and tree.__hash__ else rounded_once.__wrapped__
    own, uneven, even = map(list, parts(tree, number))

    # outward: each frame's motion at qdd = 0, in its own axes
    motions = []
    for i, joint in enumerate(joints):
        to_child = turns[i].transposed
        if tree.parent[i] >= 0:
            a, omega, omegad, P = motions[tree.parent[i]]
            a, omega, omegad = a + P @ offsets[i], to_child @ omega, to_child @ omegad
        else:
            a, omega, omegad = Vector(*tree.gravity) * -1.0, ZERO, ZERO
        moving = total_vector(axis * rate for axis, rate in zip(axes[joint.qd], qd[joint.qd]))
        if joint.kind == "slide":
            motions.append((a + omega.cross(moving * 2.0), omega, omegad, turning(omega, omegad)))
            continue
        a, omegad, omega = to_child @ a, omegad + omega.cross(moving), omega + moving
        motions.append((a, omega, omegad, turning(omega, omegad)))

    # inward: force and moment on all that a joint carries, and its mass; what is even about a hinge is not turned
    h, M = [None] * n, [[0.0] * n for _ in range(n)]
    forces, moments = [ZERO] * len(joints), [ZERO] * len(joints)
    for i in reversed(range(len(joints))):
        a, _, _, P = motions[i]
        forces[i] = forces[i] + own[i].mass * a + P @ own[i].moment
        moments[i] = moments[i] + vee(P @ own[i].second) + own[i].moment.cross(a)
        carried, parent = uneven[i].plus(even[i]), tree.parent[i]
        for k in range(*joints[i].qd.indices(n)):
            slides = tree.kind[i] == "slide"
            h[k] = axes[k].dot(forces[i] if slides else moments[i])
            if slides:
                force, moment = carried.mass * axes[k], carried.moment.cross(axes[k])
            else:
                force, moment = axes[k].cross(carried.moment), carried.inertia @ axes[k]
            M[k][k] = axes[k].dot(force if slides else moment)
            M[k][k] = M[k][k] + tree.armature[k] if tree.armature[k] else M[k][k]
            for other in range(joints[i].qd.start, k):  # of the same ball
                M[k][other] = M[other][k] = axes[other].dot(moment)
            j = i
            while tree.parent[j] >= 0:
                force, moment = handed_down(turns[j], offsets[j], force, moment)
                j = tree.parent[j]
                for other in range(*joints[j].qd.indices(n)):
                    M[k][other] = M[other][k] = axes[other].dot(force if tree.kind[j] == "slide" else moment)
        if parent >= 0:
            force, moment = handed_down(turns[i], offsets[i], forces[i], moments[i])
            forces[parent], moments[parent] = forces[parent] + force, moments[parent] + moment
            uneven[parent] = uneven[parent].plus(uneven[i].turned(turns[i]).plus(even[i]).moved(offsets[i]))
    return M, h


@lru_cache(maxsize=64)
def rounded_once(tree, number) -> tuple[list, list, list]:
    """What each joint carries itself, and the part of it that is not even about a hinge, and the part that is."""
    exact = carried_by_joint(tree)
    even = [
        d.even_about(Vector(*map(fraction, tree.axis[joint.qd.start]))) if joint.kind == "hinge" else NOTHING
        for d, joint in zip(exact, tree.coordinates.joints)
    ]
    uneven = [d.less(e) for d, e in zip(exact, even)]
    return tuple([d.rounded(number) for d in ds] for ds in (exact, uneven, even))


def placed(tree, i, q) -> tuple[Vector, Matrix]:
    """Origin and turn of joint i's frame in its parent's."""
    joint = tree.coordinates.joints[i]
    offset = Vector(*tree.offset[i])
    if joint.kind == "ball":
        frame = Matrix(tree.axis[joint.qd])
        return offset, frame.transposed @ turn_of(q[joint.q]) @ frame
    off = q[joint.q.start] - tree.reference[i]
    if joint.kind == "slide":
        return offset + Vector(*tree.axis[joint.qd.start]) * off, IDENTITY
    return offset, rotation(tree.axis[joint.qd.start], off)


def handed_down(turn, offset, force, moment):
    """Force and moment about the origin of the parent's frame, in its axes."""
    force = turn @ force
    return force, turn @ moment + offset.cross(force)


def turning(omega, omegad) -> Matrix:
    """P = [omegad]x + [omega]x[omega]x."""
    x, y, z = omega
    u, v, w = omegad
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    return Matrix(
        [
            [(yy + zz) * -1.0, xy - w, xz + v],
            [xy + w, (xx + zz) * -1.0, yz - u],
            [xz - v, yz + u, (xx + yy) * -1.0],
        ]
    )


def vee(matrix) -> Vector:
    """Integral of x cross P x dm, for the matrix P S."""
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = matrix
    return Vector(zy - yz, xz - zx, yx - xy)
