"""Compiled quantities: the same bits side by side as one at a time, derivatives, sines. Their numbers see test_answers."""

import ctypes
import math

import mpmath
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trees import random_state, random_states, small_tree

from tmt import literal
from tmt.compiled import Evaluator, forms
from tmt.compiled.ir import POINTER, Code, module
from tmt.compiled.machine import Library
from tmt.compiled.straight import LIMIT, functions, trace
from tmt.derivation.dual import jacobian
from tmt.derivation.vectors import cos, sin
from tmt.methods import METHODS

EPS = np.finfo(float).eps
SMALL = small_tree()
COUNT = 19  # two blocks and a rest, in any register


def rows_of(compiled, states, wide=False):
    out = np.full((len(states[0]), compiled.size), np.nan)
    assert compiled.fill(wide, out, *states)
    return out


def test_states_side_by_side_have_the_bits_of_each_alone(rng):
    states, compiled = random_states(rng, SMALL, COUNT), Evaluator(SMALL, "acceleration")
    wanted, found = literal.acceleration(*states, SMALL), rows_of(compiled, states)
    assert np.abs(found - wanted).max() <= 1e5 * EPS * np.abs(wanted).max() and compiled.operations > 0
    for count in (*range(10), 17, COUNT):
        some = [rows[:count] for rows in states]
        assert np.array_equal(rows_of(compiled, some, wide=True), found[:count])
        assert np.array_equal(compiled.of_rows(*some), found[:count])


def compiled(traced):
    """The traced function of some numbers, as a function in Python."""
    code = Code("f", {"in": POINTER, "out": POINTER})
    code.call(traced.name, code["in"], code["out"])
    code.give_back()
    library = Library(module([*functions(traced, 1), code]))
    function = library.function("f", None, ctypes.c_void_p, ctypes.c_void_p)

    def call(given):
        given, out = np.array(given, dtype=float), np.full(len(traced.outputs), np.nan)
        function(given.ctypes.data, out.ctypes.data)
        return out

    return call


@pytest.mark.parametrize("name, way", [("rk4", 1), ("implicit", 0), ("rk4", 2)])
def test_the_derivative_of_a_slope_is_that_of_dual_numbers_in_the_literal_form(name, way, rng, monkeypatch):
    """In articulated bodies, where that can be, and by Mbar and h."""
    monkeypatch.setattr(forms, "all_dynamics", lambda tree, ways=forms.all_dynamics: [ways(tree)[way]])
    stepping, (q, qd, tau), dt = METHODS[name], random_state(rng, SMALL), 0.05
    start, direction = [*q.tolist(), *qd.tolist()], rng.uniform(-1, 1, len(q) + len(qd))
    found = compiled(forms.directional(SMALL, stepping))([*start, *tau, dt, *direction])

    def slope(x):
        return stepping.slope(SMALL, x[: len(q)], x[len(q) :], tau.tolist(), dt)

    wanted = [*slope(start), *(row[0] for row in jacobian(slope, start, [direction]))]
    assert found == pytest.approx(np.array(wanted), rel=1e-10, abs=1e-10)


sincos = compiled(trace("both", [1], lambda x: [sin(x[0]), cos(x[0])]))
EIGHTHS = st.integers(-1000, 1000).map(lambda n: n * np.pi / 4)  # of a turn


@given(st.floats(LIMIT / 2, LIMIT) | st.floats(-10.0, 10.0) | EIGHTHS)
def test_sine_and_cosine_to_the_last_digit(x):
    with mpmath.workdps(60):
        for value, truth in zip(sincos([x]), (mpmath.sin(x), mpmath.cos(x))):
            assert abs(mpmath.mpf(float(value)) - truth) <= 1.2 * EPS


@pytest.mark.parametrize("x", [math.nextafter(LIMIT, math.inf), -1e300, -np.inf, np.nan])
def test_no_sine_beyond_the_limit(x):
    assert np.isnan(sincos([x])).all() and np.isfinite(sincos([math.copysign(LIMIT, x)])).all()
