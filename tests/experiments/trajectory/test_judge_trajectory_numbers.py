"""What is found of runs beside their agreement: errors, drift, how far digits reach, why a held robot leaves."""

import dataclasses

import mpmath
import numpy as np
import pytest
from trajectory_curves import CASES, FREE, HELD, run_of

import tmt
from compare.engines.mujoco import parse
from compare.engines.mujoco.engine import METHODS as OF_MUJOCO
from compare.experiments.trajectory import drift, errors, horizon, leaving, sentences
from compare.judge.check import Result
from compare.judge.run import departure
from compare.robots.arm import ARM
from tmt.methods import METHODS, one_step


def test_the_error_of_a_held_scene_is_its_distance_from_the_start():
    result = Result("trajectory", curves={"runs": {
        ("ball catch, held", "rk4", 64): run_of(HELD, 0.25, np.nan), ("ball catch, held", "rk4", 128): run_of(HELD, 9.0, 9.0),
        ("ball catch, held", "implicit", 64): run_of(HELD, 9.0, 9.0), ("bent, free", "rk4", 64): run_of(FREE, 9.0, 9.0),
    }})  # fmt: skip
    assert errors.errors_when_held(result, ARM) == {"ball catch, held": (0.25, None)}


def test_the_error_of_a_free_scene_is_its_distance_from_many_digits():
    runs = {}
    for name in ("zero, free", "bent, free"):
        case = CASES[name]
        path = tmt.simulate(*case.start, case.tau, 5 / 64, 64, "rk4", case.tree).q
        runs[name, "rk4", 64] = run_of(case) | {"tmt": [path, path], "mujoco": [path + 100.0, path]}
    of_runs = errors.errors_when_free(Result("trajectory", curves={"runs": runs}), ARM)
    ours = {name: error for name, (error, _) in of_runs.items()}
    assert ours == pytest.approx({"zero, free": 1.6, "bent, free": 0.27}, rel=0.03)
    assert all(theirs > 90.0 for _, theirs in of_runs.values())


@pytest.mark.parametrize("error, is_far", [(0.49, False), (0.51, True), (None, False)])
def test_agreement_that_says_nothing_is_told(error, is_far):
    """An error is a hundred times the distance of the engines."""
    runs = {("ball catch, held", "rk4", 64): run_of(HELD, 0.25, 0.26, until=2.5)}
    first, second = sentences.of_errors(runs, {"ball catch, held": (error, 0.1)}, CASES)
    assert "ball catch, held" in first and ("ball catch, held" in second) is is_far


def test_an_engine_that_does_not_drift_is_named(engines):
    """Without gravity MuJoCo's arm stays where it is let go, and TMT's falls."""
    rests = parse(ARM.mjcf.read_text().replace("0 0 -9.81", "0 0 0"), tmt.ARM)
    result = Result("trajectory")
    drift.measure_drift(result, ARM, engines | {"mujoco": rests}, {1: (32, 64), 4: (32, 64)})
    found = result.curves["drift"]["drifts"]
    for name in ("Euler", "RK4"):
        of = found["bent, free", "energy", "J"][OF_MUJOCO[name]]
        assert of["mujoco"] == [0.0, 0.0] and min(of["tmt"]) > 0.0
    assert not {"bent, damped", "bent, held"} & {scene for scene, *_ in found}
    assert [scene for scene, quantity, _ in found if quantity == "alpha-momentum"] == ["thrown, no gravity"]
    still, result = dataclasses.replace(ARM, scenes=(CASES["bent, held"].scene,)), Result("trajectory")
    drift.measure_drift(result, still, engines, drift.FEW_DRIFT_STEPS)
    assert result.checks == [] and result.curves["drift"]["drifts"] == {}


def test_momentum_about_the_first_hinge_is_constant_where_nothing_turns_the_arm():
    case = CASES["thrown, no gravity"]
    (_, energy), (_, momentum) = drift.constants(case).items()
    _, q, v = tmt.simulate(*case.start, case.tau, 1 / 4096, 2048, "rk4", case.tree)
    assert np.ptp(momentum(q, v)) < 1e-9 < abs(momentum(q, v)[0]) and np.ptp(energy(q, v)) < 1e-8
    assert ("alpha-momentum", "N m s") not in drift.constants(case.changed(speed=(), locked=("alpha",)))


# how far digits reach


