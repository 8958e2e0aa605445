"""The motion of the runs: the pictures of it and the GIF."""

import numpy as np
import pytest
from edited import setup_of_file
from models import PATHS, chain
from PIL import Image
from trajectory_curves import CASES

from compare.experiments.trajectory import figures_motion_gif as gif
from compare.experiments.trajectory import motion
from compare.experiments.trajectory.runs import Path, TrajectoryResult, follow
from compare.robots.arm import landmarks
from compare.robots.stick import as_seen, stick_figure

CATCH = CASES["ball catch, free"]  # in which a method of order 1 diverges
BLUE, ORANGE = (0, 114, 178), (230, 159, 0)


@pytest.fixture(scope="module")
def runs(engines):
    return follow(CATCH, engines, (1, 4)).runs


@pytest.fixture(scope="module")
def drawn(runs):
    return motion.pictures_of(CATCH, runs)


def test_what_is_let_go_is_drawn_by_the_finest_run_and_every_picture_is_a_state_of_it(drawn, runs):
    run = next(run for run in runs if (run.scheme, run.steps) == ("rk4", 256))
    np.testing.assert_array_equal(drawn.t, run.t[::2])
    for name, path in run.paths.items():
        points = [[np.array([*point], float) for point in landmarks(q)] for q in path.q[::2]]
        np.testing.assert_allclose(drawn.points[name], as_seen(np.array(points)), atol=1e-15)
    apart = np.abs(run.paths["tmt"].q - run.paths["mujoco"].q).max(axis=1)
    np.testing.assert_array_equal(drawn.apart, apart[::2])


def test_between_steps_a_run_is_interpolated_until_it_has_diverged(runs):
    coarse = next(run for run in runs if (run.scheme, run.steps) == ("rk4", 64))
    path = coarse.paths["tmt"]
    for ended, last in ((None, 5.0), (2.5, 2.5 - 5 / 64), (5 / 64, 0.0)):
        times, q = motion.frames(CATCH, coarse.t, path._replace(ended=ended))
        np.testing.assert_allclose(times, np.linspace(0.0, 5.0, 129))
        assert (np.isfinite(q).all(axis=1) == (times <= last)).all()
        alive = times[::2] <= last
        np.testing.assert_allclose(q[::2][alive], path.q[alive])
    t = np.linspace(0.0, 5.0, 65)  # a cubic is itself
    cubic = Path(t[:, None] ** [1, 2, 3], [1, 2, 3] * t[:, None] ** [0, 1, 2])
    times, q = motion.frames(CATCH, t, cubic)
    np.testing.assert_allclose(q, times[:, None] ** [1, 2, 3], atol=1e-12)


def test_a_free_body_is_a_cross_that_turns_with_it():
    robot, half = setup_of_file(PATHS["free_body"]).robot, np.sqrt(0.5)
    a_quarter_about_z = np.array([[0.0, 0.0, 2.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, half, 0.0, 0.0, half]])
    points, links = stick_figure(robot, a_quarter_about_z, crosses=True)
    before, after = points[:, -3:] - points[:, :1]
    assert links[-3:] == [(0, 2), (0, 3), (0, 4)] and np.abs(before).max() > 0.1
    turn = [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]]
    np.testing.assert_allclose(after, before @ turn, atol=1e-15)


def test_sticks_go_from_joint_to_joint_and_from_the_last_to_its_centre_of_mass_and_up_is_up():
    points, links = stick_figure(setup_of_file(chain(3)).robot, np.zeros((1, 3)))
    assert links == [(0, 1), (1, 2), (2, 3)] and points.shape == (1, 4, 3)
    right, _, up = as_seen(np.eye(3))
    assert up == pytest.approx([0.0, np.cos(np.radians(20.0))]) and right[0] > 0.9


def test_the_gif_shows_each_engine_where_it_is_until_it_has_diverged(drawn, tmp_path):
    left = np.array([[-1.0, 1.0], [-1.0, 1.5], [-1.0, 2.0]])
    right = left[:, ::-1]
    points = {"tmt": np.stack([left] * 3), "mujoco": np.stack([right, left, np.nan * right])}
    scene = drawn._replace(t=drawn.t[:3], apart=drawn.apart[:3], points=points)
    name, figure, _ = gif.draw_motion(TrajectoryResult("trajectory", pictures=[scene]))
    figure.savefig(tmp_path / f"{name}{figure.suffix}")
    found = []
    with Image.open(tmp_path / "motion.gif") as image:
        for k in range(image.n_frames):
            image.seek(k)
            pixels = np.asarray(image.convert("RGB"), int)[gif.TOP : -gif.BOTTOM]  # below the names
            columns = [np.nonzero(np.abs(pixels - colour).max(axis=2) < 8)[1] for colour in (BLUE, ORANGE)]
            found.append([of.mean() // (gif.PIXELS[0] / 2) if len(of) > 100 else None for of in columns])
    assert found == [[0, 1], [0, 0], [0, None]]  # in the left half, in the right one, nowhere
