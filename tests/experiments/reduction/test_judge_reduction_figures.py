"""Tables and figures of reduction: times and engines keep their places."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from compare.engines.mujoco import additions
from compare.experiment import Setup
from compare.experiments.reduction import cost, figures_motion, figures_needs, times
from compare.judge.check import Result
from compare.robots.arm import ARM

GREEN, ORANGE = "#009e73", "#e69f00"
FLOOR = additions.ON_FLOOR


def test_the_cost_of_an_addition_is_the_ratio_of_its_times_and_is_drawn_so():
    moved = np.zeros((3, 6))
    moved[1, 2], moved[2, 5] = 0.25, 9.0  # an angle, a rate
    names = (additions.MINIMAL, additions.AGAIN, "a motor", FLOOR)
    paths = {(name, i): moved * (name == FLOOR) for name in names for i in ("Euler", "RK4")}
    seconds = {(name, i): 128e-9 * (names.index(name) + 2) * (4 if i == "RK4" else 1) for name, i in paths}
    table = cost.cost_rows(seconds, paths, dict.fromkeys(paths, 0.0), ARM.coordinates)
    rows = {(row["added"], row["integrator"]): row for row in table}
    motor, floor = rows["a motor", "RK4"], rows[FLOOR, "RK4"]
    assert rows["a motor", "Euler"]["ns_per_step"] == pytest.approx(4.0) and motor["ns_per_step"] == pytest.approx(16.0)
    assert (motor["ratio"], floor["ratio"]) == pytest.approx((2.0, 2.5))
    assert (motor["same_bits"], floor["same_bits"], floor["max_difference_rad"]) == (True, False, 0.25)
    _, fig, caption = figures_needs.draw_costs(Result("reduction", tables={"cost_in_mujoco": table}))
    bars = [(bar.get_width(), bar.get_hatch() is not None) for bar in fig.axes[0].patches]
    assert sorted(bars) == [(pytest.approx(width), width == 1.5) for width in (0.5, 0.5, 1.0, 1.0, 1.5, 1.5)]
    assert "2.50" in caption and "50.0 %" in caption and FLOOR in caption


def test_the_table_and_the_figure_of_needs_have_the_times_of_each_engine(engines):
    """Of a scene with a smaller model and of one that needs no run, from known seconds of the runs."""
    cases, seconds = {case.name: case for case in ARM.cases}, {}
    free, held, planar = cases["zero, free"], cases["bent, held"], cases["elbow swing"]  # stands for the smaller model
    for engine, steps, whole, small in (("tmt", 1024, 300e-9, 100e-9), ("mujoco", 128, 6000e-9, 4000e-9)):
        for integrator, factor in (("RK4", 1.0), ("Euler", 0.25)):
            for case, of, taken in ((free, free, whole), (held, held, whole), (free, planar, small)):
                seconds[case.name, of.joints, engine, integrator] = steps * taken * factor
    models = [(free.name, free), (free.name, planar), (held.name, held), (held.name, None)]
    table = times.time_rows(models, Setup.small(ARM, engines), seconds, {(free.name, "tmt", "RK4"): 1e-12})
    rows = {(r["scene"], r["nv"], r["engine"], r["integrator"]): r for r in table}
    for engine, whole, small in (("tmt", 300.0, 100.0), ("mujoco", 6000.0, 4000.0)):
        of_whole, of_small = rows[free.name, 3, engine, "RK4"], rows[free.name, 1, engine, "RK4"]
        assert (of_whole["ns_per_step"], of_whole["speedup"]) == pytest.approx((whole, 1.0))
        assert (of_small["ns_per_step"], of_small["speedup"]) == pytest.approx((small, whole / small))
        assert rows[free.name, 1, engine, "Euler"]["ns_per_step"] == pytest.approx(small / 4)
        assert rows[held.name, 0, engine, "RK4"]["ns_per_step"] is None
    assert [rows[free.name, nv, "tmt", "RK4"]["max_difference_rad"] for nv in (1, 3)] == [1e-12, None]

    needs = {free.name: {"locked": (), "stays": ("beta",)}, held.name: {"locked": (), "stays": ARM.joints}}
    _, fig, caption = figures_needs.draw_needs(Result("reduction", rows=table, curves={"needs": needs}), ARM)
    assert "TMT in zero, free" in caption and "1 of 3" in caption and "0.33" in caption  # the largest gain
    lines = [line for line in fig.axes[1].get_lines() if len(line.get_xdata()) == 1]
    for colour, drawn_times in ((GREEN, (100.0, 300.0)), (ORANGE, (4000.0, 6000.0))):
        of_engine = [line for line in lines if to_hex(line.get_color()) == colour]
        drawn = sorted(line.get_xdata()[0] for line in of_engine if round(line.get_ydata()[0]) == 0)
        assert drawn == pytest.approx(drawn_times)


def test_the_figure_of_needs_shows_which_joints_stay_and_of_which_nothing_is_decided():
    needs = {"swing": {"locked": ("alpha",), "stays": ("beta",), "undecided": ("gamma",)}}
    _, fig, _ = figures_needs.draw_needs(Result("reduction", curves={"needs": needs}), ARM)
    marks = [(line.get_marker(), line.get_markerfacecolor()) for line in fig.axes[0].get_lines()][:3]
    assert [marker for marker, _ in marks] == ["x", "o", "d"] and marks[1][1] == "none"


def test_the_figures_of_known_motions_have_each_engine_in_its_place():
    errors = {(engine, i): [e * 2.0 ** (-o * k) for k in range(6)] for engine, e in (("tmt", 1e-3), ("mujoco", 3e-3))
              for i, o in (("RK4", 4), ("Euler", 1))}  # fmt: skip
    orders = {("tmt", "RK4"): 4.01, ("mujoco", "RK4"): 3.97, ("tmt", "Euler"): 1.02}
    small = {"amplitude": np.array([0.02, 0.01]), "off": {"tmt": [4e-4, 1e-4], "mujoco": [3e-4, 3e-4]}, "duration": 5.0,
             "frequencies": np.array([4.0, 5.0, 11.0]), "powers": {"tmt": 2.0, "mujoco": 0.0},
             "posture": "hanging", "sides": 1}  # fmt: skip
    swing = {"dt": 0.02 / 2.0 ** np.arange(6), "errors": errors, "orders": orders, "stated": {"RK4": 4, "Euler": 1}}
    result = Result("reduction", curves={"swings": {"elbow swing": swing}, "small": small})
    _, fig, caption = figures_motion.draw_swing(result, "elbow swing")
    lines = {line.get_label(): line.get_ydata()[0] for line in fig.axes[0].get_lines()}
    assert lines["RK4, TMT"] == 1e-3 and lines["RK4, MuJoCo"] == 3e-3
    found = [caption.index(number) for number in ("4.01", "3.97", "9.5e-10", "2.9e-09", "1.02")]
    assert found == sorted(found)
    _, fig, caption = figures_motion.draw_small_oscillations(result, ARM)
    lines = {line.get_label(): line.get_ydata()[-1] for line in fig.axes[0].get_lines()}
    assert lines["TMT"] == 1e-4 and lines["MuJoCo"] == 3e-4 and "2.000 (TMT)" in caption and "0.000 (MuJoCo)" in caption
