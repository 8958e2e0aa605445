"""A scalar that records arithmetic: the method run on it once is a tape of operations for straight.py.

The parameters of a model are plain numbers and fold in; terms with a zero or a one disappear; equal
subexpressions are computed once; signs are carried outward until a sum takes them up; numbers that meet in a
sum or a product become one. What remains is the arithmetic of this one model.
"""

import math
import operator
from collections import Counter
from collections.abc import Callable, Iterable
from numbers import Real
from typing import Any

from tmt.derivation.vectors import Scalar, cos, sign, sin, sqrt

Function = Callable[[Scalar], Scalar]


def folded(of_float: Function, function: Function) -> Function:
    return lambda x: of_float(x) if isinstance(x, float) else function(x)


FOLD: dict[str, Callable[..., Scalar]] = {
    "+": operator.add, "-": operator.sub, "*": operator.mul, "/": operator.truediv, "neg": operator.neg,
    "sin": folded(math.sin, sin), "cos": folded(math.cos, cos), "sqrt": folded(math.sqrt, sqrt),
    "sign": sign,
}  # fmt: skip
LEAVES = ("input", "number")


class Tape:
    """The expressions of one trace, each once, in order of computation; number: float, or an exact type."""

    def __init__(self, number: Callable[[Scalar], Scalar] = float):
        self.number_type = number
        # (operation, arguments): arguments are indices, but a number or a name for a leaf
        self.nodes: list[tuple[str, tuple[Any, ...]]] = []
        self.index: dict[tuple[str, tuple[Any, ...]], int] = {}

    def node(self, operation: str, *arguments: Any) -> "Expression":
        key = (operation, arguments)
        i = self.index.setdefault(key, len(self.nodes))
        if i == len(self.nodes):
            self.nodes.append(key)
        return Expression(self, i)

    def inputs(self, *names: int | str) -> list["Expression"]:
        return [self.node("input", name) for name in names]

    def call(self, function: str, arguments: Iterable[Scalar], count: int) -> list["Expression"]:
        call = self.node("call", function, *(self.lift(a).i for a in arguments))
        return [self.node("item", call.i, k) for k in range(count)]

    def lift(self, value: Scalar) -> "Expression":
        if isinstance(value, Expression):
            return value
        return self.node("number", self.number_type(value))

    # one rule for each way in which an operation can become simpler

    def add(self, a: "Expression", b: "Expression") -> "Expression":
        if 0.0 in (a.number, b.number):
            return a if b.number == 0.0 else b
        if b.negated is not None:
            return self.subtract(a, b.negated)
        if a.negated is not None:
            return self.subtract(b, a.negated)
        if a.i == b.i:
            return self.multiply(self.lift(2.0), a)
        return self.merged("+", a, b) or self.node("+", *sorted((a.i, b.i)))

    def subtract(self, a: "Expression", b: "Expression") -> "Expression":
        if a.i == b.i:
            return self.lift(0.0)
        if b.number == 0.0:
            return a
        if b.negated is not None:
            return self.add(a, b.negated)
        if a.number == 0.0:
            return self.negative(b)
        if a.negated is not None:
            return self.negative(self.add(a.negated, b))
        return self.node("-", a.i, b.i)

    def multiply(self, a: "Expression", b: "Expression") -> "Expression":
        if 0.0 in (a.number, b.number):
            return self.lift(0.0)
        if 1.0 in (a.number, b.number):
            return b if a.number == 1.0 else a
        for x, y in ((a, b), (b, a)):
            if x.negated is not None:
                return self.negative(self.multiply(x.negated, y))
            if x.number is not None and x.number < 0.0:
                return self.negative(self.multiply(self.lift(-x.number), y))
        return self.merged("*", a, b) or self.node("*", *sorted((a.i, b.i)))

    def divide(self, a: "Expression", b: "Expression") -> "Expression":
        if b.number == 1.0 or a.number == 0.0:
            return a
        if a.negated is not None:
            return self.negative(self.divide(a.negated, b))
        if b.negated is not None:
            return self.negative(self.divide(a, b.negated))
        return self.node("/", a.i, b.i)

    def negative(self, a: "Expression") -> "Expression":
        if a.number is not None:
            return self.lift(-a.number)
        return self.node("neg", a.i) if a.negated is None else a.negated

    def merged(self, operation: str, a: "Expression", b: "Expression") -> "Expression | None":
        """c1 o (c2 o x) as (c1 o c2) o x for numbers c1, c2: else None."""
        for x, y in ((a, b), (b, a)):
            if x.number is not None and self.nodes[y.i][0] == operation:
                inner = [Expression(self, i) for i in self.nodes[y.i][1]]
                inner.sort(key=lambda part: part.number is None)
                if inner[0].number is not None:
                    return self.apply(operation, self.apply(operation, x, inner[0]), inner[1])
        return None

    def apply(self, operation: str, *operands: Scalar) -> "Expression":
        values = [x if type(x) is Expression else self.lift(x) for x in operands]
        numbers = [value.number for value in values]
        if None not in numbers:
            return self.lift(FOLD[operation](*numbers))
        if operation in RULES:
            return RULES[operation](self, *values)
        if operation in ("sin", "cos"):
            return self.node("item", self.node("sincos", values[0].i).i, ("sin", "cos").index(operation))
        return self.node(operation, values[0].i)

    def fused(self, order: list[int], outputs: list["Expression"]) -> dict[int, int]:
        """For each sum or difference that takes one up, a product that is used nowhere else."""
        uses = Counter(o.i for o in outputs)
        for i in order:
            uses.update(self.operands(i))
        chosen = {}
        for i in order:
            operation, arguments = self.nodes[i]
            if operation in ("+", "-"):
                products = [a for a in arguments if self.nodes[a][0] == "*" and uses[a] == 1]
                if products:
                    chosen[i] = products[-1]  # the later one: the other is ready earlier
        return chosen

    def needed(self, outputs: list["Expression"]) -> list[int]:
        needed: set[int] = set()
        open_ = [o.i for o in outputs]
        while open_:
            i = open_.pop()
            if i not in needed:
                needed.add(i)
                open_ += self.operands(i)
        return sorted(needed)

    def operands(self, i: int) -> tuple[int, ...]:
        operation, arguments = self.nodes[i]
        if operation in LEAVES:
            return ()
        if operation == "call":
            return arguments[1:]
        return arguments[:1] if operation == "item" else arguments


