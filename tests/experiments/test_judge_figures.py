"""Figures of the single states: whose number stands where, and what their captions say of it."""

import dataclasses

import matplotlib.colors
import numpy as np
import pytest
from crane import crane
from edited import MOON, setup_of

import tmt
from compare.engines.mujoco import load, parse
from compare.experiment import Setup, engines
from compare.experiments import acceleration, gravity, kinematics, mass, parameters
from compare.experiments import figures as draw
from compare.experiments import figures_sketch as sketch
from compare.judge.check import Result
from compare.robots.arm import ARM

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach
MODULES = [parameters, kinematics, mass, gravity, acceleration]


def lines_of(ax, colour):
    return [line for line in ax.lines if matplotlib.colors.same_color(line.get_color(), colour)]


def both(ours, theirs) -> dict:
    return {"tmt": ours, "mujoco": theirs}


def test_the_figure_of_distances_says_who_is_how_far_from_what():
    curves = {"TMT to MuJoCo": [1.0, 5.0], "TMT to exact": [1.5, 2.0], "MuJoCo to exact": [2.5, 3.0]}
    result = Result("mass", curves={"random states": {"Mbar": {name: np.array(v) for name, v in curves.items()}}})
    name, fig, caption = draw.draw_distances(result, "random states")
    assert name == "mass_distances" and "at most 5 eps apart (Mbar)" in caption
    assert "the first 2 of the states, TMT is at most 2 eps off and MuJoCo at most 3." in caption
    larger = {name: np.array([7.0, 9.0]) for name in curves}
    result.curves["random states"]["Abar"] = larger
    said = draw.draw_distances(result, "random states")[2]
    assert "at most 9 eps apart (Abar)" in said and "TMT is at most 9 eps off and MuJoCo at most 9." in said
    for label, values in curves.items():
        (line,) = (line for line in fig.axes[0].lines if line.get_label() == label)
        assert line.get_xdata().tolist() == values
    assert lines_of(fig.axes[0], draw.BLUE)[0].get_label() == "TMT to exact"


def test_the_figure_of_holding_torques_says_whose_they_are_and_where_none_is_needed():
    ours, theirs = np.array([1.0, 2.0, 3.0]), np.array([-1.0, -2.0, -3.0])
    postures = {"zero": both(ours, theirs), "hanging": both(0 * ours, 0 * ours)}
    _, fig, caption = draw.draw_holding_torques(Result("gravity", curves={"postures": postures}), ARM)
    assert [bar.get_height() for bar in fig.axes[0].patches][::2] == ours.tolist()
    assert [line.get_ydata()[0] for line in fig.axes[0].lines][:3] == theirs.tolist()
    assert [text.get_text() for text in fig.legends[0].get_texts()] == ["α, TMT", "β, TMT", "γ, TMT", "MuJoCo"]
    assert len({bar.get_hatch() for bar in fig.axes[0].patches}) == 3
    assert "at most 6.0e+00 N m apart. Both need none, but for rounding, at: hanging." in caption
    one = {"zero": both(0 * ours, ours), "bent": both(ours, ours + 0.99 * 64 * EPS * WEIGHT)}
    assert draw.needless(one, ARM) == (
        "TMT needs none, but for rounding, at: zero. MuJoCo needs some at every posture."
    )
    for share, said in ((0.99, "bent"), (1.01, None)):
        rest = np.full(3, share * 64 * EPS * WEIGHT)
        assert draw.needless({"bent": both(rest, rest)}, ARM) == (
            f"Both need none, but for rounding, at: {said}." if said else "Both need some at every posture."
        )


def test_the_map_of_the_condition_number_says_whose_maximum_is_where():
    result = Result("mass")
    result.curves["condition"] = mass.condition_grid(ARM, tmt.mass_matrix, 30.0)
    ours, theirs = np.radians([-90.0, 90.0]), np.radians([45.0, -60.0])
    result.curves["worst"] = both((126.8, ours, 126.8), (99.0, theirs, 50.0))
    _, fig, caption = draw.draw_condition(result, ARM)
    assert caption.startswith("Condition number of TMT's Mbar over β and γ, α = 0.")
    assert "TMT's is 126.80 at β = -90.0°, γ = 90.0°, and the same at -β" in caption
    assert "MuJoCo's is 99.00 at β = 45.0°, γ = -60.0°, and 50.00 at -β" in caption
    marks = {line.get_label(): line for line in fig.axes[0].lines}
    for label, x, y in (("maximum, TMT", [-90.0, 90.0], [90.0, 90.0]), ("maximum, MuJoCo", [45.0], [-60.0])):
        assert marks[label].get_xdata() == pytest.approx(x) and marks[label].get_ydata() == pytest.approx(y)
    assert [text.get_text() for text in fig.legends[0].get_texts()] == list(marks)


