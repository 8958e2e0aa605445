"""Predicted against observed in runs, and errors that the experiment must see."""

import dataclasses

import numpy as np
import pytest

import tmt
from compare.engines.mujoco.linear import left_to_itself, transition
from compare.experiments.stability import choice, departure, failure, falling, growth, limits, torques
from compare.judge import run
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.truth.linear import held
from tmt.methods import METHODS, RungeKutta

BENT, BALL = held(ARM, "bent"), held(ARM, "ball catch")
FREE = choice.free_motion(ARM)


@pytest.fixture
def method(engines):
    """method(engine, name): one method of integration."""
    return lambda engine, name: engines[engine].methods[name]


def test_predicted_and_observed_limits_agree(engines, method):
    ours = [method("tmt", scheme) for scheme in ("semi_implicit_euler", "implicit_midpoint")]
    rows = limits.limits_and_growths(BENT, engines, (*ours, method("mujoco", "RK4")))["rows"]
    assert [row["seen"] for row in rows] == [row["limit"] for row in rows] == ["finite", "never_fails", "finite"]
    for row in (rows[0], rows[2]):
        assert row["observed_dt_s"] == pytest.approx(row["predicted_dt_s"], rel=limits.LIMIT_TOLERANCE)
    assert rows[1]["observed_dt_s"] is rows[1]["predicted_dt_s"] is None


def test_the_limit_of_explicit_euler_with_little_damping_is_seen(engines, method):
    """Growth beyond it is slow: 100-fold in 2000 steps comes 6 % later."""
    row = limits.limits_and_growths(held(ARM, "bent", 0.5), engines, (method("tmt", "explicit_euler"),))["rows"][0]
    assert row["seen"] == "finite" and row["observed_dt_s"] == pytest.approx(row["predicted_dt_s"], rel=5e-4)


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "RK4"])
def test_amplification_is_mujocos_and_sees_damping(mujoco, integrator):
    at, scheme = held(ARM, "bent", 0.5), mujoco.methods[integrator].scheme
    theirs = transition(mujoco.of(at.case), at.q, at.tau, 0.01, integrator)
    assert np.abs(at.step(scheme, 0.01) - theirs).max() < 1e-8
    assert np.abs(BENT.step(scheme, 0.01) - theirs).max() > 1e-2


def test_a_departure_is_predicted_where_no_other_mode_grows_faster_than_that_of_the_saddle(engines, method):
    """By the explicit Euler method with steps of 1 s a swing of ball catch grows 9.5-fold in each, what leaves 8.5-fold."""
    ours = (method("tmt", "explicit_euler"),)
    assert departure.is_led(BALL, "explicit_euler", 5 / 64) and not departure.is_led(BALL, "explicit_euler", 1.0)
    assert departure.departures(1.0, BALL, engines, ours) == []
    (text,) = departure.not_led_in_words(BALL, ours, (5 / 64, 1.0))
    assert "explicit_euler at 1 s" in text and "0.078" not in text
    assert departure.not_led_in_words(BALL, ours, (5 / 64,)) == []


def test_departure_is_predicted_and_the_prediction_can_miss(engines, method):
    rows = departure.departures(5 / 64, BALL, engines, (method("tmt", "rk4"), method("mujoco", "Euler")))
    assert len({row["observed_s"] for row in rows}) > 8  # the arm left, at other times from other starts
    result = Result("stability")
    departure.check_departures(result, rows)
    assert len(result.checks) == len(rows) and all(check.passed for check in result.checks)
    result = Result("stability")
    departure.check_departures(result, [row | {"predicted_s": row["predicted_s"] + 0.2} for row in rows])
    assert not any(check.passed for check in result.checks)


def test_a_marginal_posture_is_left_with_one_over_the_square_root(engines, method):
    at = held(ARM, "zero")
    rows = falling.fall(method("tmt", "rk4"), at, engines)
    times = {row["perturbation_rad"]: row["observed_s"] for row in rows}
    assert times[1e-5] / times[1e-4] == pytest.approx(np.sqrt(10.0), rel=0.03)
    shape, slope = falling.cubic(at)
    step = 1e-4 * shape  # q'' along the mode is slope q^2: from the accelerations themselves
    found = tmt.acceleration(at.q + step, np.zeros(3), tmt.gravity_balance(at.q)) @ shape / (shape @ shape)
    assert found == pytest.approx(slope * 1e-8, rel=1e-3)


