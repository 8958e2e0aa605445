"""What the first screen draws and says of results: which is whose, what is judged, what is marked, and when it is drawn."""

from types import SimpleNamespace

import pytest
from matplotlib.colors import to_hex

from compare.experiments import EXPERIMENTS
from compare.judge.check import Result
from compare.report import engines_apart, figures_overview, methods_compared, overview
from compare.report.engines_apart import Agreement, SceneRun
from compare.report.methods_compared import Cheapest, Curve, Limit
from compare.report.one_number import one_number
from compare.report.style import BLUE, GREY, ORANGE, RED
from compare.report.verdict import Section
from compare.robots.arm import ARM

OF_BIAS = {"quantity": "Mbar", "difference_eps": 2.0, "tmt_from_exact_eps": 1.0, "mujoco_from_exact_eps": 4.0,
           "passed": True}  # fmt: skip
RUN = {"scene": "a", "level": "open loop", "difference_over_band": 0.2, "judged_until_s": 3.0, "diverged_at_s": None}
AS_PREDICTED = "limit, observed / predicted - 1"


def timed(engine, method, seconds, error, **more):
    return {"scene": "s", "engine": engine, "method": method, "seconds": seconds, "worst_error_rad": error, "why_not": None,
            "diverged": False} | more  # fmt: skip


def limits(*observed):
    row = {"scene": "s", "engine": "tmt", "method": "rk4", "damping": 0.5, "limit": "finite", "predicted_dt_s": 0.1}
    rows = [row | {"observed_dt_s": value} for value in observed] + [row | {"scene": "saddle", "observed_dt_s": 0.1}]
    return Result("stability", rows=rows, curves={"looked at": {"centres": ("s",)}, "schemes": {("tmt", "rk4"): "rk4"}})


def drawn(experiment, result):
    return [call() for call in figures_overview.pictures(experiment, {experiment: result}, ARM)]


def marks(ax):
    """What is marked in a panel: (mark, colour, x) of every point."""
    found = []
    for line in ax.get_lines():
        if line.get_marker() not in (None, "None", ""):
            colour = to_hex(line.get_markerfacecolor()) if line.get_markerfacecolor() != "none" else "none"
            found += [(line.get_marker(), colour, float(x)) for x in line.get_xdata()]
    return found


def upright(ax):
    """Where upright lines stand, with their colours."""
    lines = [
        line for line in ax.get_lines() if line.get_linestyle() != "None" and line.get_marker() in (None, "None", "")
    ]
    lines = [line for line in lines if len(set(line.get_xdata())) == 1]
    return [(to_hex(line.get_color()), float(line.get_xdata()[0])) for line in lines]


def hexes(*colours):
    return [to_hex(colour) for colour in colours]


@pytest.mark.parametrize("names, expected", [
    (list(EXPERIMENTS), {"acceleration": ["mass", "acceleration"], "trajectory": ["trajectory"], "speed": ["speed"],
                         "stability": ["stability"]}),
    (["mass"], {"mass": ["mass"]}),
    (["parameters", "reduction"], {}),
])  # fmt: skip
def test_every_picture_is_drawn_once_with_the_last_of_its_experiments_that_run(names, expected):
    done, found = [], {}
    for name in names:
        done.append(Section(name, "", "", "", Result(name, rows=[{"a": 1}], label="yours")))
        if needs := overview.results_needed(name, names, done):
            found[name] = list(needs)
            assert len(overview.drawn_with(name, needs)) == 1
    assert found == expected


@pytest.mark.parametrize("experiment, name", [
    ("mass", "agreement"), pytest.param("trajectory", "scenes", marks=pytest.mark.slow),
    pytest.param("stability", "limits", marks=pytest.mark.slow),
])  # fmt: skip
def test_pictures_are_drawn_of_a_small_run(small, experiment, name):
    ((file, figure, caption),) = drawn(experiment, small(experiment))
    assert file == f"{overview.BEGINNING}{name}" and caption and "nan" not in caption
    assert figure.get_size_inches()[0] == figures_overview.SIZE[0]


