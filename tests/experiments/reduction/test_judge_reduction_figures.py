"""Tables and figures of reduction: times and engines keep their places, and captions say what was measured."""

import numpy as np
import pytest
from matplotlib.colors import to_hex

from compare.engines.mujoco import additions
from compare.experiment import Setup
from compare.experiments import reduction
from compare.experiments.reduction import cost, figures_motion, figures_needs, times
from compare.judge.check import Result
from compare.robots.arm import ARM

GREEN, ORANGE, BLUE = "#009e73", "#e69f00", "#0072b2"
FLOOR = additions.ON_FLOOR
JOINTS = ARM.joints


def costs_of_two():
    zero = np.zeros((3, 6))
    moved = zero.copy()
    moved[1, 2], moved[2, 5] = 0.25, 9.0  # an angle, a rate
    names = (additions.MINIMAL, additions.AGAIN, "a motor", FLOOR)
    paths = {(name, i): moved if name == FLOOR else zero for name in names for i in ("RK4", "Euler")}
    seconds = {
        (name, i): 128e-9 * (k + 2) * (4 if i == "RK4" else 1) for k, name in enumerate(names) for i in ("RK4", "Euler")
    }
    return cost.cost_rows(seconds, paths, dict.fromkeys(paths, 0.0), ARM.coordinates)


def test_the_cost_of_an_addition_is_the_ratio_of_its_times():
    rows = {(row["added"], row["integrator"]): row for row in costs_of_two()}
    assert next(iter(rows)) == (additions.MINIMAL, "Euler") and len(rows) == 8
    assert rows["a motor", "Euler"]["ns_per_step"] == pytest.approx(4.0)
    assert rows["a motor", "RK4"]["ns_per_step"] == pytest.approx(16.0)
    assert rows["a motor", "RK4"]["ratio"] == pytest.approx(2.0) and rows[FLOOR, "Euler"]["ratio"] == pytest.approx(2.5)
    assert rows["a motor", "RK4"]["same_bits"] and rows[FLOOR, "RK4"]["max_difference_rad"] == 0.25
    assert not rows[FLOOR, "RK4"]["same_bits"]


def test_the_costs_are_drawn_as_they_are():
    result = Result("reduction", tables={"cost_in_mujoco": costs_of_two()})
    _, fig, caption = figures_needs.draw_costs(result)
    bars = [(to_hex(bar.get_facecolor()), bar.get_width(), bar.get_hatch()) for bar in fig.axes[0].patches]
    assert sorted(width for _, width, _ in bars) == pytest.approx(sorted(2 * [0.5, 1.0, 1.5]))
    assert {colour for colour, *_ in bars} == {BLUE, GREEN} and sum(hatch is not None for *_, hatch in bars) == 2
    assert f"2.50 and 2.50 with {FLOOR}" in caption and "timed again differs by 50.0 %" in caption
    assert f"changed by: {FLOOR}; 1 additions leave the same bits" in caption


# the table and its figure


def needed_rows(engines):
    """Rows of a scene with a smaller model and of one that needs no run, from known seconds of the runs."""
    cases = {case.name: case for case in ARM.cases}
    case, held = ARM.cases[0], cases["bent, held"]
    planar = cases["elbow swing"]  # stands for the smaller model
    seconds = {}
    for engine, whole, small in (("tmt", 1024 * 300e-9, 1024 * 100e-9), ("mujoco", 128 * 6000e-9, 128 * 4000e-9)):
        for integrator, factor in (("RK4", 1.0), ("Euler", 0.25)):
            for name in (case.name, held.name):
                seconds[name, JOINTS, engine, integrator] = whole * factor
            seconds[case.name, planar.joints, engine, integrator] = small * factor
    models = [(case.name, case), (case.name, planar), (held.name, held), (held.name, None)]
    return times.time_rows(models, Setup.small(ARM, engines), seconds, {(case.name, "tmt", "RK4"): 1e-12})


