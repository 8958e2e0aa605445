"""Straight-line functions over the numbers of the compiled loops: doubles, complex ones, or eight doubles side by side.

An `inlined` function is plain Python over any scalar. In compiled code it is run once, while that is compiled, on Numbers, which
write down what is done with them in the place of the call: nothing is called, and one source serves all types of number.

In an array, number k of one state is w[k]; of eight states w has the shape (n, 8), and w[k] are eight. No index is below zero.
"""

import cmath
import math
import operator
from collections.abc import Callable

from numba import types
from numba.core.typing.templates import AbstractTemplate, infer_global, signature
from numba.extending import lower_builtin, overload

from tmt.eight import COMPLEX, DOUBLE, EIGHT, INDEX, VECTOR, WIDTH, Eight, Number, alike
from tmt.equations import vectors as space
from tmt.sine import sincos

TUPLES = tuple, space.Vector, space.Matrix


def known(symbol, function, of=()):
    """Make numba write a function in the place of calls of a symbol; of: with numbers of these types alone."""

    class Template(AbstractTemplate):
        key = symbol

        def generic(self, given, named):
            if named or (of and not (len(of) == len(given) and all(map(isinstance, given, of)))):
                return None
            if any(isinstance(x, types.Array) and x.layout != "C" for x in given):
                return None
            return signature(type_of(function(*(taken(x) for x in given))), *given)

    @lower_builtin(symbol, *(of or [types.VarArg(types.Any)]))
    def lowered(context, builder, found, arguments):
        given = [taken(of, context, builder, value) for of, value in zip(found.args, arguments)]
        return handed_over(context, builder, found.return_type, function(*given))

    infer_global(symbol, types.Function(Template))


def inlined(function: Callable) -> Callable:
    """The function, of numbers, arrays and tuples of them, which numba writes in the place of its calls."""
    known(function, function)
    return function


class Store:
    """The numbers of an array in code that is being written."""

    def __init__(self, of, context, builder, value):
        self.of, self.one = EIGHT if of.ndim == 2 else of.dtype, Number(of.dtype, context, builder)
        self.data = context and context.make_array(of)(context, builder, value).data

    def place(self, index):
        """Where a number is."""
        index, builder = Number.cast(*alike(self.one.made(INDEX, lambda: None), index)[1:], INDEX), self.one.builder
        if self.of is not EIGHT:
            return builder.gep(self.data, [index.value])
        return builder.bitcast(builder.gep(self.data, [(index * WIDTH).value]), VECTOR.as_pointer())

    def zero(self) -> Number:
        return self.one.made(DOUBLE, lambda: self.one.context.get_constant(DOUBLE, 0.0)).cast(self.of)

    def __getitem__(self, index):
        one = self.one
        if self.of is EIGHT:
            return one.made(EIGHT, lambda: one.builder.load(self.place(index), align=8))
        return one.made(self.of, lambda: one.context.unpack_value(one.builder, self.of, self.place(index)))

    def __setitem__(self, index, x):
        one, x = self.one, alike(self.zero(), x)[1]
        if one.context and self.of is EIGHT:
            one.builder.store(x.value, self.place(index), align=8)
        elif one.context:
            one.context.pack_value(one.builder, self.of, x.value, self.place(index))


def taken(of, context=None, builder=None, value=None):
    """An argument of a compiled call as an inlined function takes it: three numbers as a Vector, three of those as a Matrix."""
    if isinstance(of, types.BaseTuple):
        parts = [
            taken(part, context, builder, builder and builder.extract_value(value, k)) for k, part in enumerate(of)
        ]
        for kind, made in ((Number, lambda parts: space.Vector(*parts)), (space.Vector, space.Matrix)):
            if len(parts) == 3 and all(isinstance(part, kind) for part in parts):
                return made(parts)
        return tuple(parts)
    if isinstance(of, types.Array):
        return Store(of, context, builder, value)
    number = Number(of, context, builder, value)
    return number.cast(INDEX) if isinstance(of, types.Integer) else number


def type_of(found):
    """numba's type of what an inlined function returns."""
    if isinstance(found, TUPLES):
        return types.BaseTuple.from_types([type_of(part) for part in found])
    return types.none if found is None else found.of if isinstance(found, Number) else DOUBLE


def handed_over(context, builder, of, found):
    """What an inlined function returns, as the value of a compiled call."""
    if found is None:
        return context.get_dummy_value()
    if isinstance(found, TUPLES):
        return context.make_tuple(builder, of, [handed_over(context, builder, *pair) for pair in zip(of, found)])
    return found.value if isinstance(found, Number) else context.get_constant(of, found)


for _operation in (operator.add, operator.sub, operator.mul, operator.truediv):
    for _types in ((Eight, Eight), (Eight, types.Float), (types.Float, Eight)):
        known(_operation, _operation, _types)
for _function in (space.sin, space.cos, space.sqrt, space.arctan):
    known(_function, _function)


@inlined
def get(w, k):
    """Number k of an array."""
    return w[k]


@inlined
def put(w, k, x):
    """Make x number k of an array."""
    w[k] = x


@inlined
def zero(w):
    """0 as a number of an array."""
    return w.zero() if isinstance(w, Store) else 0.0


def put_sines(q, at, reference, w, k):
    """Put sine and cosine of number `at` of q, less a reference, to k and k + 1 of w."""
    x = q[at] - reference
    w[k], w[k + 1] = space.sin(x), space.cos(x)


@overload(put_sines, jit_options={"error_model": "numpy", "forceinline": True})
def _put_sines(q, at, reference, w, k):
    def of_one(q, at, reference, w, k):
        w[k], w[k + 1] = sincos(q[at] - reference)
        if w[k] != w[k]:  # so far out that it takes the library's
            w[k], w[k + 1] = math.sin(q[at] - reference), math.cos(q[at] - reference)

    def of_complex(q, at, reference, w, k):
        w[k], w[k + 1] = cmath.sin(q[at] - reference), cmath.cos(q[at] - reference)

    def of_eight(q, at, reference, w, k):
        for l in range(WIDTH):
            w[k, l], w[k + 1, l] = sincos(q[at, l] - reference)
        for l in range(WIDTH):
            if w[k, l] != w[k, l]:
                w[k, l], w[k + 1, l] = math.sin(q[at, l] - reference), math.cos(q[at, l] - reference)

    return of_eight if q.ndim == 2 else of_complex if q.dtype is COMPLEX else of_one
