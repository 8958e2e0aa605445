"""Pairs of doubles: what they compute beside numbers of many digits."""

import ctypes

import mpmath
import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from tmt.compiled import Library
from tmt.compiled.ir import DOUBLE, POINTER, Code, module
from tmt.exact import pairs
from tmt.exact.pairs import pair

NUMBERS = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-100)
DIGITS = 1e-31


def compiled(name, inputs):
    """A function of pairs.py in machine code."""
    code = Code("f", {"out": POINTER} | {f"x{k}": DOUBLE for k in range(inputs)})
    results = getattr(pairs, name)(*(code[f"x{k}"] for k in range(inputs)))
    for k, x in enumerate(results):
        code["out"].store(x, k)
    code.give_back()
    own = Library(module([code])).function("f", None, ctypes.c_void_p, *[ctypes.c_double] * inputs)

    def call(*given):
        out = np.empty(len(results))
        own(out.ctypes.data, *given)
        return tuple(out.tolist())

    return call


add, multiply, divide = (compiled(name, 4) for name in ("add", "multiply", "divide"))
root, sincos = compiled("root", 2), compiled("sincos", 2)


def exact(high, low=0.0):
    return mpmath.mpf(high) + mpmath.mpf(low)


def of_many_digits(x, share):
    """A number of more digits than a double has."""
    return pair(exact(x) * (1 + exact(share) / 2**54))


@given(NUMBERS, NUMBERS, st.floats(-1.0, 1.0))
def test_sums_products_quotients_and_roots(x, y, share):
    with mpmath.workdps(60):
        a, b = of_many_digits(x, share), of_many_digits(y, -share)
        p, r = exact(*a), exact(*b)
        assert abs(exact(*add(*a, *b)) - (p + r)) <= DIGITS * abs(p + r)
        assert abs(exact(*multiply(*a, *b)) - p * r) <= DIGITS * abs(p * r) + 1e-300
        assert abs(exact(*root(*multiply(*a, *a))) - abs(p)) <= DIGITS * abs(p)
        if y:
            assert abs(exact(*divide(*a, *b)) - p / r) <= DIGITS * abs(p / r) + 1e-300
        assert add(*a, *b) == pairs.add(*a, *b)


@given(st.floats(-1e4, 1e4) | st.integers(-1000, 1000).map(lambda n: n * np.pi / 4), st.floats(-1.0, 1.0))
def test_sines_and_cosines(x, share):
    with mpmath.workdps(60):
        angle = of_many_digits(x, share)
        sh, sl, ch, cl = sincos(*angle)
        assert abs(exact(sh, sl) - mpmath.sin(exact(*angle))) <= DIGITS
        assert abs(exact(ch, cl) - mpmath.cos(exact(*angle))) <= DIGITS


def test_a_root_of_nothing_is_nothing_and_one_of_less_is_no_number():
    assert root(0.0, 0.0) == (0.0, 0.0) and np.isnan(root(-1.0, 0.0)[0])
