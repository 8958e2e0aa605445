"""Straight-line code from a tape: one function, or several of a long tape, for one state or several.

A traced function has the signature void name(ptr in, ptr out): numbers in a row, of several states side by
side each number of all of them together. A product that goes into one sum alone is rounded with it, once.
LLVM takes more than twice as long for twice as many lines in one function, so long tapes are cut; what one
part hands to a later one stands in an array.
"""

import math
from collections import defaultdict
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TypeVar

from tmt.derivation.vectors import Scalar

from .ir import DOUBLE, INDEX, POINTER, Code, Value, wide, width_of
from .trace import FOLD, LEAVES, Expression, Tape

LIMIT = 2.0**49  # rad: of larger angles there is no sine
LONGEST = 1_000  # nodes of one function
Key = TypeVar("Key", int, str)


@dataclass(frozen=True)
class Traced:
    name: str
    tape: Tape
    inputs: list[Expression]
    outputs: list[Scalar]  # Expressions or numbers

    @cached_property
    def nodes(self) -> list[int]:
        return self.tape.needed([self.tape.lift(x) for x in self.outputs])

    @cached_property
    def places(self) -> dict[int, list[int]]:
        places: dict[int, list[int]] = defaultdict(list)
        for k, x in enumerate(self.outputs):
            places[self.tape.lift(x).i].append(k)
        return places

    @cached_property
    def items(self) -> dict[int, list[int]]:
        items: dict[int, list[int]] = defaultdict(list)
        for i in self.nodes:
            if self.tape.nodes[i][0] == "item":
                items[self.tape.nodes[i][1][0]].append(i)
        return items

    @property
    def length(self) -> float:
        calls = [self.tape.operands(i) for i in self.nodes if self.tape.nodes[i][0] == "call"]
        return self.operations + sum((1 + len(arguments)) ** 1.5 / 3 for arguments in calls)

    @property
    def operations(self) -> int:
        """+ - * / and changes of sign; a sine, a cosine, a root count as one each."""
        nodes = self.tape.nodes
        of_calls = [i for i in self.nodes if nodes[i][0] == "item" and nodes[nodes[i][1][0]][0] == "call"]
        return sum(nodes[i][0] not in (*LEAVES, "call", "sincos") for i in self.nodes) - len(of_calls)


def trace(name: str, sizes: Iterable[int], function: Callable[..., Sequence[Scalar]]) -> Traced:
    """function(*lists), each list of one of these sizes, which returns a list."""
    tape, count = Tape(), 0
    lists = []
    for size in sizes:
        lists.append(tape.inputs(*range(count, count + size)))
        count += size
    outputs = function(*lists)
    return Traced(name, tape, [x for part in lists for x in part], list(outputs))


def functions(traced: Traced, width: int, inline: bool = False) -> list[Code]:
    steps = Steps(traced)
    if len(steps.order) <= LONGEST:
        code = entry(traced.name, "alwaysinline" if inline else "noinline")
        steps.write(code, steps.order, width, {})
        return [code]
    sections = [steps.order[k : k + LONGEST] for k in range(0, len(steps.order), LONGEST)]
    places, size = steps.live_out(sections)
    main, result = entry(traced.name, "noinline"), []
    handed = main.reserve(wide(DOUBLE, width), size)
    for k, section in enumerate(sections):
        part = entry(f"{traced.name}.{k}", "noinline", "handed")
        steps.write(part, section, width, places)
        main.call(part.name, main["in"], main["out"], handed)
        result.append(part)
    main.ret()
    return [*result, main]


def entry(name: str, attributes: str, *more: str) -> Code:
    return Code(name, dict.fromkeys(("in", "out", *more), POINTER), attributes=attributes)


def live_out_places(made: list[list[Key]], last: Mapping[Key, int]) -> tuple[dict[Key, int], int]:
    """The place of each value that a part hands to later ones, free after the last; how many places."""
    leaving: list[list[int]] = [[] for _ in made]
    free: list[int] = []
    places: dict[Key, int] = {}
    size = 0
    for k, values in enumerate(made):
        for i in values:
            if last.get(i, k) > k:
                places[i] = free.pop() if free else size
                size = max(size, places[i] + 1)
                leaving[last[i]].append(places[i])
        free += leaving[k]
    return places, max(size, 1)


