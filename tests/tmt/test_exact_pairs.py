"""Pairs of doubles: what they compute beside numbers of many digits; and series of each operation."""

import ctypes

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from tmt.compiled import Library
from tmt.compiled.ir import DOUBLE, POINTER, Code, module
from tmt.exact import pairs, series
from tmt.exact.pairs import pair

NUMBERS = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-100)
DIGITS = 1e-31


def compiled(function, inputs):
    """A function of pairs.py in machine code."""
    code = Code("f", {"out": POINTER} | {f"x{k}": DOUBLE for k in range(inputs)})
    results = function(*(code[f"x{k}"] for k in range(inputs)))
    for k, x in enumerate(results):
        code["out"].store(x, k)
    code.give_back()
    own = Library(module([code])).function("f", None, ctypes.c_void_p, *[ctypes.c_double] * inputs)

    def call(*given):
        out = np.empty(len(results))
        own(out.ctypes.data, *given)
        return tuple(out.tolist())

    return call


IN_CODE = {name: compiled(getattr(pairs, name), 4) for name in ("add", "multiply", "divide")}
root, sincos = compiled(pairs.root, 2), compiled(pairs.sincos, 2)


def exact(high, low=0.0):
    return mpmath.mpf(high) + mpmath.mpf(low)


def of_many_digits(x, share):
    """A number of more digits than a double has."""
    return pair(exact(x) * (1 + exact(share) / 2**54))


@given(NUMBERS, NUMBERS, st.floats(-1.0, 1.0))
def test_sums_products_and_quotients(x, y, share):
    with mpmath.workdps(60):
        a, b = of_many_digits(x, share), of_many_digits(y, -share)
        p, r = exact(*a), exact(*b)
        assert abs(exact(*IN_CODE["add"](*a, *b)) - (p + r)) <= DIGITS * abs(p + r)
        assert abs(exact(*IN_CODE["multiply"](*a, *b)) - p * r) <= DIGITS * abs(p * r) + 1e-300
        if y:
            assert abs(exact(*IN_CODE["divide"](*a, *b)) - p / r) <= DIGITS * abs(p / r) + 1e-300
        assert all(IN_CODE[name](*a, *b) == getattr(pairs, name)(*a, *b) for name in IN_CODE if y)
        assert abs(exact(*root(*IN_CODE["multiply"](*a, *a))) - abs(p)) <= DIGITS * abs(p)


@given(st.floats(-1e4, 1e4) | st.integers(-1000, 1000).map(lambda n: n * np.pi / 4), st.floats(-1.0, 1.0))
def test_sines_and_cosines(x, share):
    with mpmath.workdps(60):
        angle = of_many_digits(x, share)
        sh, sl, ch, cl = sincos(*angle)
        assert abs(exact(sh, sl) - mpmath.sin(exact(*angle))) <= DIGITS
        assert abs(exact(ch, cl) - mpmath.cos(exact(*angle))) <= DIGITS


def test_a_root_of_nothing_is_nothing_and_one_of_less_is_no_number():
    assert root(0.0, 0.0) == (0.0, 0.0) and np.isnan(root(-1.0, 0.0)[0])


# series

RULES = {
    "sum": (series.ADD, lambda x, y: x + y),
    "difference": (series.SUBTRACT, lambda x, y: x - y),
    "change of sign": (series.NEGATIVE, lambda x, y: -x),
    "product": (series.MULTIPLY, lambda x, y: x * y),
    "quotient": (series.DIVIDE, lambda x, y: x / y),
    "root": (series.ROOT, lambda x, y: mpmath.sqrt(x)),
}


@pytest.mark.parametrize("name", RULES)
def test_a_series_has_the_derivatives_of_its_operation(name):
    """x' = 0.7 y, y' = 1.5 from x = 2, y = 0.9: then the result of the operation is known in closed form."""
    operation, rule = RULES[name]
    found = expanded([(series.SCALE, 4, 1, 2), (operation, 5, 0, 1)], rates=[4, 3])[5]
    with mpmath.workdps(60):
        expected = mpmath.taylor(lambda t: rule(x_at(t), y_at(t)), 0, ORDER - 1)
    compare(found, expected)


@pytest.mark.parametrize("place, function", [(5, mpmath.sin), (6, mpmath.cos)])
def test_a_series_of_sine_and_cosine(place, function):
    code = [(series.SCALE, 7, 1, 2), (series.SLOPE, 4, 0, 0), (series.SINE, 5, 0, 0), (series.COSINE, 6, 0, 0)]
    found = expanded(code, rates=[7, 3])[place]
    with mpmath.workdps(60):
        expected = mpmath.taylor(lambda t: function(x_at(t)), 0, ORDER - 1)
    compare(found, expected)


ORDER, ROWS, FIRST = 12, 8, (2.0, 0.9, 0.7, 1.5)


def x_at(t):
    x, y, a, b = map(mpmath.mpf, FIRST)
    return x + a * (y * t + b * t**2 / 2)


def y_at(t):
    return mpmath.mpf(FIRST[1]) + mpmath.mpf(FIRST[3]) * t


def expanded(code, rates):
    """The series of all rows: x, y, the two numbers, and what is computed; rates: the rows that are those of x and y."""
    code = [*code, *((series.RATE, k, rate, 0) for k, rate in enumerate(rates))]
    high, low = np.zeros((2, ROWS, ORDER + 1))
    high[:4, 0] = FIRST
    series.expand(np.array(code), high, low)
    with mpmath.workdps(60):
        return [[exact(*c) for c in zip(*row)] for row in zip(high.tolist(), low.tolist())]


def compare(found, expected):
    with mpmath.workdps(60):
        assert max(abs(a - b) for a, b in zip(found, expected[:ORDER])) < 1e-29
        assert abs(expected[2]) > 1e-3 or max(map(abs, expected[1:])) > 0.5
