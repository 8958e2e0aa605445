"""The functions by which a compiled quantity is called: of one state, of many in rows or columns, of one again and again.

one(q, qd, tau, out): a state; whether it is wrong: a number that the quantity takes or gives is not finite, a quaternion not
of length 1. rows(q, qd, tau, out, count, of_q, of_qd, of_tau): states one after the other, of_q numbers from each q to the next
(0: the same for all); how often some were wrong. columns(...): number k of state i at k count + i. chain(q, qd, tau, count): the
same state so often, each time after the last.
"""

from tmt.derivation.quantities import QUANTITIES
from tmt.model.lock import CLOSE_TO_ONE

from . import forms, linear
from .ir import DOUBLE, INDEX, POINTER, Code, Value, Variable, module, wide
from .straight import Traced, functions

INLINED = 600  # nodes that are put in the place of a call
SHORTEST, LONGEST = (1.0 - CLOSE_TO_ONE) ** 2, (1.0 + CLOSE_TO_ONE) ** 2
ARRAYS = ("q", "qd", "tau")


def source(tree, quantity: str, width: int, terms=None, chain: bool = False) -> str:
    """The module of a quantity for one state at a time, or for several side by side; chain: of that function alone."""
    traced = forms.quantity(tree, quantity, terms)
    entries = Entries(tree, quantity, traced, width)
    made = [entries.many("rows"), entries.one() if width == 1 else entries.many("columns")]
    made = [entries.chain()] if chain else made
    return module([*functions(traced, width, inline=len(traced.nodes) <= INLINED), *made])


class Entries:
    """The lines around a traced quantity."""

    def __init__(self, tree, quantity: str, traced: Traced, width: int):
        self.tree, self.width, self.kind = tree, width, wide(DOUBLE, width)
        self.sizes = tree.coordinates.nq, tree.coordinates.nv, tree.coordinates.nv
        self.begins = 0, self.sizes[0], self.sizes[0] + self.sizes[1]  # of q, qd, tau in a state
        self.count, self.results = sum(self.sizes), len(traced.outputs)
        takes = QUANTITIES[quantity].takes if quantity in QUANTITIES else ("q", "qd")
        self.taken = sum(size for name, size in zip(ARRAYS, self.sizes) if name in takes)
        self.balls = [joint.q.start for joint in tree.coordinates.balls]

    def wrong(self, code: Code, state: Value, out: Value) -> Value:
        """Which of the states, or of their results, are not right."""
        size = Variable(code, self.kind, 0.0)
        for array, count in ((state, self.taken), (out, self.results)):
            for k in code.each(count):
                size.set(size.get() + array.load(k * self.width, self.kind).function("fabs"))
        right = size.get().compare("lt", float("inf"))
        for k in self.balls:
            p = [state.load((k + j) * self.width, self.kind) for j in range(4)]
            square = sum((x * x for x in p[1:]), p[0] * p[0])
            right = right.bits("and", square.compare("ge", SHORTEST)).bits(
                "and", square.compare("le", LONGEST)
            )
        return right.bits("xor", True)

    def one(self) -> Code:
        code = Code("one", dict.fromkeys((*ARRAYS, "out"), POINTER), result=INDEX)
        state, out = code.reserve(DOUBLE, self.count), code["out"]
        for array, size, before in zip(ARRAYS, self.sizes, self.begins):
            for k in code.each(size):
                state.store(code[array].load(k), k + before)
        code.call("quantity", state, out)
        code.give_back(self.wrong(code, state, out).choose(code.number(1, INDEX), 0))
        return code

    def many(self, name: str) -> Code:
        names = dict.fromkeys((*ARRAYS, "out"), POINTER) | dict.fromkeys(
            ("count", *(f"of_{a}" for a in ARRAYS)), INDEX
        )
        code, width, kind = Code(name, names, result=INDEX), self.width, self.kind
        count, state, out = code["count"], code.reserve(kind, self.count), code.reserve(kind, self.results)
        wrong = Variable(code, INDEX, 0)

        with code.loop(count, width) as loop:
            if name == "columns":  # the last are taken with those before them
                late = loop.index.compare("gt", count - width)
                first = late.choose(count - width, loop.index)
                for array, size, before in zip(ARRAYS, self.sizes, self.begins):
                    for k in code.each(size):
                        state.store(code[array].load(count * k + first, kind), (k + before) * width)
            else:  # for those that are missing at the end the last stands
                each = [loop.index + l for l in range(width)]
                each = [i.compare("lt", count).choose(i, count - 1) for i in each]
                for l, i in enumerate(each):
                    for array, size, first in zip(ARRAYS, self.sizes, self.begins):
                        begin = i * code[f"of_{array}"]
                        for k in code.each(size):
                            state.store(code[array].load(begin + k), (k + first) * width + l)
            code.call("quantity", state, out)
            flags = self.wrong(code, state, out)
            wrong.set(wrong.get() + linear.any_of(flags, width).choose(code.number(1, INDEX), 0))
            for k in code.each(self.results):
                if name == "columns":
                    code["out"].store(out.load(k * width, kind), count * k + first)
                else:
                    for l, i in enumerate(each):
                        code["out"].store(out.load(k * width + l), i * self.results + k)
        code.give_back(wrong.get())
        return code

    def chain(self) -> Code:
        code = Code("chain", dict.fromkeys(ARRAYS, POINTER) | {"count": INDEX}, result=DOUBLE)
        state, out, last = (
            code.reserve(DOUBLE, self.count),
            code.reserve(DOUBLE, self.results),
            Variable(code, DOUBLE, 0.0),
        )
        with code.loop(code["count"]):
            numbers = [code[array].load(i) for array, size in zip(ARRAYS, self.sizes) for i in range(size)]
            for k, x in enumerate(numbers):
                state.store(x + 1e-300 * last.get(), k)
            code.call("quantity", state, out)
            last.set(0.0)
            for k in code.each(self.results):
                last.set(last.get() + out.load(k))
        code.give_back(last.get())
        return code