def test_the_table_has_nanoseconds_of_a_step(engines):
    rows = {(r["scene"], r["nv"], r["engine"], r["integrator"]): r for r in needed_rows(engines)}
    assert len(rows) == 4 * 2 * 2
    for engine, whole, small in (("tmt", 300.0, 100.0), ("mujoco", 6000.0, 4000.0)):
        assert rows["zero, free", 3, engine, "RK4"]["ns_per_step"] == pytest.approx(whole)
        assert rows["zero, free", 1, engine, "RK4"]["ns_per_step"] == pytest.approx(small)
        assert rows["zero, free", 1, engine, "Euler"]["ns_per_step"] == pytest.approx(small / 4)
        assert rows["zero, free", 1, engine, "RK4"]["speedup"] == pytest.approx(whole / small)
        assert rows["zero, free", 3, engine, "RK4"]["speedup"] == pytest.approx(1.0)
        assert rows["bent, held", 0, engine, "RK4"]["ns_per_step"] is None
    assert rows["zero, free", 1, "tmt", "RK4"]["max_difference_rad"] == 1e-12
    assert rows["zero, free", 3, "tmt", "RK4"]["max_difference_rad"] is None


def test_the_figure_of_needs_draws_the_times_of_each_engine(engines):
    curves = {
        "needs": {"zero, free": {"locked": (), "stays": ("beta",)}, "bent, held": {"locked": (), "stays": JOINTS}}
    }
    result = Result("reduction", rows=needed_rows(engines), curves=curves)
    _, fig, caption = figures_needs.draw_needs(result, ARM)
    points = [(to_hex(line.get_color()), line.get_xdata()[0], line.get_ydata()[0]) for line in fig.axes[1].get_lines()
              if len(line.get_xdata()) == 1]  # fmt: skip
    for colour, drawn_times in ((GREEN, (300.0, 100.0)), (ORANGE, (6000.0, 4000.0))):
        drawn = [x for c, x, y in points if c == colour and round(y) == 0]
        assert sorted(drawn) == pytest.approx(sorted(drawn_times))
    labels = {text.get_text(): to_hex(handle.get_color()) for text, handle in zip(
        fig.axes[1].get_legend().get_texts(), fig.axes[1].get_legend().legend_handles)}  # fmt: skip
    assert labels["TMT, whole model"] == GREEN and labels["MuJoCo, smallest model"] == ORANGE
    assert "Nothing for bent, held" in caption and "hinges, proved, for zero, free." in caption
    assert "that of TMT in zero, free" in caption and "with 1 of 3 hinges a step takes 0.33 of the time" in caption
    assert figures_needs.gain([], 3) == "No smaller model was timed."


def test_the_figure_of_needs_shows_of_which_joints_nothing_is_decided():
    """And its legend names that kind only where there are such."""
    for undecided, kinds in (((), 3), (("gamma",), 4)):
        curves = {"needs": {"free": {"locked": (), "stays": ("beta",), "undecided": undecided}}}
        _, fig, _ = figures_needs.draw_needs(Result("reduction", curves=curves), ARM)
        assert [line.get_marker() for line in fig.axes[0].get_lines()][2] == "od"[len(undecided)]
        assert len(fig.axes[0].get_legend().get_texts()) == kinds


def test_where_no_run_is_needed_one_label_stands_for_engines_that_take_alike():
    curves = {"needs": {"held": {"locked": (), "stays": JOINTS}}}
    for slower, labels in ((1.5, 1), (30.0, 2)):
        times = {"tmt": 100.0, "mujoco": 100.0 * slower}
        common = {"scene": "held", "integrator": "RK4", "nv": 3, "speedup": None}
        rows = [{"engine": engine, "ns_per_step": time, **common} for engine in times for time in (times[engine], None)]
        _, fig, _ = figures_needs.draw_needs(Result("reduction", rows=rows, curves=curves), ARM)
        assert [text.get_text() for text in fig.axes[1].texts] == ["no run needed"] * labels


def test_the_figure_of_needs_shows_which_joints_stay():
    curves = {"needs": {"swing": {"locked": ("alpha",), "stays": ("beta",)}}}
    _, fig, caption = figures_needs.draw_needs(Result("reduction", curves=curves), ARM)
    marks = {line.get_xdata()[0]: (line.get_marker(), line.get_markerfacecolor()) for line in fig.axes[0].get_lines()}
    assert marks[0][0] == "x" and marks[1] == ("o", "none") and marks[2][1].lower() == BLUE
    assert [text.get_text() for text in fig.axes[0].get_xticklabels()] == ["α", "β", "γ"]
    assert caption.startswith("What each scene of the stated arm needs. Fewer than all 3 hinges, proved, for swing.")