def test_the_grid_of_condition_numbers_has_the_first_joint_along_its_rows():
    first, second, values = mass.condition_grid(ARM, tmt.mass_matrix, 90.0)
    assert np.degrees(first).tolist() == np.degrees(second).tolist() == [-180.0, -90.0, 0.0, 90.0, 180.0]
    q = np.array([0.0, first[1], second[3]])
    assert values[3, 1] == pytest.approx(np.linalg.cond(tmt.mass_matrix(q)), rel=1e-12)
    assert values[1, 3] < 0.5 * values[3, 1]


# the sketch


def test_the_sketch_says_where_each_hinge_is():
    assert sketch.hinges(ARM) == ["α about y at the shoulder", "β about x at the shoulder", "γ about y at the elbow"]
    other = dataclasses.replace(tmt.ARM, axis=((0.0, 1.0, 0.0), (1.0, 0.0, 0.0), (0.0, 0.6, 0.8)))
    assert sketch.hinges(dataclasses.replace(ARM, tree=other))[2] == "γ about (0, 0.6, 0.8) at the elbow"
    moved = dataclasses.replace(tmt.ARM, offset=((0.0, 0.0, 0.0), (0.0, 0.0, 0.0), (0.0, 0.0, -0.2)))
    assert sketch.hinges(dataclasses.replace(ARM, tree=moved))[2] == "γ about y at (0, 0, -0.2) m"


def test_the_sketch_of_the_arm_names_its_landmarks_and_shows_both_postures():
    name, fig, caption = sketch.draw_sketch(ARM)
    assert name == "arm" and caption.startswith("The arm and its hinges, drawn from")
    assert caption.endswith("Dots: centres of mass of the upper arm (1) and the forearm (2).")
    assert [ax.get_title() for ax in fig.axes] == ["zero: (0, 0, 0)°", "ball catch: (-70, 70, -30)°"]
    for ax in fig.axes:
        texts = [text.get_text() for text in ax.texts]
        assert sorted(texts) == sorted(["α", "β", "γ", "1", "2", "shoulder", "elbow", "hand"])
        assert ax.get_xlabel() == "x north, m"


def test_the_sketch_of_a_robot_without_landmarks_follows_its_tree(tmp_path):
    robot = crane(tmp_path)
    name, fig, caption = sketch.draw_sketch(robot)
    assert name == "crane" and [ax.get_title().split(":")[0] for ax in fig.axes] == ["down", "raised"]
    assert (
        "swing about x at the origin, then lift about y at the origin, then bend about y at (0, 0, -0.4) m" in caption
    )
    assert caption.endswith(
        "centres of mass of the foot (1), the boom (2), the jib (3), the hook (4) and the weight (5)."
    )
    lines = sketch.chains(robot, np.zeros(4))
    ends = [[0, 0, 0], [0, 0, -0.4], [0, 0, 0.3], [0, 0.01, -0.55], [0.03, 0, -0.7], [0, 0.05, 0.22]]
    assert np.allclose([line[1] for line in lines], ends, rtol=0.0, atol=1e-15)


def test_labels_stand_away_from_what_meets_in_a_point():
    chain = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, -1.0], [0.0, 0.0, -2.0]])
    arrow = np.array([[chain[1], sketch.RIGHTWARD]])
    first, middle, last = sketch.label_directions(chain, arrow)
    assert first[1] > 0.9 and last[1] < -0.9  # beyond the ends of the chain
    assert middle[0] == pytest.approx(-1.0)  # on the other side of the arrow
    assert np.allclose(np.linalg.norm([first, middle, last], axis=1), 1.0)


# every figure


@pytest.mark.parametrize("module", MODULES)
def test_every_figure_of_the_single_states_is_drawn(module):
    setup = setup_of(MOON)
    result = module.rows(setup)
    for figure in module.figures(result, setup.robot):
        name, drawn, caption = figure()
        assert name.startswith((result.experiment, "arm")) and drawn.axes and caption.endswith(".")


@pytest.mark.parametrize("module", MODULES)
def test_every_figure_of_a_robot_of_four_hinges_is_drawn(module, tmp_path):
    robot = crane(tmp_path)
    result = module.rows(Setup.small(robot, engines(load(robot.mjcf, robot.tree))))
    assert [str(check) for check in result.checks if not check.passed] == []
    for figure in module.figures(result, robot):
        name, drawn, caption = figure()
        drawn.savefig(tmp_path / name)
        assert name.startswith((result.experiment, "crane")) and caption.endswith(".") and "arm" not in caption


def test_what_is_kept_for_the_figures_is_whose_it_says():
    kept = gravity.rows(setup_of(MOON)).curves["postures"]["zero"]
    theirs = parse(MOON, tmt.ARM).of(ARM.case()).gravity_balance(np.zeros(3))
    assert np.array_equal(kept["tmt"], tmt.gravity_balance(np.zeros(3))) and np.array_equal(kept["mujoco"], theirs)
