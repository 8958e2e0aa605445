"""Claims and failures without a warning: each rule just inside and outside."""

import numpy as np
import pytest

from compare.engines.mujoco.engine import METHODS as INTEGRATORS
from compare.engines.tmt import Tmt
from compare.experiments.stability import claims, failure
from compare.experiments.stability.tables import FinerRow, KeptRow, TorqueRow
from compare.robots.arm import ARM

RK4 = (Tmt().methods["rk4"], INTEGRATORS["RK4"])
NAMES = (*(f"{claims.VARIANT} {k}" for k in range(1, 28)), claims.NEAREST, *claims.CLEAR_TORQUES)
FREE = ARM.case("bent, free", posture="bent")


def torque_rows(times=(4.7, 4.7), moved=0.0, sides=(1, 1), clear=(1, 1), leaving=27):
    """Rows of claims.holding_torques, for TMT and for MuJoCo; leaving: how many of TMT's variants do."""
    rows = []
    for method, time, side, away in zip(RK4, times, sides, clear):
        for k, name in enumerate(NAMES):
            stays = method.engine == "tmt" and leaving <= k < 27
            rows.append(TorqueRow(
                scene="ball catch", engine=method.engine, method=method.name, dt=5 / 64, torque=name,
                push=1e-14 * (away if "ulps" in name else 1), predicted=time, observed=None if stays else time,
                direction=None if stays else side, moved=moved if "own" in name else 1.0,
            ))  # fmt: skip
    return rows


@pytest.mark.parametrize("changed, reproduced, passes", [
    ({"times": (5.49, 3.51)}, True, True), ({"times": (5.51, 4.7)}, False, True), ({"times": (4.7, 3.49)}, False, True),
    ({"leaving": 14}, True, True), ({"leaving": 13}, False, True),  # more than half leave
    ({"moved": 1e-17}, False, False), ({"clear": (1, -1)}, False, False),  # against its push
    ({"sides": (1, None)}, False, False),
])  # fmt: skip
def test_claim_1(result, changed, reproduced, passes):
    result.check("elsewhere", "a check that is not of this claim", 2.0, 1.0, "")
    claims.check_torques(result, ARM, torque_rows(**changed))
    assert result.notes[-1].values["reproduced"] is reproduced
    assert all(check.passed for check in result.checks[1:]) is passes


@pytest.mark.parametrize("to, found", [(0.3, 1), (-0.3, -1), (np.nan, None)])
def test_the_side_to_which_a_posture_is_left(to, found):
    path = np.array([[1.0, 0.0, 0.0], [1.0 + to / 3, 0.0, 0.0], [1.0 + to, 9.0, 9.0]])
    assert claims.side(path, 0.2, 0.1) == found and claims.side(path, None, 0.1) is None


def finer_rows(moved=0.0, directions=(1, -1), times=(5.0, 6.0)):
    return [
        FinerRow(scene="ball catch", engine=method.engine, method=method.name, dt=5 / count, ulps=sign,
                 observed=time, direction=side, moved=away, step=1e-17, half_ulp=5e-17)
        for method in RK4 for sign in (1, -1)
        for count, time, side, away in ((64, times[0], directions[0], 1.0), (128, times[1], directions[1], 1.0),
                                        (4096, None, None, moved))
    ]  # fmt: skip


@pytest.mark.parametrize("changed, word, passes", [
    ({}, "yes", True), ({"directions": (1, 1)}, "in part", True), ({"moved": 1e-17}, "in part", False),
    ({"directions": (None, None), "times": (None, None)}, "no", True),
])  # fmt: skip
def test_claim_2(result, changed, word, passes):
    claims.check_finer_steps(result, ARM, finer_rows(**changed))
    assert result.notes[-1].values["reproduced"] == word
    assert [check.passed for check in result.checks] == 4 * [passes]


def kept_runs(observed=None, largest=0.06, acceleration=50.0):
    rows = [
        KeptRow(scene="bent", engine=method.engine, method=method.name, dt=dt, torque=claims.ONE_ULP,
                observed=observed if dt < 0.31 else None, diverged_at=None, moved=away, run=1000.0)
        for method in RK4 for dt, away in ((0.3, 1e-9), (0.35, largest))
    ]  # fmt: skip
    engines = [method.engine for method in RK4]
    return claims.KeptRuns(rows, 0.3108, 9.1, dict.fromkeys(engines, np.array([0.0, -acceleration, 0.0])))


@pytest.mark.parametrize("changed, word, failing", [
    ({}, "bounded", 0), ({"observed": 999.0}, "no", 2), ({"largest": 1.01e-3}, "bounded", 0),
    ({"largest": 0.99e-3}, "no", 0), ({"acceleration": 1.01}, "bounded", 0), ({"acceleration": 0.99}, "yes", 2),
])  # fmt: skip
def test_claim_3(result, changed, word, failing):
    claims.check_kept(result, ARM, kept_runs(**changed))
    assert result.notes[0].values["reproduced"] == word
    assert sum(not check.passed for check in result.checks) == failing and len(result.checks) == 4


@pytest.mark.parametrize("reset, caught, passes", [
    (1.0, 1.0 + 0.999 * 5 / 64, [True]), (1.0, 1.0 + 1.001 * 5 / 64, [False]), (1.0, None, [False]), (None, None, []),
])  # fmt: skip
def test_a_reset_is_caught_within_a_step(result, reset, caught, passes):
    run = failure.OwnReset(5.0, int(reset is not None), reset, True, 0, caught)
    failure.check_reset(result, FREE, run)
    assert [check.passed for check in result.checks] == passes
