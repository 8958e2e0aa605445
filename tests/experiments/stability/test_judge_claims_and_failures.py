"""What is concluded of the claims, of failures beyond linear limits and of long runs, each rule just inside and outside."""

import numpy as np
import pytest
from judged import INSIDE, only

import tmt
from compare.engines.mujoco.engine import METHODS as INTEGRATORS
from compare.engines.tmt import Tmt
from compare.experiments.stability import beyond, choice, claims, claims_judged, failure, long_runs
from compare.judge.scale import gravity_scale
from compare.robots.arm import ARM

RK4 = (Tmt().methods["rk4"], INTEGRATORS["RK4"])
NAMES = (*(f"{claims.VARIANT} {k}" for k in range(1, 28)), claims.NEAREST, *claims.CLEAR_TORQUES)
FREE = choice.free_motion(ARM)


def verdict(note) -> str:
    """The verdict in a note: what stands before its first colon."""
    return note.split(":")[0].split(", ")[1]


def torque_rows(times=(4.7, 4.7), ulps=2.0, moved=0.0, sides=(1, 1), clear=(1, 1), leaving=27):
    """Rows of claims.holding_torques, for TMT and for MuJoCo; leaving: how many of TMT's variants do."""
    rows = []
    for method, time, side, away in zip(RK4, times, sides, clear):
        for k, name in enumerate(NAMES):
            stays = method.engine == "tmt" and leaving <= k < 27
            rows.append({
                "scene": "ball catch", "engine": method.engine, "method": method.name, "dt_s": 5 / 64, "torque": name,
                "push_rad_per_s2": 1e-14 * (away if "ulps" in name else 1), "predicted_s": time,
                "observed_s": None if stays else time, "direction": None if stays else side, "largest_residual_n_m": 1e-15,
                "moved_rad": moved if "own" in name else 1.0, "residual_ulps": ulps,
            })  # fmt: skip
    return rows


@pytest.mark.parametrize("changed, word, passes", [
    ({"times": (5.49, 3.51)}, "reproduced", True), ({"times": (5.51, 4.7)}, "not reproduced", True),
    ({"times": (4.7, 3.49)}, "not reproduced", True),
    ({"ulps": 15.9}, "reproduced", True), ({"ulps": 16.1}, "not reproduced", True),
    ({"leaving": 14}, "reproduced", True), ({"leaving": 13}, "not reproduced", True),  # more than half leave
    ({"moved": 1e-17}, "not reproduced", False), ({"clear": (1, -1)}, "not reproduced", False),  # against its push
    ({"sides": (1, None)}, "not reproduced", False),
])  # fmt: skip
def test_claim_1(result, changed, word, passes):
    result.check("elsewhere", "a check that is not of this claim", 2.0, 1.0, "")
    claims_judged.check_torques(result, ARM, torque_rows(**changed))
    assert verdict(result.notes[-1]) == word and all(check.passed for check in result.checks[1:]) is passes


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
    ({}, "reproduced", True), ({"directions": (1, 1)}, "reproduced in part", True),
    ({"moved": 1e-17}, "reproduced in part", False),
    ({"directions": (None, None), "times": (None, None)}, "not reproduced", True),
])  # fmt: skip
def test_claim_2(result, changed, word, passes):
    claims_judged.check_finer_steps(result, ARM, finer_rows(**changed))
    assert verdict(result.notes[-1]) == word and [check.passed for check in result.checks] == 4 * [passes]


def kept_runs(observed=None, largest=0.06, leaves=(), acceleration=50.0, rest=0.0):
    rows = [
        {"scene": "bent", "engine": method.engine, "method": method.name, "dt_s": dt, "torque": torque, "growth": 1.0,
         "observed_s": observed if dt < 0.31 else None, "steps": None, "diverged_at_s": None, "largest_rad": away,
         "run_s": 1000.0}
        for method in RK4 for torque in beyond.NEAR_TORQUES for dt, away in ((0.3, 1e-9), (0.35, largest))
    ]  # fmt: skip
    engines = [method.engine for method in RK4]
    return {
        "rows": rows, "limit": 0.3108, "fastest": 9.1, "counts": [1, 2, 3], "paths": {},
        "leaves": {(engine, torque): list(leaves) for engine in engines for torque in beyond.NEAR_TORQUES},
        "acceleration_at_end": {engine: np.array([0.0, -acceleration, 0.0]) for engine in engines},
        "free_from_end": dict.fromkeys(engines, rest),
    }  # fmt: skip


@pytest.mark.parametrize("changed, word, failing", [
    ({}, "bounded", 0), ({"observed": 999.0}, "not reproduced", 4), ({"leaves": (2,)}, "not reproduced", 2),
    ({"largest": 1.01e-3}, "bounded", 0), ({"largest": 0.99e-3}, "not reproduced", 0),
    ({"acceleration": 1.01}, "bounded", 0), ({"acceleration": 0.99}, "reproduced", 2),
    ({"rest": 0.99e-9}, "bounded", 0), ({"rest": 1.01e-9}, "bounded", 2),
])  # fmt: skip
def test_claim_3(result, changed, word, failing):
    beyond.check_kept(result, ARM, kept_runs(**changed))
    assert verdict(result.notes[0]) == word
    assert sum(not check.passed for check in result.checks) == failing and len(result.checks) == 10


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


@pytest.mark.parametrize("back, fast, first", [(3, 2, 2.0), (2, 3, 2.0), (None, 3, 3.0), (4, None, 4.0)])
def test_a_failure_is_caught_at_the_first_of_its_signs(back, fast, first):
    """A clock that goes back, and more energy than the arm can have: whichever comes first."""
    t, time, qd = np.arange(5.0), np.arange(5.0), np.zeros((5, 3))
    time[slice(back, None) if back else slice(0)] -= 2.0
    qd[slice(fast, None) if fast else slice(0)] = 1e3
    run = {"time": time, "q": np.tile(FREE.q, (5, 1)), "qd": qd, "warnings": 0}
    assert failure.caught(FREE, t, run) == first == failure.observed(FREE, t, run)["since_s"]


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
