"""Checks of limits, growth, departures, claims: a row just inside of each tolerance and one just outside; no runs."""

import numpy as np
import pytest
from helpers.judged import BOTH, INSIDE, OUTSIDE, only

from compare.engines.mujoco.engine import METHODS as INTEGRATORS
from compare.engines.tmt import Tmt
from compare.experiments.stability import claims, departure, limits
from compare.experiments.stability.tables import ClaimRow, DepartureRow, LimitRow
from compare.robots.arm import ARM

RK4 = (Tmt().methods["rk4"], INTEGRATORS["RK4"])
NAMES = (*(f"{claims.VARIANT} {k}" for k in range(1, 28)), claims.NEAREST)


def limit_row(predicted=0.1, observed=0.1, kind="finite", seen="finite", **more):
    usual = {"scene": "bent", "engine": "tmt", "method": "rk4", "damping": 0.0, "mode": 9.1, "limit": kind}
    row = LimitRow(**usual | {"predicted_dt": predicted, "observed_dt": observed} | more)
    return limits.Observed(row, seen, 1e-3)


@BOTH
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_observed_limit_within_a_thousandth(result, share, passes, sign):
    limits.check_limits(result, [limit_row(observed=0.1 * (1 + sign * share * 1e-3))])
    assert only(result) is passes


@pytest.mark.parametrize("kind, seen, passes", [
    ("never_fails", "never_fails", True), ("never_fails", "finite", False), ("always_fails", "always_fails", True),
    ("always_fails", "never_fails", False), ("finite", "never_fails", False),
])  # fmt: skip
def test_kind_of_limit_is_as_predicted(result, kind, seen, passes):
    limits.check_limits(result, [limit_row(0.1 if kind == "finite" else None, None, kind, seen)])
    assert only(result) is passes


@pytest.mark.parametrize("early, late, grown", [
    (1.0, 1.0009, False), (1.0, 1.0011, True),
    (1e-4, 0.9e-3, False), (1e-4, 1.1e-3, True),  # what has decayed leaves rounding
    (200.0, 99.0, False), (200.0, 101.0, True), (1.1e4, 0.5, True), (np.nan, np.nan, True),
])  # fmt: skip
def test_when_a_deviation_grows(early, late, grown):
    assert limits.grows(np.array([0.5, early]), np.array([0.4, late])) is grown


def departure_row(observed, predicted, **more):
    usual = {"scene": "ball catch", "engine": "tmt", "method": "rk4", "dt": 0.01, "perturbation": 1e-6}
    return DepartureRow(**usual | {"predicted": predicted, "observed": observed} | more)


@pytest.mark.parametrize("observed, predicted, more, passes", [
    *((2.0 + off, 2.0, {}, passes) for off, passes in ((0.0299, True), (0.0301, False), (-0.0299, True), (-0.0301, False))),
    (2.0 + INSIDE * 5 / 64, 2.0, {"dt": 5 / 64}, True), (2.0 + OUTSIDE * 5 / 64, 2.0, {"dt": 5 / 64}, False),
    (None, None, {}, True), (1.0, None, {}, False), (None, 1.0, {}, False),
])  # fmt: skip
def test_departure_within_one_step_or_three_hundredths(result, observed, predicted, more, passes):
    departure.check_departures(result, [departure_row(observed, predicted, **more)])
    assert only(result) is passes


def test_the_largest_difference_of_a_departure_is_reported():
    rows = [departure_row(1.01, 1.0), departure_row(2.02, 2.0, engine="mujoco"), departure_row(3.0, 3.0)]
    assert departure.departure_values(rows) == {"count": 3, "close": 3, "worst": pytest.approx(0.02)}


def torque_rows(times=(4.7, 4.7), moved=0.0, sides=(1, 1), leaving=27):
    """Rows of claims.holding_torques, for TMT and for MuJoCo; leaving: how many of TMT's variants do."""
    rows = []
    for method, time, side in zip(RK4, times, sides):
        for k, name in enumerate(NAMES):
            stays = method.engine == "tmt" and leaving <= k < 27
            rows.append(ClaimRow(
                claim=1, scene="ball catch", engine=method.engine, method=method.name, dt=5 / 64, torque=name,
                observed=None if stays else time,
                direction=None if stays else side, moved=moved if "own" in name else 1.0,
            ))  # fmt: skip
    return rows


@pytest.mark.parametrize("changed, reproduced, passes", [
    ({"times": (5.49, 3.51)}, True, True), ({"times": (5.51, 4.7)}, False, True), ({"times": (4.7, 3.49)}, False, True),
    ({"leaving": 14}, True, True), ({"leaving": 13}, False, True),  # more than half leave
    ({"moved": 1e-17}, False, False),
])  # fmt: skip
def test_claim_1(result, changed, reproduced, passes):
    result.check("elsewhere", "a check that is not of this claim", 2.0, 1.0, "")
    claims.check_torques(result, torque_rows(**changed), ARM)
    assert result.notes[-1].values["reproduced"] is reproduced
    assert all(check.passed for check in result.checks[1:]) is passes


@pytest.mark.parametrize("to, found", [(0.3, 1), (-0.3, -1), (np.nan, None)])
def test_the_side_to_which_a_posture_is_left(to, found):
    path = np.array([[1.0, 0.0, 0.0], [1.0 + to / 3, 0.0, 0.0], [1.0 + to, 9.0, 9.0]])
    assert claims.side(path, 0.2, 0.1) == found and claims.side(path, None, 0.1) is None


def finer_rows(moved=0.0, directions=(1, -1), times=(5.0, 6.0)):
    return [
        ClaimRow(claim=2, scene="ball catch", engine=method.engine, method=method.name, dt=5 / count, ulps=sign,
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
    claims.check_finer_steps(result, finer_rows(**changed), ARM)
    assert result.notes[-1].values["reproduced"] == word
    assert [check.passed for check in result.checks] == 4 * [passes]


def kept_runs(observed=None, largest=0.06, acceleration=50.0):
    rows = [
        ClaimRow(claim=3, scene="bent", engine=method.engine, method=method.name, dt=dt, torque=claims.ONE_ULP,
                observed=observed if dt < 0.31 else None, direction=None, diverged_at=None, moved=away, run=1000.0)
        for method in RK4 for dt, away in ((0.3, 1e-9), (0.35, largest))
    ]  # fmt: skip
    return rows, dict.fromkeys(("TMT", "MuJoCo"), acceleration)


@pytest.mark.parametrize("changed, word, failing", [
    ({}, "bounded", 0), ({"observed": 999.0}, "no", 2), ({"largest": 1.01e-3}, "bounded", 0),
    ({"largest": 0.99e-3}, "no", 0), ({"acceleration": 1.01}, "bounded", 0), ({"acceleration": 0.99}, "yes", 2),
])  # fmt: skip
def test_claim_3(result, changed, word, failing):
    rows, ends = kept_runs(**changed)
    claims.check_kept(result, rows, ARM, ends)
    assert result.notes[0].values["reproduced"] == word
    assert sum(not check.passed for check in result.checks) == failing and len(result.checks) == 4
