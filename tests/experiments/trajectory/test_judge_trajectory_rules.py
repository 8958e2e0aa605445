"""The rules of runs, of their derivative, of drift and of many digits: for each a row just inside and one just outside."""

import dataclasses

import numpy as np
import pytest
from judged import verdicts
from trajectory_curves import FREE, HELD

import tmt
from compare.case import Coordinates
from compare.engines.mujoco.engine import METHODS
from compare.experiments.trajectory import drift, horizon, rules
from compare.experiments.trajectory.derivative import check_derivative
from compare.judge.check import Result
from compare.judge.run import check_movement, required_time
from compare.judge.scale import EPS

TWO_HINGES = Coordinates(("alpha", "beta"))
BY_ENGINE = pytest.mark.parametrize("engine, label", [("tmt", "TMT"), ("mujoco", "MuJoCo")])


def test_a_run_is_judged_while_its_band_is_below_a_thousandth_of_a_radian_and_nothing_has_diverged():
    times, never = np.arange(5.0), {"tmt": None, "mujoco": None}
    narrow, wide = np.full(5, 0.999e-3), np.array([0.0, 0.999e-3, 1.001e-3, 0.0, 0.0])
    assert rules.judged(times, narrow, never) == 5
    assert rules.judged(times, wide, never) == 2
    assert rules.judged(times, narrow, {"tmt": 2.5, "mujoco": 4.0}) == 3
    assert rules.judged(times, wide + 1.0, never) == 1


def level(difference, bar, coordinates=TWO_HINGES, name="open loop"):
    """The check and the row of differences (states, 2 nv)."""
    result, difference = Result("trajectory"), np.atleast_2d(difference)
    times = np.arange(len(difference)) / 2
    rules.check_level(result, "x", {"level": name}, coordinates, difference, bar, times, {})
    return result.checks[0], result.rows[0]


def test_a_row_is_the_component_and_the_time_that_come_closest_to_the_tolerance():
    for off, passes in ((0.999, True), (1.001, False), (np.nan, False), (np.inf, False)):
        check, row = level([[0.0] * 4, [0.0, 0.0, 0.0, off], [0.0] * 4], 1.0)
        assert (check.passed, check.unit) == (passes, "rad/s") and "beta" in check.note and "0.500" in check.note
        assert row["worst_difference"] == check.value and (row["largest_difference"] is None) == (check.value is None)
    _, row = level([[0.2, 0.7, 3.0, 0.0], [0.1, 0.4, 0.0, 0.0], [0.0, 0.5, 0.0, 0.9]], 1.0)
    assert (row["largest_difference"], row["worst_difference"]) == (0.7, 3.0)
    for off, passes in ((0.0, True), (1e-300, False), (np.nan, False)):  # where nothing is rounded nothing may differ
        assert level([0.0, 0.0, off, 0.0], 0.0)[0].passed is passes


@pytest.mark.parametrize("place, name, unit", [(0, "lift", "m"), (3, "head z", "rad"), (5, "head x", "rad/s")])
def test_a_row_names_the_joint_of_any_kind_and_its_own_unit(place, name, unit):
    """A slide, then a ball: four movements, and four speeds."""
    coordinates, difference = Coordinates(("lift", "head"), ("slide", "ball")), np.full(8, 0.1)
    difference[place] = 0.9
    check, row = level(difference, 1.0, coordinates)
    assert (check.unit, row["worst_unit"]) == (unit, unit) and check.note.startswith(name)
    assert row["unit"] == "rad or m" and row["largest_difference"] == (0.9 if place < 4 else 0.1)
    check, row = level(np.ones(4), 1.0, coordinates, "derivative")
    assert (check.unit, row["unit"]) == ("m/s2", "rad/s2 or m/s2")


def test_what_a_scene_asks_for_depends_on_the_scheme_and_the_step():
    assert required_time(FREE, "rk4", 5 / 64) == 5.0 and required_time(HELD, "rk4", 5 / 64) == 2.5
    assert [required_time(FREE, "implicit", dt) for dt in (0.0099, 0.0101)] == [5.0, 0.3]


