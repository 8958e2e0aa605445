"""The sums of method.py regrouped for speed: in the frames of the joints, from the tips of the tree inward.

All that a joint carries is one mass distribution: mass m, first moment s and second moment S = integral of x
x' dm about the origin of its frame. Where that origin accelerates by a and the frame turns with P = [omegad]x
+ [omega]x[omega]x, the point x accelerates by a + P x, and force and moment of the distribution are

    f = m a + P s        n = integral of x cross (a + P x) dm = vee(P S) + s cross a.

Virtual power asks for the component of n along each axis only: h_i = axis_i . n_i, with f and n summed over
all that joint i carries, gravity as an acceleration -g of the world; along a slide for that of f. Column i of
Mbar is the same for omegad = axis_i (of a slide a = axis_i), all else 0, and the distribution of the whole
subtree. These are the sums of the assignment's part e in another order.
"""

from collections.abc import Callable, Hashable
from fractions import Fraction
from functools import lru_cache
from numbers import Rational
from typing import NamedTuple

import mpmath

from .coordinates import Joint
from .mechanism import Mechanism, origin_in_parent, rotation_in_parent
from .method import with_diagonal, with_rotors
from .vectors import ZERO, Matrix, Rows, Scalar, Scalars, Values, Vector, combined, outer

Placement = tuple[Vector, Matrix]  # origin (m) and turn of a frame in its parent's
Round = Callable[..., Scalar]  # float or mpmath.mpf, to which what is exact is rounded once


class Distribution(NamedTuple):
    mass: Scalar  # kg
    moment: Vector  # kg m
    second: Matrix  # kg m2, symmetric

    def less(self, other: "Distribution") -> "Distribution":
        return Distribution(self.mass - other.mass, self.moment - other.moment, self.second - other.second)

    def moved(self, by: Vector) -> "Distribution":
        """The distribution about another origin, from which the old one is at `by` (m)."""
        moment = self.moment + self.mass * by
        return Distribution(self.mass, moment, self.second + outer(by, self.moment) + outer(moment, by))

    def turned(self, rotation: Matrix) -> "Distribution":
        return Distribution(self.mass, rotation @ self.moment, rotation @ self.second @ rotation.transposed)

    @property
    def inertia(self) -> Matrix:
        (xx, xy, xz), (_, yy, yz), (_, _, zz) = self.second
        return Matrix([[yy + zz, -xy, -xz], [-xy, xx + zz, -yz], [-xz, -yz, xx + yy]])

    def at_unit_acceleration(self, kind: str, axis: Vector) -> tuple[Vector, Vector]:
        """Force and moment about the origin where a joint accelerates by 1 along or about its axis."""
        if kind == "slide":
            return self.mass * axis, self.moment.cross(axis)
        return axis.cross(self.moment), self.inertia @ axis

    def on_line(self, axis: Vector) -> "Distribution":
        """Its part on a line through the origin: a hinge about it cannot tell to which side that belongs."""
        along = self.moment.dot(axis)
        return Distribution(self.mass, axis * along, outer(axis, axis * axis.dot(self.second @ axis)))

    def even_about(self, axis: Vector) -> "Distribution":
        """A part u (1 - axis axis') of the second moment, which turning about the axis leaves as it is."""
        across = min((Vector(1, 0, 0), Vector(0, 1, 0), Vector(0, 0, 1)), key=lambda e: abs(e.dot(axis)))
        across = across - axis * axis.dot(across)
        u = across.dot(self.second @ across) / across.dot(across)
        second = Matrix([[u, 0, 0], [0, u, 0], [0, 0, u]]) - outer(axis, axis * u)
        return Distribution(0, NOTHING.moment, second)

    def rounded(self, number: Round) -> "Distribution":
        """The distribution in another type of number, each rounded once; zeros stay plain."""

        def one(x: Scalar) -> Scalar:
            if not isinstance(x, Rational):  # a parameter
                return x
            x = Fraction(x)
            if not x:
                return 0.0
            return float(x) if number is float else number(x.numerator) / x.denominator

        moment, *second = [Vector(*map(one, v)) for v in (self.moment, *self.second)]
        return Distribution(one(self.mass), moment, Matrix(second))


NOTHING = Distribution(0, Vector(0, 0, 0), Matrix([[0] * 3] * 3))


