"""Figures of runs: whose number stands where, and which figures there are."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
from matplotlib.text import Text
from trajectory_curves import CASES, HELD, run_of

from compare.engines.mujoco.engine import METHODS
from compare.experiments import trajectory
from compare.experiments.trajectory import drift, figures_drift, figures_runs, leaving
from compare.judge.check import Result
from compare.robots.arm import ARM


def drawn_run(size=1.0, ours=0.1):
    """The figure of a run whose speeds are so large."""
    curve = run_of(HELD, ours, 0.2)
    for name in ("tmt", "mujoco"):
        curve[name][1] = size * curve[name][1]
    result = Result("trajectory", curves={"runs": {(HELD.name, "rk4", 64): curve}, "errors": {}})
    return figures_runs.draw_run(result, HELD)[1]


def test_lines_are_tmt_and_marks_are_mujoco_in_every_figure_of_a_run():
    curve = run_of(HELD, 0.1, 0.2, until=2.5, left=(None, 4.0))
    curves = {"runs": {("ball catch, held", s, 64): curve for s in ("rk4", "implicit", "semi_implicit_euler")}}
    result = Result("trajectory", curves=curves | {"errors": {"ball catch, held": (0.1, 0.2)}})
    name, fig, caption = figures_runs.draw_held(result, HELD, 2)
    lines = [line for line in fig.axes[0].lines if len(line.get_xdata())]
    for i in range(3):
        ours, theirs = lines[2 * i : 2 * i + 2]
        assert np.allclose(ours.get_ydata(), np.degrees(curve["tmt"][0][:, i])) and ours.get_marker() == "None"
        assert np.allclose(theirs.get_ydata(), np.degrees(curve["mujoco"][0][:, i])) and theirs.get_marker() == "o"
    assert (
        name == "assignment_figure_2" and caption.count("4.00 s") == 1 and "MuJoCo is 0.1 rad away at 4.00 s" in caption
    )
    at = [caption.index(number) for number in ("1.0e-01 rad", "2.0e-01 rad", "2.50 s", "5.0e-02 rad")]
    assert at == sorted(at)  # TMT's error, MuJoCo's, how long judged, how far apart

    about = {"scene": "ball catch, held", "level": "open loop", "engine_integrator": "RK4", "dt_s": 5 / 64}
    ends = ((None, 0.25), (0.0, None), (None, 0.125))
    result.rows = [about | {"diverged_at_s": at, "difference_over_band": used} for at, used in ends]
    name, fig, caption = figures_runs.draw_run(result, HELD)
    assert name == "trajectory_ball_catch_held"
    assert all(number in caption for number in ("2.5e-01", "1.0e-01 rad", "2.0e-01 rad", "0.0781 s", "2.50 s"))
    angle, rate, difference = fig.axes[0], fig.axes[3], fig.axes[6]
    for ax, k in ((angle, 0), (rate, 1)):
        assert np.array_equal(ax.lines[0].get_ydata(), curve["tmt"][k][:, 0])
        assert np.array_equal(ax.lines[1].get_ydata(), curve["mujoco"][k][::3, 0]) and ax.lines[1].get_marker() == "o"
    ours, apart, width = difference.lines
    assert ours.get_label().startswith("TMT, start ") and ours.get_ydata()[-1] == pytest.approx(0.1)
    assert apart.get_label() == "TMT to MuJoCo" and apart.get_ydata()[-1] == pytest.approx(0.1)
    assert set(width.get_ydata()) == {1e-9}


def test_a_factor_of_an_axis_stands_in_its_name_and_nowhere_else():
    for size, named in ((1e-14, "1e-13 rad/s"), (1e9, "1e+10 rad/s")):
        fig = drawn_run(size)
        fig.draw_without_rendering()
        rate = fig.axes[1]
        assert rate.get_ylabel().endswith(named) and rate.yaxis.get_offset_text().get_text() == ""
        written = [text.get_text() for text in rate.get_yticklabels()]
        assert len(set(written)) == len(written) > 2 and max(map(len, written)) <= 5


def test_what_comes_after_a_run_has_diverged_is_not_drawn_and_no_difference_is_drawn_at_0():
    curve = run_of(HELD, 1.0, 1e135, ended=(None, 2.5))
    result = Result("trajectory", curves={"runs": {(HELD.name, "rk4", 64): curve}, "errors": {HELD.name: (0.1, None)}})
    of_run, of_held = figures_runs.draw_run(result, HELD)[1], figures_runs.draw_held(result, HELD, 2)[1]
    for ax in (of_run.axes[0], of_held.axes[0]):
        ours, theirs = ax.lines[:2]
        assert np.isfinite(ours.get_ydata()).all()
        assert np.array_equal(np.isfinite(theirs.get_ydata()), curve["t"] < 2.5)
    (apart,) = (line for line in of_run.axes[2].lines if line.get_label() == "TMT to MuJoCo")
    assert np.array_equal(np.isfinite(apart.get_ydata()), curve["t"][1:] < 2.5)
    fig = drawn_run(ours=0.0)
    lowest, other = fig.axes[2].get_yticklabels()[:2]
    assert (lowest.get_text(), lowest.get_position()[1]) == ("0", figures_runs.DRAWN_ZERO) and other.get_text() != "0"


@pytest.mark.parametrize(
    "rate, left_over, predicted, numbers",
    [
        (7.5, (1e-14, 2e-14), (5.0, 4.77), ["e^7.5", "5.00 s", "MuJoCo at 4.77 s"]),
        (7.5, (0.0, 2e-14), (None, 4.77), ["e^7.5", "4.77 s"]),
        (1e-4, (1e-14, 2e-14), (None, None), []),
        (7.5, (1e-14, 1.01e-12), (5.0, 4.0), ["1.0e-12 rad/s2 in MuJoCo"]),
        (7.5, (np.nan, 1e-14), (None, 4.0), ["nan rad/s2 in TMT", "1.0e-12"]),
    ],
)
def test_the_figure_of_a_held_posture_says_why_one_leaves_and_the_other_does_not(rate, left_over, predicted, numbers):
    of_engines = (dict(zip(("tmt", "mujoco"), of)) for of in (left_over, predicted))
    found = leaving.Leaving(rate, 1e-12, *of_engines)
    curve = run_of(HELD, left=(None, 4.69))
    curves = {"runs": {(HELD.name, "rk4", 64): curve}, "errors": {HELD.name: (0.1, 0.2)}, "leaving": {HELD.name: found}}
    _, fig, caption = figures_runs.draw_held(Result("trajectory", curves=curves), HELD, 2)
    title = fig.axes[0].get_title(loc="left").replace("\n", " ")
    assert all(number in caption and number in title for number in numbers)
    (line,) = (line for line in fig.axes[0].lines if "4.69 s" in line.get_label())
    assert line.get_label().startswith("MuJoCo") and set(line.get_xdata()) == {4.69}


def test_the_figure_of_drift_has_each_engine_in_its_place():
    steps = {METHODS[name]: drift.DRIFT_STEPS[METHODS[name].order] for name in ("Euler", "implicit", "RK4")}
    made = {method: {"tmt": [8.0, 4.0, 2.0], "mujoco": [48.0, 12.0, 3.0]} for method in steps}
    curves = {"drift": {"drifts": {("bent, free", "energy", "J"): made}, "steps": steps}}
    name, fig, caption = figures_drift.draw_drift(Result("trajectory", curves=curves))
    assert name == "trajectory_drift" and "TMT 1.00 to 1.00, MuJoCo 2.00 to 2.00" in caption
    assert "TMT 2.0e+00 J, MuJoCo 3.0e+00 J" in caption and caption.endswith(": 1.5 to 6.")  # MuJoCo's over TMT's
    lines = {line.get_label(): line for line in fig.axes[0].lines}
    assert lines["implicit, TMT"].get_ydata().tolist() == [8.0, 4.0, 2.0]
    marked = [line.get_ydata().tolist() for line in fig.axes[0].lines if line.get_marker() == "D"]
    assert marked and all(values == [48.0, 12.0, 3.0] for values in marked)


def test_names_of_the_growth_stand_beside_the_ends_of_their_curves_in_their_order():
    t, ends = np.linspace(0.0, 60.0, 61), [52.0, 40.0, 3.0, 2.8, 2.9, 1.0, -15.0]
    curves = {f"scene {end}": end * t / 60.0 for end in ends} | {"diverges": np.where(t < 51.0, 0.4 * t, np.nan)}
    ends = dict(zip(curves, [*ends, 20.0]))
    name, fig, _ = figures_drift.draw_growth(Result("trajectory", curves={"growth": {"t": t, "curves": curves}}))
    fig.draw_without_rendering()
    names = {text.get_text(): text for text in fig.axes[0].texts if text.get_text() in curves}
    low, high = fig.axes[0].get_ylim()
    for of, text in names.items():
        assert text.xy[1] == ends[of] and abs(text.get_position()[1] - ends[of]) < 0.1 * (high - low)
    boxes = {of: Text.get_window_extent(names[of]) for of in sorted(curves, key=ends.get)}
    assert name == "trajectory_growth" and max(box.x1 for box in boxes.values()) < fig.bbox.x1
    assert all(below.y1 <= above.y0 for below, above in pairwise(boxes.values()))


def test_which_figures_there_are_follows_what_was_run():
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
