"""The checks of amplification, limits and growth on rows just inside and just outside of each tolerance; no runs."""

from types import SimpleNamespace

import numpy as np
import pytest
from judged import BOTH, only
from models import PATHS

from compare.engines.mujoco import reading
from compare.engines.mujoco.engine import METHODS as INTEGRATORS
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


def test_an_amplification_that_is_no_number_fails(result):
    equilibria.check_amplification(result, "", np.ones(1), np.eye(2), np.full((2, 2), np.nan))
    assert not only(result)


# step limits


def limit_row(predicted=0.1, observed=0.1, kind="finite", seen="finite", **more):
    return {
        "scene": "bent", "engine": "tmt", "method": "rk4", "damping": 0.0, "mode_per_s": 9.1, "predicted_dt_s": predicted,
        "observed_dt_s": observed, "limit": kind, "criterion": "", "seen": seen, "allowed": 1e-3, **more,
    }  # fmt: skip


def check_limits(result, *rows, growths=()):
    limits_judged.check_limits(result, ARM, [{"rows": list(rows), "growths": list(growths)}])


@BOTH
@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("damping", [0.0, 0.5])
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
    check_limits(result, limit_row(observed=0.12), limit_row(observed=theirs) | {"engine": "mujoco", "method": "RK4"})
    assert result.checks[0].about == about and not result.checks[0].passed


def test_a_step_that_multiplies_a_deviation_by_much_is_told_and_not_compared(result):
    part = {"rows": [], "growths": [], "too long": {"bent, TMT rk4, dt = 0.01 s": 243.2}}
    limits_judged.check_limits(result, ARM, [part])
    assert not result.checks and "dt = 0.01 s is 243 times beyond the limit" in result.notes[-1]


def test_how_far_a_step_is_beyond_the_limit():
    at = held(ARM, "hanging")
    limit = at.limit("rk4")[1]
    assert beyond_limit(at, "rk4", 50.0 * limit) == pytest.approx(50.0, rel=0.1)
    assert beyond_limit(at, "rk4", 0.5 * limit) == 1.0


def test_a_slow_mode_that_does_not_grow_by_itself_is_not_seen_in_a_short_run():
    rates = np.array([3.0j, 0.01j, -0.01, 0.01, -50.0])
    np.testing.assert_array_equal(limits.is_seen(rates, 1e-6, 10.0), [True, False, False, True, True])
    assert limits.is_seen(np.array([0.01j]), 1e-6, 10.0).all()  # there is no other


def test_a_limit_that_no_run_shows_fails_and_is_said(result):
    check_limits(result, limit_row(observed=None, seen="never_fails"))
    assert not only(result) and "In 1 cases the runs show no finite limit" in result.notes[0]


def test_the_largest_difference_of_a_limit_is_said():
    (text,) = limits_judged.limits_in_words(ARM, [limit_row(observed=observed) for observed in (0.1, 0.1005, 0.0998)])
    assert "largest difference: 0.500 % undamped" in text and text.startswith("3 finite limits")


def test_a_limit_that_no_run_decides_is_said_and_not_checked(result):
    open_row = limit_row(observed=None, seen=None, undecided="a reason") | {"engine": "mujoco", "method": "RK4"}
    check_limits(result, limit_row(), open_row, limit_row(None, None, "never_fails", None, undecided="a reason"))
    assert only(result) and "2 finite limits" in result.notes[0] and "Of 1 no run decides." in result.notes[0]
    assert "not checked, for a reason: bent, MuJoCo RK4, damping 0; bent, TMT rk4, damping 0." in result.notes[1]
    assert all("undecided" not in row for row in result.rows)


@pytest.mark.parametrize("tolerance, decided", [(0.0999, True), (0.1001, False)])
def test_a_limit_that_shows_far_above_it_only_is_not_decided(tolerance, decided):
    robot = robot_of(reading.read(PATHS["arm7"]), "arm7.xml")
    assert (limits.why_undecided(held(robot, "ready"), tolerance) is None) is decided
    assert limits.why_undecided(held(ARM, "bent"), 1.0) is None


