"""How far digits reach: growth, horizons, and runs with many digits."""

import mpmath
import numpy as np
import pytest
from judged import verdicts
from trajectory_curves import FREE, run_of

import tmt
from compare.experiments.trajectory import horizon
from compare.experiments.trajectory.figures_drift import draw_growth as draw
from compare.judge.check import Result
from tmt.methods import METHODS, one_step


def test_each_engine_is_compared_with_many_digits():
    path = tmt.simulate(*FREE.start, FREE.tau, 5 / 64, 64, "rk4", FREE.tree).q
    other = tmt.simulate(*FREE.start, FREE.tau + 1e-6, 5 / 64, 64, "rk4", FREE.tree).q
    curve = run_of(FREE) | {"tmt": [path, path], "mujoco": [other, path]}
    result = Result("trajectory", curves={"runs": {("bent, free", "rk4", 64): curve}})
    horizon.many_digits(result, [FREE], [{"rk4": path.astype(object)}])
    assert [(check.quantity[:6], check.passed) for check in result.checks] == [("TMT to", True), ("MuJoCo", False)]
    assert {check.scene for check in result.checks} == {"bent, free, RK4, dt = 5/64 s"}
    assert "TMT is at most 0.0e+00 rad off, MuJoCo" in result.notes[0] and "to 5.00 s" in result.notes[0]


@pytest.mark.parametrize("engine, label", [("tmt", "TMT"), ("mujoco", "MuJoCo")])
def test_a_run_stays_in_the_band_about_many_digits(engine, label):
    width = np.array([0.0, 1e-12, 2e-12])
    for share, passes in ((0.999, True), (1.001, False), (np.nan, False)):
        off, result = {name: np.zeros(3) for name in ("tmt", "mujoco")}, Result("trajectory")
        off[engine][2] = share * 2e-12
        horizon.check_digits(result, "x", off, width, 0.5)
        passed = {"TMT": True, "MuJoCo": True} | {label: passes}
        assert verdicts(result) == {f"{name} to many digits of its own scheme": ok for name, ok in passed.items()}
    first, second = ("2.0e-12", "0.0e+00") if engine == "tmt" else ("0.0e+00", "2.0e-12")
    horizon.check_digits(result, "x", {name: np.full(3, 2e-12 * (name == engine)) for name in off}, width, 0.5)
    assert f"TMT is at most {first} rad off, MuJoCo {second} rad" in result.notes[-1]


def test_a_horizon_is_where_a_difference_of_the_last_digit_has_grown_to_a_radian():
    t = np.linspace(0.0, 60.0, 61)
    assert horizon.reach(t, 0.3 * t, 16) == 54.0 and horizon.reach(t, 0.26 * t, 16) is None
    growth, horizons = horizon.growth_in_words(t, {"calm": 0.1 * t, "wild": 0.4 * t})
    assert "calm: 10^0.5 and 10^6.0; wild: 10^2.0 and 10^24.0" in growth and "over 5 s and 60 s" in growth
    assert horizons.endswith("on the step: wild: about 41 s for doubles (16 digits) and more than 60 s for 30 digits.")
    assert horizon.growth_in_words(t, {"calm": 0.1 * t})[1].startswith("No scene has a horizon within 60 s")


def test_a_horizon_of_a_run_that_diverges_is_known_until_there():
    t = np.linspace(0.0, 60.0, 61)
    ends = np.where(t < 51.0, 0.4 * t, np.nan)
    growth, horizons = horizon.growth_in_words(t, {"calm": 0.1 * t, "ends": ends})
    assert "ends: 10^2.0 and no number (the run diverges)." in growth
    assert horizons.endswith("ends: about 41 s for doubles (16 digits) and more than 50 s for 30 digits.")
    assert horizon.growth_in_words(t, {"calm": 0.1 * t, "ends": ends / 9})[1].startswith(
        "No scene has a horizon within 50 s"
    )
    at_once = np.where(t < 1.0, 0.0, np.nan)
    assert horizon.growth_in_words(t, {"calm": 0.1 * t, "a": at_once, "b": at_once})[1].endswith(
        "within 60 s: nowhere does a difference of the last digit grow to 1 rad; but of a and b nothing is known, for the run "
        "diverges at once."
    )
    _, fig, caption = draw(Result("trajectory", curves={"growth": {"t": t, "curves": {"calm": 0.1 * t, "ends": ends}}}))
    assert "ends: 10^2.0 and no number (the run diverges); calm: 10^0.5 and 10^6." in caption
    assert [text.get_position()[1] for text in fig.axes[0].texts[:2]] == [6.0, 20.0]


def test_the_figure_of_growth_says_which_scene_grows_how_much():
    t = np.linspace(0.0, 60.0, 61)
    result = Result("trajectory", curves={"growth": {"t": t, "curves": {"calm": 0.1 * t, "wild": 0.4 * t}}})
    name, fig, caption = draw(result)
    assert (
        name == "trajectory_growth" and "in 5 s and in 60 s: wild: 10^2.0 and 10^24; calm: 10^0.5 and 10^6." in caption
    )
    assert fig.axes[0].lines[0].get_ydata()[-1] == pytest.approx(6.0)


def test_many_digits_are_many():
    """The same two steps with 80 digits; 50 are those of the run."""
    found = horizon.exact_run(FREE, "rk4", 2, 5 / 64)[-1]
    with mpmath.workdps(80):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (*FREE.start, FREE.tau))
        for _ in range(2):
            q, qd = one_step(METHODS["rk4"], FREE.tree, q, qd, tau, mpmath.mpf(5 / 64))
        assert max(abs(a - b) for a, b in zip(found, q)) < mpmath.mpf(10) ** -46


def test_runs_with_many_digits_are_those_of_the_scene_s_own_steps():
    case = FREE.changed(duration=0.5, dt=0.125)
    (short,), (own,) = (horizon.exact_runs(case, ["rk4"], most).values() for most in (2, 64))
    assert (short.shape, own.shape) == ((3, 3), (5, 3)) and (short == own[:3]).all()
    q = tmt.simulate(*case.start, case.tau, 0.125, 4, "rk4", case.tree).q
    assert np.abs(own.astype(float) - q).max() < 1e-13
