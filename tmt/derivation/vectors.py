"""Vectors, rotations and linear systems over any scalar: float, array, mpf, traced or symbolic.

A scalar is anything with + - * / that `sin` and `cos` know, and for ball joints `sqrt` and `sign`. A new
scalar type registers itself with `sin.register` and so on; nothing else has to change.
"""

from collections.abc import Iterable, Iterator, Sequence
from functools import singledispatch
from typing import Any, NamedTuple, TypeVar, overload

import mpmath
import numpy as np
from numpy.typing import NDArray

Scalar = Any  # of any number type over which the method is written
Record = TypeVar("Record", bound=NamedTuple)
Values = list[Scalar]
Rows = list[Values]
Scalars = Sequence[Scalar] | NDArray[Any]
# of a scalar of any registered type, angles in rad
sin, cos, sqrt = map(singledispatch, (np.sin, np.cos, np.sqrt))
sin.register(mpmath.mpf, mpmath.sin)
cos.register(mpmath.mpf, mpmath.cos)
sqrt.register(mpmath.mpf, mpmath.sqrt)


@singledispatch
def sign(x: Scalar) -> Scalar:
    """-1 where x < 0, else 1: of zeros too, whatever their sign."""
    return 1.0 - 2.0 * (x < 0.0)


class Vector:
    __slots__ = ("x", "y", "z")
    __array_ufunc__ = None  # else ndarray * Vector would be taken apart by NumPy

    def __init__(self, x: Scalar, y: Scalar, z: Scalar):
        self.x, self.y, self.z = x, y, z

    def __iter__(self) -> Iterator[Scalar]:
        return iter((self.x, self.y, self.z))

    def __add__(self, other: "Vector") -> "Vector":
        return Vector(self.x + other.x, self.y + other.y, self.z + other.z)

    def __sub__(self, other: "Vector") -> "Vector":
        return Vector(self.x - other.x, self.y - other.y, self.z - other.z)

    def __mul__(self, scalar: Scalar) -> "Vector":
        return Vector(self.x * scalar, self.y * scalar, self.z * scalar)

    __rmul__ = __mul__

    def dot(self, other: "Vector") -> Scalar:
        return self.x * other.x + self.y * other.y + self.z * other.z

    def cross(self, other: "Vector") -> "Vector":
        return Vector(
            self.y * other.z - self.z * other.y,
            self.z * other.x - self.x * other.z,
            self.x * other.y - self.y * other.x,
        )


ZERO = Vector(0.0, 0.0, 0.0)


class Matrix:
    """A 3 x 3 matrix by rows, each a Vector; `matrix @ vector` and `matrix @ matrix`."""

    __slots__ = ("rows",)

    def __init__(self, rows: Iterable[Iterable[Scalar]]):
        self.rows = tuple(row if isinstance(row, Vector) else Vector(*row) for row in rows)

    def __iter__(self) -> Iterator[Vector]:
        return iter(self.rows)

    def __add__(self, other: "Matrix") -> "Matrix":
        return Matrix([row + more for row, more in zip(self, other)])

    def __sub__(self, other: "Matrix") -> "Matrix":
        return Matrix([row - less for row, less in zip(self, other)])

    @overload
    def __matmul__(self, other: Vector) -> Vector: ...
    @overload
    def __matmul__(self, other: "Matrix") -> "Matrix": ...
    def __matmul__(self, other: "Vector | Matrix") -> "Vector | Matrix":
        if isinstance(other, Vector):
            return Vector(*(row.dot(other) for row in self.rows))
        columns = other.transposed.rows
        return Matrix([[row.dot(column) for column in columns] for row in self.rows])

    @property
    def transposed(self) -> "Matrix":
        return Matrix(zip(*self.rows))


IDENTITY = Matrix([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]])


def outer(a: Vector, b: Vector) -> Matrix:
    return Matrix([b * component for component in a])


def rotation(axis: Iterable[Scalar], angle: Scalar) -> Matrix:
    """Matrix that turns by `angle` (rad, right-handed) about the unit vector `axis`.

    R = a a' + cos (1 - a a') + sin [a]x, grouped so that a coordinate axis leaves exact zeros and ones.
    """
    x, y, z = axis
    s, c = sin(angle), cos(angle)
    first = x * x + c * (1 - x * x), x * y - c * (x * y) - s * z, x * z - c * (x * z) + s * y
    second = x * y - c * (x * y) + s * z, y * y + c * (1 - y * y), y * z - c * (y * z) - s * x
    third = x * z - c * (x * z) - s * y, y * z - c * (y * z) + s * x, z * z + c * (1 - z * z)
    return Matrix([first, second, third])


