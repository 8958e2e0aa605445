"""Figures of runs: whose number stands where, and which figures there are."""

import dataclasses

import numpy as np
import pytest
from trajectory_curves import CASES, HELD, run_of

from compare.experiments import trajectory
from compare.experiments.trajectory import figures_runs
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
        assert np.array_equal(ax.lines[1].get_ydata(), curve["mujoco"][k][:, 0]) and ax.lines[1].get_marker() == "o"
    ours, apart, width = difference.lines
    assert ours.get_label() == "TMT, start 1 ulp away" and ours.get_ydata()[-1] == pytest.approx(0.1)
    assert apart.get_label() == "TMT to MuJoCo" and apart.get_ydata()[-1] == pytest.approx(0.1)
    assert set(width.get_ydata()) == {1e-9}


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