def test_the_agreement_is_the_largest_of_all_rows_of_a_quantity():
    rows = [
        OF_BIAS | {"mujoco_from_exact_eps": None},
        OF_BIAS | {"difference_eps": 7.0, "tmt_from_exact_eps": None, "mujoco_from_exact_eps": None},
        OF_BIAS | {"quantity": "other", "difference_eps": 9.0},
    ]
    (found,) = engines_apart.agreements({"mass": Result("mass", rows=rows)})
    assert found[1:] == (7.0, 1.0, None, True)
    rows.append(OF_BIAS | {"difference_eps": float("nan"), "passed": False})
    (found,) = engines_apart.agreements({"mass": Result("mass", rows=rows)})
    assert found.apart == float("inf") and not found.passed
    good, bad = Agreement("bias h", 4.8, 1.0, 5.0, True), Agreement("accelerations", 64.1, 1.0, 5.0, False)
    said = engines_apart.agreement_in_words([good], "TMT")
    assert "bias h" in said and "4.8 eps" in said and " 5 eps" in said
    said = engines_apart.agreement_in_words([good, bad], "yours")
    assert "accelerations" in said and "64 eps" in said and "bias h" not in said


def test_the_picture_of_agreement_shows_whose_distance_is_whose_beside_the_tolerance():
    blue, orange, red, black = hexes(BLUE, ORANGE, RED, "black")
    for apart, passed in ((2.0, True), (5e4, False)):
        ((_, figure, _),) = drawn("mass", Result("mass", rows=[OF_BIAS | {"difference_eps": apart, "passed": passed}]))
        ax = figure.axes[0]
        assert sorted(marks(ax)) == sorted([("D", black, apart), ("o", blue, 1.0), ("s", orange, 4.0)])
        labels = {line.get_marker(): line.get_label() for line in ax.get_lines()}
        assert "TMT" in labels["o"] and "MuJoCo" in labels["s"]
        assert upright(ax) == [(red, 64.0)] and ax.get_xlim()[1] > max(apart, 64.0)
        assert [label.get_text().startswith("✗ ") for label in ax.get_yticklabels()] == [not passed]


def test_a_scene_at_a_glance():
    rows = [RUN, RUN | {"judged_until_s": 0.5, "diverged_at_s": 0.6}, RUN | {"level": "one step", "difference_over_band": 0.7},
            RUN | {"scene": "a, more", "difference_over_band": None}]  # fmt: skip
    result = Result("trajectory", rows=rows)
    result.check("a, more, RK4", "one step", 2.0, 1.0, "rad")
    result.check("a, RK4", "one step", 1.0, 1.0, "rad")
    robot = SimpleNamespace(cases=[SimpleNamespace(name="a", duration=5.0, is_held=False)])
    found = engines_apart.scene_runs(result, robot)
    assert found == [
        SceneRun("a", 0.7, (0.5, 3.0), 5.0, 0.6, None, True),
        SceneRun("a, more", None, (3.0, 3.0), 3.0, None, None, False),
    ]
    assert "a, more" in engines_apart.scenes_in_words(found, "yours")
    good = engines_apart.scenes_in_words(found[:1], "TMT")
    left = engines_apart.scenes_in_words([found[0]._replace(left=(None, 4.7))], "TMT")
    assert "70 %" in good and "0.5 to 3 s" in good and "4.7" in left and "4.7" not in good


def test_the_picture_of_scenes_shows_shares_times_and_who_leaves_when():
    orange, red, black = hexes(ORANGE, RED, "black")
    rows = [RUN | {"scene": "held", "judged_until_s": until} for until in (0.5, 3.0)]
    robot = SimpleNamespace(cases=[SimpleNamespace(name="held", duration=5.0, is_held=True, steps=64)])
    left = {"tmt": 1.0, "mujoco": 2.0}
    runs = {("held", "rk4", steps): {"t": [0.0, 5.0], "left": left if steps == 64 else {}} for steps in (64, 128)}
    result = Result("trajectory", rows=rows, curves={"runs": runs})
    assert [one.left for one in engines_apart.scene_runs(result, robot)] == [(1.0, 2.0)]
    _, figure, _ = figures_overview.picture_of_scenes({"trajectory": result}, robot)
    of_shares, of_times = figure.axes
    assert marks(of_shares) == [("D", black, 0.2)] and upright(of_shares) == [(red, 1.0)]
    assert {("o", "#ffffff", 1.0), ("s", orange, 2.0)} <= set(marks(of_times))
    bars = [bar.get_width() for bar in of_times.patches]
    assert bars[:3] == [5.0, 3.0, 0.5]  # the scene, judged at some step, judged at every step


