"""Figures of runs: whose number stands where, and which figures there are."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.text import Text
from trajectory_curves import CASES, HELD, run_of

from compare.experiments import trajectory
from compare.experiments.trajectory import figures_drift, figures_runs, leaving
from compare.judge.check import Result
from compare.robots.arm import ARM


def test_lines_are_tmt_and_marks_are_mujoco_in_every_figure_of_a_run():
    curve = run_of(HELD, 0.1, 0.2, until=2.5, left=(None, 4.0))
    curves = {"runs": {("ball catch, held", s, 64): curve for s in ("rk4", "implicit", "semi_implicit_euler")}}
    result = Result("trajectory", curves=curves | {"errors": {"ball catch, held": (0.1, 0.2)}})
    name, fig, caption = figures_runs.draw_held(result, HELD, 2)
    (ax,) = fig.axes
    lines = [line for line in ax.lines if len(line.get_xdata())]
    for i in range(3):
        assert (
            np.allclose(lines[2 * i].get_ydata(), np.degrees(curve["tmt"][0][:, i]))
            and lines[2 * i].get_marker() == "None"
        )
        assert np.allclose(lines[2 * i + 1].get_ydata(), np.degrees(curve["mujoco"][0][:, i]))
        assert lines[2 * i + 1].get_marker() == "o" and lines[2 * i].get_label().endswith("TMT")
    assert name == "assignment_figure_2"
    assert "the arm of TMT stays within 0.1 rad, that of MuJoCo is 0.1 rad away at 4.00 s" in caption
    assert "of that TMT is at most 1.0e-01 rad off, MuJoCo 2.0e-01 rad" in caption
    assert "while judged, to 2.50 s, they are 5.0e-02 rad apart" in caption

    about = {"scene": "ball catch, held", "level": "open loop", "engine_integrator": "RK4", "dt_s": 5 / 64}
    ends = ((None, 0.25), (0.0, None), (None, 0.125))
    result.rows = [about | {"diverged_at_s": at, "difference_over_band": used} for at, used in ends]
    name, fig, caption = figures_runs.draw_run(result, HELD)
    assert name == "trajectory_ball_catch_held" and "difference is at most 2.5e-01 of the band" in caption
    assert "With 64 steps of RK4 TMT is 1.0e-01 rad and MuJoCo 2.0e-01 rad from the true motion." in caption
    assert "MuJoCo's run diverged: RK4 at dt = 0.0781 s." in caption and "RK4 to 2.50 s" in caption
    angle, rate, difference = fig.axes[0], fig.axes[3], fig.axes[6]
    for ax, k in ((angle, 0), (rate, 1)):
        assert np.array_equal(ax.lines[0].get_ydata(), curve["tmt"][k][:, 0])
        assert np.array_equal(ax.lines[1].get_ydata(), curve["mujoco"][k][::3, 0]) and ax.lines[1].get_marker() == "o"
    ours, apart, width = difference.lines
    assert ours.get_label() == "TMT, start 2e-16 away" and ours.get_ydata()[-1] == pytest.approx(0.1)
    assert apart.get_label() == "TMT to MuJoCo" and apart.get_ydata()[-1] == pytest.approx(0.1)
    assert set(width.get_ydata()) == {1e-9}


def drawn_run(size=1.0, until=5.0, ours=0.1):
    """The figure of a run whose speeds are so large, judged so long, and its caption."""
    curve = run_of(HELD, ours, 0.2, until=until)
    for name in ("tmt", "mujoco"):
        curve[name][1] = size * curve[name][1]
    result = Result("trajectory", curves={"runs": {(HELD.name, "rk4", 64): curve}, "errors": {}})
    return figures_runs.draw_run(result, HELD)[1:]


def test_what_is_not_judged_is_grey_in_the_panel_in_the_legend_and_in_the_caption_or_in_none():
    for until, said in ((2.5, True), (5.0, False)):
        fig, caption = drawn_run(until=until)
        texts = [text.get_text() for text in fig.legends[0].get_texts()]
        assert ("not judged" in texts) is bool(fig.axes[2].patches) is ("grey: not judged" in caption) is said


def test_a_factor_of_an_axis_stands_in_its_name_and_nowhere_else():
    for size, named in ((1.0, "rate, rad/s"), (1e-14, "rate, 1e-13 rad/s"), (1e9, "rate, 1e+10 rad/s")):
        fig, _ = drawn_run(size)
        fig.draw_without_rendering()
        rate = fig.axes[1]
        assert rate.get_ylabel() == named and rate.yaxis.get_offset_text().get_text() == ""
        written = [text.get_text() for text in rate.get_yticklabels()]
        assert len(set(written)) == len(written) > 2 and max(map(len, written)) <= 5


def test_what_comes_after_a_run_has_diverged_is_not_drawn():
    curve = run_of(HELD, 1.0, 1e135, ended=(None, 2.5))
    curves = {"runs": {(HELD.name, "rk4", 64): curve}, "errors": {HELD.name: (0.1, None)}}
    (_, fig, caption), (_, of_held, _) = (
        draw(Result("trajectory", curves=curves), HELD, *more)
        for draw, more in ((figures_runs.draw_run, ()), (figures_runs.draw_held, (2,)))
    )
    for ax in (fig.axes[0], of_held.axes[0]):
        ours, theirs = ax.lines[:2]
        assert np.isfinite(ours.get_ydata()).all()
        assert np.array_equal(np.isfinite(theirs.get_ydata()), curve["t"] < 2.5)
    (apart,) = (line for line in fig.axes[2].lines if line.get_label() == "TMT to MuJoCo")
    assert np.array_equal(np.isfinite(apart.get_ydata()), curve["t"][1:] < 2.5)
    assert caption.endswith("Lines and marks end where a run has diverged.") and "diverged" not in drawn_run()[1]


def test_differences_that_are_none_are_drawn_at_a_mark_that_says_0():
    assert "are drawn at 0" not in drawn_run()[1]
    fig, caption = drawn_run(ours=0.0)
    lowest, other = fig.axes[2].get_yticklabels()[:2]
    assert (lowest.get_text(), lowest.get_position()[1]) == ("0", figures_runs.DRAWN_ZERO) and other.get_text() != "0"
    assert "Differences below 1e-18 are drawn at 0." in caption


@pytest.mark.parametrize(
    "rate, left_over, predicted, said",
    [
        (7.5, (1e-14, 2e-14), (5.0, 4.77), "grows by e^7.5 per second; by that alone TMT would be 0.1 rad away at 5.00 s, "
         "MuJoCo at 4.77 s"),
        (7.5, (0.0, 2e-14), (None, 4.77), "by that alone TMT would stay, MuJoCo at 4.77 s"),
        (1e-4, (1e-14, 2e-14), (None, None), "no small deviation grows here"),
        (7.5, (1e-14, 1.01e-12), (5.0, 4.0), "leaves an acceleration of 1.0e-12 rad/s2 in MuJoCo: that is no rounding"),
        (7.5, (np.nan, 1e-14), (None, 4.0), "nan rad/s2 in TMT: that is no rounding, which allows 1.0e-12"),
    ],
)  # fmt: skip
def test_the_figure_of_a_held_posture_says_why_one_leaves_and_the_other_does_not(rate, left_over, predicted, said):
    found = leaving.Leaving(
        rate, 1e-12, dict(zip(("tmt", "mujoco"), left_over)), dict(zip(("tmt", "mujoco"), predicted))
    )
    curve = run_of(HELD, left=(None, 4.69))
    curves = {"runs": {(HELD.name, "rk4", 64): curve}, "errors": {HELD.name: (0.1, 0.2)}, "leaving": {HELD.name: found}}
    _, fig, caption = figures_runs.draw_held(Result("trajectory", curves=curves), HELD, 2)
    assert said in caption.replace(" No ", " no ") and said[1:] in fig.axes[0].get_title(loc="left").replace("\n", " ")
    (line,) = (line for line in fig.axes[0].lines if line.get_label().endswith("rad away at 4.69 s"))
    assert line.get_label().startswith("MuJoCo") and set(line.get_xdata()) == {4.69}


def test_names_of_the_growth_stand_beside_the_ends_of_their_curves_in_their_order():
    t, ends = np.linspace(0.0, 60.0, 61), [52.0, 40.0, 3.0, 2.8, 2.9, 1.0, -15.0]
    curves = {f"scene {end}": end * t / 60.0 for end in ends}
    _, fig, caption = figures_drift.draw_growth(Result("trajectory", curves={"growth": {"t": t, "curves": curves}}))
    fig.draw_without_rendering()
    ax = fig.axes[0]
    names = {text.get_text(): text for text in ax.texts if text.get_text() in curves}
    heights = {name: Text.get_window_extent(text) for name, text in names.items()}
    low, high = ax.get_ylim()
    for name, text in names.items():
        assert text.xy == (60.0, curves[name][-1]) and abs(text.get_position()[1] - text.xy[1]) < 0.1 * (high - low)
    boxes = sorted(heights.values(), key=lambda box: box.y0)
    assert all(below.y1 <= above.y0 for below, above in pairwise(boxes)) and len(boxes) == len(ends)
    assert sorted(names, key=lambda name: heights[name].y0) == sorted(curves, key=lambda name: curves[name][-1])
    assert max(box.x1 for box in boxes) < fig.bbox.x1 and "scene 52.0: 10^" in caption


def test_which_figures_there_are_follows_what_was_run():
    """A quick run does not show twice what the assignment's figures show; a robot without claims has none of those."""
    cases = (CASES["bent, free"], HELD)
    curves = {"runs": {(case.name, "rk4", 64): run_of(case) for case in cases}, "drift": {"drifts": {}}}
    plain, t = dataclasses.replace(ARM, claims=None), np.linspace(0.0, 60.0, 61)

    def drawn(robot, **more):
        result = Result("trajectory", curves=curves | {"errors": {HELD.name: (0.1, 0.2)}} | more)
        return [call()[0] for call in trajectory.figures(result, robot)]

    assert drawn(ARM) == ["assignment_figure_2", "trajectory_bent_free"]
    assert drawn(plain) == ["trajectory_bent_free", "trajectory_ball_catch_held"]
    growth = {"growth": {"t": t, "curves": {"bent, free": 0.1 * t}}}
    assert drawn(ARM, **growth) == ["assignment_figure_2", *drawn(plain), "trajectory_growth"]
