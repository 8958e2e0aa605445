"""`written`: straight-line functions of doubles, compiled without numba looking at their lines.

Numba takes most of its time to find out the type of each value, and here all are doubles: the lines are run once, on values
that write their instructions down. They are the same instructions, and give the same bits.
"""

from collections.abc import Callable
from types import FunctionType

from numba import njit, types
from numba.core.dispatcher import Dispatcher
from numba.core.typing import signature
from numba.core.typing.templates import AbstractTemplate, infer_global
from numba.extending import lower_builtin

DOUBLE = types.float64


class Value:
    """A double in code that is being written."""

    def __init__(self, writer, value):
        self.writer, self.value = writer, value

    def of(self, write: Callable, *others) -> "Value":
        return Value(self.writer, write(self.value, *(self.writer.lifted(x).value for x in others)))

    def __neg__(self):
        return self.of(self.writer.builder.fneg)

    def __add__(self, other):
        return self.of(self.writer.builder.fadd, other)

    def __sub__(self, other):
        return self.of(self.writer.builder.fsub, other)

    def __mul__(self, other):
        return self.of(self.writer.builder.fmul, other)

    def __truediv__(self, other):
        return self.of(self.writer.builder.fdiv, other)

    def __radd__(self, other):
        return self.writer.lifted(other) + self

    def __rsub__(self, other):
        return self.writer.lifted(other) - self

    def __rmul__(self, other):
        return self.writer.lifted(other) * self

    def __rtruediv__(self, other):
        return self.writer.lifted(other) / self


class Writer:
    """What writes the instructions of one function, and knows what its lines call."""

    def __init__(self, context, builder):
        self.context, self.builder = context, builder

    def lifted(self, x) -> Value:
        return x if isinstance(x, Value) else Value(self, self.context.get_constant(DOUBLE, x))

    def known(self, name, found):
        """What a name in the lines stands for here."""
        if name == "fma":
            return lambda a, b, c: Value(self, self.builder.fma(*(self.lifted(x).value for x in (a, b, c))))
        if not isinstance(found, Dispatcher):  # of math

            def of_math(x):
                kind = signature(DOUBLE, DOUBLE)
                return Value(self, self.context.get_function(found, kind)(self.builder, [self.lifted(x).value]))

            return of_math
        count = getattr(found, "results", 2)  # a sine and a cosine

        def called(*given):
            kind = signature(types.UniTuple(DOUBLE, count), *[DOUBLE] * len(given))
            values = [self.lifted(x).value for x in given]
            made = self.context.compile_internal(self.builder, found.py_func, kind, values)
            return [Value(self, self.builder.extract_value(made, k)) for k in range(count)]

        return called


def written(results: int, inline: bool = False) -> Callable:
    """A decorator of a function of doubles with so many results; inline: in the place of its calls."""

    def decorated(function):
        code = function.__code__
        count, all_of = code.co_argcount, types.UniTuple(DOUBLE, results)
        kind = signature(all_of, *[DOUBLE] * count)

        def lines():
            """Stands for the lines in what numba looks at."""

        class Template(AbstractTemplate):
            key = lines

            def generic(self, given, named):
                return kind

        @lower_builtin(lines, *[DOUBLE] * count)
        def lowered(context, builder, found, given):
            writer = Writer(context, builder)
            names = {name: writer.known(name, function.__globals__[name]) for name in code.co_names}
            outputs = FunctionType(code, names)(*(Value(writer, value) for value in given))
            return context.make_tuple(builder, all_of, [writer.lifted(x).value for x in outputs])

        infer_global(lines, types.Function(Template))
        # with the name of its module, which is made from its source: numba takes functions for one whose names and instructions
        # are the same, also where it reads the machine code of other processes
        module = function.__globals__["__name__"]
        name = f"{function.__name__}_of_{module}"
        names, scope = ", ".join(code.co_varnames[:count]), {"lines": lines, "__name__": module}
        exec(f"def {name}({names}):\n    return lines({names})", scope)
        made = njit(error_model="numpy", forceinline=inline)(scope[name])
        made.results = results
        return made

    return decorated
