"""Limits that are known, predicted against observed, and errors that the experiment must see."""

import dataclasses

import numpy as np
import pytest

import tmt
from compare import departure, failure, limits, stability
from compare.agreement import Result
from compare.engine_linear import left_to_itself, transition
from compare.linear import held, region
from compare.parties import Party
from compare.scenes import posture
from tmt.methods import METHODS, RungeKutta

BENT, BALL = (held(name, posture(name)) for name in ("bent", "ball catch"))
RK4, EULER, MIDPOINT = Party("TMT", "rk4"), Party("TMT", "semi_implicit_euler"), Party("TMT", "implicit_midpoint")


@pytest.mark.parametrize(
    "name, kind, rates",
    [
        ("zero", "marginal", [0.0, 0.0]),
        ("hanging", "centre", [10.995j, 4.975j, 4.867j]),
        ("upright", "saddle", [10.995, 4.975, 4.867]),
        ("ball catch", "saddle", [7.513, 5.300]),
        ("bent", "centre", [9.101j, 5.039j, 4.314j]),
    ],
)
def test_what_each_posture_is(name, kind, rates):
    at = held(name, posture(name))
    assert at.kind == kind
    values = at.modes[0]
    for rate in rates:
        assert np.abs(values - rate).min() < 5e-4
    assert np.abs(values.sum()) < 1e-9  # undamped: they come in opposite pairs


@pytest.mark.parametrize(
    "name, imaginary, real",
    [
        ("semi_implicit_euler", 2.0, None),
        ("implicit", 2.0, None),
        ("rk4", 2.0 * np.sqrt(2.0), 2.785294),
        ("explicit_euler", 0.0, 2.0),
        ("implicit_midpoint", None, None),
        ("gauss_legendre_4", None, None),
    ],
)
def test_known_limits_on_the_axes(name, imaginary, real):
    beyond = np.linspace(1e-3, 20.0, 400)
    if imaginary is None:
        assert region(name, 1j * beyond).max() < 1.0 + 1e-12
    else:
        below, above = region(name, 1j * (imaginary + np.array([-1e-4, 1e-4])))
        assert above > 1.0 + 1e-9 and (below < 1.0 + 1e-12 or imaginary == 0.0)
    if real is None and imaginary is None:
        assert region(name, -beyond + 0j).max() < 1.0
    elif real is not None:
        assert region(name, np.array([-real + 1e-5 + 0j])) < 1.0 < region(name, np.array([-real - 1e-5 + 0j]))


@pytest.mark.parametrize("at", [BENT, held("hanging", posture("hanging"))], ids=lambda at: at.name)
@pytest.mark.parametrize("name, swing", [("rk4", 2.0 * np.sqrt(2.0)), ("semi_implicit_euler", 2.0), ("implicit", 2.0)])
def test_limit_of_the_arm_is_that_of_its_fastest_mode(at, name, swing):
    kind, dt = at.limit(name)
    assert kind == "finite" and dt * np.abs(at.modes[0]).max() == pytest.approx(swing, rel=1e-6)


def test_damped_rk4_meets_its_real_limit_at_the_stiffest_mode():
    at = held("bent", posture("bent"), 50.0)
    kind, dt = at.limit("rk4")
    assert kind == "finite" and dt * np.abs(at.modes[0]).max() == pytest.approx(2.785294, rel=1e-6)


@pytest.mark.parametrize("name", ["implicit_midpoint", "gauss_legendre_4"])
def test_a_stable_methods_have_no_limit_but_on_a_saddle(name):
    assert BENT.limit(name) == ("never_fails", None)
    assert BALL.limit(name) == ("always_fails", None)


def test_explicit_euler_fails_on_a_centre_at_every_step():
    assert BENT.limit("explicit_euler") == ("always_fails", None)


@pytest.mark.parametrize("name", ["bent", "hanging"])
def test_predicted_and_observed_limits_agree(name, engine):
    parties = (RK4, EULER, MIDPOINT, Party("MuJoCo", "RK4"), Party("MuJoCo", "Euler"))
    rows = limits.examine((name, 0.0), engine, parties)["rows"]
    assert [row["seen"] for row in rows] == [row["limit"] for row in rows]
    assert sum(row["limit"] == "finite" for row in rows) == 4
    for row in rows:
        if row["limit"] == "finite":
            assert row["observed_dt_s"] == pytest.approx(row["predicted_dt_s"], rel=limits.AIM)
        else:
            assert row["observed_dt_s"] is row["predicted_dt_s"] is None


def test_the_limit_of_explicit_euler_with_little_damping_is_seen(engine):
    """Growth beyond it is slow: 100-fold in 2000 steps comes 6 % later."""
    scene = ("bent", 0.5)
    row = limits.examine(scene, engine, (Party("TMT", "explicit_euler"),))["rows"][0]
    assert row["seen"] == "finite" and row["observed_dt_s"] == pytest.approx(row["predicted_dt_s"], rel=5e-4)


@pytest.mark.parametrize("integrator", ["Euler", "implicit", "RK4"])
def test_amplification_is_mujocos_and_sees_damping(engine, integrator):
    at = held("bent", posture("bent"), 0.5)
    scheme = stability.TWINS[integrator]
    theirs = transition(engine.variant(damping=0.5), at.q, at.tau, 0.01, integrator)
    assert np.abs(at.step(scheme, 0.01) - theirs).max() < 1e-8
    assert np.abs(BENT.step(scheme, 0.01) - theirs).max() > 1e-2


