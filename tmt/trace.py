"""A scalar that records arithmetic: run the method once on it, and it yields straight-line code.

The parameters of a model are plain numbers and fold in; terms with a zero or a one disappear; equal
subexpressions are computed once. What remains is the arithmetic of this one model.
"""

import math
import operator
from numbers import Real

from .space import cos, sin

COMMUTATIVE = {"+", "*"}
FOLD = {
    "+": operator.add,
    "-": operator.sub,
    "*": operator.mul,
    "/": operator.truediv,
    "sin": math.sin,
    "cos": math.cos,
}


class Tape:
    """The expressions of one trace, each held once, in an order in which they can be computed."""

    def __init__(self):
        self.nodes = []  # (operation, arguments): arguments are indices, but a number or a name for a leaf
        self.index = {}

    def node(self, operation, *arguments) -> "Expression":
        key = (operation, arguments)
        if key not in self.index:
            self.index[key] = len(self.nodes)
            self.nodes.append(key)
        return Expression(self, self.index[key])

    def inputs(self, *names) -> list["Expression"]:
        return [self.node("input", name) for name in names]

    def call(self, function, arguments, count) -> list["Expression"]:
        """The `count` results of a function of that name, which the generated code calls."""
        call = self.node("call", function, *(self.lift(a).i for a in arguments))
        return [self.node("item", call.i, k) for k in range(count)]

    def lift(self, value) -> "Expression":
        if isinstance(value, Expression):
            return value
        return self.node("number", float(value))

    def apply(self, operation, *values) -> "Expression":
        """The expression for one operation, simplified where an argument is a number."""
        values = [self.lift(v) for v in values]
        numbers = [v.number for v in values]
        if None not in numbers:
            return self.lift(FOLD[operation](*numbers))
        a, b = numbers if len(numbers) == 2 else (None, None)
        if operation == "*":
            if 0.0 in numbers:
                return self.lift(0.0)
            if 1.0 in numbers:
                return values[1 - numbers.index(1.0)]
        elif operation == "+" and 0.0 in numbers:
            return values[1 - numbers.index(0.0)]
        elif operation == "-":
            if b == 0.0:
                return values[0]
            if values[0].i == values[1].i:
                return self.lift(0.0)
        elif operation == "/":
            if b == 1.0:
                return values[0]
            if a == 0.0:
                return self.lift(0.0)
        indices = [v.i for v in values]
        return self.node(operation, *(sorted(indices) if operation in COMMUTATIVE else indices))

    def function(self, name, inputs, outputs) -> tuple[str, int]:
        """Python source of `name(inputs) -> outputs`, and the number of operations in it."""
        outputs = [self.lift(o) for o in outputs]
        needed = set()
        open_ = [o.i for o in outputs]
        while open_:
            i = open_.pop()
            if i not in needed:
                needed.add(i)
                open_.extend(self._operands(i))
        text = {}
        lines = []
        operations = 0
        for i in sorted(needed):
            operation, arguments = self.nodes[i]
            if operation in ("input", "number"):
                text[i] = arguments[0] if operation == "input" else repr(arguments[0])
                continue
            text[i] = f"t{i}"
            if operation == "call":
                value = f"{arguments[0]}({', '.join(text[a] for a in arguments[1:])})"
            elif operation == "item":
                value = f"{text[arguments[0]]}[{arguments[1]}]"
            elif operation in ("sin", "cos"):
                value = f"{operation}({text[arguments[0]]})"
            else:
                value = f"{text[arguments[0]]} {operation} {text[arguments[1]]}"
            operations += operation in FOLD
            lines.append(f"    {text[i]} = {value}")
        names = ", ".join(text.get(i.i, i.name) for i in inputs)
        returns = ", ".join(text[o.i] for o in outputs)
        return "\n".join([f"def {name}({names}):", *lines, f"    return {returns},", ""]), operations

    def _operands(self, i):
        operation, arguments = self.nodes[i]
        if operation in ("input", "number"):
            return []
        if operation == "call":
            return arguments[1:]
        return arguments[:1] if operation == "item" else arguments


class Expression:
    """A traced scalar."""

    __slots__ = ("i", "tape")
    __array_ufunc__ = None

    def __init__(self, tape, i):
        self.tape, self.i = tape, i

    @property
    def number(self):
        """The value, if it is known without running: else None."""
        operation, arguments = self.tape.nodes[self.i]
        return arguments[0] if operation == "number" else None

    @property
    def name(self):
        """The name of an input."""
        return self.tape.nodes[self.i][1][0]

    def apply(self, operation, *values):
        """The expression for an operation; NotImplemented if another kind of scalar takes part, which then decides."""
        if all(isinstance(value, (Expression, Real)) for value in values):
            return self.tape.apply(operation, *values)
        return NotImplemented

    def __add__(self, other):
        return self.apply("+", self, other)

    __radd__ = __add__

    def __mul__(self, other):
        return self.apply("*", self, other)

    __rmul__ = __mul__

    def __sub__(self, other):
        return self.apply("-", self, other)

    def __rsub__(self, other):
        return self.apply("-", other, self)

    def __truediv__(self, other):
        return self.apply("/", self, other)

    def __rtruediv__(self, other):
        return self.apply("/", other, self)


sin.register(Expression, lambda angle: angle.tape.apply("sin", angle))
cos.register(Expression, lambda angle: angle.tape.apply("cos", angle))
