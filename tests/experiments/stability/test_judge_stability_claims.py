"""What is concluded of the claims, on rows just inside and just outside of each of their rules; no runs."""

import numpy as np
import pytest

from compare.engines.mujoco.engine import METHODS as INTEGRATORS
from compare.engines.tmt import Tmt
from compare.experiments.stability import beyond, claims, claims_judged, figures_claims
from compare.robots.arm import ARM

RK4 = (Tmt().methods["rk4"], INTEGRATORS["RK4"])
NAMES = (*(f"{claims.VARIANT} {k}" for k in range(1, 28)), claims.NEAREST, *claims.CLEAR_TORQUES)


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


def test_what_each_engine_does_is_drawn_of_that_engine(result):
    claims_judged.check_torques(result, ARM, torque_rows(times=(4.11, 5.22), sides=(1, -1), clear=(1, -1)))
    _, fig, caption = figures_claims.draw_torques(result, ARM)
    assert caption.index("TMT") < caption.index("4.11 s") < caption.index("5.22 s")
    for ax, engine, time in zip(fig.axes, ("TMT", "MuJoCo"), (4.11, 5.22)):
        assert engine in ax.get_ylabel() and {line.get_xdata()[0] for line in ax.lines} == {time}


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


def test_the_printed_torque_is_judged_as_every_departure(result):
    row = {
        "scene": "ball catch, printed torque",
        "engine": "tmt",
        "method": "rk4",
        "dt_s": 0.01,
        "perturbation_rad": 1e-5,
    }
    times = ((1.4, 1.371), (1.4, 1.369), (None, None))
    printed = [row | {"observed_s": observed, "predicted_s": predicted} for observed, predicted in times]
    claims_judged.check_claims(result, ARM, torque_rows(), [], printed)
    assert [check.passed for check in result.checks[-3:]] == [True, False, True]


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
