"""A Tree with its numbers in another type, so that none is rounded on the way: for many digits."""

from collections.abc import Callable, Iterable

import mpmath

from tmt.derivation.coordinates import Coordinates, normalized
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import Scalar, Scalars, Vector, sqrt
from tmt.model.tree import Tree

DIGITS = 50  # of computations that show that numbers are zero or that others are right
HALVINGS = 4  # of a turn of at most pi rad: then the sine of its half is below 0.1
with mpmath.workdps(60):  # arcsin x = x (1 + x^2 / 6 + ...), the highest first; the next is below 1e-37
    ARC_SINE = [mpmath.binomial(2 * k, k) / (4**k * (2 * k + 1)) for k in reversed(range(18))]


class ExactTree(Mechanism[Scalar]):
    @property
    def coordinates(self) -> Coordinates:
        return Analytic(*super().coordinates)


def exact_tree(tree: Tree, number: Callable[[float], Scalar]) -> ExactTree:
    """A Tree with each number made by `number` from its double; directions have length 1 in all digits.

    number: mpmath.mpf, or another type made from a double. Turns about an axis that is a little longer than 1
    would not be turns, and regrouped sums would differ from the literal ones by that.
    """

    def lifted(value: Scalar) -> Scalar:
        if isinstance(value, tuple):
            return tuple(map(lifted, value))
        return number(value) if isinstance(value, float) else value

    axis: list[Vector] = []
    for joint in tree.coordinates.joints:
        first, *more = [Vector(*map(number, direction)) for direction in tree.axis[joint.qd]]
        x = _unit(first)
        axis.append(x)
        if joint.kind == "ball":
            y = _unit(more[0] - x * x.dot(more[0]))
            axis += [y, x.cross(y)]
    numbers = {name: lifted(value) for name, value in vars(tree).items()}
    rest = tuple(of_length_1(tree.coordinates, numbers["rest"]))
    return ExactTree(**numbers | {"axis": tuple(map(tuple, axis)), "rest": rest})


def _unit(vector: Vector) -> Vector:
    return vector * (1 / sqrt(vector.dot(vector)))


def of_length_1(coordinates: Coordinates, q: Iterable[Scalar]) -> list[Scalar]:
    position = list(q)
    for joint in coordinates.balls:
        position[joint.q] = normalized(position[joint.q])
    return position


class Analytic(Coordinates):
    """Coordinates whose `difference` of two quaternions of length 1 has derivatives where it is zero too."""

    @staticmethod
    def logarithm(p: Scalars) -> list[Scalar]:
        """Without a root of what vanishes: the turn is halved until a series of the arc sine takes it."""
        w, *v = p
        cosine = sqrt(w * w)
        scale = w / cosine
        for _ in range(HALVINGS):
            cosine = sqrt((cosine + 1.0) / 2.0)
            scale = scale / (cosine * 2.0)
        v = Vector(*v) * scale
        square, share = v.dot(v), 0.0
        for factor in ARC_SINE:
            share = share * square + factor
        return list(v * (share * 2.0 ** (HALVINGS + 1)))