def test_a_mode_so_slow_that_rounding_moves_it_is_not_decided():
    robot = robot_of(reading.read(FAR), "far.xml")
    assert "is so slow that rounding" in limits.why_undecided(held(subjects_of(robot).robot, "at rest"), 0.0)
    near, far = (equilibria.rounding_of_step(at, "rk4", 0.01) for at in (held(ARM, "bent"), held(robot, "qpos0")))
    assert far > 100.0 * near


@BOTH
def test_amplification_within_the_rounding_of_a_step_where_that_is_more(result, share, passes):
    ours = np.eye(2)
    equilibria.check_amplification(result, "", np.ones(1), ours, ours + share * 1e-9 / 1e-6, 1e-9)
    assert only(result) is passes


@pytest.mark.parametrize("rates, swings, name", [
    ((1.0, 2.0), 0.0, "a stable node"), ((1.0, 2.0), 3.0, "a stable focus"), ((0.0, 2.0), 3.0, "a centre"),
])  # fmt: skip
def test_what_decays_is_a_node_or_a_focus(rates, swings, name):
    values = np.array([complex(-rate, sign * swings) for rate in rates for sign in (1, -1)])
    at = SimpleNamespace(
        kind="centre", modes=(values, None), small=1e-6, without_stiffness=np.zeros(4, bool), name="low",
        tree=SimpleNamespace(damping=(1.0,)), case=SimpleNamespace(robot=SimpleNamespace(is_read=True, positions=())),
    )  # fmt: skip
    assert equilibria.kind_in_words(at).startswith(f"Low, held, is {name}: ")


@BOTH
def test_growth_in_all_steps_within_a_thousandth(result, share, passes):
    row = {"scene": "upright", "engine": "mujoco", "method": "Euler", "dt_s": 0.01, "predicted_growth": 1.1,
           "observed_growth": 1.1, "steps": 70, "total_off": share * 1e-3}  # fmt: skip
    check_limits(result, growths=[row])
    assert only(result) is passes and "total_off" not in row


@pytest.mark.parametrize(
    "early, late, grown",
    [
        (1.0, 1.0009, False),
        (1.0, 1.0011, True),
        (1e-4, 0.9e-3, False),  # decayed: what is left is rounding
        (1e-4, 1.1e-3, True),
        (200.0, 99.0, False),
        (200.0, 101.0, True),  # it has grown before, and no longer grows
        (np.nan, np.nan, True),
    ],
)
def test_when_a_deviation_grows(early, late, grown):
    assert limits.grows(np.array([0.5, early]), np.array([0.4, late])) is grown


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
    _, fig, caption = figures_limits.draw_limits(result, ARM)
    marks = [line.get_xdata() for line in fig.axes[0].lines if line.get_marker() == "|" and len(line.get_xdata())]
    assert [float(*x) for x in marks] == [0.0999]
    ends = sorted(bar.get_x() + bar.get_width() for bar in fig.axes[0].patches if bar.get_y() >= -1)
    assert ends == pytest.approx([0.1, 0.1001, 0.2])
    assert "2 of 3 predicted limits are observed" in caption and "at most 0.100 %" in caption


def test_map_names_who_grows():
    dts = np.array([0.1, 0.2, 0.4, 0.8])
    by_method = {
        RK4: np.array([1.0, 1.0, 1e3, 1e3]), INTEGRATORS["RK4"]: np.array([1.0, 99.0, 99.0, 99.0]),
        INTEGRATORS["Euler"]: np.full(4, np.inf), INTEGRATORS["implicit"]: np.array([1.0, 101.0, 1.0, 1.0]),
    }  # fmt: skip
    limit = {("tmt", "rk4"): 0.3, ("mujoco", "implicit"): 0.3}
    text = figures_limits.map_in_words(by_method, dts, 100.0, limit)
    assert "first at 0.20 to 0.40 s, for 1 of 2" in text
    assert "At every dt: MuJoCo Euler. At none: MuJoCo RK4." in text
