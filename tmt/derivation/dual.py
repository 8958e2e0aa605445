"""A scalar that carries its derivative: exact derivatives over any other scalar.

The slope may be an array of more dimensions than the value: derivatives in many directions at once. Dual
numbers may be nested (a derivative inside a step that is itself differentiated): each differentiation has a
level of its own, and a number of another level is a constant to it.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import count

import numpy as np

from .vectors import Rows, Scalar, Scalars, Values, cos, sign, sin, sqrt

levels = count()


class Dual:
    """value + slope d, with d d = 0; both parts are scalars of any type."""

    __slots__ = ("level", "slope", "value")
    __array_ufunc__ = None  # else ndarray * Dual would be taken apart by NumPy

    def __init__(self, value: Scalar, slope: Scalar, level: int):
        self.value, self.slope, self.level = value, slope, level

    def new(self, value: Scalar, slope: Scalar) -> "Dual":
        return Dual(value, slope, self.level)

    def parts(self, other: Scalar) -> tuple[Scalar, Scalar]:
        return (other.value, other.slope) if getattr(other, "level", None) == self.level else (other, 0.0)

    def outranked(self, other: Scalar) -> bool:
        """Whether the other is a dual number of an inner differentiation: then it decides."""
        return isinstance(other, Dual) and other.level > self.level

    def __add__(self, other: Scalar) -> Scalar:
        if isinstance(other, float):  # constants are many, and zeros and ones among them
            return self if other == 0.0 else self.new(self.value + other, self.slope)
        if self.outranked(other):
            return other.__radd__(self)
        value, slope = self.parts(other)
        return self.new(self.value + value, self.slope + slope)

    __radd__ = __add__

    def __neg__(self) -> "Dual":
        return self.new(-self.value, -self.slope)

    def __sub__(self, other: Scalar) -> Scalar:
        return self + -other

    def __rsub__(self, other: Scalar) -> Scalar:
        return -self + other

    def __mul__(self, other: Scalar) -> Scalar:
        if isinstance(other, float):
            if other in (0.0, 1.0):
                return self if other else 0.0
            return self.new(self.value * other, self.slope * other)
        if self.outranked(other):
            return other.__rmul__(self)
        value, slope = self.parts(other)
        return self.new(self.value * value, self.slope * value + self.value * slope)

    __rmul__ = __mul__

    def __truediv__(self, other: Scalar) -> Scalar:
        if isinstance(other, float):
            return self.new(self.value / other, self.slope / other)
        if self.outranked(other):
            return other.__rtruediv__(self)
        value, slope = self.parts(other)
        quotient = self.value / value
        return self.new(quotient, (self.slope - quotient * slope) / value)

    def __rtruediv__(self, other: Scalar) -> Scalar:
        return self.new(*self.parts(other)) / self


def seeded(values: Iterable[Scalar], slopes: Iterable[Scalar]) -> list[Dual]:
    level = next(levels)
    return [Dual(value, slope, level) for value, slope in zip(values, slopes)]


def jacobian(
    function: Callable[[Values], Iterable[Scalar]], x: Scalars, directions: Sequence[Scalars] = (),
    at_once: bool = False,
) -> Rows:  # fmt: skip
    """d function_i / d x_j (rows i, columns j); directions: in place of each x_j alone.

    at_once: all directions in one array, of an x of floats and arrays.
    """
    directions = directions or unit_vectors(len(x))
    if not at_once:
        columns = []
        for direction in directions:
            nudged = seeded(x, direction)
            columns.append([nudged[0].parts(result)[1] for result in function(nudged)])
        return [list(row) for row in zip(*columns)]
    batch = np.broadcast_shapes(*map(np.shape, x))
    nudged = seeded(x, [np.stack([np.broadcast_to(d, batch) for d in part]) for part in zip(*directions)])
    shape = len(directions), *batch
    slopes = [nudged[0].parts(result)[1] for result in function(nudged)]
    return [list(np.broadcast_to(slope, shape)) for slope in slopes]


def values_of(numbers: Values) -> Values:
    return [x.value if isinstance(x, Dual) else x for x in numbers]


def unit_vectors(n: int) -> list[list[float]]:
    return [[1.0 if i == j else 0.0 for i in range(n)] for j in range(n)]


sin.register(Dual, lambda angle: angle.new(sin(angle.value), cos(angle.value) * angle.slope))
cos.register(Dual, lambda angle: angle.new(cos(angle.value), sin(angle.value) * angle.slope * -1.0))
sqrt.register(Dual, lambda x: x.new(root := sqrt(x.value), x.slope / (root * 2.0)))
sign.register(Dual, lambda x: sign(x.value))
