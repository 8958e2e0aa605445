"""Figures of runs: whose number stands where, and which figures there are."""

import dataclasses

import numpy as np
import pytest
from models import random_tree
from trajectory_curves import CASES, HELD, run_of

from compare.engines.mujoco import reading
from compare.engines.mujoco.engine import METHODS
from compare.experiments import trajectory
from compare.experiments.trajectory import drift, figures_drift, figures_lines, figures_runs, leaving
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.robots.file import robot_of


def result_of(curve, **curves) -> Result:
    """With this curve of the held scene, for each scheme."""
    runs = {(HELD.name, scheme, 64): curve for scheme in ("rk4", "implicit", "semi_implicit_euler")}
    return Result("trajectory", curves={"runs": runs, "errors": {HELD.name: (0.1, 0.2)}} | curves)


def test_lines_are_tmt_and_marks_are_mujoco_in_every_figure_of_a_run():
    curve = run_of(HELD, 0.1, 0.2, until=2.5, left=(None, 4.0))
    result = result_of(curve)
    name, fig, caption = figures_runs.draw_held(result, HELD, 2)
    lines = [line for line in fig.axes[0].lines if len(line.get_xdata())]
    for i in range(3):
        ours, theirs = lines[2 * i : 2 * i + 2]
        assert np.allclose(ours.get_ydata(), np.degrees(curve["tmt"][0][:, i])) and ours.get_marker() == "None"
        assert np.allclose(theirs.get_ydata(), np.degrees(curve["mujoco"][0][:, i])) and theirs.get_marker() == "o"
    assert name == "assignment_figure_2" and "MuJoCo is 0.1 rad away at 4.00 s" in caption
    at = [caption.index(number) for number in ("1.0e-01 rad", "2.0e-01 rad", "2.50 s", "5.0e-02 rad")]
    assert at == sorted(at) and caption.count("4.00 s") == 1  # TMT's error, MuJoCo's, how long judged, how far apart

    about = {"scene": HELD.name, "level": "open loop", "engine_integrator": "RK4", "dt_s": 5 / 64}
    ends = ((None, 0.25), (0.0, None), (None, 0.125))
    result.rows = [about | {"diverged_at_s": at, "difference_over_band": used} for at, used in ends]
    name, fig, caption = figures_runs.draw_run(result, HELD)
    assert name == "trajectory_ball_catch_held"
    assert all(number in caption for number in ("2.5e-01", "1.0e-01 rad", "2.0e-01 rad", "0.0781 s", "2.50 s"))
    for ax, k in ((fig.axes[0], 0), (fig.axes[3], 1)):  # angles and rates of the first scheme
        assert np.array_equal(ax.lines[0].get_ydata(), curve["tmt"][k][:, 0])
        assert np.array_equal(ax.lines[1].get_ydata(), curve["mujoco"][k][::3, 0]) and ax.lines[1].get_marker() == "o"
    ours, apart, width = fig.axes[6].lines
    assert ours.get_label().startswith("TMT, start ") and ours.get_ydata()[-1] == pytest.approx(0.1)
    assert apart.get_label() == "TMT to MuJoCo" and apart.get_ydata()[-1] == pytest.approx(0.1)
    assert set(width.get_ydata()) == {1e-9}


def test_what_comes_after_a_run_has_diverged_is_not_drawn():
    curve = run_of(HELD, 1.0, 1e135, ended=(None, 2.5))
    result = result_of(curve, errors={HELD.name: (0.1, None)})
    of_run, of_held = figures_runs.draw_run(result, HELD)[1], figures_runs.draw_held(result, HELD, 2)[1]
    for ours, theirs in (of_run.axes[0].lines[:2], of_held.axes[0].lines[:2]):
        assert np.isfinite(ours.get_ydata()).all()
        assert np.array_equal(np.isfinite(theirs.get_ydata()), np.array(theirs.get_xdata()) < 2.5)
    assert np.array_equal(np.isfinite(of_run.axes[6].lines[1].get_ydata()), curve["t"][1:] < 2.5)


@pytest.mark.parametrize(
    "rate, of_mujoco, said", [(7.5, 2e-14, "4.77 s"), (1e-4, 2e-14, ""), (7.5, 1.01e-12, "1.0e-12 rad/s2 in MuJoCo")]
)
def test_why_one_leaves_a_held_posture_and_the_other_does_not_is_said(rate, of_mujoco, said):
    found = leaving.Leaving(rate, 1e-12, {"tmt": 0.0, "mujoco": of_mujoco}, {"tmt": None, "mujoco": 4.77})
    words = leaving.why_in_words(found)
    assert said in words and ("4.77 s" in words) == (said == "4.77 s")


def test_the_figure_of_drift_has_each_engine_in_its_place():
    steps = {METHODS[name]: drift.DRIFT_STEPS[METHODS[name].order] for name in ("Euler", "implicit", "RK4")}
    made = {method: {"tmt": [8.0, 4.0, 2.0], "mujoco": [48.0, 12.0, 3.0]} for method in steps}
    curves = {"drift": {"drifts": {("bent, free", "energy", "J"): made}, "steps": steps}}
    _, fig, caption = figures_drift.draw_drift(Result("trajectory", curves=curves))
    assert "TMT 1.00 to 1.00, MuJoCo 2.00 to 2.00" in caption
    assert "TMT 2.0e+00 J, MuJoCo 3.0e+00 J" in caption and caption.endswith(": 1.5 to 6.")  # MuJoCo's over TMT's
    for line in fig.axes[0].lines[:-1]:
        assert line.get_ydata().tolist() == ([8.0, 4.0, 2.0] if line.get_marker() == "None" else [48.0, 12.0, 3.0])


def test_which_figures_there_are_follows_what_was_run():
    cases, plain = (CASES["bent, free"], HELD), dataclasses.replace(ARM, claims=None)
    t = np.linspace(0.0, 60.0, 61)
    runs = {"runs": {(case.name, "rk4", 64): run_of(case) for case in cases}, "drift": {"drifts": {}}}
    growth = {"growth": {"t": t, "curves": {"bent, free": 0.1 * t, "diverges": np.where(t < 51.0, 0.4 * t, np.nan)}}}

    def drawn(robot, **more):
        result = result_of(None, **runs, **more)
        return [call()[0] for call in trajectory.figures(result, robot)]

    of_scenes = ["trajectory_bent_free", "trajectory_ball_catch_held"]
    assert drawn(ARM) == ["assignment_figure_2", of_scenes[0]] and drawn(plain) == of_scenes
    assert drawn(ARM, **growth) == ["assignment_figure_2", *of_scenes, "trajectory_growth"]


def test_a_ball_is_drawn_by_its_turn_from_the_start():
    """Times the root of 3: on this side of half a turn, and beyond it, where nothing is drawn."""
    case = robot_of(reading.read(random_tree(2, joints=5)), "kinds.xml").case("c")
    turns = np.array([0.0, 0.1, 1.75, 1.85])
    q = case.coordinates.move(case.q, turns[:, None] * np.ones(case.coordinates.nv))
    values = figures_lines.drawn(case, q)
    for kind, at, by in case.coordinates.places.joints:
        if kind == "ball":
            assert values[:3, by] == pytest.approx(turns[:3, None] * np.ones(3)) and np.isnan(values[3, by]).all()
        else:
            assert values[:, by] == pytest.approx(q[:, at])