def test_the_figures_of_known_motions_say_what_was_measured():
    errors = {(engine, i): [e * 2.0 ** (-o * k) for k in range(6)] for engine, e in (("tmt", 1e-3), ("mujoco", 3e-3))
              for i, o in (("RK4", 4), ("Euler", 1))}  # fmt: skip
    orders = {("tmt", "RK4"): 4.01, ("mujoco", "RK4"): 3.97, ("tmt", "Euler"): 1.02}
    small = {"amplitude": np.array([0.02, 0.01]), "off": {"tmt": [4e-4, 1e-4], "mujoco": [3e-4, 3e-4]}, "duration": 5.0,
             "frequencies": np.array([4.0, 5.0, 11.0]), "powers": {"tmt": 2.0, "mujoco": 0.0},
             "posture": "hanging", "sides": 1}  # fmt: skip
    dt = 0.02 / 2.0 ** np.arange(6)
    swings = {"elbow swing": {"dt": dt, "errors": errors, "orders": orders, "stated": {"RK4": 4, "Euler": 1}}}
    result = Result("reduction", curves={"swings": swings, "small": small})
    _, fig, caption = figures_motion.draw_swing(result, "elbow swing")
    lines = {line.get_label(): line.get_ydata()[0] for line in fig.axes[0].get_lines()}
    assert lines["RK4, TMT"] == 1e-3 and lines["RK4, MuJoCo"] == 3e-3
    assert [text.get_text() for text in fig.axes[0].texts] == ["order 4", "order 1"]
    assert "RK4: order 4.01 and 3.97, down to 9.5e-10 and 2.9e-09 rad" in caption
    assert "Euler: order 1.02 and not measured, down to" in caption
    _, fig, caption = figures_motion.draw_small_oscillations(result, ARM)
    lines = {line.get_label(): line.get_ydata()[-1] for line in fig.axes[0].get_lines()}
    assert lines["TMT"] == 1e-4 and lines["MuJoCo"] == 3e-4
    assert "about hanging" in caption and "half the difference" not in caption
    assert "power 2.000 (TMT) and 0.000 (MuJoCo)" in caption and "1.0e-04 (TMT) and 3.0e-04 (MuJoCo) at 0.01" in caption
    small["sides"] = 2
    assert "half the difference" in figures_motion.draw_small_oscillations(result, ARM)[2]


def test_any_name_of_a_scene_is_drawn_as_it_is_and_gives_a_plain_file_name(tmp_path):
    scene = "to / $5 and $6_x^"
    _, fig, caption = figures_needs.draw_needs(
        Result("reduction", curves={"needs": {scene: {"locked": (), "stays": JOINTS[:1]}}}), ARM
    )
    fig.savefig(tmp_path / "needs.png")
    assert f"proved, for {scene}." in caption
    errors = {(engine, i): [1e-3] * 6 for engine in ("tmt", "mujoco") for i in ("RK4", "Euler")}
    swing = {"dt": 0.02 / 2.0 ** np.arange(6), "errors": errors, "orders": {}, "stated": {"RK4": 4, "Euler": 1}}
    name, fig, _ = figures_motion.draw_swing(Result("reduction", curves={"swings": {scene: swing}}), scene)
    long = 300 * "x"
    assert len(figures_motion.draw_swing(Result("reduction", curves={"swings": {long: swing}}), long)[0]) == 60
    assert name == "reduction_to_5_and_6_x_" and not fig.axes[0].texts  # no order is measured


@pytest.mark.parametrize("stays, count", [((), 0), (("gamma",), 1)])
def test_what_needs_every_joint_has_no_figure_of_needs(stays, count):
    needs = {"bent, free": {"stays": list(stays), "locked": []}}
    result = Result("reduction", rows=[{"scene": "bent, free"}], curves={"swings": {}, "needs": needs})
    assert len(list(reduction.figures(result, ARM))) == count


def test_an_empty_section_has_no_figures_and_none_raises():
    empty = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}}, tables={"cost_in_mujoco": []})
    assert len(list(reduction.figures(Result("reduction", curves={"swings": {}}), ARM))) == 0
    assert len(figures_needs.draw_needs(empty, ARM)) == len(figures_needs.draw_costs(empty)) == 3
