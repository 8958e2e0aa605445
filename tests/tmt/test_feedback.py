"""A torque that is a function of time and state: against SciPy's DOP853, and against gains of the model."""

import dataclasses

import numpy as np
import pytest
from helpers.trees import tree_of_kinds
from scipy.integrate import solve_ivp

import tmt
from tmt.feedback import as_gains

START, REST, GOAL = np.array([0.5, 0.3, 1.0]), np.zeros(3), np.array([0.2, 0.1, 0.8])
KP, KD = np.diag([8.0, 9.0, 4.0]), np.array([[1.0, 0.2, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 0.3]])


def proportional(t, q, qd):
    return -KP @ (q - GOAL) - KD @ qd / 2.0 + 1.5


LAWS = {
    "linear": proportional,
    "saturated": lambda t, q, qd: np.clip(proportional(t, q, qd), -1.0, 1.0),
    "in time": lambda t, q, qd: proportional(t, q, qd) + np.sin(3.0 * t),
    "a product": lambda t, q, qd: proportional(t, q, qd) * (1.0 + q[0] * qd[0]),
    "a branch": lambda t, q, qd: proportional(t, q, qd) if q[2] > 0.9 else np.zeros(3),
    "a list": lambda t, q, qd: [float(-2.0 * v) for v in qd],
    "equal to a number": lambda t, q, qd: np.ones(3) if q[0] == 0.0 else -3.0 * qd,
}


@pytest.mark.parametrize("law", LAWS.values(), ids=LAWS)
def test_a_run_is_that_of_dop853(law):
    def rates(t, x):
        qd = x[3:]
        return [*qd, *tmt.acceleration(tmt.ARM, x[:3], qd, np.asarray(law(t, x[:3], qd), float))]

    expected = solve_ivp(
        rates, (0.0, 0.5), [*START, *REST], "DOP853", rtol=1e-11, atol=1e-12, max_step=1e-2
    ).y[:, -1]
    motion = tmt.simulate(tmt.ARM, START, REST, law, dt=1 / 1024, steps=512, every=128)
    assert motion.ended is None and motion.q.shape == (5, 3) and motion.evaluations == 4 * 512
    assert np.abs(np.concatenate([motion.q[-1], motion.qd[-1]]) - expected).max() < 1e-6


def test_a_linear_torque_is_gains_and_what_is_left_at_zero_positions():
    tree = dataclasses.replace(tmt.ARM, reference=(0.4, -0.2, 0.7))
    driven, constant, torque = as_gains(tree, proportional)
    assert torque is None and np.allclose(constant, KP @ GOAL + 1.5, rtol=0.0, atol=1e-14)
    assert np.array_equal(driven.position_gain, KP) and np.array_equal(driven.speed_gain, KD / 2.0)


@pytest.mark.parametrize("method", ["rk4", "implicitfast", "gauss_legendre_4", "dopri8_adaptive", "taylor"])
def test_a_linear_law_is_gains_of_the_model(method):
    gains = {"position_gain": KP, "speed_gain": KD / 2.0}
    driven = dataclasses.replace(tmt.ARM, **gains)
    expected = tmt.simulate(driven, START, REST, KP @ GOAL + 1.5, 0.01, 8, method)
    found = tmt.simulate(tmt.ARM, START, REST, proportional, 0.01, 8, method)
    assert np.abs(found.q - expected.q).max() < 1e-14


def test_each_run_of_a_batch_is_asked_with_its_own_state():
    starts = np.stack([START, 0.5 * START])
    seen = []

    def law(t, q, qd):
        seen.append((np.shape(q), np.shape(qd)))
        return np.tanh(-q)

    batch = tmt.simulate(tmt.ARM, starts, REST, law, 0.01, 4, "semi_implicit_euler")
    assert {*seen[2:]} == {((3,), (3,))}
    for start, q in zip(starts, batch.q):
        assert np.array_equal(tmt.simulate(tmt.ARM, start, REST, law, 0.01, 4, "semi_implicit_euler").q, q)


def test_balls_are_driven_too():
    tree = tree_of_kinds(np.random.default_rng(3))
    motion = tmt.simulate(tree, tree.zero, np.zeros(tree.nv), lambda t, q, qd: -2.0 * qd, 1e-3, 20)
    damped = dataclasses.replace(tree, damping=np.array(tree.damping) + 2.0)
    expected = tmt.simulate(damped, tree.zero, np.zeros(tree.nv), np.zeros(tree.nv), 1e-3, 20)
    assert np.abs(motion.q - expected.q).max() < 1e-9


@pytest.mark.parametrize("given, word", [(np.zeros(2), r"\(3,\)"), (None, "numbers")])
def test_what_is_no_torque_is_said(given, word):
    with pytest.raises(ValueError, match=f"tau.*{word}"):
        tmt.simulate(tmt.ARM, START, REST, lambda t, q, qd: given, 0.01, 4)


@pytest.mark.parametrize("law", [lambda t, q, qd: 1e4 * q**3, lambda t, q, qd: np.full(3, np.nan)])
def test_a_run_that_is_driven_away_ends_where_its_last_state_is(law):
    with np.errstate(over="ignore"):
        run = tmt.simulate(tmt.ARM, START, REST, law, 0.01, 100)
    last = np.flatnonzero(np.isfinite(run.q).all(axis=1))[-1]
    assert last < 50 and run.ended.startswith(f"at t = {0.01 * last:g} s") and "diverges" in run.ended


@pytest.mark.parametrize("method", ["dopri8_adaptive", "implicit_midpoint", "taylor"])
def test_a_method_that_cannot_ask_it_is_refused(method):
    with pytest.raises(ValueError, match="rk4"):
        tmt.simulate(tmt.ARM, START, REST, LAWS["saturated"], 0.01, 4, method)
