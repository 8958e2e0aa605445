"""A traced function as assignments in a language: one for each value that is used twice or is long."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from math import prod
from typing import Any, NamedTuple

from tmt.compiled.straight import Traced

LONGEST = 40  # characters of an expression that stands within another
SUM, PRODUCT, ATOM = 1, 2, 3  # how strongly the parts of an expression are bound


class Function(NamedTuple):
    name: str
    title: str  # what it returns, with units
    takes: tuple[str, ...]  # of the arrays in sizes
    sizes: dict[str, int]  # of each array, in the order of the traced inputs
    shape: tuple[int, ...]  # of a result
    results: tuple[str, ...]  # names of the results
    traced: Traced

    @property
    def size(self) -> int:
        return prod(self.shape)

    @property
    def inputs(self) -> list[tuple[str, int]]:
        """The name and the place of each number that is taken, in the order of the traced inputs."""
        return [(name, k) for name, size in self.sizes.items() for k in range(size)]

    @property
    def used(self) -> list[tuple[str, int]]:
        nodes = set(self.traced.nodes)
        return [place for place, x in zip(self.inputs, self.traced.inputs) if x.i in nodes]


class Program(NamedTuple):
    name: str
    head: Sequence[str]  # lines of the comment that it begins with
    functions: Sequence[Function]
    single: bool  # float in C


@dataclass(frozen=True)
class Syntax:
    """How a language writes what is not the same in all, as formats; k counts from 0, n from 1."""

    input: str  # of a number of x
    assignment: str  # of the value of an expression to a name
    result: str  # of a value to a number of the result x
    function: str = "{}"  # sin, cos and sqrt
    number: Callable[[float], str] = repr
    times: str = "*"
    over: str = "/"


class Line(NamedTuple):
    text: str
    takes: frozenset[str]  # the names of the values in it
    name: str = ""  # of the value that it gives


def statements(function: Function, syntax: Syntax) -> list[Line]:
    inputs = [syntax.input.format(x=x, k=k, n=k + 1) for x, k in function.inputs]
    places = [divmod(number, function.size) for number in range(len(function.traced.outputs))]
    results = [syntax.result.format(x=function.results[x], k=k, n=k + 1, value="{value}") for x, k in places]
    return Writer(function.traced, inputs, results, syntax).lines


class Writer:
    def __init__(self, traced: Traced, inputs: Sequence[str], results: Sequence[str], syntax: Syntax):
        self.tape, self.syntax = traced.tape, syntax
        self.traced, self.results = traced, results
        self.uses = Counter({i: len(places) for i, places in traced.places.items()})
        for i in traced.nodes:
            self.uses.update(self.tape.operands(i))
        # the text of each node, how it is bound, and the names of the values in it
        self.known = {x.i: (name, ATOM) for x, name in zip(traced.inputs, inputs)}
        self.takes = {x.i: frozenset[str]() for x in traced.inputs}
        self.lines = [line for i in traced.nodes for line in self.written(i)]

    def written(self, i: int) -> Iterator[Line]:
        kind, arguments = self.tape.nodes[i]
        if kind == "number":
            number = float(arguments[0])
            self.known[i] = self.syntax.number(number), SUM if number < 0.0 else ATOM
            self.takes[i] = frozenset()
        elif kind == "sincos":
            for item in self.traced.items[i]:
                function = ("sin", "cos")[self.tape.nodes[item][1][1]]
                self.takes[item] = self.takes[arguments[0]]
                yield self.assigned(item, f"{function[0]}{i}", self.call(function, arguments[0]))
        elif kind not in ("input", "item"):
            self.known[i] = self.expression(kind, arguments)
            self.takes[i] = frozenset().union(*(self.takes[operand] for operand in arguments))
            text, _ = self.known[i]
            if self.uses[i] > 1 or len(text) > LONGEST:
                yield self.assigned(i, f"x{i}", text)
        for place in self.traced.places.get(i, ()):
            yield Line(self.results[place].format(value=self.text(i)), self.takes[i])

    def assigned(self, i: int, name: str, value: str) -> Line:
        line = Line(self.syntax.assignment.format(name=name, value=value), self.takes[i], name)
        self.known[i], self.takes[i] = (name, ATOM), frozenset((name,))
        return line

    def text(self, i: int, least: int = SUM) -> str:
        text, bound = self.known[i]
        return text if bound >= least else f"({text})"

    def call(self, function: str, i: int) -> str:
        return f"{self.syntax.function.format(function)}({self.text(i)})"

    def expression(self, kind: str, operands: Sequence[Any]) -> tuple[str, int]:
        if kind == "sqrt":
            return self.call("sqrt", operands[0]), ATOM
        if kind == "sign":
            one, two, zero = map(self.syntax.number, (1.0, 2.0, 0.0))
            return f"{one} - {two} {self.syntax.times} ({self.text(operands[0])} < {zero})", SUM
        if kind == "neg":
            return f"-{self.text(operands[0], PRODUCT)}", SUM
        a, b = operands
        if kind in "+-":
            return f"{self.text(a)} {kind} {self.text(b, PRODUCT)}", SUM
        sign = self.syntax.times if kind == "*" else self.syntax.over
        return f"{self.text(a, PRODUCT)} {sign} {self.text(b, ATOM)}", PRODUCT
