"""A scalar that carries its derivative: exact derivatives over any other scalar.

The slope may be an array of more dimensions than the value: derivatives in many directions at once.
"""

from .space import cos, sin


class Dual:
    """value + slope d, with d d = 0; both parts are scalars of any type."""

    __slots__ = ("slope", "value")
    __array_ufunc__ = None  # else ndarray * Dual would be taken apart by NumPy

    def __init__(self, value, slope):
        self.value, self.slope = value, slope

    def __add__(self, other):
        value, slope = parts(other)
        return Dual(self.value + value, self.slope + slope)

    __radd__ = __add__

    def __sub__(self, other):
        value, slope = parts(other)
        return Dual(self.value - value, self.slope - slope)

    def __rsub__(self, other):
        value, slope = parts(other)
        return Dual(value - self.value, slope - self.slope)

    def __mul__(self, other):
        value, slope = parts(other)
        return Dual(self.value * value, self.slope * value + self.value * slope)

    __rmul__ = __mul__

    def __truediv__(self, other):
        value, slope = parts(other)
        quotient = self.value / value
        return Dual(quotient, (self.slope - quotient * slope) / value)

    def __rtruediv__(self, other):
        return Dual(*parts(other)) / self


def parts(scalar):
    """Value and slope of a scalar; a constant has slope 0."""
    return (scalar.value, scalar.slope) if isinstance(scalar, Dual) else (scalar, 0.0)


def jacobian(function, x) -> list:
    """d function_i / d x_j (rows i, columns j) of a function from a list of scalars to a list of scalars."""
    columns = []
    for j in range(len(x)):
        nudged = [Dual(value, 1.0 if i == j else 0.0) for i, value in enumerate(x)]
        columns.append([parts(result)[1] for result in function(nudged)])
    return [list(row) for row in zip(*columns)]


sin.register(Dual, lambda angle: Dual(sin(angle.value), cos(angle.value) * angle.slope))
cos.register(Dual, lambda angle: Dual(cos(angle.value), sin(angle.value) * angle.slope * -1.0))