def test_a_curve_has_what_nothing_of_the_same_engine_beats():
    rows = [
        timed("tmt", "rk4", 1e-3, 1e-3), timed("tmt", "rk4", 2e-3, 1e-2), timed("tmt", "dopri8", 4e-3, 1e-6),
        timed("tmt", "dopri8", 5e-3, 1e-9), timed("mujoco", "RK4", 1e-2, 1.1e-6), timed("tmt", "rk4", 1e-9, None, diverged=True),
        timed("tmt", "rk4", 1e-9, 2.0), timed("heyoka", "Taylor", None, None, why_not="absent"),
    ]  # fmt: skip
    result = Result("speed", rows=rows, curves={"regular": "s", "unit": "rad"})
    assert methods_compared.best_curves(result) == [
        Curve("tmt", [1e-3, 1e-6, 1e-9], [1.0, 4.0, 5.0], Cheapest("dopri8", 4.0)),
        Curve("mujoco", [1.1e-6], [10.0], None),
    ]
    assert "dopri8, 4 ms" in methods_compared.times_in_words(result)
    assert "RK4" not in methods_compared.times_in_words(result)  # which is just outside of the error asked for
    rows.append(timed("mujoco", "RK4", 3e-3, 1e-6, dt_s=0.00244140625, steps=2048.0))
    rows.append(timed("scipy", "DOP853", 4.5e-3, 1e-7))  # which is not the cheapest beside MuJoCo
    for said in (methods_compared.times_in_words(result), one_number(Section("speed", "", "", "", result))):
        assert (
            "MuJoCo RK4, 2048 steps (dt 0.0024 s), 3 ms" in said and "tmt dopri8, 4 ms" in said and "1e-06 rad" in said
        )


def test_the_picture_of_times_rings_the_cheapest_within_the_error_asked_for():
    rows = [timed("tmt", "rk4", 1e-3, 1e-3), timed("tmt", "dopri8", 4e-3, 1e-7), timed("mujoco", "RK4", 1e-2, 1e-8)]
    ((_, figure, _),) = drawn("speed", Result("speed", rows=rows, curves={"regular": "s", "unit": "rad"}))
    (ax,) = figure.axes
    assert upright(ax) == [(to_hex(GREY), 1e-6)]
    rings = [line for line in ax.get_lines() if line.get_markerfacecolor() == "none"]
    assert [(line.get_xdata()[0], line.get_ydata()[0]) for line in rings] == [(1e-7, 4.0), (1e-8, 10.0)]
    assert {text.get_text() for text in ax.texts} == {"dopri8 4 ms", "RK4 10 ms"}
    curves = {line.get_label(): to_hex(line.get_color()) for line in ax.get_lines() if line not in rings}
    assert (curves["tmt"], curves["MuJoCo"]) == (to_hex(BLUE), to_hex(ORANGE))


def test_limits_are_counted_where_they_are_predicted_and_observed():
    result = limits(0.1001, None)
    found = methods_compared.limits_found(result)
    assert found[0] == Limit("rk4", "tmt", "s", 0.5, "finite", 0.1, 0.1001, True) and len(found) == 2
    said = [
        methods_compared.limits_at_a_glance(methods_compared.limits_found(of))
        for of in (result, limits(0.1001, 0.0995))
    ]
    assert said[0].startswith("1 ") and " 0.1 %" in said[0] and said[1].startswith("2 ") and " 0.5 %" in said[1]
    result.check("s, TMT rk4, damping 0.5", "growth in 8 steps", 2.0, 1.0, "")  # of something else
    assert all(one.passed for one in methods_compared.limits_found(result))
    result.check("s, TMT rk4, damping 0.5", AS_PREDICTED, 2.0, 1.0, "")
    found = methods_compared.limits_found(result)
    assert not any(one.passed for one in found) and "2 of 2" in methods_compared.limits_at_a_glance(found)


def test_the_picture_of_limits_shows_what_is_predicted_and_what_is_observed():
    result = limits(0.125)
    result.rows.append(result.rows[0] | {"engine": "mujoco", "method": "RK4", "observed_dt_s": 0.5})
    result.curves["schemes"]["mujoco", "RK4"] = "rk4"
    blue, orange, red = hexes(BLUE, ORANGE, RED)
    for failing, of_mujoco in ((False, ("s", orange, 0.5)), (True, ("X", red, 0.5))):
        if failing:
            result.check("s, MuJoCo RK4, damping 0.5", AS_PREDICTED, 4.0, 1.0, "")
        ((_, figure, _),) = drawn("stability", result)
        (ax,) = figure.axes
        assert marks(ax) == [("o", blue, 0.125), of_mujoco]
        assert [float(lines.get_segments()[0][0][0]) for lines in ax.collections] == [0.1, 0.1]
        assert [label.get_text() for label in ax.get_yticklabels()] == ["✗ RK4" if failing else "RK4"]
