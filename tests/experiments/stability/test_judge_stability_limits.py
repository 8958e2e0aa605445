"""The checks of amplification, limits and growth on rows just inside and just outside of each tolerance; no runs."""

import numpy as np
import pytest
from judged import BOTH, only
from models import PATHS

from compare.engines.mujoco import reading
from compare.engines.tmt import Tmt
from compare.experiments.stability import equilibria, figures_limits, limits, limits_judged
from compare.experiments.stability.subjects import subjects_of
from compare.judge.check import About
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.truth.linear import held
from compare.truth.steps import beyond_limit

EPS = 2.0**-52
RK4 = Tmt().methods["rk4"]
FAR = """<mujoco><worldbody><body><joint name="far" axis="0 1 0" pos="10000 0 0"/>
  <geom type="sphere" size="0.1" pos="0 0 0.5" mass="2"/><body pos="0 0 1"><joint name="near" axis="0 1 0"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="1"/></body></body></worldbody></mujoco>"""


@BOTH
def test_amplification_within_the_rounding_of_a_difference_quotient(result, share, passes):
    ours, q = np.diag([3.0, -7.0]), np.array([1.0, -2.0])
    theirs = ours + [[0.0, share * 64 * EPS * 3.0 * 7.0 / 1e-6], [0.0, 0.0]]
    equilibria.check_amplification(result, "", q, ours, theirs)
    assert only(result) is passes


@BOTH
def test_amplification_within_the_rounding_of_a_step_where_that_is_more(result, share, passes):
    equilibria.check_amplification(result, "", np.ones(1), np.eye(2), np.eye(2) + share * 1e-9 / 1e-6, 1e-9)
    assert only(result) is passes


def test_an_amplification_that_is_no_number_fails(result):
    equilibria.check_amplification(result, "", np.ones(1), np.eye(2), np.full((2, 2), np.nan))
    assert not only(result)


# step limits


def limit_row(predicted=0.1, observed=0.1, kind="finite", seen="finite", **more):
    return {
        "scene": "bent", "engine": "tmt", "method": "rk4", "damping": 0.0, "mode_per_s": 9.1, "predicted_dt_s": predicted,
        "observed_dt_s": observed, "limit": kind, "criterion": "", "seen": seen, "allowed": 1e-3, **more,
    }  # fmt: skip


def check_limits(result, *rows, **more):
    limits_judged.check_limits(result, ARM, [{"rows": list(rows), "growths": []} | more])


@BOTH
@pytest.mark.parametrize("sign, damping", [(1.0, 0.0), (-1.0, 0.5)])
def test_observed_limit_within_a_thousandth(result, share, passes, sign, damping):
    check_limits(result, limit_row(observed=0.1 * (1 + sign * share * 1e-3), damping=damping))
    assert only(result) is passes


@pytest.mark.parametrize("kind", ["never_fails", "always_fails"])
@pytest.mark.parametrize("seen", ["never_fails", "always_fails", "finite"])
def test_kind_of_limit_is_as_predicted(result, kind, seen):
    check_limits(result, limit_row(None, None, kind, seen))
    assert only(result) is (kind == seen)


@pytest.mark.parametrize("theirs, about", [(0.12, About.PREDICTION), (0.1, About.MODELS)])
def test_what_both_engines_do_and_is_not_predicted_is_no_difference_of_the_models(result, theirs, about):
    result.curves["schemes"] = {("mujoco", "RK4"): "rk4"}
    check_limits(result, limit_row(observed=0.12), limit_row(observed=theirs, engine="mujoco", method="RK4"))
    assert result.checks[0].about == about and not result.checks[0].passed


def test_what_no_run_shows_fails_and_what_none_decides_is_not_checked(result):
    open_row = limit_row(observed=None, seen=None, undecided="a reason", engine="mujoco", method="RK4")
    check_limits(result, limit_row(), open_row, limit_row(None, None, "never_fails", None, undecided="a reason"))
    assert only(result) and "a reason" in result.notes[1] and "MuJoCo RK4, damping 0" in result.notes[1]
    assert all("undecided" not in row for row in result.rows)
    check_limits(result, limit_row(observed=None, seen="never_fails"))
    assert [check.passed for check in result.checks] == [True, False]
    check_limits(result, **{"too long": {"bent, TMT rk4, dt = 0.01 s": 243.2}})
    assert len(result.checks) == 2 and "243" in result.notes[-1]


