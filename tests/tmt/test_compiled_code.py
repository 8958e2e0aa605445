"""Compiled quantities and runs: the same bits side by side, in threads and alone. The numbers of quantities see test_answers."""

import ctypes
import math
from dataclasses import replace

import mpmath
import numpy as np
import pytest
from helpers.trees import random_state, random_states, small_tree
from hypothesis import given
from hypothesis import strategies as st

import tmt
from tmt.compiled import forms, runner, runs, straight
from tmt.compiled.ir import POINTER, Code, module
from tmt.compiled.machine import Library
from tmt.compiled.runner import Runner
from tmt.compiled.straight import LIMIT, functions, trace
from tmt.derivation.dual import jacobian
from tmt.derivation.vectors import cos, sin
from tmt.methods import METHODS, one_step

EPS = np.finfo(float).eps
SMALL = small_tree()


def compiled(traced):
    """The traced function of some numbers, as a function in Python."""
    code = Code("f", {"in": POINTER, "out": POINTER})
    code.call(traced.name, code["in"], code["out"])
    code.ret()
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
    monkeypatch.setattr(forms, "forms_of", lambda tree, ways=forms.forms_of: [ways(tree)[way]])
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


FREE = replace(SMALL, position_gain=(), speed_gain=())  # without a controller
LARGER = ("implicit", SMALL), ("implicit", FREE), ("implicit_midpoint", SMALL)


def starts(count) -> list[np.ndarray]:
    return random_states(np.random.default_rng(0), SMALL, count)


def paths_from(q, qd, steps) -> list[np.ndarray]:
    paths = [np.full((len(x), steps + 1, x.shape[1]), np.nan) for x in (q, qd)]
    paths[0][:, 0], paths[1][:, 0] = q, qd
    return paths


def assert_is_the_step(name, q, qd, tau, dt, tree=SMALL):
    """The first run is that of the method over floats."""
    state = q[0, 0].tolist(), qd[0, 0].tolist()
    for k in (1, 2):
        state = one_step(METHODS[name], tree, *state, tau[0].tolist(), dt)
        assert np.allclose(q[0, k], state[0], rtol=0, atol=1e-11)
        assert np.allclose(qd[0, k], state[1], rtol=0, atol=1e-10)


# the steps of the others are compiled in the same way, and engines/test_contract.py follows the arm by them
@pytest.mark.parametrize("name, counts", [
    ("rk4", (*range(1, 10), 17)), ("implicit", (4, 9)), ("implicit_midpoint", (1, 3)), ("dopri8_adaptive", (1, 3)),
])  # fmt: skip
def test_runs_together_have_the_bits_of_each_alone(name, counts):
    """Two of them diverge, one at once; some batches are no multiple of what a register holds."""
    most, dt = counts[-1], 0.3 if METHODS[name].adaptive else 0.02  # of the steps of its own some are refused
    q, qd, tau = starts(most)
    qd[1], tau[most // 2 + 1] = 1e200, 1e300
    alone = [tmt.simulate(SMALL, *run, dt, 6, name) for run in zip(q, qd, tau)]
    for count in counts:
        batch = tmt.simulate(SMALL, q[:count], qd[:count], tau[:count], dt, 6, name)
        assert np.array_equal(batch.q, [one.q for one in alone[:count]], equal_nan=True)
        assert np.array_equal(batch.qd, [one.qd for one in alone[:count]], equal_nan=True)
        assert batch.ended.tolist() == [one.ended for one in alone[:count]]
        assert batch.evaluations == sum(one.evaluations for one in alone[:count])
    assert [k for k in range(most) if batch.ended[k]] == [1, most // 2 + 1]
    third = tmt.simulate(SMALL, q, qd, tau, dt, 6, name, every=3)
    assert np.array_equal(third.t, batch.t[::3])
    assert all(np.array_equal(x[:, ::3], y, equal_nan=True) for x, y in zip(batch[1:], third[1:]))
    assert batch.evaluations == third.evaluations and np.array_equal(batch.ended, third.ended)
    if not METHODS[name].adaptive:
        assert_is_the_step(name, batch.q, batch.qd, tau, dt)


@pytest.mark.parametrize("name, tree", LARGER)
def test_the_code_of_larger_trees_does_the_same(name, tree, folder, monkeypatch):
    """Linear systems and derivatives by calls, articulated bodies, no lines in the place of a call, lines cut into parts."""
    monkeypatch.setattr(forms, "DENSE", 0)
    monkeypatch.setattr(runs, "INLINED", 0)
    monkeypatch.setattr(forms, "FORMS", forms.FORMS[1:2])
    monkeypatch.setattr(straight, "LONGEST", 50)
    q, qd, tau = starts(9)
    (q, qd), other = paths_from(q, qd, 3), paths_from(q[4:5], qd[4:5], 3)
    for paths, torque in (((q, qd), tau), (other, tau[4:5])):
        Runner(tree, METHODS[name]).follow(*paths, torque, 0.02, 0.0, 1)
    assert np.array_equal(q[4], other[0][0]) and np.array_equal(qd[4], other[1][0])
    assert_is_the_step(name, q, qd, tau, 0.02, tree)


def test_several_cores_give_the_bits_of_one(monkeypatch):
    q, qd, tau = starts(75)
    qd[40] = 1e200
    monkeypatch.setattr(runner, "SPREAD", 0)
    for name in ("rk4", "implicit_midpoint"):
        monkeypatch.setattr(runner, "cores", lambda: 1)
        one = tmt.simulate(SMALL, q, qd, tau, 0.02, 6, name)
        monkeypatch.setattr(runner, "cores", lambda: 3)
        three = tmt.simulate(SMALL, q, qd, tau, 0.02, 6, name)
        assert all(np.array_equal(a, b, equal_nan=True) for a, b in zip(one, three)) and one.ended[40]
        assert one.evaluations == three.evaluations and np.array_equal(one.ended, three.ended)
