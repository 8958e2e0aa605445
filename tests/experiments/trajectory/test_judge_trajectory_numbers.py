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

THROWN = CASES["thrown, no gravity"]


def path_of(case, more=0.0) -> np.ndarray:
    """Angles of TMT's run with the scene's own steps, its torques so much larger."""
    return tmt.simulate(*case.start, case.tau + more, 5 / 64, 64, "rk4", case.tree).q


def with_gravity(gravity):
    return {"mujoco": parse(ARM.mjcf.read_text().replace("0 0 -9.81", gravity), tmt.ARM)}


def test_the_error_of_a_held_scene_is_its_distance_from_the_start():
    result = Result("trajectory", curves={"runs": {
        ("ball catch, held", "rk4", 64): run_of(HELD, 0.25, np.nan), ("ball catch, held", "rk4", 128): run_of(HELD, 9.0, 9.0),
        ("ball catch, held", "implicit", 64): run_of(HELD, 9.0, 9.0), ("bent, free", "rk4", 64): run_of(FREE, 9.0, 9.0),
    }})  # fmt: skip
    assert errors.errors_when_held(result, ARM) == {"ball catch, held": (0.25, None)}


def test_the_error_of_a_free_scene_is_its_distance_from_many_digits():
    path = path_of(FREE)
    run = run_of(FREE) | {"tmt": [path, path], "mujoco": [path + 100.0, path]}
    of_runs = errors.errors_when_free(Result("trajectory", curves={"runs": {(FREE.name, "rk4", 64): run}}), ARM)
    ours, theirs = of_runs.pop(FREE.name)
    assert ours == pytest.approx(0.27, rel=0.03) and theirs > 90.0 and not of_runs


@pytest.mark.parametrize("error, is_far", [(0.49, False), (0.51, True), (None, False)])
def test_agreement_that_says_nothing_is_told(error, is_far):
    """An error is a hundred times the distance of the engines."""
    runs = {("ball catch, held", "rk4", 64): run_of(HELD, 0.25, 0.26, until=2.5)}
    first, second = sentences.of_errors(runs, {"ball catch, held": (error, 0.1)}, CASES)
    assert "ball catch, held" in first and ("ball catch, held" in second) is is_far


def test_drift_is_measured_where_nothing_takes_energy_and_an_engine_that_does_not_drift_is_seen(engines):
    """Without gravity MuJoCo's arm stays where it is let go, and TMT's falls."""
    scenes = tuple(CASES[name].scene for name in ("bent, free", "bent, damped", "bent, held", "thrown, no gravity"))
    rests, result = engines | with_gravity("0 0 0"), Result("trajectory")
    drift.measure_drift(result, dataclasses.replace(ARM, scenes=scenes), rests, {1: (32, 64), 4: (32, 64)})
    found = result.curves["drift"]["drifts"]
    assert [key[:2] for key in found] == [
        ("bent, free", "energy"),
        *((THROWN.name, of) for of in ("energy", "alpha-momentum")),
    ]
    for name in ("Euler", "RK4"):
        of = found["bent, free", "energy", "J"][OF_MUJOCO[name]]
        assert of["mujoco"] == [0.0, 0.0] and min(of["tmt"]) > 0.0
    assert {check.passed for check in result.checks if "MuJoCo" in check.scene and "bent, free" in check.scene} == {
        False
    }


def test_momentum_about_the_first_hinge_is_constant_where_nothing_turns_the_arm():
    (_, energy), (_, momentum) = drift.constants(THROWN).items()
    _, q, v = tmt.simulate(*THROWN.start, THROWN.tau, 1 / 4096, 2048, "rk4", THROWN.tree)
    assert np.ptp(momentum(q, v)) < 1e-9 < abs(momentum(q, v)[0]) and np.ptp(energy(q, v)) < 1e-8
    assert ("alpha-momentum", "N m s") not in drift.constants(THROWN.changed(speed=(), locked=("alpha",)))


# how far digits reach


def test_each_engine_is_compared_with_many_digits():
    path = path_of(FREE)
    run = run_of(FREE) | {"tmt": [path, path], "mujoco": [path_of(FREE, 1e-6), path]}
    result = Result("trajectory", curves={"runs": {("bent, free", "rk4", 64): run}})
    horizon.many_digits(result, [FREE], [{"rk4": path.astype(object)}])
    assert [(check.quantity[:6], check.passed) for check in result.checks] == [("TMT to", True), ("MuJoCo", False)]


def test_many_digits_are_many_and_those_of_the_own_steps_of_the_scene():
    """The same two steps with 80 digits; 50 are those of the run."""
    case = FREE.changed(duration=0.5, dt=0.125)
    (short,), (own,) = (horizon.exact_runs(case, ["rk4"], most).values() for most in (2, 64))
    assert (short.shape, own.shape) == ((3, 3), (5, 3)) and (short == own[:3]).all()
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
    assert all(number in growth for number in ("10^0.5", "10^6.0", "10^2.0"))
    assert "calm" not in horizons and all(number in horizons for number in ("wild", "41 s", "50 s"))


# why a held robot leaves


def test_the_linear_map_says_when_a_torque_that_is_off_makes_the_arm_leave():
    push = 1e-9 * np.array([1.0, 0.5, -1.0])
    t, q, _ = tmt.simulate(*HELD.start, HELD.tau + tmt.mass_matrix(HELD.q) @ push, 5 / 64, 64, "rk4")
    assert leaving.predicted_leaving(HELD, push) == pytest.approx(departure(t, q), abs=5 / 64)
    assert leaving.predicted_leaving(CASES["bent, held"], 1e-9 * np.ones(3)) is None


def test_rounding_is_the_cause_only_of_what_rounding_can_do():
    may = leaving.allowed(HELD)
    assert 1e-13 < may < 1e-11

    def cause(share, at, left=4.69):
        return leaving.cause_in_words(HELD, share * may, may, at, left)

    rounding, too_large, too_soon = cause(0.999, 4.69), cause(1.001, 4.69), cause(0.5, 4.69 - 2.6 * 5 / 64)
    assert len({rounding, too_large, too_soon, ""}) == 4
    assert cause(0.5, 4.69 + 2.4 * 5 / 64) == rounding and cause(0.5, None) == too_soon
    assert cause(9.0, 0.1, None) == ""  # it stays


def test_a_torque_that_does_not_hold_is_no_rounding(engines):
    earth, moon = (leaving.leaving(HELD, engines | other) for other in ({}, with_gravity("0 0 -1.62")))
    assert earth.rate == pytest.approx(7.5, abs=0.1) and max(earth.left_over.values()) <= earth.allowed
    assert moon.left_over["tmt"] == earth.left_over["tmt"] and moon.left_over["mujoco"] == pytest.approx(38, rel=0.02)