@pytest.mark.parametrize(
    "ours, theirs, width, found",
    [
        (None, None, np.zeros(11), []),
        (0.5, 0.5, np.zeros(11), [True]),
        (0.5, 0.51, np.zeros(11), [False]),
        (None, 0.5, np.zeros(11), [False]),
        (0.5, None, np.full(11, 0.999e-3), [False]),
        (0.5, None, np.full(11, 1.001e-3), []),
        (0.1, 0.11, np.array([0.0, 1e-9, *[np.inf] * 9]), [False]),
        (0.12, 0.13, np.array([0.0, 1e-9, *[np.inf] * 9]), []),  # the band opens before the next recorded state
    ],
)
def test_both_diverge_at_the_same_step_while_the_band_is_narrow(ours, theirs, width, found):
    result = Result("trajectory")
    rules.check_divergence(result, "x", {"tmt": ours, "mujoco": theirs}, 0.01, 100, width)
    assert [check.passed for check in result.checks] == found and all(check.rule == "equal" for check in result.checks)


@pytest.mark.parametrize("moved, passes", [(0.1001, True), (0.0999, False), (np.nan, False)])
def test_a_free_run_moves_by_a_tenth_of_a_radian(moved, passes):
    result = Result("trajectory")
    check_movement(result, "x", moved)
    assert verdicts(result) == {"movement": passes}


def test_integrators_that_are_one_scheme_give_the_same_bits():
    one = [np.array([1.0, np.nan]), np.array([2.0, 3.0])]
    for other, passes in (([one[0].copy(), one[1] + 0.0], True), ([one[0], np.nextafter(one[1], 9.0)], False)):
        result = Result("trajectory")
        rules.check_same_bits(result, "x", "Euler", one, other)
        assert verdicts(result) == {"the same bits as Euler": passes}


@pytest.mark.parametrize("state, rates", [(0, 6.0), (1, 0.1)])
def test_the_derivative_of_the_bias_is_judged_by_the_rates_of_each_state(state, rates):
    q, qd = np.zeros((2, 3)), np.array([[1.0, -2.0, 3.0], [0.1, 0.0, 0.0]])
    damped, size = dataclasses.replace(tmt.ARM, damping=(0.1, 0.5, 0.0)), tmt.mass_matrix(q[0]).max() * rates + 0.5
    for share, passes in ((0.999, True), (1.001, False), (np.nan, False)):
        theirs, result = np.zeros((2, 3, 3)), Result("trajectory")
        theirs[state, 2, 1] = share * 64 * EPS * size
        check_derivative(result, damped, q, qd, np.zeros((2, 3, 3)), theirs)
        assert result.checks[0].passed is passes


@BY_ENGINE
@pytest.mark.parametrize("share, passes", [(0.999, True), (1.001, False), (np.nan, False)])
def test_a_run_stays_in_the_band_about_many_digits(engine, label, share, passes):
    off, result = {name: np.zeros(3) for name in ("tmt", "mujoco")}, Result("trajectory")
    off[engine][2] = share * 2e-12
    horizon.check_digits(result, "x", off, np.array([0.0, 1e-12, 2e-12]), 0.5)
    passed = {"TMT": True, "MuJoCo": True} | {label: passes}
    assert verdicts(result) == {f"{name} to many digits of its own scheme": ok for name, ok in passed.items()}


def drifts(engine, order=1.0, euler=1.0, share=1e-4) -> dict:
    """Drifts of one scene; those of an engine fall at another order, or those of its RK4 are another share of Euler's."""
    good = {METHODS["Euler"]: [4.0, 2.0, 1.0], METHODS["RK4"]: [256e-5, 16e-5, 1e-5]}
    made = {method: {name: list(values) for name in ("tmt", "mujoco")} for method, values in good.items()}
    made[METHODS["Euler"]][engine] = [4.0, 2.0**order * euler, euler]
    made[METHODS["RK4"]][engine] = [256 * share, 16 * share, share]
    return {("bent, free", "energy", "J"): made}


@BY_ENGINE
@pytest.mark.parametrize(
    "made, falls, is_small",
    [
        ({"order": 1.149}, True, True), ({"order": 1.151}, False, True),
        ({"order": 0.851}, True, True), ({"order": 0.849}, False, True),
        ({"share": 0.999e-3}, True, True), ({"share": 1.001e-3}, True, False), ({"euler": np.nan}, False, False),
    ],
)  # fmt: skip
def test_drift_falls_at_the_order_of_the_scheme_and_that_of_rk4_is_far_below_that_of_euler(
    engine, label, made, falls, is_small
):
    result = Result("trajectory")
    drift.check_drifts(result, drifts(engine, **made), {})
    order = f"order of the drift of energy, from 1 bent, free, Euler, {label}, 1 s"
    share = f"drift of energy over that of Euler bent, free, RK4, {label}, 1 s"
    failed = {f"{check.quantity} {check.scene}" for check in result.checks if not check.passed}
    expected = {name for name, passes in ((order, falls), (share, is_small)) if not passes}
    assert len(result.checks) == 6 and failed == expected