def rotation_of(quaternion: Iterable[Scalar]) -> Matrix:
    """Matrix that turns as a quaternion p = (w, v) of any length: R = 1 + 2 (w [v]x + [v]x [v]x) / p.p."""
    w, x, y, z = quaternion
    scale = 2.0 / (w * w + x * x + y * y + z * z)
    a, b, c = x * scale, y * scale, z * scale
    xx, yy, zz, xy, xz, yz = x * a, y * b, z * c, x * b, x * c, y * c
    wx, wy, wz = w * a, w * b, w * c
    first = 1.0 - (yy + zz), xy - wz, xz + wy
    second = xy + wz, 1.0 - (xx + zz), yz - wx
    third = xz - wy, yz + wx, 1.0 - (xx + yy)
    return Matrix([first, second, third])


class Factors:
    """A symmetric positive definite matrix, given by rows, as U D U', from the last row to the first.

    Without square roots or pivots (none are needed: it is positive definite). In that order a joint meets
    only its ancestors: zeros between branches stay zeros, as in MuJoCo.
    """

    def __init__(self, matrix: Sequence[Scalars]):
        n = len(matrix)
        scaled: Rows = [[None] * n for _ in range(n)]  # U D
        upper: Rows = [[None] * n for _ in range(n)]
        inverse: Values = [None] * n  # of D
        for j in reversed(range(n)):
            behind = range(j + 1, n)
            inverse[j] = 1.0 / (matrix[j][j] - total(scaled[j][k] * upper[j][k] for k in behind))
            for i in range(j):
                scaled[i][j] = matrix[i][j] - total(scaled[i][k] * upper[j][k] for k in behind)
                upper[i][j] = scaled[i][j] * inverse[j]
        self.upper, self.inverse = upper, inverse

    def solve(self, right: Scalars) -> Values:
        n, x = len(right), list(right)
        for i in reversed(range(n)):
            x[i] = x[i] - total(self.upper[i][k] * x[k] for k in range(i + 1, n) if not is_zero(x[k]))
        for i in range(n):
            x[i] = x[i] * self.inverse[i] - total(self.upper[k][i] * x[k] for k in range(i))
        return x

    def solve_columns(self, right: Sequence[Scalars]) -> Rows:
        return [list(row) for row in zip(*[self.solve(column) for column in zip(*right)])]

    def inverted(self) -> Rows:
        n = len(self.inverse)
        columns = [self.solve([1.0 if i == j else 0.0 for i in range(n)]) for j in range(n)]
        return [[columns[max(i, j)][min(i, j)] for j in range(n)] for i in range(n)]


def solve_any(matrix: Sequence[Scalars], right: Scalars) -> Values:
    """Solution x of `matrix` x = `right`, any by rows, by L U without pivots, as MuJoCo's implicit has it."""
    n = len(right)
    upper, x = [list(row) for row in matrix], list(right)
    for k in range(n):
        for i in range(k + 1, n):
            factor = upper[i][k] / upper[k][k]
            for j in range(k + 1, n):
                upper[i][j] = upper[i][j] - factor * upper[k][j]
            x[i] = x[i] - factor * x[k]
    for i in reversed(range(n)):
        x[i] = (x[i] - total(upper[i][k] * x[k] for k in range(i + 1, n))) / upper[i][i]
    return x


def combined(a: Record, b: Record) -> Record:
    parts = zip(a, b)
    return a._make([combined(x, y) if isinstance(x, tuple) else x + y for x, y in parts])


def is_zero(x: Scalar) -> bool:
    """Whether a scalar is a plain zero, as many entries of directions and of trees with branches are."""
    return isinstance(x, float) and x == 0.0


def total(terms: Iterable[Scalar]) -> Scalar:
    return sum(terms, 0.0)


def weighted(weights: Iterable[Scalar], values: Iterable[Scalar]) -> Scalar:
    """The sum of weights times values, of those that are not plain zeros; 0.0 where all are."""
    return total(weight * value for weight, value in zip(weights, values) if weight)


def plus(first: Scalars, second: Scalars) -> Values:
    return [a + b for a, b in zip(first, second)]


def minus(first: Scalars, second: Scalars) -> Values:
    return [a - b for a, b in zip(first, second)]


def added(first: Sequence[Scalars], second: Sequence[Scalars]) -> Rows:
    return [plus(*rows) for rows in zip(first, second)]
