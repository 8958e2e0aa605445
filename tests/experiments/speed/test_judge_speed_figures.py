"""Figures of speed draw the numbers of the engine that they name."""

import numpy as np
from matplotlib.colors import to_hex
from speed_rows import NS, absent, known_rows

from compare.experiments import speed
from compare.experiments.speed import advice, evaluations, figures_evaluations
from compare.experiments.speed import figures_times as draw
from compare.judge.check import Result
from compare.robots.arm import ARM

MUJOCOS, OURS = "#e69f00", "#0072b2"  # colours


def drawn_result(*more):
    curves = {"floors": {"bent, free": 1e-15}, "regular": "bent, free"}
    result = Result("speed", rows=known_rows(), curves=curves)
    result.tables["what_should_i_use"] = advice.advice(result.rows, ["bent, free"], {"bent, free": 1e-15})
    result.tables["evaluations"] = evaluations.evaluation_rows(NS)
    result.check("bent, free", "the same error as tmt's rk4", 0.0, 1.0, "rad")
    result.check("bent, free", "the same error as tmt's implicit", 2.0, 1.0, "rad")
    result.rows += more
    return result


def test_the_fewest_evaluations_are_those_of_the_coarsest_step_that_is_near_enough():
    result = Result("speed", rows=known_rows())
    assert draw.fewest(result, "bent, free", 1e-3) == "For 1e-03 rad (bent, free) rk4 needs 1024, dopri8 256. "
    assert draw.fewest(result, "bent, free", 1e-30) == ""


def test_the_figures_draw_the_numbers_of_each_engine():
    result = drawn_result()
    name, fig, caption = draw.draw_times(result, "bent, free")
    ax = fig.axes[0]
    lines = {(to_hex(line.get_color()), tuple(np.round(line.get_ydata(), 9))) for line in ax.get_lines()}
    assert (MUJOCOS, (20.0, 40.0, 80.0, 160.0, 320.0)) in lines and (OURS, (1.0, 2.0, 4.0, 8.0, 16.0)) in lines
    labels = {line.get_label(): to_hex(line.get_color()) for line in ax.get_lines()}
    assert name == "speed_bent_free" and (labels["MuJoCo"], labels["tmt"]) == (MUJOCOS, OURS)
    assert caption.startswith("Bent, free: MuJoCo's cheapest setting takes 20 times as long for 1e-02")
    assert "40 times as long for 1e-03 rad" in caption and "1 setting diverges" in caption
    _, fig, caption = draw.draw_evaluations(result)
    assert "Of 2 settings of MuJoCo near the reference 1 have the error" in caption
    assert "For 1e-09 rad (bent, free) rk4 needs" not in caption  # rk4 does not come so near
    for figure in (fig, draw.draw_energy(result)[1]):
        data = {line.get_label(): line for line in figure.axes[0].get_lines()}
        assert to_hex(data["MuJoCo: RK4"].get_color()) == MUJOCOS and to_hex(data["tmt: rk4"].get_color()) == OURS
        assert np.allclose(data["tmt: dopri8"].get_xdata(), [(2e-2 / 16**k) ** 2 for k in range(5)])
    assert np.allclose(data["MuJoCo: RK4"].get_ydata(), [20.0, 40.0, 80.0, 160.0, 320.0])
    assert "MuJoCo RK4 3.1e-07 J" in draw.draw_energy(result)[2] and "time for 5 s" in figure.get_supylabel()


def test_an_engine_that_is_not_there_is_not_drawn():
    with_it, without = drawn_result(absent()), drawn_result()
    for call, same in zip(speed.figures(with_it, ARM), speed.figures(without, ARM), strict=True):
        (name, fig, caption), (_, other, as_before) = call(), same()
        assert caption == as_before, name
        assert len(fig.axes[0].get_lines()) == len(other.axes[0].get_lines())


def test_the_bars_are_nanoseconds_of_each_way():
    _, fig, caption = figures_evaluations.draw_cost(drawn_result(), "arm")
    ax = fig.axes[0]
    names = [label.get_text() for label in ax.get_yticklabels()]
    bars = {name: (bar.get_width(), to_hex(bar.get_facecolor())) for name, bar in zip(names, ax.patches)}
    assert bars["MuJoCo, mj_forward, 1 state"] == (1000.0, MUJOCOS) and bars["lanes, 1,000 states"] == (10.0, OURS)
    assert "of the arm for one state: from 1,000 ns (MuJoCo, mj_forward, 1 state) to 10.0 ns (lanes, 1,000" in caption
    assert caption.endswith(
        "MuJoCo's mj_forward takes 1,000 ns. Blue is tmt, orange MuJoCo, grey are others. The kernel is code made for this one "
        "arm, the lanes are 32 states of it side by side."
    )


def test_an_empty_section_has_no_figures_and_none_raises():
    empty = Result("speed", tables={"evaluations": []})
    assert list(speed.figures(empty, ARM)) == []
    for draws in (draw.draw_evaluations, draw.draw_energy, lambda result: figures_evaluations.draw_cost(result, "arm")):
        assert len(draws(empty)) == 3


def test_each_engine_is_said_to_take_longer_where_it_does():
    def said(**ratios):
        lines = [
            {"scene": "a", "target_rad": target, "ratio": ratio}
            for target, ratio in zip((1e-2, 1e-3, 1e-6), ratios.values())
        ]
        return draw.spoken(Result("speed", tables={"what_should_i_use": lines}), "a")

    assert said(x=20.0, y=1.0) == (
        "MuJoCo's cheapest setting takes 20 times as long for 1e-02 rad, 1.0 times as long for 1e-03 rad as tmt's."
    )
    assert said(x=0.1) == "tmt's cheapest setting takes 10 times as long for 1e-02 rad as MuJoCo's."
    assert said(x=0.5, y=4.0, z=None) == (
        "MuJoCo's cheapest setting takes 4 times as long for 1e-03 rad as tmt's; "
        "tmt's cheapest setting takes 2.0 times as long for 1e-02 rad as MuJoCo's."
    )
    assert said() == "no error asked for is reached by both MuJoCo and tmt."