def fraction(x: Scalar) -> Scalar:
    """A double, or a number of mpmath's, exactly; a parameter, which has no value yet, as it is."""
    if isinstance(x, (float, Rational)):
        return Fraction(x)
    if not isinstance(x, mpmath.mpf):
        return x
    digits, power = x.man_exp  # without the sign
    return Fraction(int(digits if x > 0 else -digits)) * Fraction(2) ** int(power)


def exact_vector(components: Scalars) -> Vector:
    return Vector(*map(fraction, components))


def distribution_of(tree: Mechanism, body: int) -> Distribution:
    """The distribution of a body about the origin of its joint's frame, in exact fractions: ten numbers."""
    inertia = Matrix(map(exact_vector, tree.inertia[body]))
    (xx, *_), (_, yy, _), (*_, zz) = inertia
    half = (xx + yy + zz) / 2
    symmetric = Matrix([row * Fraction(1, 2) for row in inertia + inertia.transposed])
    second = Matrix([[half, 0, 0], [0, half, 0], [0, 0, half]]) - symmetric
    about_com = Distribution(fraction(tree.mass[body]), NOTHING.moment, second)
    return about_com.moved(exact_vector(tree.com[body]))


def carried_by_joint(tree: Mechanism) -> list[Distribution]:
    """The distribution that each joint carries itself, in exact fractions, as far inward as it can be handed.

    What lies on a hinge's axis (its mass, first moment and second moment along it) acts the same if it
    belongs to the parent, and so does the mass at a ball's centre, or the second moment alone of what slides.
    So it is handed over: many numbers of the outer bodies become zeros, and what reaches the world drops out.
    """
    joints = tree.coordinates.joints
    own = [NOTHING] * len(joints)
    for body, i in enumerate(tree.body_joint):
        if i >= 0:
            own[i] = combined(own[i], distribution_of(tree, body))
    for i in reversed(range(len(joints))):
        if joints[i].kind == "hinge":
            handed = own[i].on_line(exact_vector(tree.axis[joints[i].qd.start]))
        elif joints[i].kind == "ball":
            handed = NOTHING._replace(mass=own[i].mass)
        else:
            handed = NOTHING._replace(second=own[i].second)
        own[i] = own[i].less(handed)
        if tree.parent[i] >= 0:
            handed = handed.moved(exact_vector(tree.offset[i]))
            own[tree.parent[i]] = combined(own[tree.parent[i]], handed)
    return own


class Motion(NamedTuple):
    a: Vector  # of its origin
    omega: Vector
    omegad: Vector
    P: Matrix


def along_axes(tree: Mechanism, joint: Joint, rates: Scalars) -> Vector:
    return sum((Vector(*axis) * rate for axis, rate in zip(tree.axis[joint.qd], rates[joint.qd])), ZERO)


def motions(tree: Mechanism, placements: list[Placement], qd: Scalars, qdd: Scalars = ()) -> list[Motion]:
    result: list[Motion] = []
    for i, (joint, (offset, rotation)) in enumerate(zip(tree.coordinates.joints, placements)):
        a, omega, omegad = Vector(*tree.gravity) * -1.0, ZERO, ZERO
        if tree.parent[i] >= 0:
            parent, to_child = result[tree.parent[i]], rotation.transposed
            a = parent.a + parent.P @ offset
            omega, omegad = to_child @ parent.omega, to_child @ parent.omegad
        moving = along_axes(tree, joint, qd)
        if joint.kind == "slide":
            a = a + omega.cross(moving * 2.0)
        else:
            a, omegad, omega = rotation.transposed @ a, omegad + omega.cross(moving), omega + moving
        if qdd:
            more = along_axes(tree, joint, qdd)
            a, omegad = (a + more, omegad) if joint.kind == "slide" else (a, omegad + more)
        result.append(Motion(a, omega, omegad, turning(omega, omegad)))
    return result


