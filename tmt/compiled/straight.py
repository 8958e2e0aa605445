"""Straight-line code from a tape: one function, or a row of functions where the tape is long, for one state or several.

A traced function has the signature void name(ptr in, ptr out): numbers in a row, of several states side by side each number of
all of them together. A product that goes into one sum alone is rounded with it, once. LLVM takes more than twice as long for
twice as many lines in one function, so long tapes are cut; what one part hands to a later one stands in an array.
"""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property

from .ir import DOUBLE, POINTER, Code, Value, wide
from .sine import sincos
from .trace import Tape

LONGEST = 1_000  # nodes of one function
OF_ONE = ("solution", "bias_rates")  # functions of linear.py, which take one state
OPERATIONS = {"+": "add", "-": "sub", "*": "mul", "/": "sdiv"}


@dataclass(frozen=True)
class Traced:
    """A function that was traced."""

    name: str
    tape: Tape
    inputs: list  # Expressions
    outputs: list  # Expressions or numbers

    @cached_property
    def nodes(self) -> list[int]:
        return self.tape.needed([self.tape.lift(x) for x in self.outputs])

    @property
    def length(self) -> float:
        """How many operations it has, those of a linear system that it has solved among them."""
        solved = (
            arguments for kind, arguments in map(self.tape.nodes.__getitem__, self.nodes) if kind == "call"
        )
        return len(self.nodes) + sum(len(arguments) ** 1.5 / 3 for arguments in solved)

    @property
    def operations(self) -> int:
        """+ - * / and changes of sign; a sine, a cosine, a root count as one each."""
        kinds = (self.tape.nodes[i] for i in self.nodes)
        return sum(
            kind not in ("input", "number", "call", "sincos", "item")
            or (kind == "item" and self.tape.nodes[arguments[0]][0] == "sincos")
            for kind, arguments in kinds
        )


def trace(name: str, sizes: Iterable[int], function: Callable) -> Traced:
    """function(*lists), each list of one of these sizes, which returns a list."""
    tape, count = Tape(), 0
    lists = []
    for size in sizes:
        lists.append(tape.inputs(*range(count, count + size)))
        count += size
    outputs = function(*lists)
    return Traced(name, tape, [x for part in lists for x in part], outputs)


def functions(traced: Traced, width: int, inline: bool = False) -> list[Code]:
    """The code of a traced function, with all its parts, for `width` states side by side."""
    steps = Steps(traced)
    if len(steps.order) <= LONGEST:
        code = entry(traced.name, "alwaysinline" if inline else "noinline")
        values = {}
        steps.write(code, steps.order, values, width, code["in"], code["out"], None)
        code.give_back()
        return [code]
    cuts = [steps.order[k : k + LONGEST] for k in range(0, len(steps.order), LONGEST)]
    places, size = steps.handed_on(cuts)
    main, result = entry(traced.name, "noinline"), []
    handed = main.reserve(wide(DOUBLE, width), size)
    for k, cut in enumerate(cuts):
        part = entry(f"{traced.name}.{k}", "noinline", handed=True)
        steps.write(part, cut, {}, width, part["in"], part["out"], (part["handed"], places))
        part.give_back()
        main.call(part.name, main["in"], main["out"], handed)
        result.append(part)
    main.give_back()
    return [*result, main]


def entry(name: str, attributes: str, handed: bool = False) -> Code:
    arguments = ["in", "out", *["handed"] * handed]
    return Code(name, dict.fromkeys(arguments, POINTER), attributes=attributes, own=True)


