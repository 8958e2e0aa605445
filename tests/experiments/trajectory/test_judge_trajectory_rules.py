"""The rules of a run: for each a row just inside and one just outside."""

import numpy as np
import pytest
from judged import verdicts
from trajectory_curves import FREE, HELD

from compare.case import Coordinates
from compare.experiments.trajectory import rules
from compare.judge.check import Result
from compare.judge.run import check_movement, required_time

TWO_HINGES = Coordinates(("alpha", "beta"))


def test_a_run_is_judged_while_its_band_is_below_a_thousandth_of_a_radian_and_nothing_has_diverged():
    times, never = np.arange(5.0), {"tmt": None, "mujoco": None}
    narrow, wide = np.full(5, 0.999e-3), np.array([0.0, 0.999e-3, 1.001e-3, 0.0, 0.0])
    assert rules.judged(times, narrow, never) == 5
    assert rules.judged(times, wide, never) == 2
    assert rules.judged(times, narrow, {"tmt": None, "mujoco": 3.0}) == 3
    assert rules.judged(times, narrow, {"tmt": 2.5, "mujoco": 4.0}) == 3
    assert rules.judged(times, wide + 1.0, never) == 1


def test_a_row_is_the_component_and_the_time_that_come_closest_to_the_tolerance():
    bar, times = np.full((3, 4), 1.0), np.array([0.0, 0.5, 1.0])
    for off, passes in ((0.999, True), (1.001, False), (np.nan, False), (np.inf, False)):
        difference, result = np.zeros((3, 4)), Result("trajectory")
        difference[1, 3] = off
        rules.check_level(result, "x", {"level": "open loop"}, TWO_HINGES, difference, bar, times, {})
        (check,), (row,) = result.checks, result.rows
        assert (check.passed, check.unit, check.note) == (passes, "rad/s", "beta at t = 0.500 s")
        assert row["worst_difference"] == check.value and (row["largest_difference"] is None) == (check.value is None)
    difference = np.array([[0.2, 0.7, 3.0, 0.0], [0.1, 0.4, 0.0, 0.0], [0.0, 0.5, 0.0, 0.9]])
    result = Result("trajectory")
    rules.check_level(result, "x", {"level": "open loop"}, TWO_HINGES, difference, bar, times, {})
    assert (result.rows[0]["largest_difference"], result.rows[0]["worst_difference"]) == (0.7, 3.0)
    for off, passes in (
        (0.0, True),
        (1e-300, False),
        (np.nan, False),
    ):  # where rounding has nothing to add, nothing may differ
        result, difference = Result("trajectory"), np.array([[0.0, 0.0, off, 0.0]])
        rules.check_level(result, "x", {"level": "open loop"}, TWO_HINGES, difference, 0.0 * bar[:1], times, {})
        assert result.checks[0].passed is passes


def test_a_row_names_the_joint_of_any_kind_and_its_own_unit():
    """A slide, then a ball: four movements, and four speeds."""
    coordinates, one = Coordinates(("lift", "head"), ("slide", "ball")), np.ones((1, 8))
    for place, name, unit in ((0, "lift", "m"), (3, "head z", "rad"), (4, "lift", "m/s"), (5, "head x", "rad/s")):
        result, difference = Result("trajectory"), 0.1 * one
        difference[0, place] = 0.9
        rules.check_level(result, "x", {"level": "open loop"}, coordinates, difference, one, np.zeros(1), {})
        (check,), (row,) = result.checks, result.rows
        assert (check.unit, check.note, row["worst_unit"]) == (unit, f"{name} at t = 0.000 s", unit)
        assert row["unit"] == "rad or m" and row["largest_difference"] == (0.9 if place < 4 else 0.1)
    result = Result("trajectory")
    rules.check_level(result, "x", {"level": "derivative"}, coordinates, one[:, :4], one[:, :4], np.zeros(1), {})
    assert result.rows[0]["unit"] == "rad/s2 or m/s2" and result.checks[0].unit == "m/s2"


def test_what_a_scene_asks_for_depends_on_the_scheme_and_the_step():
    assert required_time(FREE, "rk4", 5 / 64) == 5.0 and required_time(HELD, "rk4", 5 / 64) == 2.5
    for scheme in ("semi_implicit_euler", "implicit"):
        assert (required_time(FREE, scheme, 0.0099), required_time(FREE, scheme, 0.0101)) == (5.0, 0.3)
    assert required_time(FREE.changed(judged=0.2), "implicit", 5 / 64) == 0.2


@pytest.mark.parametrize(
    "ours, theirs, width, found",
    [
        (None, None, 0.0, {}),
        (0.5, 0.5, 0.0, True),
        (0.5, 0.51, 0.0, False),
        (0.51, 0.5, 0.0, False),
        (None, 0.5, 0.0, False),
        (0.5, None, 0.0, False),
        (0.5, None, 0.999e-3, False),
        (0.5, None, 1.001e-3, {}),
    ],
)
def test_both_diverge_at_the_same_step_while_the_band_is_narrow(ours, theirs, width, found):
    result = Result("trajectory")
    rules.check_divergence(result, "x", {"tmt": ours, "mujoco": theirs}, 0.01, 100, np.full(11, width))
    assert verdicts(result) == ({} if found == {} else {"step of divergence, MuJoCo's, is TMT's": found})
    assert all(check.rule == "equal" for check in result.checks)


def test_no_step_of_divergence_is_asked_where_the_band_opens_before_the_next_recorded_state():
    for end, found in ((0.12, {}), (0.1, {"step of divergence, MuJoCo's, is TMT's": False})):
        result = Result("trajectory")
        width = np.array([0.0, 1e-9, *[np.inf] * 9])
        rules.check_divergence(result, "x", {"tmt": end, "mujoco": end + 0.01}, 0.01, 100, width)
        assert verdicts(result) == found


def test_a_free_run_moves_by_a_tenth_of_a_radian():
    for moved, passes in ((0.1001, True), (0.0999, False)):
        result = Result("trajectory")
        check_movement(result, "x", moved)
        assert verdicts(result) == {"movement": passes}


def test_integrators_that_are_one_scheme_give_the_same_bits():
    one = [np.array([1.0, np.nan]), np.array([2.0, 3.0])]
    for other, passes in (
        (one, True), ([one[0].copy(), one[1] + 0.0], True), ([one[0], np.nextafter(one[1], 9.0)], False),
        ([one[0] + 1, one[1]], False),
    ):  # fmt: skip
        result = Result("trajectory")
        rules.check_same_bits(result, "x", "Euler", one, other)
        assert verdicts(result) == {"the same bits as Euler": passes}