def test_a_tiny_step_that_rounding_holds_back_is_in_the_prediction(engines, method):
    """From a torque error of a few ulps at 1 ms the arm leaves later than the linear map without rounding says."""
    at, dt, euler = BALL, 1e-3, method("tmt", "semi_implicit_euler")
    tau = torques.own_torque(method("mujoco", "Euler"), engines, at)
    tau = tau + 3e-15 * tmt.mass_matrix(at.q) @ at.modes[1][:3, 0].real / np.abs(at.modes[1][:3, 0]).max() * 7.513**2
    off = torques.residual(euler, engines, at, tau[None])
    rounded, exact = (
        departure.predicted(at, euler.scheme, dt, np.zeros((1, 3)), off, rounded=rounded)[0]
        for rounded in (True, False)
    )
    motion = engines["tmt"].of(at.case).run(at.q, np.zeros(3), tau, dt, 7000, euler.name)
    observed = run.departure(motion.t, motion.q)
    assert abs(observed - rounded) < departure.DEPARTURE_TOLERANCE < 0.1 < observed - exact


def test_own_bias_holds_for_ever(engines, method):
    theirs, ours = method("mujoco", "RK4"), method("tmt", "rk4")
    tau = torques.own_torque(theirs, engines, BALL)
    assert not engines["mujoco"].of(BALL.case).run(BALL.q, np.zeros(3), tau, 5 / 64, 200, "RK4").v.any()
    own = torques.own_torque(ours, engines, BALL)  # no double need be the bias of compiled code: the nearest is taken
    left = torques.residual(ours, engines, BALL, np.array([own, BALL.tau]))
    assert np.abs(left[0]).max() <= min(np.abs(left[1]).max(), np.spacing(np.abs(BALL.tau).max()))
    motion = engines["tmt"].of(BALL.case).run(BALL.q, np.zeros(3), own + 1e-12, 5 / 64, 100, "rk4")
    assert np.nanmax(np.abs(motion.q - BALL.q)) > 0.1


def test_resonance_needs_a_large_perturbation(engines, method):
    sizes = [growth.LINEAR_DEVIATION, failure.LARGE_DEVIATION]
    near = failure.edge_growth(method("tmt", "implicit"), BENT, engines, sizes, failure.RESONANT_SWINGS)
    assert near[0].max() < 3.0 and near[1].max() > limits.GROWTH_ALLOWED


def test_the_free_motion_is_a_scene_of_the_robots_own():
    assert FREE.name == "bent, free" and FREE.scene in ARM.scenes
    other = choice.free_motion(dataclasses.replace(ARM, scenes=()))
    assert other.name == "bent, free" and other.start[0].tolist() == FREE.q.tolist() and other.is_free
    still = dataclasses.replace(ARM, kinds={"centre": "hanging"})  # where it rests: nothing would be seen
    assert choice.free_motion(still).scene.posture == "bent"


def test_silent_failures_are_caught(mujoco, engines):
    reset = failure.own_reset(FREE, engines)
    assert reset["finite"] and reset["resets"] >= 1
    assert reset["caught_in_it_s"] <= reset["first_reset_s"]
    gain = failure.silent_gain(FREE, engines)
    assert gain["gain"] > 5.0 * gain["range"] and gain["caught_in_it_s"] == gain["since_s"]
    assert gain["definite"][64] < 0.0 < gain["definite"][128]
    calm = left_to_itself(mujoco.of(FREE), *FREE.start, np.zeros(3), 1e-3, 100, "RK4")
    assert failure.caught(FREE, 1e-3 * np.arange(101), calm) is None and calm["warnings"] == 0


def test_a_wrong_method_or_stiffness_is_seen(mujoco, engines, monkeypatch):
    """Two weights of RK4 off by 0.01, which no tableau check can see, or a forearm of another mass: MuJoCo's limit is another."""
    rk4, right = mujoco.methods["RK4"], METHODS["rk4"]
    heavy = held(dataclasses.replace(ARM, tree=dataclasses.replace(tmt.ARM, mass=(1.9, 1.65))), "bent")
    seen, observed = limits.observed_limit(rk4, engines, BENT)
    assert seen == "finite" and abs(observed / heavy.limit("rk4")[1] - 1.0) > 2.0 * limits.LIMIT_TOLERANCE
    wrong = RungeKutta(right.order, right.A, (1 / 6 + 0.01, 1 / 3 - 0.01, 1 / 3, 1 / 6), right.c)
    monkeypatch.setitem(METHODS, "rk4", wrong)
    other = held(dataclasses.replace(ARM, name="another"), "bent")  # whose limits are not known yet
    kind, predicted = other.limit("rk4")
    assert kind != "finite" or abs(observed / predicted - 1.0) > limits.LIMIT_TOLERANCE
    theirs = transition(mujoco.of(BENT.case), BENT.q, BENT.tau, 0.1, "RK4")
    assert np.abs(other.step("rk4", 0.1) - theirs).max() > 1e-4