def test_the_largest_difference_of_a_limit_is_said():
    (text,) = limits_judged.limits_in_words(ARM, [limit_row(observed=observed) for observed in (0.1, 0.1005, 0.0998)])
    assert "0.500 %" in text and "0.200" not in text


@BOTH
def test_growth_in_all_steps_within_a_thousandth(result, share, passes):
    row = {"scene": "upright", "engine": "mujoco", "method": "Euler", "dt_s": 0.01, "predicted_growth": 1.1,
           "observed_growth": 1.1, "steps": 70, "total_off": share * 1e-3}  # fmt: skip
    check_limits(result, growths=[row])
    assert only(result) is passes and "total_off" not in row


@pytest.mark.parametrize("early, late, grown", [
    (1.0, 1.0009, False), (1.0, 1.0011, True),
    (1e-4, 0.9e-3, False), (1e-4, 1.1e-3, True),  # what has decayed leaves rounding
    (200.0, 99.0, False), (200.0, 101.0, True), (1.1e4, 0.5, True), (np.nan, np.nan, True),
])  # fmt: skip
def test_when_a_deviation_grows(early, late, grown):
    assert limits.grows(np.array([0.5, early]), np.array([0.4, late])) is grown


def test_how_far_a_step_is_beyond_the_limit():
    at = held(ARM, "hanging")
    limit = at.limit("rk4")[1]
    assert beyond_limit(at, "rk4", 50.0 * limit) == pytest.approx(50.0, rel=0.1)
    assert beyond_limit(at, "rk4", 0.5 * limit) == 1.0


def test_a_slow_mode_that_does_not_grow_by_itself_is_not_seen_in_a_short_run():
    rates = np.array([3.0j, 0.01j, -0.01, 0.01, -50.0])
    np.testing.assert_array_equal(limits.is_seen(rates, 1e-6, 10.0), [True, False, False, True, True])
    assert limits.is_seen(np.array([0.01j]), 1e-6, 10.0).all()  # there is no other


def test_limits_that_no_run_decides():
    arm7, far = (robot_of(reading.read(source), "robot.xml") for source in (PATHS["arm7"], FAR))
    open_ones = [limits.why_undecided(held(arm7, "ready"), share) for share in (0.0999, 0.1001)]
    assert open_ones[0] is None and open_ones[1] and limits.why_undecided(held(ARM, "bent"), 1.0) is None
    # a mode so slow that rounding moves it
    assert limits.why_undecided(held(subjects_of(far).robot, "at rest"), 0.0)
    near, away = (equilibria.rounding_of_step(at, "rk4", 0.01) for at in (held(ARM, "bent"), held(far, "qpos0")))
    assert away > 100.0 * near


# figures: the right engine with the right number


def test_limits_figure_marks_mujoco_where_mujoco_is(result):
    check_limits(
        result,
        limit_row(0.1, 0.1001),
        limit_row(0.1, 0.0999, engine="mujoco", method="RK4"),
        limit_row(None, None, "never_fails", "never_fails", method="implicit_midpoint"),
        limit_row(0.2, None, method="implicit", seen="never_fails"),
    )
    names = ("rk4", "implicit_midpoint", "implicit")
    result.curves["schemes"] = {("tmt", name): name for name in names} | {("mujoco", "RK4"): "rk4"}
    result.curves["looked at"] = {"centres": ("bent",)}
    ax = figures_limits.draw_limits(result, ARM)[1].axes[0]
    marks = [line.get_xdata() for line in ax.lines if line.get_marker() == "|" and len(line.get_xdata())]
    ends = sorted(bar.get_x() + bar.get_width() for bar in ax.patches if bar.get_y() >= -1)
    assert [float(*x) for x in marks] == [0.0999] and ends == pytest.approx([0.1, 0.1001, 0.2])
