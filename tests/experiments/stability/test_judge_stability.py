"""Checks of amplification, limits, growth, departures: a row just inside of each tolerance and one just outside; no runs."""

import numpy as np
import pytest
from edited import setup_of_file
from judged import BOTH, INSIDE, OUTSIDE, only
from models import PATHS

from compare.experiments.stability import departure, equilibria, limits
from compare.experiments.stability.tables import DepartureRow, LimitRow
from compare.robots.arm import ARM
from compare.truth.linear import held


@pytest.mark.parametrize("off, rounded, passes", [
    (INSIDE * 64 * 2.0**-52 * 3.0 * 7.0 / 1e-6, 0.0, True), (OUTSIDE * 64 * 2.0**-52 * 3.0 * 7.0 / 1e-6, 0.0, False),
    (INSIDE * 1e-9 / 1e-6, 1e-9, True), (OUTSIDE * 1e-9 / 1e-6, 1e-9, False), (np.nan, 0.0, False),
])  # fmt: skip
def test_amplification_within_the_rounding_of_a_quotient_or_of_a_step(result, off, rounded, passes):
    ours, q = np.diag([3.0, -7.0]), np.array([1.0, -2.0])
    equilibria.check_amplification(result, "", q, ours, ours + [[0.0, off], [0.0, 0.0]], rounded)
    assert only(result) is passes


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


def test_what_no_run_decides_is_not_checked(result):
    rows = [limit_row(), limit_row(observed=None, seen=None, method="implicit")]
    limits.check_limits(result, rows)
    assert only(result) and [row.passed for row in result.rows] == [True, None]
    assert result.notes[0].values["where"] == ["bent, TMT implicit, damping 0"]


@pytest.mark.parametrize("early, late, grown", [
    (1.0, 1.0009, False), (1.0, 1.0011, True),
    (1e-4, 0.9e-3, False), (1e-4, 1.1e-3, True),  # what has decayed leaves rounding
    (200.0, 99.0, False), (200.0, 101.0, True), (1.1e4, 0.5, True), (np.nan, np.nan, True),
])  # fmt: skip
def test_when_a_deviation_grows(early, late, grown):
    assert limits.grows(np.array([0.5, early]), np.array([0.4, late])) is grown


def test_a_slow_mode_that_does_not_grow_by_itself_is_not_seen_in_a_short_run():
    rates = np.array([3.0j, 0.01j, -0.01, 0.01, -50.0])
    np.testing.assert_array_equal(limits.is_seen(rates, 1e-6, 10.0), [True, False, False, True, True])
    assert limits.is_seen(np.array([0.01j]), 1e-6, 10.0).all()  # there is no other


def test_a_limit_that_runs_show_no_nearer_than_a_tenth_is_not_decided_by_them():
    arm7 = held(setup_of_file(PATHS["arm7"]).robot, "ready")
    assert limits.is_shown(arm7, 0.0999) and not limits.is_shown(arm7, 0.1001)


@pytest.mark.parametrize("stiffness, shown", [(9.8101, True), (9.810001, False)])
def test_a_limit_is_not_decided_by_runs_in_which_a_slow_mode_is_lost_in_rounding(stiffness, shown):
    """An inverted pendulum of 9.81 N m/rad that its spring just balances."""
    joint = f'<joint name="swing" axis="0 1 0" stiffness="{stiffness}"/>'
    body = f'<body>{joint}<geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/></body>'
    setup = setup_of_file(f"<mujoco><worldbody>{body}</worldbody></mujoco>")
    assert limits.is_shown(held(setup.robot, "qpos0"), 1e-3) is shown


def departure_row(observed, predicted, **more):
    usual = {"scene": "ball catch", "engine": "tmt", "method": "rk4", "dt": 0.01, "perturbation": 1e-6}
    return DepartureRow(**usual | {"predicted": predicted, "observed": observed} | more)


@pytest.mark.parametrize("observed, predicted, more, passes", [
    *((2.0 + off, 2.0, {}, passes) for off, passes in ((0.0299, True), (0.0301, False), (-0.0299, True), (-0.0301, False))),
    (2.0 + INSIDE * 5 / 64, 2.0, {"dt": 5 / 64}, True), (2.0 + OUTSIDE * 5 / 64, 2.0, {"dt": 5 / 64}, False),
    (2.199, 2.0, {"allowed": 0.2}, True), (2.201, 2.0, {"allowed": 0.2}, False),  # a row may say how near
    (None, None, {}, True), (1.0, None, {}, False), (None, 1.0, {}, False),
])  # fmt: skip
def test_departure_within_one_step_or_three_hundredths(result, observed, predicted, more, passes):
    departure.check_departures(result, [departure_row(observed, predicted, **more)])
    assert only(result) is passes


def test_the_largest_difference_of_a_departure_is_reported():
    rows = [departure_row(1.01, 1.0), departure_row(2.02, 2.0, engine="mujoco"), departure_row(3.0, 3.0)]
    assert departure.departure_values(rows) == {"count": 3, "close": 3, "worst": pytest.approx(0.02)}


def test_the_linear_map_says_when_a_tenth_of_a_radian_is_reached():
    at, size = held(ARM, "ball catch"), 1e-4
    values, vectors = at.modes
    shape = size * vectors[:3, 0].real / np.abs(vectors[:3, 0]).max()
    (found,) = departure.predicted(at, "rk4", 1e-3, shape[None], np.zeros((1, 3)))
    left = np.arccosh(0.1 / size + 1.0) / values[0].real  # cosh - 1, from rest
    assert found == pytest.approx(left, abs=2e-3)


@pytest.mark.parametrize("joints, reach, count", [(4, 2, 625), (5, 1, 243)])
def test_torques_within_some_ulps_are_bounded_in_number(joints, reach, count):
    tau = np.linspace(-3.0, 5.0, joints)
    found = departure.variants(tau, reach)
    assert found.shape == (count, joints) and (found[count // 2] == tau).all()
    away = np.abs(found - tau) / np.spacing(np.abs(tau))
    assert len({tuple(row) for row in found}) == count and (away.max(axis=0) == reach).all()