class Steps:
    """The operations of a traced function in order, and which values each takes and makes."""

    def __init__(self, traced: Traced):
        tape, nodes = traced.tape, traced.nodes
        self.tape, outputs = tape, [tape.lift(x) for x in traced.outputs]
        self.fused, self.outputs = tape.fused(nodes, outputs), {}
        taken = set(self.fused.values())
        for k, x in enumerate(outputs):
            self.outputs.setdefault(x.i, []).append(k)
        self.input = {x.i: k for k, x in enumerate(traced.inputs)}
        self.items = {}  # of a node with several results, which of them are needed
        self.order = []
        for i in nodes:
            kind, arguments = tape.nodes[i]
            if kind == "item":
                self.items.setdefault(arguments[0], []).append(i)
            elif kind not in ("input", "number") and i not in taken:
                self.order.append(i)

    def takes(self, i: int) -> list[int]:
        """The values that a step takes."""
        arguments = self.tape.operands(i)
        if i in self.fused:
            product = self.fused[i]
            arguments = [*(a for a in arguments if a != product), *self.tape.operands(product)]
        return [a for a in arguments if self.tape.nodes[a][0] != "number"]

    def handed_on(self, cuts) -> tuple[dict[int, int], int]:
        """The place of each value that a part hands to a later one, and how many places there are."""
        part_of, last = {}, {}
        for k, cut in enumerate(cuts):
            for i in cut:
                part_of |= dict.fromkeys(self.items.get(i, [i]), k)
                last |= dict.fromkeys((a for a in self.takes(i) if a not in self.input), k)
        leaving = [[] for _ in cuts]
        free, places, size = [], {}, 0
        for k in range(len(cuts)):
            for i in (i for i, made in part_of.items() if made == k and last.get(i, k) > k):
                if free:
                    places[i] = free.pop()
                else:
                    places[i], size = size, size + 1
                leaving[last[i]].append(places[i])
            free += leaving[k]
        return places, max(size, 1)

    def write(self, code, order, values, width, given, out, handed) -> None:
        """The lines of some of the steps; values: what is known, by node."""
        tape, kind = self.tape, wide(DOUBLE, width)

        def value(i) -> Value:
            if i not in values:
                name, arguments = tape.nodes[i]
                if name == "number":
                    values[i] = code.number(float(arguments[0]), kind)
                elif i in self.input:
                    values[i] = given.load(self.input[i] * width, kind)
                else:
                    array, places = handed
                    values[i] = array.load(places[i] * width, kind)
            return values[i]

        for i in order:
            name, arguments = tape.nodes[i]
            made = {}
            if name == "sincos":
                both = sincos(value(arguments[0]))
                made = {item: both[tape.nodes[item][1][1]] for item in self.items[i]}
            elif name == "call":
                results = called(
                    code, arguments[0], [value(a) for a in arguments[1:]], self.count_of(i), width
                )
                made = {item: results.load(tape.nodes[item][1][1] * width, kind) for item in self.items[i]}
            elif i in self.fused:
                product = self.fused[i]
                x, y = map(value, tape.nodes[product][1])
                (other,) = (a for a in arguments if a != product)
                if name == "-" and arguments[0] != product:
                    x = -x
                plus = value(other) if name == "+" or arguments[0] != product else -value(other)
                made[i] = x.fma(y, plus)
            elif name == "neg":
                made[i] = -value(arguments[0])
            elif name == "sqrt":
                made[i] = value(arguments[0]).function("sqrt")
            elif name == "arctan":
                made[i] = code.library("atan", value(arguments[0]))
            else:
                made[i] = value(arguments[0]).two(OPERATIONS[name], *map(value, arguments))
            values |= made
            for one, x in made.items():
                for k in self.outputs.get(one, ()):
                    out.store(x, k * width)
                if handed and one in handed[1]:
                    handed[0].store(x, handed[1][one] * width)
        if order is self.order or order[-1] == self.order[-1]:  # inputs and numbers that are results too
            for i, places in self.outputs.items():
                if tape.nodes[i][0] in ("input", "number"):
                    for k in places:
                        out.store(value(i), k * width)

    def count_of(self, call: int) -> int:
        """How many results a call has, as far as they are needed."""
        return 1 + max(self.tape.nodes[item][1][1] for item in self.items[call])


def called(code: Code, name: str, values: list[Value], count: int, width: int) -> Value:
    """Call void name(ptr in, ptr out), lane by lane where it is for one state alone; the place of its results."""
    given = code.reserve(wide(DOUBLE, width), len(values))
    out = code.reserve(wide(DOUBLE, width), count)
    for k, x in enumerate(values):
        given.store(x, k * width)
    if width == 1 or name not in OF_ONE:
        code.call(name, given, out)
        return out
    one, found = code.reserve(DOUBLE, len(values)), code.reserve(DOUBLE, count)
    with code.loop(width) as lane:
        with code.loop(len(values)) as loop:
            one.store(given.load(loop.index * width + lane.index), loop.index)
        code.call(name, one, found)
        with code.loop(count) as loop:
            out.store(found.load(loop.index), loop.index * width + lane.index)
    return out