def mass_matrix_and_bias(
    tree: Mechanism, q: Scalars, qd: Scalars, number: Round = float
) -> tuple[Rows, Values]:
    n, joints, placements = len(tree.axis), tree.coordinates.joints, placed(tree, q)
    axes = [Vector(*axis) for axis in tree.axis]
    own, uneven, even = map(list, rounded(tree, number))
    # inward: the mass that a joint carries; what is even about a hinge is not turned
    M: Rows = [[0.0] * n for _ in range(n)]
    for i in reversed(range(len(joints))):
        kind, parent = joints[i].kind, tree.parent[i]
        carried = combined(uneven[i], even[i])
        for k in joints[i].speeds:
            force, moment = carried.at_unit_acceleration(kind, axes[k])
            M[k][k] = axes[k].dot(force if kind == "slide" else moment)
            for other in range(joints[i].qd.start, k):  # of the same ball
                M[k][other] = M[other][k] = axes[other].dot(moment)
            j = i
            while tree.parent[j] >= 0:
                force, moment = handed_down(*placements[j], force, moment)
                j = tree.parent[j]
                acts = force if joints[j].kind == "slide" else moment
                for other in joints[j].speeds:
                    M[k][other] = M[other][k] = axes[other].dot(acts)
        if parent >= 0:
            offset, rotation = placements[i]
            carried = combined(uneven[i].turned(rotation), even[i]).moved(offset)
            uneven[parent] = combined(uneven[parent], carried)
    h = inward(tree, placements, motions(tree, placements, qd), own)
    return with_diagonal(M, tree.armature), h


def generalized_force(
    tree: Mechanism, q: Scalars, qd: Scalars, qdd: Scalars, number: Round = float
) -> Values:
    placements = placed(tree, q)
    own, moving = rounded(tree, number)[0], motions(tree, placements, qd, qdd)
    return with_rotors(tree, inward(tree, placements, moving, own), qdd)


def placed(tree: Mechanism, q: Scalars) -> list[Placement]:
    return [(origin_in_parent(tree, i, q), rotation_in_parent(tree, i, q)) for i in range(len(tree.parent))]


def inward(
    tree: Mechanism, placements: list[Placement], moving: list[Motion], own: list[Distribution]
) -> Values:
    """Force and moment on all that each joint carries, along and about its axes, (nv,)."""
    result: Values = [0.0] * len(tree.axis)
    forces, moments = [ZERO] * len(own), [ZERO] * len(own)
    for i, joint in reversed(list(enumerate(tree.coordinates.joints))):
        parent, a, P = tree.parent[i], moving[i].a, moving[i].P
        forces[i] = forces[i] + own[i].mass * a + P @ own[i].moment
        moments[i] = moments[i] + vee(P @ own[i].second) + own[i].moment.cross(a)
        for k in joint.speeds:
            result[k] = Vector(*tree.axis[k]).dot(forces[i] if joint.kind == "slide" else moments[i])
        if parent >= 0:
            offset, rotation = placements[i]
            force, moment = handed_down(offset, rotation, forces[i], moments[i])
            forces[parent], moments[parent] = forces[parent] + force, moments[parent] + moment
    return result


def rounded(tree: Mechanism, number: Round) -> tuple[list[Distribution], ...]:
    """As rounded_once, which holds floats alone: other numbers may have other digits in another call."""
    parts = rounded_once if number is float and isinstance(tree, Hashable) else rounded_once.__wrapped__
    return parts(tree, number)


@lru_cache(maxsize=64)
def rounded_once(tree: Mechanism, number: Round) -> tuple[list[Distribution], ...]:
    """What each joint carries itself, its part that is not even about a hinge, and the part that is."""
    exact = carried_by_joint(tree)
    even = [NOTHING] * len(exact)
    for i, joint in enumerate(tree.coordinates.joints):
        if joint.kind == "hinge":
            even[i] = exact[i].even_about(exact_vector(tree.axis[joint.qd.start]))
    uneven = [all_of_it.less(part) for all_of_it, part in zip(exact, even)]
    return tuple([part.rounded(number) for part in parts] for parts in (exact, uneven, even))


def handed_down(offset: Vector, rotation: Matrix, force: Vector, moment: Vector) -> tuple[Vector, Vector]:
    force = rotation @ force
    return force, rotation @ moment + offset.cross(force)


def turning(omega: Vector, omegad: Vector) -> Matrix:
    x, y, z = omega
    u, v, w = omegad
    xx, yy, zz = x * x, y * y, z * z
    xy, xz, yz = x * y, x * z, y * z
    first = (yy + zz) * -1.0, xy - w, xz + v
    second = xy + w, (xx + zz) * -1.0, yz - u
    third = xz - v, yz + u, (xx + yy) * -1.0
    return Matrix([first, second, third])


def vee(matrix: Matrix) -> Vector:
    (_, xy, xz), (yx, _, yz), (zx, zy, _) = matrix
    return Vector(zy - yz, xz - zx, yx - xy)
