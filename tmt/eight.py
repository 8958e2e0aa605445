"""Eight doubles side by side as one number of compiled code, and numbers of such code while it is written, see inlined.py.

Each of eight is to the bit what one double is, as the processor's instructions for eight do what those for one do.
"""

import cmath
import math
import operator
from collections.abc import Callable

from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.core.typing import signature
from numba.extending import models, register_model

from tmt.equations.vectors import arctan, cos, sin, sqrt

WIDTH = 8
VECTOR = ir.VectorType(ir.DoubleType(), WIDTH)
DOUBLE, COMPLEX, INDEX = types.float64, types.complex128, types.intp


class Eight(types.Type):
    """The type of eight doubles as one number."""

    def __init__(self):
        super().__init__("Eight")


EIGHT = Eight()


@register_model(Eight)
class EightModel(models.PrimitiveModel):
    """It is one register of the processor."""

    def __init__(self, manager, of):
        super().__init__(manager, of, VECTOR)


class Number:
    """A number of type `of` in code that is being written; while types alone are asked for, context is None.

    A product that is added to a number is rounded once with the sum: fma. Of complex numbers nothing is.
    """

    __array_ufunc__ = None

    def __init__(self, of, context=None, builder=None, value=None, factors=()):
        self.of, self.context, self.builder, self.value, self.factors = of, context, builder, value, factors

    def made(self, of, write: Callable, factors=()) -> "Number":
        """A number of this type, of the value that write() returns."""
        return Number(of, self.context, self.builder, self.context and write(), factors)

    def plain(self, x) -> "Number":
        """A plain Python number beside this one."""
        of = INDEX if self.of is INDEX else DOUBLE
        return self.made(of, lambda: self.context.get_constant(of, x))

    def cast(self, of) -> "Number":
        """The same number in another type; of eight it is in every lane."""
        if of is self.of:
            return self
        factors = [x.cast(of) for x in self.factors]
        if of is not EIGHT:
            return self.made(of, lambda: self.context.cast(self.builder, self.value, self.of, of), factors)
        return self.made(
            of, lambda: self.lane(0, ir.Constant(VECTOR, ir.Undefined), self.value, everywhere=True), factors
        )

    def lane(self, l, eight, one=None, everywhere=False):
        """Lane l of eight; with another double there; with that in every lane."""
        index, lanes = ir.Constant(ir.IntType(32), l), ir.Constant(ir.VectorType(ir.IntType(32), WIDTH), [0] * WIDTH)
        if one is None:
            return self.builder.extract_element(eight, index)
        eight = self.builder.insert_element(eight, one, index)
        return self.builder.shuffle_vector(eight, eight, lanes) if everywhere else eight

    def by_numba(self, function, *others) -> "Number":
        """What a function that numba knows makes of numbers of one type."""
        kind, values = signature(self.of, *[self.of] * (1 + len(others))), [x.value for x in (self, *others)]
        return self.made(self.of, lambda: self.context.get_function(function, kind)(self.builder, values))

    def of_each(self, function, of_complex) -> "Number":
        """A function of math, of eight that of each; of_complex: that of cmath."""
        if self.of is not EIGHT:
            return self.by_numba(of_complex if self.of is COMPLEX else function)

        def write():
            value = self.value
            for l in range(WIDTH):
                one = self.made(DOUBLE, lambda l=l: self.lane(l, self.value)).by_numba(function)
                value = self.lane(l, value, one.value)
            return value

        return self.made(EIGHT, write)

    def fma(self, b, c) -> "Number":
        """self b + c, rounded once, of numbers of the same type."""
        kind = VECTOR if self.of is EIGHT else ir.DoubleType()
        name, of_three = f"llvm.fma.{'v8f64' if self.of is EIGHT else 'f64'}", ir.FunctionType(kind, [kind] * 3)
        return self.made(
            self.of,
            lambda: self.builder.call(
                cgutils.get_or_insert_function(self.builder.module, of_three, name), [self.value, b.value, c.value]
            ),
        )

    def sum(self, other) -> "Number":
        for a, b in ((self, other), (other, self)):
            if b.factors:
                return b.factors[0].fma(b.factors[1], a)
        return self.made(self.of, lambda: self.builder.fadd(self.value, other.value))

    def difference(self, other) -> "Number":
        if other.factors:
            return (-other.factors[0]).fma(other.factors[1], self)
        if self.factors:
            return self.factors[0].fma(self.factors[1], -other)
        return self.made(self.of, lambda: self.builder.fsub(self.value, other.value))

    def product(self, other) -> "Number":
        return self.made(self.of, lambda: self.builder.fmul(self.value, other.value), [self, other])

    def quotient(self, other) -> "Number":
        if self.of is COMPLEX:
            kind, values = signature(COMPLEX, COMPLEX, COMPLEX), [self.value, other.value]
            return self.made(COMPLEX, lambda: self.context.compile_internal(self.builder, divided, kind, values))
        return self.made(self.of, lambda: self.builder.fdiv(self.value, other.value))

    def __neg__(self):
        return self * -1.0


def divided(a, b):
    """a / b of complex numbers; NaN where b is zero, for which numba has an error."""
    return a / b if b != 0.0 else complex(math.nan, math.nan)


def alike(a, b) -> list[Number]:
    """Two numbers, of which one may be a plain one, of one type."""
    first = a if isinstance(a, Number) else b
    both = [x if isinstance(x, Number) else first.plain(x) for x in (a, b)]
    of = next(of for of in (EIGHT, COMPLEX, DOUBLE, INDEX) if of in (both[0].of, both[1].of))
    return [x.cast(of) for x in both]


def operation(symbol, of_doubles, neutral):
    """Give Numbers an operation on two of them; neutral: the second one that leaves the first, if it is a plain number."""

    def operate(a, b):
        if not all(isinstance(x, Number | int | float) for x in (a, b)):
            return NotImplemented
        if b.__class__ is float and b == neutral:
            return a
        a, b = alike(a, b)
        by_numba = a.of is INDEX or (a.of is COMPLEX and symbol is not operator.truediv)
        return a.by_numba(symbol, b) if by_numba else of_doubles(a, b)

    name = symbol.__name__
    setattr(Number, f"__{name}__", operate)
    setattr(Number, f"__r{name}__", lambda a, b: operate(b, a))


operation(operator.add, Number.sum, 0.0)
operation(operator.sub, Number.difference, 0.0)
operation(operator.mul, Number.product, 1.0)
operation(operator.truediv, Number.quotient, 1.0)
for _of_all, _of_one, _of_complex in (
    (sin, math.sin, cmath.sin),
    (cos, math.cos, cmath.cos),
    (sqrt, math.sqrt, cmath.sqrt),
    (arctan, math.atan, cmath.atan),
):
    _of_all.register(Number, lambda x, one=_of_one, complex=_of_complex: x.of_each(one, complex))
