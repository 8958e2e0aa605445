"""A traced function as assignments in a programming language: one for each value that is used twice or is long."""

from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import NamedTuple

from tmt.compiled.straight import Traced

LONGEST = 40  # characters of an expression that stands within another
SUM, PRODUCT, ATOM = 1, 2, 3  # how strongly the parts of an expression are bound


@dataclass(frozen=True)
class Syntax:
    """How a language writes what is not the same in all."""

    number: Callable = repr
    times: str = "*"
    over: str = "/"
    sqrt: str = "sqrt"
    arctan: str = "atan"


class Assignment(NamedTuple):
    """The value of an expression, or of a function ("sin" or "cos") of it."""

    name: str
    expression: str
    function: str = ""


class Writer:
    """The assignments of a traced function, and the expressions of its results; `inputs` are the expressions of its inputs."""

    def __init__(self, traced: Traced, inputs: list[str], syntax: Syntax):
        self.tape, self.syntax = traced.tape, syntax
        outputs = [self.tape.lift(x) for x in traced.outputs]
        self.uses = Counter(x.i for x in outputs)
        for i in traced.nodes:
            self.uses.update(self.tape.operands(i))
        self.known = {
            x.i: (name, ATOM) for x, name in zip(traced.inputs, inputs)
        }  # by node: (text, how it is bound)
        self.items = {}  # of a sine and cosine: [(which, node)]
        for i in traced.nodes:
            kind, arguments = self.tape.nodes[i]
            if kind == "item":
                self.items.setdefault(arguments[0], []).append((arguments[1], i))
        self.assignments = list(self.written(traced.nodes))
        self.results = [self.text(x.i) for x in outputs]

    def written(self, order: list[int]) -> Iterator[Assignment]:
        for i in order:
            kind, arguments = self.tape.nodes[i]
            if kind == "number":
                self.known[i] = self.syntax.number(float(arguments[0])), SUM if arguments[0] < 0.0 else ATOM
            elif kind == "sincos":
                for which, item in self.items[i]:
                    name = f"{'sc'[which]}{i}"
                    self.known[item] = name, ATOM
                    yield Assignment(name, self.text(arguments[0]), ("sin", "cos")[which])
            elif kind not in ("input", "item"):
                text, bound = self.expression(kind, arguments)
                if self.uses[i] > 1 or len(text) > LONGEST:
                    yield Assignment(f"x{i}", text)
                    text, bound = f"x{i}", ATOM
                self.known[i] = text, bound

    def text(self, i: int, least: int = SUM) -> str:
        """The expression of a node, in brackets where it is bound less than `least`."""
        text, bound = self.known[i]
        return text if bound >= least else f"({text})"

    def expression(self, kind: str, operands: tuple) -> tuple[str, int]:
        if kind in ("sqrt", "arctan"):
            return f"{getattr(self.syntax, kind)}({self.text(operands[0])})", ATOM
        if kind == "neg":
            return f"-{self.text(operands[0], PRODUCT)}", SUM
        a, b = operands
        if kind in "+-":
            return f"{self.text(a)} {kind} {self.text(b, PRODUCT)}", SUM
        sign = self.syntax.times if kind == "*" else self.syntax.over
        return f"{self.text(a, PRODUCT)} {sign} {self.text(b, ATOM)}", PRODUCT