class Steps:
    def __init__(self, traced: Traced):
        tape, nodes = traced.tape, traced.nodes
        outputs = [tape.lift(x) for x in traced.outputs]
        self.tape, self.fused = tape, tape.fused(nodes, outputs)
        self.outputs, self.items = traced.places, traced.items
        self.input = {x.i: k for k, x in enumerate(traced.inputs)}
        left_out = {*self.fused.values(), *(i for i in nodes if tape.nodes[i][0] in (*LEAVES, "item"))}
        self.order = [i for i in nodes if i not in left_out]

    def takes(self, i: int) -> list[int]:
        arguments = self.tape.operands(i)
        if i in self.fused:
            product = self.fused[i]
            arguments = *(a for a in arguments if a != product), *self.tape.operands(product)
        return [a for a in arguments if self.tape.nodes[a][0] != "number"]

    def live_out(self, sections: list[list[int]]) -> tuple[dict[int, int], int]:
        made: list[list[int]] = [[] for _ in sections]  # by each part
        last: dict[int, int] = {}  # the part that takes a value last
        for k, section in enumerate(sections):
            for i in section:
                made[k] += self.items.get(i, [i])
                last |= {a: k for a in self.takes(i) if a not in self.input}
        return live_out_places(made, last)

    def write(self, code: Code, order: list[int], width: int, places: dict[int, int]) -> None:
        """The lines of some of the steps; places: of the nodes that parts of a function hand on."""
        tape, kind, out = self.tape, wide(DOUBLE, width), code["out"]
        values: dict[int, Value] = {}

        def value(i: int) -> Value:
            if i not in values:
                name, arguments = tape.nodes[i]
                if name == "number":
                    values[i] = code.number(float(arguments[0]), kind)
                elif i in self.input:
                    values[i] = code["in"].load(self.input[i] * width, kind)
                elif i in places:
                    values[i] = code["handed"].load(places[i] * width, kind)
            return values[i]

        for i in order:
            made = self.results(code, i, value, width)
            values |= made
            for node, x in made.items():
                for k in self.outputs.get(node, ()):
                    out.store(x, k * width)
                if node in places:
                    code["handed"].store(x, places[node] * width)
        if order[-1:] == self.order[-1:]:  # inputs and numbers that are results too
            for i in [i for i in self.outputs if tape.nodes[i][0] in LEAVES]:
                for k in self.outputs[i]:
                    out.store(value(i), k * width)
        code.ret()

    def results(self, code: Code, i: int, value: Callable[[int], Value], width: int) -> dict[int, Value]:
        nodes = self.tape.nodes
        name, arguments = nodes[i]
        if name == "sincos":
            both = sincos(value(arguments[0]))
            return {item: both[nodes[item][1][1]] for item in self.items[i]}
        if name == "call":
            numbers = {item: nodes[item][1][1] for item in self.items[i]}
            taken = [value(a) for a in arguments[1:]]
            place = called(code, arguments[0], taken, 1 + max(numbers.values()), width)
            return {item: place.load(k * width, wide(DOUBLE, width)) for item, k in numbers.items()}
        if i in self.fused:
            product = self.fused[i]
            x, y = map(value, nodes[product][1])
            (other,) = (a for a in arguments if a != product)
            if name == "-" and arguments[0] != product:
                return {i: (-x).fma(y, value(other))}
            return {i: x.fma(y, value(other) if name == "+" else -value(other))}
        if name == "sqrt":
            return {i: value(arguments[0]).function("sqrt")}
        if name == "sign":
            x = value(arguments[0])
            return {i: x.compare("lt", 0.0).choose(x.like(-1.0), 1.0)}
        return {i: FOLD[name](*map(value, arguments))}


def called(code: Code, name: str, values: list[Value], count: int, width: int) -> Value:
    """Call void name(ptr in, ptr out), lane by lane what is for one state: the place of its results."""
    taken = code.reserve(wide(DOUBLE, width), len(values))
    out = code.reserve(wide(DOUBLE, width), count)
    for k, x in enumerate(values):
        taken.store(x, k * width)
    if width == 1 or name != "solution":
        code.call(name, taken, out)
        return out
    taken_one, out_one = code.reserve(DOUBLE, len(values)), code.reserve(DOUBLE, count)
    with code.loop(width) as lane:
        with code.loop(len(values)) as loop:
            taken_one.store(taken.load(loop.index * width + lane.index), loop.index)
        code.call(name, taken_one, out_one)
        with code.loop(count) as loop:
            out.store(out_one.load(loop.index), loop.index * width + lane.index)
    return out


def sincos(x: Value) -> tuple[Value, Value]:
    """(sin x, cos x) for |x| <= LIMIT, x in rad, else NaN; without a branch, for many side by side.

    x is reduced to r = x - n pi/2 in [-pi/4, pi/4] by two fused multiply-adds (pi/2 as the sum of two
    doubles: the first difference is rounded once, however large n is), then the minimax polynomials of fdlibm
    (Sun, 1993), then n modulo 4 swaps the two and sets their signs by bits. Off by at most 2.2e-16. Beyond,
    neighbouring doubles are an eighth of a radian apart.
    """
    bits = wide(INDEX, width_of(x.kind))
    unit = x.function("fabs").compare("le", LIMIT).choose(x.like(1.0), math.nan)
    # the sum with 1.5 * 2^52 rounds to an integer, which is then in the last bits
    shifted = x.fma(0.6366197723675814, 6755399441055744.0)
    n = shifted - 6755399441055744.0
    r = n.fma(-6.123233995736766e-17, n.fma(-1.5707963267948966, x))
    z = r * r
    w = z * z
    top = z.fma(1.58969099521155010221e-10, -2.50507602534068634195e-08)
    high = w.fma(top, z.fma(2.75573137070700676789e-06, -1.98412698298579493134e-04))
    s = high.fma(w, z.fma(8.33333333332248946124e-03, -1.66666666666666324348e-01)).fma(z * r, r * unit)
    top = z.fma(-1.13596475577881948265e-11, 2.08757232129817482790e-09)
    high = w.fma(top, z.fma(-2.75573143513906633035e-07, 2.48015872894767294178e-05))
    c = high.fma(w, z.fma(-1.38888888888741095749e-03, 4.16666666666666019037e-02)).fma(w, z.fma(-0.5, unit))
    turns = shifted.cast("bitcast", bits)
    swap = turns.bits("and", 1).compare("ne", 0)

    def signed(value: Value, turns: Value) -> Value:
        flip = turns.bits("and", 2).bits("shl", 62)
        return value.cast("bitcast", bits).bits("xor", flip).cast("bitcast", x.kind)

    return signed(swap.choose(c, s), turns), signed(swap.choose(s, c), turns + 1)
