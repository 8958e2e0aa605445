"""The checks of failures beyond the linear limits and of long runs, just inside and just outside of each rule; no runs."""

import dataclasses

import numpy as np
import pytest
from judged import INSIDE, only

import tmt
from compare.engines.mujoco.engine import METHODS as INTEGRATORS
from compare.experiments.stability import choice, failure, long_runs
from compare.judge.scale import gravity_scale
from compare.robots.arm import ARM

FREE = choice.free_motion(ARM)


@pytest.mark.parametrize("small, large, posture, passes", [
    (99.0, 101.0, "bent", [True, True]), (101.0, 99.0, "bent", [False, False]), (2.0, np.inf, "bent", [True, True]),
    (np.inf, 1e7, "bent", [False, True]),
    (101.0, 1.0, "hanging", [False]),  # not known to resonate: large deviations are not judged
])  # fmt: skip
def test_growth_at_the_resonance(result, small, large, posture, passes):
    grown = {INTEGRATORS["implicit"]: np.array([[1.0, small], [1.0, large]])}
    failure.check_near(result, ARM, posture, {"steps": 2000, "grown": grown})
    assert [check.passed for check in result.checks] == passes


def silent_run(since=None, caught=None, definite=-0.5):
    return {
        "t": np.arange(3.0), "energy": np.zeros(3), "clock": np.arange(3.0), "warnings": 0, "range": 18.8, "gain": 30.0,
        "since_s": since, "caught_in_it_s": caught, "resets": 0, "caught_at_s": caught, "finite": True,
        "first_reset_s": None, "after_q": np.zeros(3), "smallest": np.zeros(3), "definite": {64: definite, 128: 0.1},
        "case": FREE,
    }  # fmt: skip


@pytest.mark.parametrize("since, caught, passes", [
    (1.0, 1.0 + 0.999 * 5 / 64, [True]), (1.0, 1.0 + 1.001 * 5 / 64, [False]), (1.0, None, [False]), (None, None, []),
])  # fmt: skip
def test_a_silent_failure_is_caught_within_a_step(result, since, caught, passes):
    failure.check_silent(result, silent_run(since, caught), silent_run())
    failure.check_silent(result, silent_run(), silent_run(since, caught))
    assert [check.passed for check in result.checks] == 2 * passes


def test_definiteness_is_the_sign_of_an_eigenvalue():
    lost, kept = (failure.gain_in_words(silent_run(definite=least)) for least in (-1e-9, 1e-9))
    assert "loses" in lost and "loses" not in kept


@pytest.mark.parametrize("share, found", [(INSIDE, None), (1.001, 1.0)])
def test_energy_gives_a_failure_away(share, found):
    """A free run from the centre that gains a share of the physical bound on its energy as motion in its second state."""
    t, (q, qd) = np.arange(3.0), FREE.start
    rate = np.sqrt(2.0 * share * 2.0 * gravity_scale(ARM.tree) / tmt.mass_matrix(q)[0, 0])
    run = {"q": np.array([q, q, q]), "qd": np.array([qd, [rate, 0.0, 0.0], qd]), "time": t, "warnings": 0}
    assert failure.caught(FREE, t, run) == found
    seen = failure.observed(FREE, t, run)
    assert seen["since_s"] == seen["caught_in_it_s"] == found
    assert seen["gain"] == pytest.approx(share * seen["range"], rel=1e-3)


def test_the_range_of_the_potential_is_found_from_any_postures():
    """The arm's is from hanging to upright, twice the sum of m g reach; one bent posture leads to both."""
    one = dataclasses.replace(ARM, postures={"bent": ARM.postures["bent"]}, scenes=()).case("one", posture="bent")
    assert failure.potential_range(FREE) == pytest.approx(2.0 * gravity_scale(ARM.tree), rel=1e-12)
    assert failure.potential_range(one) == pytest.approx(failure.potential_range(FREE), rel=1e-9)


@pytest.mark.parametrize("back, fast, first", [(3, 2, 2.0), (2, 3, 2.0), (None, 3, 3.0), (4, None, 4.0)])
def test_a_failure_is_caught_at_the_first_of_its_signs(back, fast, first):
    """A clock that goes back, and more energy than the arm can have: whichever comes first."""
    t, time, qd = np.arange(5.0), np.arange(5.0), np.zeros((5, 3))
    time[slice(back, None) if back else slice(0)] -= 2.0
    qd[slice(fast, None) if fast else slice(0)] = 1e3
    run = {"time": time, "q": np.tile(FREE.q, (5, 1)), "qd": qd, "warnings": 0}
    assert failure.caught(FREE, t, run) == first == failure.observed(FREE, t, run)["since_s"]


# long runs


@pytest.mark.parametrize("deviations, kind", [(2.99, "bounded"), (3.01, "drifts"), (-3.01, "drifts")])
def test_energy_drifts_by_three_standard_deviations(deviations, kind):
    swing = np.tile([1.0, -1.0], 50)  # standard deviation 1
    off = np.concatenate([swing, np.zeros(300), swing + deviations])
    assert long_runs.behaviour(off) == (kind, pytest.approx(deviations))


def minute(engine, method, kind):
    ended = 1.0 if kind == "diverges" else None
    row = {"scene": "bent, free", "engine": engine, "method": method, "dt_s": 0.01, "energy": kind,
           "largest_j": None if ended else 0.1, "change_j": None if ended else 0.2, "diverged_at_s": ended}  # fmt: skip
    return {"row": row, "scheme": "rk4", "t": np.arange(60.0), "off": np.zeros(60), "seconds": 60.0}


@pytest.mark.parametrize("theirs, passes", [("drifts", True), ("bounded", False), ("diverges", False)])
def test_energy_does_as_by_the_same_scheme(result, theirs, passes):
    long_runs.check_minutes(result, [minute("tmt", "rk4", "drifts"), minute("mujoco", "RK4", theirs)])
    assert only(result) is passes