RULES: dict[str, Callable[..., "Expression"]] = {
    "+": Tape.add, "-": Tape.subtract, "*": Tape.multiply, "/": Tape.divide, "neg": Tape.negative,
}  # fmt: skip


def operator_of(operation: str, is_reflected: bool = False) -> Callable[["Expression", Scalar], Scalar]:
    if is_reflected:
        return lambda self, other: self.apply(operation, other, self)
    return lambda self, other: self.apply(operation, self, other)


class Expression:
    """A node of a tape. number: its value, if it is known without running, else None."""

    __slots__ = ("i", "number", "tape")
    __array_ufunc__ = None

    def __init__(self, tape: Tape, i: int):
        self.tape, self.i = tape, i
        operation, arguments = tape.nodes[i]
        self.number: Scalar | None = arguments[0] if operation == "number" else None

    @property
    def negated(self) -> "Expression | None":
        operation, arguments = self.tape.nodes[self.i]
        return Expression(self.tape, arguments[0]) if operation == "neg" else None

    @property
    def name(self) -> str:
        return self.tape.nodes[self.i][1][0]

    def apply(self, operation: str, *values: Scalar) -> Scalar:
        """The expression for an operation; NotImplemented where another kind of scalar is to decide."""
        for value in values:
            if type(value) not in SCALARS and not isinstance(value, Real):
                return NotImplemented
        return self.tape.apply(operation, *values)

    def __neg__(self) -> Scalar:
        return self.apply("neg", self)

    __add__ = __radd__ = operator_of("+")
    __mul__ = __rmul__ = operator_of("*")
    __sub__, __rsub__ = operator_of("-"), operator_of("-", is_reflected=True)
    __truediv__, __rtruediv__ = operator_of("/"), operator_of("/", is_reflected=True)


SCALARS = (Expression, float, int)
for name, function in (("sin", sin), ("cos", cos), ("sqrt", sqrt), ("sign", sign)):
    function.register(Expression, lambda x, name=name: x.tape.apply(name, x))
