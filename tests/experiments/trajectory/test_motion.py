"""The motion of the runs: its table, the pictures of it and the GIF."""

import dataclasses

import numpy as np
import pytest
from models import PATHS
from PIL import Image
from trajectory_curves import CASES

from compare.engines import GRID
from compare.engines.mujoco import reading
from compare.experiments.trajectory import figures_motion_gif as gif
from compare.experiments.trajectory import motion
from compare.experiments.trajectory.runs import follow
from compare.judge.check import Result
from compare.robots.arm import ARM, landmarks
from compare.robots.coordinates import Coordinates
from compare.robots.file import robot_of
from compare.robots.stick import as_seen, stick_figure

CATCH = CASES["ball catch, free"]  # in which a method of order 1 diverges
BLUE, ORANGE = (0, 114, 178), (230, 159, 0)
METHOD = {"tmt": "rk4", "mujoco": "RK4"}


@pytest.fixture(scope="module")
def runs(engines):
    """Of a scene by its own steps and finer ones."""
    return follow(CATCH, engines, (1, 4)).curves


def tabulated(curves, robot=ARM) -> Result:
    result = Result("trajectory", curves={"runs": curves})
    motion.tabulate_motion(result, robot)
    return result


def test_every_run_of_a_scene_has_65_equal_times_its_own_values_and_none_after_it_has_diverged(runs):
    result, columns = tabulated(runs), motion.motion_columns(ARM.coordinates)
    assert result.filed == ("motion",) and result.notes == []
    for scheme, integrator in (("rk4", "RK4"), ("semi_implicit_euler", "Euler")):
        curve = runs[CATCH.name, scheme, 64]
        for of in (("tmt", scheme), ("mujoco", integrator)):
            run = [row for row in result.tables["motion"] if (row["engine"], row["integrator"]) == of]
            about = [(row["scene"], row["dt_s"], row["t_s"]) for row in run]
            assert about == [(CATCH.name, 5 / 64, k * 5 / 64) for k in range(GRID + 1)]  # by the scene's own step
            alive = curve["t"] < (np.inf if curve["ended"][of[0]] is None else curve["ended"][of[0]])
            assert alive.all() == (scheme == "rk4") and alive[0]
            expected = np.where(alive[:, None], np.concatenate(curve[of[0]], axis=1), np.nan)
            found = np.array([[row[column] for column in columns] for row in run], dtype=float)
            np.testing.assert_array_equal(found, expected)


def test_a_run_ends_in_the_table_at_the_very_state_at_which_it_has_diverged():
    t, ones = np.linspace(0.0, 5.0, 2 * GRID + 1), np.ones((2 * GRID + 1, 3))
    for ended, alive in ((None, 65), (5.0, 64), (t[4], 2), (t[5], 3)):
        _, values = motion.at_equal_times(CATCH, t, ones, ones, ended)
        assert np.isfinite(values).all(axis=1).sum() == alive and np.isfinite(values[:alive]).all()
    ones[8, 1] = np.nan  # that is no number though nobody says that it has diverged
    _, values = motion.at_equal_times(CATCH, t, ones, ones, None)
    assert np.isnan(values[4]).all() and np.isfinite(values[5]).all()


def test_a_scene_whose_steps_do_not_fall_on_the_times_shows_a_finer_run_or_none(engines):
    odd = CASES["elbow swing"].changed(name="odd", dt=5.0 / 12)
    robot, runs = dataclasses.replace(ARM, scenes=(odd.scene,)), follow(odd, engines, (1, 16)).curves
    result = tabulated(runs, robot)
    assert {row["dt_s"] for row in result.tables["motion"]} == {5.0 / 192} and result.notes == []
    assert {(row["q_beta_rad"], row["qd_beta_rad_per_s"]) for row in result.tables["motion"]} == {(odd.posture[1], 0.0)}
    result = tabulated({key: run for key, run in runs.items() if key[2] == 12}, robot)
    assert result.tables["motion"] == [] and result.notes[0].values["scenes"] == ["odd"]


def test_columns_of_every_kind_of_joint_and_of_names_that_differ_in_signs_alone():
    names = ("root x", "root y", "root z", "root turn", "my knee")
    of = Coordinates(names, ("slide", "slide", "slide", "ball", "hinge"))
    assert motion.motion_columns(of) == [
        "q_root_x_m", "q_root_y_m", "q_root_z_m", "q_root_w", "q_root_x", "q_root_y", "q_root_z", "q_my_knee_rad",
        "qd_root_x_m_per_s", "qd_root_y_m_per_s", "qd_root_z_m_per_s",
        "qd_root_x_rad_per_s", "qd_root_y_rad_per_s", "qd_root_z_rad_per_s", "qd_my_knee_rad_per_s",
    ]  # fmt: skip
    assert len(set(motion.motion_columns(Coordinates(("a-b", "a b", "a_b", "x turn"))))) == 8


def seen(path) -> np.ndarray:
    return as_seen(np.array([list(landmarks(q).values()) for q in path]))


@pytest.fixture(scope="module")
def drawn(runs, engines):
    return motion.drawn_motion(CATCH, engines, runs)


def test_what_is_let_go_is_drawn_by_the_finest_run_and_every_picture_is_a_state_of_it(drawn, runs):
    curve = runs[CATCH.name, "rk4", 256]
    np.testing.assert_array_equal(drawn.t, curve["t"][::2])
    for name in METHOD:
        np.testing.assert_allclose(drawn.points[name], seen(curve[name][0][::2]), atol=1e-15)
    np.testing.assert_array_equal(drawn.apart, np.abs(curve["tmt"][0] - curve["mujoco"][0]).max(axis=1)[::2])


def test_a_free_body_is_a_cross_that_turns_with_it():
    robot, half = robot_of(reading.read(PATHS["free_body"]), "stone.xml"), np.sqrt(0.5)
    a_quarter_about_z = np.array([[0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, half, 0.0, 0.0, half]])
    points, links = stick_figure(robot, a_quarter_about_z, crosses=True)
    before, after = points[:, -3:] - points[:, :1]
    assert links[-3:] == [(0, 2), (0, 3), (0, 4)] and np.abs(before).max() > 0.1
    np.testing.assert_allclose(after, before @ [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]], atol=1e-15)


def test_the_gif_shows_each_engine_where_it_is_until_it_has_diverged(drawn, tmp_path):
    left, right = np.array([[-1.0, 1.0], [-1.0, 1.5], [-1.0, 2.0]]), np.array([[1.0, -1.0], [1.5, -1.0], [2.0, -1.0]])
    points = {"tmt": np.stack([left] * 3), "mujoco": np.stack([right, left, np.nan * right])}
    scene = drawn._replace(t=drawn.t[:3], apart=drawn.apart[:3], points=points)
    name, figure, _ = gif.draw_motion(Result("trajectory", curves={"drawn": [scene]}))
    figure.savefig(tmp_path / f"{name}{figure.suffix}")
    found = []
    with Image.open(tmp_path / "motion.gif") as image:
        for k in range(image.n_frames):
            image.seek(k)
            pixels = np.asarray(image.convert("RGB"), int)[gif.TOP : -gif.BOTTOM]  # below the names
            columns = [np.nonzero(np.abs(pixels - colour).max(axis=2) < 8)[1] for colour in (BLUE, ORANGE)]
            found.append([of.mean() // (gif.PIXELS[0] / 2) if len(of) > 100 else None for of in columns])
    assert found == [[0, 1], [0, 0], [0, None]]  # in the left half, in the right one, nowhere
