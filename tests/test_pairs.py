"""Pairs of doubles: what they compute beside numbers of many digits; and series of each operation."""

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numba import njit

from tmt.exact import pairs, series
from tmt.exact.pairs import pair

NUMBERS = st.floats(-1e6, 1e6).filter(lambda x: x == 0.0 or abs(x) > 1e-100)
DIGITS = 1e-31


compiled = {
    "add": njit(lambda ah, al, bh, bl: pairs.add(ah, al, bh, bl)),
    "multiply": njit(lambda ah, al, bh, bl: pairs.multiply(ah, al, bh, bl)),
    "divide": njit(lambda ah, al, bh, bl: pairs.divide(ah, al, bh, bl)),
}


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
        assert abs(exact(*compiled["add"](*a, *b)) - (p + r)) <= DIGITS * abs(p + r)
        assert abs(exact(*compiled["multiply"](*a, *b)) - p * r) <= DIGITS * abs(p * r) + 1e-300
        if y:
            assert abs(exact(*compiled["divide"](*a, *b)) - p / r) <= DIGITS * abs(p / r) + 1e-300
        assert all(compiled[name](*a, *b) == getattr(pairs, name)(*a, *b) for name in compiled if y)
        assert abs(exact(*pairs.root(*compiled["multiply"](*a, *a))) - abs(p)) <= DIGITS * abs(p)


@given(st.floats(-1e4, 1e4) | st.integers(-1000, 1000).map(lambda n: n * np.pi / 4), st.floats(-1.0, 1.0))
def test_sines_and_cosines(x, share):
    with mpmath.workdps(60):
        angle = of_many_digits(x, share)
        sh, sl, ch, cl = pairs.sincos(*angle)
        assert abs(exact(sh, sl) - mpmath.sin(exact(*angle))) <= DIGITS
        assert abs(exact(ch, cl) - mpmath.cos(exact(*angle))) <= DIGITS


def test_a_root_of_nothing_is_nothing_and_one_of_less_is_no_number():
    assert pairs.root(0.0, 0.0) == (0.0, 0.0) and np.isnan(pairs.root(-1.0, 0.0)[0])


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
    series.expand(np.array(code), ORDER + 1, high.reshape(-1), low.reshape(-1))
    with mpmath.workdps(60):
        return [[exact(*c) for c in zip(*row)] for row in zip(high.tolist(), low.tolist())]


def compare(found, expected):
    with mpmath.workdps(60):
        assert max(abs(a - b) for a, b in zip(found, expected[:ORDER])) < 1e-29
        assert abs(expected[2]) > 1e-3 or max(map(abs, expected[1:])) > 0.5
