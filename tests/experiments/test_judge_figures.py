"""Figures of the single states: whose number stands where, in the drawing and in the caption."""

import re

import matplotlib.colors
import numpy as np
import pytest
from crane import crane
from edited import MOON, setup_of
from models import PATHS

import tmt
from compare.engines.mujoco import parse, read
from compare.experiments import figures as draw
from compare.experiments import figures_sketch as sketch
from compare.experiments import gravity, mass
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.robots.file import robot_of

EPS = 2.0**-52
WEIGHT = 9.81 * (1.9 * 0.15 + 1.5 * 0.45)  # N m: sum of m g reach


def both(ours, theirs) -> dict:
    return {"tmt": ours, "mujoco": theirs}


def test_the_figure_of_distances_says_who_is_how_far_from_what():
    curves = {"TMT to MuJoCo": [1.0, 5.0], "TMT to exact": [1.5, 2.0], "MuJoCo to exact": [2.5, 3.0]}
    of_bias = {name: np.array([0.5, 0.7]) for name in curves}
    of_mass = {name: np.array(values) for name, values in curves.items()}
    result = Result("mass", curves={"random states": {"Mbar": of_mass, "bias": of_bias}})
    name, fig, caption = draw.draw_distances(result, "random states")
    assert name == "mass_distances" and re.search(r"5 eps apart \(Mbar\).* 2 .*TMT\D* 2 eps .*MuJoCo\D* 3\b", caption)
    drawn = {line.get_label(): line for line in fig.axes[0].lines}
    assert all(drawn[label].get_xdata().tolist() == values for label, values in curves.items())
    assert matplotlib.colors.same_color(drawn["TMT to exact"].get_color(), draw.BLUE)
    without = Result("mass", curves={"some": {"Mbar": {"TMT to MuJoCo": of_mass["TMT to MuJoCo"]}}})
    _, fig, _ = draw.draw_distances(without, "some")
    assert {line.get_label() for line in fig.axes[0].lines} == {"TMT to MuJoCo", "tolerance, 64 eps"}


def test_the_figure_of_holding_torques_shows_the_six_joints_that_need_most_and_whose_they_are():
    one, torque = robot_of(read(PATHS["quadruped"]), "a file"), np.zeros(18)
    torque[[2, 5, 7, 9, 12, 15, 16]] = [300.0, 1.0, 2.0, 3.0, 4.0, 5.0, 0.5]
    result = Result("gravity", curves={"postures": {name: both(torque, -torque) for name in one.poses}})
    _, fig, caption = draw.draw_holding_torques(result, one)
    shown, names = (2, 5, 7, 9, 12, 15), one.coordinates.speeds
    assert [line.get_ydata()[0] for line in fig.axes[0].lines][:6] == [-torque[k] for k in shown]
    assert {bar.get_height() for bar in fig.axes[0].patches} == {torque[k] for k in shown}
    labels = [text.get_text() for text in fig.legends[0].get_texts()]
    assert labels == [*(f"{names[k]}, TMT" for k in shown), "MuJoCo"] and "6 of 18" in caption and "6.0e+02" in caption


@pytest.mark.parametrize("share, needs_none", [(0.99, True), (1.01, False)])
def test_a_posture_needs_no_torque_within_64_eps_of_its_scale(share, needs_none):
    rest, none = np.full(3, share * 64 * EPS * WEIGHT), np.zeros(3)
    apart = draw.needless({"zero": both(none, rest + 1.0), "bent": both(rest + 1.0, rest)}, ARM)
    assert (apart.index("TMT") < apart.index("zero") < apart.index("MuJoCo")) and ("bent" in apart) is needs_none
    large = robot_of(read(PATHS["gripper"]), "a file")  # of a file each joint has its own scale
    torque, name = np.zeros(4), next(iter(large.poses))
    torque[3] = share * 64 * EPS * gravity.scales(large.tree, True, large.poses[name][None]).holding[0, 3]
    assert (name in draw.needless({name: both(torque, torque)}, large)) is needs_none


def test_what_is_kept_for_the_figure_of_holding_torques_is_whose_it_says():
    kept = gravity.rows(setup_of(MOON)).curves["postures"]["zero"]
    theirs = parse(MOON, tmt.ARM).of(ARM.case()).gravity_balance(np.zeros(3))
    assert np.array_equal(kept["tmt"], tmt.gravity_balance(np.zeros(3))) and np.array_equal(kept["mujoco"], theirs)


def test_the_map_of_the_condition_number_says_whose_maximum_is_where():
    result = Result("mass")
    result.curves["condition"] = mass.condition_grid(ARM, tmt.mass_matrix, 30.0)
    ours, theirs = np.radians([-90.0, 90.0]), np.radians([45.0, -60.0])
    result.curves["worst"] = both((126.8, ours, 126.8), (99.0, theirs, 50.0))
    _, fig, caption = draw.draw_condition(result, ARM)
    assert re.search(r"TMT\D*126.80\D*-90.0\D*90.0\D*MuJoCo\D*99.00\D*45.0\D*-60.0\D*50.00", caption)
    marks = {line.get_label(): line for line in fig.axes[0].lines}
    for label, x, y in (("maximum, TMT", [-90.0, 90.0], [90.0, 90.0]), ("maximum, MuJoCo", [45.0], [-60.0])):
        assert marks[label].get_xdata() == pytest.approx(x) and marks[label].get_ydata() == pytest.approx(y)


def test_the_sketch_follows_the_tree(tmp_path):
    robot = crane(tmp_path)
    ends = [[0, 0, 0], [0, 0, -0.4], [0, 0, 0.3], [0, 0.01, -0.55], [0.03, 0, -0.7], [0, 0.05, 0.22]]
    assert np.allclose([line[1] for line in sketch.chains(robot, np.zeros(4))], ends, rtol=0.0, atol=1e-15)
    assert [ax.get_title().split(":")[0] for ax in sketch.draw_sketch(robot)[1].axes] == ["down", "raised"]
