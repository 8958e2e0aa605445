"""Figures of speed draw the numbers of the engine that they name."""

import numpy as np
from matplotlib.colors import to_hex
from speed_rows import NS, absent, known_rows

from compare.experiments import speed
from compare.experiments.speed import advice, evaluations, figures_evaluations
from compare.experiments.speed import figures_panels as beside
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
    text = beside.fewest(result, "bent, free", 1e-3)
    assert "rk4 needs 1024, dopri8 256" in text and beside.fewest(result, "bent, free", 1e-30) == ""


def test_the_figures_draw_the_numbers_of_each_engine():
    result = drawn_result()
    name, fig, caption = draw.draw_times(result, "bent, free")
    ax = fig.axes[0]
    lines = {(to_hex(line.get_color()), tuple(np.round(line.get_ydata(), 9))) for line in ax.get_lines()}
    assert (MUJOCOS, (20.0, 40.0, 80.0, 160.0, 320.0)) in lines and (OURS, (1.0, 2.0, 4.0, 8.0, 16.0)) in lines
    labels = {line.get_label(): to_hex(line.get_color()) for line in ax.get_lines()}
    assert name == "speed_bent_free" and (labels["MuJoCo"], labels["tmt"]) == (MUJOCOS, OURS)
    assert "20 times as long for 1e-02" in caption and "40 times as long for 1e-03 rad" in caption
    for figure in (beside.draw_evaluations(result)[1], beside.draw_energy(result)[1]):
        data = {line.get_label(): line for line in figure.axes[0].get_lines()}
        assert to_hex(data["MuJoCo: RK4"].get_color()) == MUJOCOS and to_hex(data["tmt: rk4"].get_color()) == OURS
        assert np.allclose(data["tmt: dopri8"].get_xdata(), [(2e-2 / 16**k) ** 2 for k in range(5)])
    assert np.allclose(data["MuJoCo: RK4"].get_ydata(), [20.0, 40.0, 80.0, 160.0, 320.0])


def test_what_has_diverged_has_its_methods_own_mark_in_a_column_of_its_own():
    result = drawn_result()
    for row in result.rows:
        row["diverged"] |= row["method"] in ("implicit", "dopri8") and row["dt_s"] > 0.02
    counts = {}
    for row in result.rows:
        if row["diverged"] and row["engine"] in ("tmt", "mujoco"):
            counts.setdefault((row["engine"], row["method"]), []).append(1e3 * row["seconds"])
    _, fig, caption = draw.draw_times(result, "bent, free")
    columns = [line for line in fig.axes[0].get_lines() if line.get_label().endswith("diverged")]
    assert {line.get_label(): sorted(line.get_ydata()) for line in columns} == {
        f"_{draw.written(engine)} {method}, diverged": sorted(times) for (engine, method), times in counts.items()
    }
    for line, ((engine, method), times) in zip(columns, counts.items(), strict=True):
        assert line.get_marker() == draw.marker(method) != "x" and len(set(line.get_xdata())) == 1
        assert f"{draw.written(engine)}'s {method} {len(times)}" in caption
    places = {line.get_xdata()[0] for line in columns}
    assert len(places) == len(columns) > 1
    assert min(places) >= draw.OF_DIVERGED and max(places) < fig.axes[0].get_xlim()[0]


def test_an_engine_that_is_not_there_is_not_drawn():
    with_it, without = drawn_result(absent()), drawn_result()
    for call, same in zip(speed.figures(with_it, ARM), speed.figures(without, ARM), strict=True):
        (name, fig, caption), (_, other, as_before) = call(), same()
        assert caption == as_before, name
        assert len(fig.axes[0].get_lines()) == len(other.axes[0].get_lines())


def test_the_bars_are_nanoseconds_of_each_way():
    _, fig, _ = figures_evaluations.draw_cost(drawn_result(), "arm")
    names = [label.get_text() for label in fig.axes[0].get_yticklabels()]
    bars = {name: (bar.get_width(), to_hex(bar.get_facecolor())) for name, bar in zip(names, fig.axes[0].patches)}
    assert bars["MuJoCo, mj_forward, 1 state"] == (1000.0, MUJOCOS)
    assert bars["compiled, side by side, 1,000 states"] == (10.0, OURS)


def test_an_empty_section_has_no_figures_and_none_raises():
    empty = Result("speed", tables={"evaluations": []})
    assert list(speed.figures(empty, ARM)) == []
    assert [len(call(empty)) for call in (beside.draw_evaluations, beside.draw_energy)] == [3, 3]
    assert len(figures_evaluations.draw_cost(empty, "arm")) == 3
