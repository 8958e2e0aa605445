"""Taylor series of a motion in pairs of doubles, by a rule for each operation: a compiled interpreter.

Row r of `high` and `low` (rows, order + 1) has the coefficients of one number over time: x(t) = sum_k x_k
t^k. The first rows are the state, numbers that are constant follow, then the results of the operations in
`code`, rows of (operation, row of the result, rows of its operands). With c = a b, c_k is the sum of a_j
b_(k-j); quotients, roots, sines and cosines have rules of this kind too (Jorba and Zou, Experimental
Mathematics 14, 2005), from c b = a, c c = a, s' = c x', c' = -s x'.
"""

import ctypes
from collections.abc import Callable
from functools import lru_cache, partial, reduce

import numpy as np

from tmt.compiled import store
from tmt.compiled.ir import DOUBLE, INDEX, POINTER, Code, Value, Variable, module, wide

from .pairs import add, divide, joined, multiply, root, sincos, two_sum

ADD, SUBTRACT, NEGATIVE, SCALE, SLOPE, MULTIPLY, ROOT, DIVIDE, SINE, COSINE, RATE, SIGN = range(12)
BESIDE = 2  # products of a sum of products side by side
BACKWARD = list(reversed(range(BESIDE)))


def expand(code: np.ndarray, high: np.ndarray, low: np.ndarray) -> None:
    """Write the coefficients of the state (its first are there) and of all that it is computed by.

    code: (operations, 4); high, low: (rows, order + 1). The last operations make the state's next
    coefficients from their rates.
    """
    functions()["expand"](code.ctypes.data, len(code), high.shape[1], high.ctypes.data, low.ctypes.data)


def values_at(high: np.ndarray, low: np.ndarray, th: float, tl: float, state: np.ndarray) -> None:
    """Write the state (2, n) at the time (th, tl), s after that of the series."""
    n = state.shape[1]
    functions()["values_at"](high.ctypes.data, low.ctypes.data, state.ctypes.data, th, tl, high.shape[1], n)


@lru_cache(maxsize=1)
def functions() -> dict[str, Callable[..., None]]:
    library, integer, place = store.library(source, "series"), ctypes.c_int64, ctypes.c_void_p
    arguments = {
        "expand": [place, integer, integer, place, place],
        "values_at": [*[place] * 3, *[ctypes.c_double] * 2, integer, integer],
    }
    return {name: library.function(name, None, *types) for name, types in arguments.items()}


def source() -> str:
    return module([sincos_of_pair(), expansion(), evaluation()])


def sincos_of_pair() -> Code:
    code = Code("sincos", {"out": POINTER, "high": DOUBLE, "low": DOUBLE}, attributes="noinline")
    for k, x in enumerate(sincos(code["high"], code["low"])):
        code["out"].store(x, k)
    code.ret()
    return code


def convolution(code: Code, a: Value, b: Value, first: Value, last: Value) -> tuple[Value, Value]:
    """sum of a_j b_(k-j), j from first to last, as if in pairs (Ogita, Rump, Oishi, SIAM J. Sci. Comp. 2005).

    a: where a_0 stands in the flat arrays, b: where b_k does. So many side by side; what is left, one after
    the other.
    """
    high, low, count, kind = code["high"], code["low"], last - first + 1, wide(DOUBLE, BESIDE)
    totals, errors = Variable(code, kind, 0.0), Variable(code, kind, 0.0)

    def take(i: Value, m: Value, total: Variable, error: Variable) -> None:
        x, of_x = high.load(i, total.kind), low.load(i, total.kind)
        y, of_y = high.load(m, total.kind), low.load(m, total.kind)
        if total is totals:
            y, of_y = y.shuffled(BACKWARD), of_y.shuffled(BACKWARD)
        p = x * y
        sum_, rounded = two_sum(total.get(), p)
        total.set(sum_)
        error.set(error.get() + (rounded + x.fma(of_y, of_x.fma(y, x.fma(y, -p)))))

    paired = count / BESIDE * BESIDE
    with code.loop(paired, BESIDE) as loop:
        at = first + loop.index
        take(a + at, b - at - (BESIDE - 1), totals, errors)
    total, error = Variable(code, DOUBLE, totals.get().lane(0)), Variable(code, DOUBLE, errors.get().lane(0))
    for l in range(1, BESIDE):
        sum_, rounded = two_sum(total.get(), totals.get().lane(l))
        total.set(sum_)
        error.set(error.get() + (rounded + errors.get().lane(l)))
    with code.loop(count - paired) as loop:
        at = first + paired + loop.index
        take(a + at, b - at, total, error)
    return joined(total.get(), error.get())


