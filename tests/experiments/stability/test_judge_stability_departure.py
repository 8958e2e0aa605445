"""The checks of departures and of the law of a marginal posture, just inside and just outside of each tolerance; no runs."""

import dataclasses

import numpy as np
import pytest
from judged import BOTH, only

from compare.experiments.stability import departure, falling, figures_departure, torques
from compare.experiments.stability.subjects import subjects_of
from compare.judge import run
from compare.robots.arm import ARM
from compare.truth.linear import held


def departure_row(observed, predicted, dt=0.01, size=1e-6, engine="tmt", scene="ball catch"):
    return {"scene": scene, "engine": engine, "method": "rk4", "dt_s": dt, "perturbation_rad": size,
            "predicted_s": predicted, "observed_s": observed}  # fmt: skip


@BOTH
@pytest.mark.parametrize("dt, aim", [(0.01, 0.03), (5 / 64, 5 / 64), (-0.01, -0.03)])
def test_departure_within_one_step_or_three_hundredths(result, share, passes, dt, aim):
    departure.check_departures(result, [departure_row(2.0 + share * aim, 2.0, abs(dt))])
    assert only(result) is passes


@BOTH
def test_a_row_may_say_itself_how_near_a_departure_is_to_be(result, share, passes):
    departure.check_departures(result, [departure_row(2.0 + share * 0.2, 2.0) | {"allowed_s": 0.2}])
    assert only(result) is passes


@pytest.mark.parametrize("observed, predicted, passes", [(None, None, True), (1.0, None, False), (None, 1.0, False)])
def test_where_the_map_stays_the_run_stays(result, observed, predicted, passes):
    departure.check_departures(result, [departure_row(observed, predicted)])
    assert only(result) is passes


def test_the_farthest_departure_is_said():
    rows = [departure_row(1.01, 1.0), departure_row(2.02, 2.0, engine="mujoco"), departure_row(3.0, 3.0)]
    text = departure.departures_in_words(rows)
    assert "0.020 s (ball catch, MuJoCo rk4" in text and "0.010" not in text


def test_left_is_a_tenth_of_a_radian():
    paths = [np.array([[0.0], [size], [0.0]]) for size in (0.0999, -0.1001)]
    assert [run.departure(np.arange(3.0), path) for path in paths] == [None, 1.0]


def test_the_linear_map_says_when_a_tenth_of_a_radian_is_reached():
    at, size = held(ARM, "ball catch"), 1e-4
    values, vectors = at.modes
    shape = size * vectors[:3, 0].real / np.abs(vectors[:3, 0]).max()
    (found,) = departure.predicted(at, "rk4", 1e-3, shape[None], np.zeros((1, 3)))
    assert found == pytest.approx(np.arccosh(0.1 / size + 1.0) / values[0].real, abs=2e-3)  # cosh - 1, from rest


@pytest.mark.parametrize("joints, reach, count", [(3, 1, 27), (4, 2, 625), (5, 1, 243), (6, 1, 13), (9, 2, 37)])
def test_torques_within_some_ulps_are_bounded_in_number(joints, reach, count):
    tau = np.linspace(-3.0, 5.0, joints)
    found = torques.variants(tau, reach)
    assert found.shape == (count, joints) and (found[count // 2] == tau).all()
    away = np.abs(found - tau) / np.spacing(np.abs(tau))
    assert len({tuple(row) for row in found}) == count and (away.max(axis=0) == reach).all()


@BOTH
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_exponent_of_the_time_to_leave_a_marginal_posture(result, share, passes, sign):
    power = -0.5 + sign * share * 0.02
    falls = [departure_row(10.0 * (size / 1e-4) ** power, 10.0, size=size, scene="zero") for size in (1e-2, 1e-4, 1e-5)]
    falling.check_falls(result, falls)
    assert [check.passed for check in result.checks] == [passes, False]  # of the other side there are no runs


def test_the_law_is_left_out_where_the_potential_is_not_cubic():
    assert falling.without_law(held(ARM, "zero")) is None
    # about an axis along gravity no posture has stiffness, nor a cubic potential
    about = dataclasses.replace(ARM.tree, axis=((0.0, 0.0, 1.0), *ARM.tree.axis[1:]))
    turning = held(dataclasses.replace(ARM, tree=about), "bent")
    assert turning.kind == "marginal" and falling.without_law(turning)
    floating = held(dataclasses.replace(ARM, tree=dataclasses.replace(ARM.tree, gravity=(0.0, 0.0, 0.0))), "bent")
    assert "3 " in falling.without_law(floating)  # modes without stiffness


@pytest.mark.parametrize("off, shared", [(0.079, True), (0.081, False), (None, False)])
def test_departure_figure_marks_each_engine_at_its_times(result, off, shared):
    """Methods less than two hundredths of the longest time, 4 s, apart share a mark; the two engines never do."""
    other = None if off is None else 4.0 - off
    rows = [departure_row(1.0, 1.0), departure_row(4.0, 4.0, size=1e-9)]
    rows += [row | {"method": "implicit"} for row in (rows[0], departure_row(other, 4.0, size=1e-9))]
    rows += [departure_row(1.0, 1.0, engine="mujoco") | {"method": "RK4"}]
    rows += [departure_row(2.0, 2.0, scene="ball catch, printed torque")]
    result.tables |= {"stability_modes": [{"scene": "ball catch", "real_per_s": 7.5}], "departure": rows}
    result.curves["looked at"] = subjects_of(ARM).names
    fig = figures_departure.draw_departure(result, ARM)[1]
    labels = {text.get_text() for text in fig.legends[0].get_texts()}
    ours = {"TMT: RK4, implicit"} if shared else {"TMT: RK4", "TMT: implicit"}
    assert labels >= ours | {"MuJoCo: RK4"} and ("TMT: implicit" in labels) is not shared
    marks = {line.get_label(): line.get_ydata().tolist() for line in fig.axes[0].lines if len(line.get_ydata())}
    assert marks["MuJoCo: RK4"] == [1.0] and 4.0 in marks["TMT: RK4, implicit" if shared else "TMT: RK4"]
