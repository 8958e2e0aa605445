"""Straight lines of machine code from what was traced: each operation, several states side by side, cut into parts."""

import ctypes
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trees import random_states, small_tree

from tmt.compiled import Library, forms, straight
from tmt.compiled.ir import POINTER, Code, module
from tmt.compiled.linear import solution, solve
from tmt.compiled.machine import lanes
from tmt.compiled.sine import LIMIT
from tmt.compiled.straight import functions, trace
from tmt.equations.dual import jacobian
from tmt.equations.vectors import arctan, cos, sin, sqrt
from tmt.methods import METHODS

EPS = np.finfo(float).eps
SMALL = small_tree()


def compiled(traced, width=1, more=()):
    """The traced function of an array (inputs, width), as a function in Python."""
    code = Code("f", {"in": POINTER, "out": POINTER})
    code.call(traced.name, code["in"], code["out"])
    code.give_back()
    own = [*functions(traced, width), *more]
    function = Library(module([*own, code])).function("f", None, ctypes.c_void_p, ctypes.c_void_p)

    def call(given):
        given, out = np.ascontiguousarray(given, dtype=float), np.full((len(traced.outputs), width), np.nan)
        assert given.shape == (len(traced.inputs), width)
        function(given.ctypes.data, out.ctypes.data)
        return out

    return call


def test_zeros_and_ones_disappear():
    def function(given):
        x, y = given
        return [(x * 1.0 + 0.0 * y) - (y - y) + (x + y) * (y + x) / 1.0, 2.0 * 3.0]

    traced = trace("few", [2], function)
    assert traced.operations == 3  # x + y once, its square, the sum
    assert compiled(traced)([[2.0], [3.0]]).ravel().tolist() == [27.0, 6.0]


def everything(given):
    """Every operation, with inputs and numbers among the results, and one of them twice."""
    x, y = given
    quotient = sqrt(2.0 - sin(x)) / (y - 3.0) + 1.0 / x
    turned = arctan(quotient * y)
    differences = [x - y, y - x, 1.0 - x, sin(x) * y - cos(x), cos(x) - x * y]
    return [*differences, x / y, -x / 4.0, quotient, -turned, turned, x, 0.25, x]


@pytest.mark.parametrize("width", [1, lanes()])
def test_every_operation(width, rng, monkeypatch):
    """Of lines that are cut into parts the bits are the same."""
    x, traced = rng.uniform(0.1, 2.0, (2, width)), trace("everything", [2], everything)
    found = compiled(traced, width)(x)
    wanted = np.array([[float(v) for v in everything(state)] for state in x.T]).T
    assert found == pytest.approx(wanted, rel=8 * EPS, abs=8 * EPS)
    monkeypatch.setattr(straight, "LONGEST", 9)
    assert len(functions(traced, width)) > 2 and np.array_equal(compiled(traced, width)(x), found)


@pytest.mark.parametrize("width", [1, lanes()])
def test_the_solution_of_a_linear_system_is_called(width, rng, monkeypatch):
    """In parts too: what is handed to a call, and what it gives back."""
    terms = forms.Terms(SMALL)
    terms.n = n = 4

    def function(matrix, right):
        rows = [matrix[n * i : n * (i + 1)] for i in range(n)]
        return [2.0 * x for x in terms.called_solution(rows, [-x for x in right])]

    traced = trace("solved", [n * n, n], function)
    A, b = rng.uniform(-1, 1, (width, n, n)) + 3.0 * np.eye(n), rng.uniform(-1, 1, (width, n, 1))
    A[0, 1, 0] = A[0, 2, 0] = 0.0
    given = np.concatenate([A.reshape(width, -1), b[..., 0]], axis=1).T
    found = compiled(traced, width, [solve(), solution(n)])(given)
    assert found == pytest.approx(-2.0 * np.linalg.solve(A, b)[..., 0].T, rel=1e-12)
    # the others have no part in it
    assert np.array_equal(compiled(traced, 1, [solve(), solution(n)])(given[:, :1])[:, 0], found[:, 0])
    monkeypatch.setattr(straight, "LONGEST", 2)
    assert np.array_equal(compiled(traced, width, [solve(), solution(n)])(given), found)


@pytest.mark.parametrize("name, few", [("rk4", 0), ("implicit", 99)])
def test_the_derivative_of_a_slope_is_that_of_dual_numbers_through_the_literal_form(name, few, rng, monkeypatch):
    """In articulated bodies, where that can be, and by Mbar and h."""
    monkeypatch.setattr(forms, "FEW", few)
    stepping, (q, qd, tau), dt = METHODS[name], (rows[0] for rows in random_states(rng, SMALL, 1)), 0.05
    nq, n = len(q), len(qd)
    given = [*q, *qd, *tau, dt, *rng.uniform(-1, 1, nq + n)]
    found = compiled(forms.directional(SMALL, stepping))(np.transpose([given]))[:, 0]

    def slope(x):
        return stepping.slope(SMALL, x[:nq], x[nq:], tau.tolist(), dt)

    start = [*q.tolist(), *qd.tolist()]
    wanted = [*slope(start), *(row[0] for row in jacobian(slope, start, [given[-nq - n :]]))]
    assert found == pytest.approx(np.array(wanted), rel=1e-10, abs=1e-10)


sincos = compiled(trace("both", [1], lambda x: [sin(x[0]), cos(x[0])]))


@given(st.floats(LIMIT / 2, LIMIT) | st.floats(-10.0, 10.0) | st.integers(-1000, 1000).map(lambda n: n * np.pi / 4))
def test_sine_and_cosine_to_the_last_digit(x):
    with mpmath.workdps(60):
        for value, truth in zip(sincos([[x]])[:, 0], (mpmath.sin(x), mpmath.cos(x))):
            assert abs(mpmath.mpf(float(value)) - truth) <= 1.2 * EPS


@pytest.mark.parametrize("x", [math.nextafter(LIMIT, math.inf), -1e300, -np.inf, np.nan])
def test_no_sine_beyond_the_limit(x):
    assert np.isnan(sincos([[x]])).all() and np.isfinite(sincos([[math.copysign(LIMIT, x)]])).all()
