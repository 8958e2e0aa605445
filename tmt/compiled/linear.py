"""Loops that traced functions call: linear systems, and derivatives in several directions side by side."""

from .ir import DOUBLE, INDEX, POINTER, Code, Value, wide
from .machine import lanes

WIDTH = lanes()  # directions, states or runs that are taken side by side


def solve() -> Code:
    """solve(matrix, stride, right, n): x with matrix x = right in place of right, by L U without pivots.

    matrix: n rows of `stride` numbers, of which the first n belong to it; it is written over.
    """
    arguments = {"matrix": POINTER, "stride": INDEX, "right": POINTER, "n": INDEX}
    code = Code("solve", arguments, attributes="noinline")
    matrix, stride, right, n = (code[name] for name in code.arguments)
    with code.loop(n) as outer:
        k = outer.index
        pivot, at_k = k * stride + k, k * stride
        inverse = matrix.load(pivot)
        with code.loop(n - k - 1) as inner:
            i = inner.index + k + 1
            row = i * stride
            factor = matrix.load(row + k) / inverse
            with code.when(factor.compare("ne", 0.0)):
                with code.loop(n - k - 1) as last:
                    j = last.index + k + 1
                    matrix.store(matrix.load(row + j) - factor * matrix.load(at_k + j), row + j)
                right.store(right.load(i) - factor * right.load(k), i)
    with code.loop(n) as outer:
        i = n - 1 - outer.index
        with code.loop(outer.index) as inner:
            j = inner.index + i + 1
            right.store(right.load(i) - matrix.load(i * stride + j) * right.load(j), i)
        right.store(right.load(i) / matrix.load(i * stride + i), i)
    code.ret()
    return code


def solution(n: int) -> Code:
    code = Code("solution", {"in": POINTER, "out": POINTER}, attributes="noinline")
    matrix = code.reserve(DOUBLE, n * n)
    with code.loop(n * n) as loop:
        matrix.store(code["in"].load(loop.index), loop.index)
    with code.loop(n) as loop:
        code["out"].store(code["in"].load(loop.index + n * n), loop.index)
    size = code.number(n, INDEX)
    code.call("solve", matrix, size, code["out"], size)
    code.ret()
    return code


def put_directions(state: Value, at: int, n: int, first: Value, width: int) -> None:
    """Put unit vectors (n,), lane l the one along `first` + l, to the numbers of a state from `at` on."""
    code = state.code
    lanes = first.everywhere(width)
    if width > 1:
        lanes = lanes + Value(code, lanes.kind, f"<{', '.join(f'i64 {l}' for l in range(width))}>")
    kind = wide(DOUBLE, width)
    with code.loop(n) as loop:
        chosen = lanes.compare("eq", loop.index.everywhere(width))
        state.store(chosen.choose(code.number(1.0, kind), code.number(0.0, kind)), (loop.index + at) * width)


def rows_of(first: Value, count: Value, width: int) -> list[Value]:
    """The rows from the first on, side by side; for those beyond the count the last one stands."""
    rows = [first + lane for lane in range(width)]
    return [row.compare("lt", count).choose(row, count - 1) for row in rows]


def any_of(flags: Value, width: int) -> Value:
    return flags if width == 1 else flags.cast("bitcast", f"i{width}").compare("ne", 0)
