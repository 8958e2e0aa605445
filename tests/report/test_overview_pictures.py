"""The pictures of the first screen: what is marked in them."""

from types import SimpleNamespace

from made_overviews import RUN, drawn, limits, timed
from matplotlib.colors import to_hex, to_rgba

from compare.judge.check import Result
from compare.report import engines_apart, figures_overview
from compare.report.style import BLUE, GREY, ORANGE, RED


def marks(ax):
    """What is marked in a panel: (mark, colour, x) of every point."""
    found = []
    for line in ax.get_lines():
        if line.get_marker() not in (None, "None", ""):
            colour = to_hex(line.get_markerfacecolor()) if line.get_markerfacecolor() != "none" else "none"
            found += [(line.get_marker(), colour, float(x)) for x in line.get_xdata()]
    return found


def straight(ax):
    """Where upright lines stand, with their colours."""
    found = [
        line for line in ax.get_lines() if line.get_linestyle() != "None" and line.get_marker() in (None, "None", "")
    ]
    return [(to_hex(line.get_color()), float(line.get_xdata()[0])) for line in found if len(set(line.get_xdata())) == 1]


def hexes(*colours):
    return [to_hex(colour) for colour in colours]


def test_the_picture_of_agreement_shows_whose_distance_is_whose_beside_the_tolerance():
    blue, orange, red, black = hexes(BLUE, ORANGE, RED, "black")
    row = {
        "quantity": "Mbar",
        "difference_eps": 2.0,
        "tmt_from_exact_eps": 1.0,
        "mujoco_from_exact_eps": 4.0,
        "passed": True,
    }
    for apart, passed, text in ((2.0, True, "2"), (5e4, False, "5e+04")):
        rows = [row | {"difference_eps": apart, "passed": passed}]
        ((_, figure, _),) = drawn("mass", Result("mass", rows=rows))
        ax = figure.axes[0]
        assert sorted(marks(ax)) == sorted([("D", black, apart), ("o", blue, 1.0), ("s", orange, 4.0)])
        assert {line.get_label() for line in ax.get_lines() if line.get_marker() == "o"} == {"TMT to exact"}
        assert {line.get_label() for line in ax.get_lines() if line.get_marker() == "s"} == {"MuJoCo to exact"}
        assert straight(ax) == [(red, 64.0)] and ax.get_xlim()[1] > max(apart, 64.0)
        assert text in [one.get_text() for one in ax.texts] and "tolerance 64 eps" in [
            one.get_text() for one in ax.texts
        ]


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
    assert marks(of_shares) == [("D", black, 0.2)] and straight(of_shares) == [(red, 1.0)]
    assert {("o", "#ffffff", 1.0), ("s", orange, 2.0)} <= set(marks(of_times))
    bars = [(bar.get_width(), bar.get_alpha() or to_rgba(bar.get_facecolor())[3]) for bar in of_times.patches][:3]
    assert bars == [(5.0, 0.2), (3.0, 0.4), (0.5, 1.0)]  # the scene, judged at some step, judged at every step


def test_a_scene_that_fails_is_in_the_picture_however_many_there_are():
    rows = [RUN | {"scene": f"s{k}", "difference_over_band": 0.1 if k < 11 else 1e4} for k in range(12)]
    result = Result("trajectory", rows=rows)
    result.check("s11, RK4", "one step", 2.0, 1.0, "rad")
    _, figure, _ = figures_overview.picture_of_scenes({"trajectory": result}, SimpleNamespace(cases=[]))
    left = figure.axes[0]
    assert [label.get_text() for label in left.get_yticklabels()] == [f"s{k}" for k in range(8)] + ["✗ s11"]
    assert marks(left)[-1] == ("X", *hexes(RED), figures_overview.MOST_SHARE)
    assert left.get_xlim()[1] == figures_overview.MOST_SHARE


def test_the_picture_of_times_rings_the_cheapest_within_the_error_asked_for():
    rows = [timed("tmt", "rk4", 1e-3, 1e-3), timed("tmt", "dopri8", 4e-3, 1e-7), timed("mujoco", "RK4", 1e-2, 1e-8)]
    result = Result("speed", rows=rows, curves={"regular": "s", "unit": "rad"})
    ((_, figure, _),) = drawn("speed", result)
    (ax,) = figure.axes
    assert straight(ax) == [(to_hex(GREY), 1e-6)]
    rings = [line for line in ax.get_lines() if line.get_markerfacecolor() == "none"]
    found = [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in rings]
    assert found == [(1e-7, 4.0), (1e-8, 10.0)]
    assert {text.get_text() for text in ax.texts} == {"dopri8 4 ms", "RK4 10 ms"}
    curves = {line.get_label(): to_hex(line.get_color()) for line in ax.get_lines() if line not in rings}
    assert (curves["tmt"], curves["MuJoCo"]) == (to_hex(BLUE), to_hex(ORANGE))


def test_the_picture_of_limits_shows_what_is_predicted_and_what_is_observed():
    result = limits(0.125)
    result.rows.append(result.rows[0] | {"engine": "mujoco", "method": "RK4", "observed_dt_s": 0.5})
    result.curves["schemes"]["mujoco", "RK4"] = "rk4"
    blue, orange, red = hexes(BLUE, ORANGE, RED)
    for failing, of_mujoco in ((False, ("s", orange, 0.5)), (True, ("X", red, 0.5))):
        if failing:
            result.check("s, MuJoCo RK4, damping 0.5", "limit, observed / predicted - 1", 4.0, 1.0, "")
        ((_, figure, _),) = drawn("stability", result)
        (ax,) = figure.axes
        assert marks(ax) == [("o", blue, 0.125), of_mujoco]
        assert [float(lines.get_segments()[0][0][0]) for lines in ax.collections] == [0.1, 0.1]
        assert [label.get_text() for label in ax.get_yticklabels()] == ["✗ RK4" if failing else "RK4"]
