"""Claims and failures without a warning: each rule just inside and outside."""

import numpy as np
import pytest
from judged import INSIDE

import tmt
from compare.engines.mujoco.engine import METHODS as INTEGRATORS
from compare.engines.tmt import Tmt
from compare.experiments.stability import claims, claims_checks, failure, subjects
from compare.judge.scale import gravity_scale
from compare.robots.arm import ARM

RK4 = (Tmt().methods["rk4"], INTEGRATORS["RK4"])
NAMES = (*(f"{claims.VARIANT} {k}" for k in range(1, 28)), claims.NEAREST, *claims.CLEAR_TORQUES)
FREE = subjects.free_motion(ARM)


def torque_rows(times=(4.7, 4.7), ulps=2.0, moved=0.0, sides=(1, 1), clear=(1, 1), leaving=27):
    """Rows of claims.holding_torques, for TMT and for MuJoCo; leaving: how many of TMT's variants do."""
    rows = []
    for method, time, side, away in zip(RK4, times, sides, clear):
        for k, name in enumerate(NAMES):
            stays = method.engine == "tmt" and leaving <= k < 27
            rows.append({
                "scene": "ball catch", "engine": method.engine, "method": method.name, "dt_s": 5 / 64, "torque": name,
                "push_rad_per_s2": 1e-14 * (away if "ulps" in name else 1), "predicted_s": time,
                "observed_s": None if stays else time, "direction": None if stays else side,
                "moved_rad": moved if "own" in name else 1.0, "residual_ulps": ulps,
            })  # fmt: skip
    return rows


@pytest.mark.parametrize("changed, reproduced, passes", [
    ({"times": (5.49, 3.51)}, True, True), ({"times": (5.51, 4.7)}, False, True),
    ({"times": (4.7, 3.49)}, False, True),
    ({"ulps": 15.9}, True, True), ({"ulps": 16.1}, False, True),
    ({"leaving": 14}, True, True), ({"leaving": 13}, False, True),  # more than half leave
    ({"moved": 1e-17}, False, False), ({"clear": (1, -1)}, False, False),  # against its push
    ({"sides": (1, None)}, False, False),
])  # fmt: skip
def test_claim_1(result, changed, reproduced, passes):
    result.check("elsewhere", "a check that is not of this claim", 2.0, 1.0, "")
    claims_checks.check_torques(result, ARM, torque_rows(**changed))
    assert (
        result.notes[-1].values["reproduced"] is reproduced
        and all(check.passed for check in result.checks[1:]) is passes
    )


@pytest.mark.parametrize("to, found", [(0.3, 1), (-0.3, -1), (np.nan, None)])
def test_the_side_to_which_a_posture_is_left(to, found):
    path = np.array([[1.0, 0.0, 0.0], [1.0 + to / 3, 0.0, 0.0], [1.0 + to, 9.0, 9.0]])
    assert claims.side(path, 0.2, 0.1) == found and claims.side(path, None, 0.1) is None


def finer_rows(moved=0.0, directions=(1, -1), times=(5.0, 6.0)):
    return [
        {"scene": "ball catch", "engine": method.engine, "method": method.name, "dt_s": 5 / count, "ulps_alpha": sign,
         "push_rad_per_s2": 1e-15, "predicted_s": 4.9, "observed_s": time, "direction": side, "moved_rad": away,
         "step_rad": 1e-17, "half_ulp_rad": 5e-17}
        for method in RK4 for sign in (1, -1)
        for count, time, side, away in ((64, times[0], directions[0], 1.0), (128, times[1], directions[1], 1.0),
                                        (4096, None, None, moved))
    ]  # fmt: skip


@pytest.mark.parametrize("changed, word, passes", [
    ({}, "yes", True), ({"directions": (1, 1)}, "in part", True),
    ({"moved": 1e-17}, "in part", False),
    ({"directions": (None, None), "times": (None, None)}, "no", True),
])  # fmt: skip
def test_claim_2(result, changed, word, passes):
    claims_checks.check_finer_steps(result, ARM, finer_rows(**changed))
    assert result.notes[-1].values["reproduced"] == word and [check.passed for check in result.checks] == 4 * [passes]