def test_each_engine_is_compared_with_many_digits():
    path = tmt.simulate(*FREE.start, FREE.tau, 5 / 64, 64, "rk4", FREE.tree).q
    other = tmt.simulate(*FREE.start, FREE.tau + 1e-6, 5 / 64, 64, "rk4", FREE.tree).q
    result = Result("trajectory", curves={"runs": {
        ("bent, free", "rk4", 64): run_of(FREE) | {"tmt": [path, path], "mujoco": [other, path]}
    }})  # fmt: skip
    horizon.many_digits(result, [FREE], [{"rk4": path.astype(object)}])
    assert [(check.quantity[:6], check.passed) for check in result.checks] == [("TMT to", True), ("MuJoCo", False)]


def test_many_digits_are_many_and_those_of_the_own_steps_of_the_scene():
    """The same two steps with 80 digits; 50 are those of the run."""
    case = FREE.changed(duration=0.5, dt=0.125)
    (short,), (own,) = (horizon.exact_runs(case, ["rk4"], most).values() for most in (2, 64))
    assert (short.shape, own.shape) == ((3, 3), (5, 3)) and (short == own[:3]).all()
    path = tmt.simulate(*case.start, case.tau, 0.125, 4, "rk4", case.tree).q
    assert np.abs(own.astype(float) - path).max() < 1e-13
    with mpmath.workdps(80):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (*case.start, case.tau))
        for _ in range(2):
            q, qd = one_step(METHODS["rk4"], case.tree, q, qd, tau, mpmath.mpf(0.125))
        assert max(abs(a - b) for a, b in zip(short[-1], q)) < mpmath.mpf(10) ** -46


def test_a_horizon_is_where_a_difference_of_the_last_digit_has_grown_to_a_radian():
    t = np.linspace(0.0, 60.0, 61)
    assert horizon.reach(t, 0.3 * t, 16) == 54.0 and horizon.reach(t, 0.26 * t, 16) is None
    ends, at_once = np.where(t < 51.0, 0.4 * t, np.nan), np.where(t < 1.0, 0.0, np.nan)
    assert (horizon.known_until(t, ends), horizon.known_until(t, at_once)) == (50.0, 0.0)
    growth, horizons = horizon.growth_in_words(t, {"calm": 0.1 * t, "wild": ends})
    assert "10^0.5" in growth and "10^6.0" in growth and "10^2.0" in growth
    assert "calm" not in horizons and all(number in horizons for number in ("wild", "41 s", "50 s"))
    assert "50 s" in horizon.growth_in_words(t, {"calm": 0.1 * t, "ends": ends / 9, "at once": at_once})[1]


# why a held robot leaves


def test_the_linear_map_says_when_a_torque_that_is_off_makes_the_arm_leave():
    for size in (1e-3, 1e-9):
        push = size * np.array([1.0, 0.5, -1.0])
        tau = HELD.tau + tmt.mass_matrix(HELD.q) @ push
        t, q, _ = tmt.simulate(*HELD.start, tau, 5 / 64, 64, "rk4")
        assert leaving.predicted_leaving(HELD, push) == pytest.approx(departure(t, q), abs=5 / 64)
    assert leaving.predicted_leaving(CASES["bent, held"], 1e-9 * np.ones(3)) is None


def test_rounding_is_the_cause_only_of_what_rounding_can_do(engines):
    may = leaving.allowed(HELD)
    assert 1e-13 < may < 1e-11

    def cause(share, at, left=4.69):
        return leaving.cause_in_words(HELD, share * may, may, at, left)

    rounding, too_large, too_soon = cause(0.999, 4.69), cause(1.001, 4.69), cause(0.5, 4.69 - 2.6 * 5 / 64)
    assert len({rounding, too_large, too_soon, ""}) == 4
    assert cause(0.5, 4.69 + 2.4 * 5 / 64) == rounding and cause(0.5, None) == too_soon
    assert cause(9.0, 0.1, None) == ""  # it stays
    moon = engines | {"mujoco": parse(ARM.mjcf.read_text().replace("0 0 -9.81", "0 0 -1.62"), tmt.ARM)}
    earth, other = (leaving.leaving(HELD, of) for of in (engines, moon))
    assert earth.rate == pytest.approx(7.5, abs=0.1) and max(earth.left_over.values()) <= earth.allowed
    assert other.left_over["tmt"] == earth.left_over["tmt"] and other.left_over["mujoco"] == pytest.approx(38, rel=0.02)
