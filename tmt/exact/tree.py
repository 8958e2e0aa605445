"""A Tree with its numbers in another type, so that none is rounded on the way: for many digits."""

from collections.abc import Callable, Iterable

from tmt.derivation.coordinates import Coordinates, normalized
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import Scalar, Vector, sqrt
from tmt.model.tree import Tree

DIGITS = 50  # of computations that show that numbers are zero or that others are right


def exact_tree(tree: Tree, number: Callable[[float], Scalar]) -> Mechanism:
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
    return Mechanism(**numbers | {"axis": tuple(map(tuple, axis)), "rest": rest})


def _unit(vector: Vector) -> Vector:
    return vector * (1 / sqrt(vector.dot(vector)))


def of_length_1(coordinates: Coordinates, q: Iterable[Scalar]) -> list[Scalar]:
    position = list(q)
    for joint in coordinates.balls:
        position[joint.q] = normalized(position[joint.q])
    return position