def kept_runs(observed=None, largest=0.06, leaves=(), acceleration=50.0, rest=0.0):
    rows = [
        {"scene": "bent", "engine": method.engine, "method": method.name, "dt_s": dt, "torque": torque, "growth": 1.0,
         "observed_s": observed if dt < 0.31 else None, "diverged_at_s": None, "moved_rad": away,
         "run_s": 1000.0}
        for method in RK4 for torque in claims.NEAR_TORQUES for dt, away in ((0.3, 1e-9), (0.35, largest))
    ]  # fmt: skip
    engines = [method.engine for method in RK4]
    return {
        "rows": rows, "limit": 0.3108, "fastest": 9.1, "leaves": {engine: list(leaves) for engine in engines},
        "acceleration_at_end": {engine: np.array([0.0, -acceleration, 0.0]) for engine in engines},
        "free_from_end": dict.fromkeys(engines, rest),
    }  # fmt: skip


@pytest.mark.parametrize("changed, word, failing", [
    ({}, "bounded", 0), ({"observed": 999.0}, "no", 4), ({"leaves": (2,)}, "no", 2),
    ({"largest": 1.01e-3}, "bounded", 0), ({"largest": 0.99e-3}, "no", 0),
    ({"acceleration": 1.01}, "bounded", 0), ({"acceleration": 0.99}, "yes", 2),
    ({"rest": 0.99e-9}, "bounded", 0), ({"rest": 1.01e-9}, "bounded", 2),
])  # fmt: skip
def test_claim_3(result, changed, word, failing):
    claims_checks.check_kept(result, ARM, kept_runs(**changed))
    assert result.notes[0].values["reproduced"] == word
    assert sum(not check.passed for check in result.checks) == failing and len(result.checks) == 10


def silent_run(since=None, caught=None):
    return {"since_s": since, "caught_in_it_s": caught}


@pytest.mark.parametrize("since, caught, passes", [
    (1.0, 1.0 + 0.999 * 5 / 64, [True]), (1.0, 1.0 + 1.001 * 5 / 64, [False]), (1.0, None, [False]), (None, None, []),
])  # fmt: skip
def test_a_silent_failure_is_caught_within_a_step(result, since, caught, passes):
    failure.check_silent(result, FREE, silent_run(since, caught), silent_run())
    failure.check_silent(result, FREE, silent_run(), silent_run(since, caught))
    assert [check.passed for check in result.checks] == 2 * passes


@pytest.mark.parametrize("share, found", [(INSIDE, None), (1.001, 1.0)])
def test_energy_gives_a_failure_away(share, found):
    """A free run from the centre that gains a share of the physical bound on its energy as motion in its second state."""
    t, (q, qd) = np.arange(3.0), FREE.start
    rate = np.sqrt(2.0 * share * 2.0 * gravity_scale(ARM.tree) / tmt.mass_matrix(q)[0, 0])
    run = {"q": np.array([q, q, q]), "qd": np.array([qd, [rate, 0.0, 0.0], qd]), "time": t, "warnings": 0}
    assert failure.caught(FREE, t, run) == found
    seen = failure.observed(FREE, t, run)
    assert seen["since_s"] == seen["caught_in_it_s"] == found
    assert seen["gain"] == pytest.approx(share * seen["reach"], rel=1e-3)


@pytest.mark.parametrize("back, fast, first", [(3, 2, 2.0), (2, 3, 2.0), (None, 3, 3.0), (4, None, 4.0)])
def test_a_failure_is_caught_at_the_first_of_its_signs(back, fast, first):
    """A clock that goes back, and more energy than the arm can have: whichever comes first."""
    t, time, qd = np.arange(5.0), np.arange(5.0), np.zeros((5, 3))
    time[slice(back, None) if back else slice(0)] -= 2.0
    qd[slice(fast, None) if fast else slice(0)] = 1e3
    run = {"time": time, "q": np.tile(FREE.q, (5, 1)), "qd": qd, "warnings": 0}
    assert failure.caught(FREE, t, run) == first == failure.observed(FREE, t, run)["since_s"]