def test_departure_is_predicted_and_the_prediction_can_miss(engine):
    rows = departure.examine(5 / 64, engine, (RK4, Party("MuJoCo", "Euler")))
    assert len({row["observed_s"] for row in rows}) > 8  # the arm left, at other times from other starts
    result = Result("stability")
    departure.judge(result, rows, [])
    assert len(result.checks) == len(rows) and all(check.passed for check in result.checks)
    result = Result("stability")
    departure.judge(result, [row | {"predicted_s": row["predicted_s"] + 0.2} for row in rows], [])
    assert not any(check.passed for check in result.checks)


def test_zero_leaves_with_one_over_the_square_root():
    rows = departure.zero_law(RK4, None)
    times = {row["perturbation_rad"]: row["observed_s"] for row in rows}
    assert times[1e-5] / times[1e-4] == pytest.approx(np.sqrt(10.0), rel=0.03)
    shape, slope = departure.cubic(held("zero", posture("zero")))
    step = 1e-4 * shape  # q'' along the mode is slope q^2: from the accelerations themselves
    q = posture("zero")
    found = tmt.acceleration(q + step, np.zeros(3), tmt.gravity_balance(q)) @ shape / (shape @ shape)
    assert found == pytest.approx(slope * 1e-8, rel=1e-3)


def test_a_tiny_step_that_rounding_holds_back_is_in_the_prediction(engine):
    """From a torque error of a few ulps at 1 ms the arm leaves later than the linear map without rounding says."""
    at, dt = BALL, 1e-3
    tau = departure.own_torque(Party("MuJoCo", "Euler"), engine, at)
    tau = tau + 3e-15 * tmt.mass_matrix(at.q) @ at.modes[1][:3, 0].real / np.abs(at.modes[1][:3, 0]).max() * 7.513**2
    off = departure.residual(EULER, engine, at, tau[None])
    rounded, exact = (
        departure.predicted(at, EULER.scheme, dt, np.zeros((1, 3)), off, rounded=rounded)[0]
        for rounded in (True, False)
    )
    q, _ = EULER.run(engine, tmt.ARM, at.q, np.zeros(3), tau, dt, 7000)
    observed = departure.departure(dt * np.arange(7001), q)
    assert abs(observed - rounded) < departure.NEAR < 0.1 < observed - exact


def test_own_bias_holds_for_ever(engine):
    tau = departure.own_torque(Party("MuJoCo", "RK4"), engine, BALL)
    _, qd = Party("MuJoCo", "RK4").run(engine, tmt.ARM, BALL.q, np.zeros(3), tau, 5 / 64, 200)
    assert not qd.any()
    ours = departure.own_torque(RK4, engine, BALL)  # no double need be the bias of compiled code: the nearest is taken
    left = departure.residual(RK4, engine, BALL, np.array([ours, BALL.tau]))
    assert np.abs(left[0]).max() <= min(np.abs(left[1]).max(), np.spacing(np.abs(BALL.tau).max()))
    q, _ = RK4.run(engine, tmt.ARM, BALL.q, np.zeros(3), ours + 1e-12, 5 / 64, 100)
    assert np.nanmax(np.abs(q - BALL.q)) > 0.1


def test_resonance_needs_a_large_perturbation():
    near = failure.edge(Party("TMT", "implicit"), None, [failure.SMALL, failure.LARGE], failure.NEAR)
    assert near[0].max() < 3.0 and near[1].max() > limits.ALLOWED


def test_silent_failures_are_caught(engine):
    reset = failure.own_reset(engine)
    assert reset["finite"] and reset["resets"] >= 1
    assert reset["caught_in_it_s"] <= reset["first_reset_s"]
    gain = failure.silent_gain(engine)
    assert gain["gain"] > 5.0 * gain["range"] and gain["caught_in_it_s"] == gain["since_s"]
    assert gain["definite"][64] < 0.0 < gain["definite"][128]
    calm = left_to_itself(engine, *failure.BENT.start, np.zeros(3), 1e-3, 100, "RK4")
    assert failure.caught(failure.BENT, 1e-3 * np.arange(101), calm) is None and calm["warnings"] == 0


def test_a_wrong_method_is_seen(engine, monkeypatch):
    """Two weights of RK4 off by 0.01, which no tableau check can see: its prediction is not that of MuJoCo's RK4."""
    right = METHODS["rk4"]
    wrong = RungeKutta(right.order, right.A, (1 / 6 + 0.01, 1 / 3 - 0.01, 1 / 3, 1 / 6), right.c)
    monkeypatch.setitem(METHODS, "rk4", wrong)
    row = limits.examine(("bent", 0.0), engine, (Party("MuJoCo", "RK4"),))["rows"][0]
    assert row["limit"] != "finite" or abs(row["observed_dt_s"] / row["predicted_dt_s"] - 1.0) > limits.AIM
    assert np.abs(BENT.step("rk4", 0.1) - transition(engine, BENT.q, BENT.tau, 0.1, "RK4")).max() > 1e-4


def test_a_wrong_stiffness_is_seen(engine):
    """Predicted for a forearm of another mass, observed on MuJoCo's arm: apart by far more than the aim."""
    model = dataclasses.replace(tmt.ARM, mass=(1.9, 1.65))
    heavy = dataclasses.replace(BENT, model=model, tau=tmt.gravity_balance(BENT.q, model))
    observed = limits.observed_limit(Party("MuJoCo", "RK4"), engine, BENT)[1]
    assert abs(observed / heavy.limit("rk4")[1] - 1.0) > 2.0 * limits.AIM