def expansion() -> Code:
    code = Code("expand", {"code": POINTER, "count": INDEX, "width": INDEX, "high": POINTER, "low": POINTER})
    high, low, width, both = code["high"], code["low"], code["width"], code.reserve(DOUBLE, 4)
    with code.loop(width - 1) as orders, code.loop(code["count"]) as operations:
        k = orders.index
        times = k.cast("sitofp", DOUBLE)
        operation, row, of_a, of_b = (code["code"].load(operations.index * 4 + j, INDEX) for j in range(4))
        r, a, b = row * width, of_a * width, of_b * width
        ah, al = high.load(a + k), low.load(a + k)

        when, put = partial(is_any, operation), partial(put_pair, high, low, r + k)
        with code.when(when(ADD, SUBTRACT)):
            sign = when(ADD).choose(code.number(1.0), -1.0)
            put(*add(ah, al, sign * high.load(b + k), sign * low.load(b + k)))
        with code.when(when(NEGATIVE)):
            put(-ah, -al)
        with code.when(when(SCALE, SLOPE)):  # by a number; of the slope of an angle, times t
            scaled = when(SCALE)
            put(*multiply(ah, al, scaled.choose(high.load(b), times), scaled.choose(low.load(b), 0.0)))
        at_first = k.compare("eq", 0)
        with code.when(when(ROOT).bits("and", at_first)):
            put(*root(ah, al))
        with code.when(when(SIGN).bits("and", at_first)):  # all later coefficients are zero
            put(ah.compare("lt", 0.0).choose(code.number(-1.0), 1.0), code.number(0.0))
        with code.when(when(SINE, COSINE).bits("and", at_first)):
            code.call("sincos", both, ah, al)
            place = when(SINE).choose(code.number(0, INDEX), 2)
            put(both.load(place), both.load(place + 1))
        with code.when(when(RATE)):
            put_pair(high, low, r + k + 1, *divide(ah, al, times + 1.0, code.number(0.0)))
        with code.when(when(MULTIPLY)):
            put(*convolution(code, a, b + k, code.number(0, INDEX), k))
        later = at_first.negated()
        is_root = when(ROOT)
        with code.when(when(DIVIDE).bits("or", is_root.bits("and", later))):
            # c_0 and the other factors of c_j, j > 0; of a root c itself
            first, second, last = is_root.choose(r, b), r, is_root.choose(k - 1, k)
            h, l = convolution(code, first, second + k, code.number(1, INDEX), last)
            h, l = add(ah, al, -h, -l)
            twice = is_root.choose(code.number(2.0), 1.0)
            put(*divide(h, l, twice * high.load(first), twice * low.load(first)))
        with code.when(when(SINE, COSINE).bits("and", later)):
            # the slope of the angle stands before the sine, and that before the cosine
            sine = when(SINE)
            slope, other = r - sine.choose(width, width * 2), sine.choose(r + width, r - width)
            h, l = convolution(code, slope, other + k, code.number(1, INDEX), k)
            put(*divide(h, l, sine.choose(times, -times), code.number(0.0)))
    code.ret()
    return code


def is_any(operation: Value, *kinds: int) -> Value:
    first, *more = (operation.compare("eq", kind) for kind in kinds)
    return reduce(lambda flag, other: flag.bits("or", other), more, first)


def put_pair(high: Value, low: Value, at: Value, h: Value, l: Value) -> None:
    high.store(h, at)
    low.store(l, at)


def evaluation() -> Code:
    names = dict.fromkeys(("high", "low", "state"), POINTER) | dict.fromkeys(("th", "tl"), DOUBLE)
    names |= dict.fromkeys(("width", "n"), INDEX)
    code = Code("values_at", names)
    with code.loop(code["n"]) as numbers:
        h, l = Variable(code, DOUBLE, 0.0), Variable(code, DOUBLE, 0.0)
        with code.loop(code["width"]) as orders:
            k = numbers.index * code["width"] + (code["width"] - 1 - orders.index)
            total = multiply(h.get(), l.get(), code["th"], code["tl"])
            total = add(*total, code["high"].load(k), code["low"].load(k))
            h.set(total[0])
            l.set(total[1])
        code["state"].store(h.get(), numbers.index)
        code["state"].store(l.get(), numbers.index + code["n"])
    code.ret()
    return code
