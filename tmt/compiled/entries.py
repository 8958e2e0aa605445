"""The functions by which a compiled quantity is called: of one state, and of many.

one(q, qd, tau, dt, out): a state; whether it is wrong: a number that the quantity takes or gives is not
finite, a quaternion not of length 1. Where a quantity takes qdd, that is in the place of tau. rows(q, qd,
tau, dt, out, count, of_q, of_qd, of_tau, of_dt): states one after the other, of_q numbers from each q to the
next (0: the same for all); how often some were wrong.
"""

from functools import lru_cache
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


@lru_cache(maxsize=1)  # for one state, for several side by side, and to count its operations
def traced_quantity(tree: Tree, quantity: str) -> Traced:
    return forms.quantity(tree, quantity)


def source(tree: Tree, quantity: str, width: int) -> str:
    traced, sizes = traced_quantity(tree, quantity), (tree.nq, tree.nv, tree.nv, 1)
    codes = functions(traced, width, inline=len(traced.nodes) <= INLINED)
    codes.append(rows(tree, quantity, sizes, len(traced.outputs), width))
    if width == 1:
        one = Code("one", dict.fromkeys((*ARRAYS, "out"), POINTER), result=INDEX)
        numbers = [one.number(size, INDEX) for size in (1, *sizes)]
        one.ret(one.call("rows", *map(one.__getitem__, one.arguments), *numbers, kind=INDEX))
        codes.append(one)
    return module(codes)


def rows(tree: Tree, quantity: str, sizes: tuple[int, ...], results: int, width: int) -> Code:
    """Many states; for those that are missing in a register at the end the last stands."""
    numbers = dict.fromkeys(("count", *(f"of_{array}" for array in ARRAYS)), INDEX)
    code = Code("rows", dict.fromkeys((*ARRAYS, "out"), POINTER) | numbers, result=INDEX)
    count, kind, begins = code["count"], wide(DOUBLE, width), list(accumulate(sizes, initial=0))
    taken = begins[len(quantity_of(quantity).takes)]
    state, out, flagged = (
        code.reserve(kind, begins[-1]),
        code.reserve(kind, results),
        Variable(code, INDEX, 0),
    )
    with code.loop(count, width) as loop:
        side_by_side = linear.rows_of(loop.index, count, width)
        for lane, row in enumerate(side_by_side):
            for array, size, first in zip(ARRAYS, sizes, begins):
                begin = row * code[f"of_{array}"]
                for k in code.each(size):
                    state.store(code[array].load(begin + k), (k + first) * width + lane)
        code.call("quantity", state, out)
        flags = wrong(tree, code, ((state, taken), (out, results)), width)
        flagged.set(flagged.get() + linear.any_of(flags, width).choose(code.number(1, INDEX), 0))
        for k in code.each(results):
            for lane, row in enumerate(side_by_side):
                code["out"].store(out.load(k * width + lane), row * results + k)
    code.ret(flagged.get())
    return code


def wrong(tree: Tree, code: Code, arrays: tuple[tuple[Value, int], ...], width: int) -> Value:
    """Whether a number of these arrays, of which the first is the state, is not finite, or a quaternion is none."""
    kind = wide(DOUBLE, width)
    size = Variable(code, kind, 0.0)
    for array, count in arrays:
        for k in code.each(count):
            size.set(size.get() + array.load(k * width, kind).function("fabs"))
    right = size.get().compare("lt", float("inf"))
    for ball in tree.coordinates.balls:
        p = [arrays[0][0].load((ball.q.start + j) * width, kind) for j in range(4)]
        square = sum((x * x for x in p[1:]), p[0] * p[0])
        for within in (square.compare("ge", SHORTEST), square.compare("le", LONGEST)):
            right = right.bits("and", within)
    return right.negated()
