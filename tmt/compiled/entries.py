"""The functions by which a compiled quantity is called: of one state, and of many.

one(q, qd, tau, dt, out): a state; whether it is wrong: a number that the quantity takes or gives is not
finite, a quaternion not of length 1. Where a quantity takes qdd, that is in the place of tau. rows(q, qd,
tau, dt, out, count, of_q, of_qd, of_tau, of_dt): states one after the other, of_q numbers from each q to the
next (0: the same for all); how often some were wrong.
"""

from itertools import accumulate

from tmt.derivation.quantities import quantity_of
from tmt.model.tree import Tree
from tmt.model.values import CLOSE_TO_ONE

from . import forms, linear
from .ir import DOUBLE, INDEX, POINTER, Code, Value, Variable, module, wide
from .straight import Traced, functions

INLINED = 600  # nodes that are put in the place of a call
SHORTEST, LONGEST = (1.0 - CLOSE_TO_ONE) ** 2, (1.0 + CLOSE_TO_ONE) ** 2
ARRAYS = ("q", "qd", "tau", "dt")


def source(tree: Tree, quantity: str, width: int) -> str:
    traced = forms.quantity(tree, quantity)
    entries = Entries(tree, quantity, traced, width)
    called = [entries.rows(), entries.one()] if width == 1 else [entries.rows()]
    return module([*functions(traced, width, inline=len(traced.nodes) <= INLINED), *called])


class Entries:
    def __init__(self, tree: Tree, quantity: str, traced: Traced, width: int):
        self.tree, self.width, self.kind = tree, width, wide(DOUBLE, width)
        self.sizes = tree.coordinates.nq, tree.coordinates.nv, tree.coordinates.nv, 1
        self.begins = list(accumulate(self.sizes, initial=0))  # of q, qd, tau, dt in a state
        self.count, self.results = sum(self.sizes), len(traced.outputs)
        self.taken = self.begins[len(quantity_of(quantity).takes)]
        self.balls = [joint.q.start for joint in tree.coordinates.balls]

    def wrong(self, code: Code, state: Value, out: Value) -> Value:
        size = Variable(code, self.kind, 0.0)
        for array, count in ((state, self.taken), (out, self.results)):
            for k in code.each(count):
                size.set(size.get() + array.load(k * self.width, self.kind).function("fabs"))
        right = size.get().compare("lt", float("inf"))
        for k in self.balls:
            p = [state.load((k + j) * self.width, self.kind) for j in range(4)]
            square = sum((x * x for x in p[1:]), p[0] * p[0])
            for within in (square.compare("ge", SHORTEST), square.compare("le", LONGEST)):
                right = right.bits("and", within)
        return right.negated()

    def one(self) -> Code:
        code = Code("one", dict.fromkeys((*ARRAYS, "out"), POINTER), result=INDEX)
        state, out = code.reserve(DOUBLE, self.count), code["out"]
        for array, size, before in zip(ARRAYS, self.sizes, self.begins):
            for k in code.each(size):
                state.store(code[array].load(k), k + before)
        code.call("quantity", state, out)
        code.ret(self.wrong(code, state, out).choose(code.number(1, INDEX), 0))
        return code

    def rows(self) -> Code:
        """Many states; for those that are missing in a register at the end the last stands."""
        numbers = dict.fromkeys(("count", *(f"of_{array}" for array in ARRAYS)), INDEX)
        code = Code("rows", dict.fromkeys((*ARRAYS, "out"), POINTER) | numbers, result=INDEX)
        count, width = code["count"], self.width
        state, out = code.reserve(self.kind, self.count), code.reserve(self.kind, self.results)
        wrong = Variable(code, INDEX, 0)
        with code.loop(count, width) as loop:
            rows = linear.rows_of(loop.index, count, width)
            for lane, row in enumerate(rows):
                for array, size, first in zip(ARRAYS, self.sizes, self.begins):
                    begin = row * code[f"of_{array}"]
                    for k in code.each(size):
                        state.store(code[array].load(begin + k), (k + first) * width + lane)
            code.call("quantity", state, out)
            flags = self.wrong(code, state, out)
            wrong.set(wrong.get() + linear.any_of(flags, width).choose(code.number(1, INDEX), 0))
            for k in code.each(self.results):
                for lane, row in enumerate(rows):
                    code["out"].store(out.load(k * width + lane), row * self.results + k)
        code.ret(wrong.get())
        return code
