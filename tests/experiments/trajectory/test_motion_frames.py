"""The motion as it is drawn: pictures of states of the runs, who leaves when and where to, and the GIF."""

import numpy as np
import pytest
from PIL import Image
from trajectory_curves import FREE, HELD

from compare.engines import compared
from compare.engines.mujoco import reading
from compare.experiments.trajectory import figures_motion_gif as gif
from compare.experiments.trajectory import motion_frames as frames
from compare.experiments.trajectory.runs import follow
from compare.judge.check import Result
from compare.judge.run import departure
from compare.robots.arm import ARM, landmarks
from compare.robots.file import robot_of
from compare.robots.stick import as_seen, stick_figure


@pytest.fixture(scope="module")
def runs(engines):
    """Of a scene that is let go, by its own steps and finer ones."""
    return follow(FREE, engines, (1, 4)).curves


@pytest.fixture(scope="module")
def drawn(runs, engines):
    return frames.drawn_motion(FREE, engines, runs)


def seen(path) -> np.ndarray:
    return as_seen(np.array([list(landmarks(q).values()) for q in path]))


def test_what_is_let_go_is_drawn_by_the_finest_run_and_every_picture_is_a_state_of_it(drawn, runs, engines):
    curve = runs[FREE.name, "rk4", 256]
    np.testing.assert_array_equal(drawn.t, curve["t"][::2])
    for name in ("tmt", "mujoco"):
        np.testing.assert_allclose(drawn.points[name], seen(curve[name][0][::2]), atol=1e-15)
    np.testing.assert_array_equal(drawn.apart, np.abs(curve["tmt"][0] - curve["mujoco"][0]).max(axis=1)[::2])
    assert f"{drawn.apart.max():.2g} rad" in drawn.seen
    assert drawn.left == {"tmt": None, "mujoco": None}  # there is no posture to leave
    assert frames.drawn_motion(FREE, engines, {key: run for key, run in runs.items() if key[1] != "rk4"}) is None


def test_what_is_held_is_drawn_by_its_own_step_until_both_have_left(engines):
    """In a scene that ends between the times at which they leave, which rounding decides."""
    dt, methods = HELD.scene.dt, {"tmt": "rk4", "mujoco": "RK4"}
    long = {name: of.run(*HELD.start, HELD.tau, dt, 128, methods[name]) for name, of in compared(engines, HELD).items()}
    left = {name: departure(motion.t, motion.q) for name, motion in long.items()}
    if None in left.values() or left["tmt"] == left["mujoco"]:
        pytest.skip("here both leave at the same time, or one stays")
    case = HELD.changed(duration=round(min(left.values()) / dt) * dt, judged=0.0)
    curves = follow(case, engines, (1, 4)).curves
    scene, curve = frames.drawn_motion(case, engines, curves), curves[case.name, "rk4", case.steps]
    assert sum(time is None for time in curve["left"].values()) == 1
    assert scene.left == left and scene.run.endswith(f"/{case.steps} s")
    assert max(left.values()) < scene.t[-1] <= max(left.values()) + 0.11 * case.duration
    for name in left:  # what was run is drawn as it was
        parts = 128 // case.steps
        run = scene.points[name][: parts * case.steps + 1 : parts]
        np.testing.assert_allclose(run, seen(curve[name][0]), atol=1e-12)
        assert f"{scene.left[name]:.2f} s" in scene.seen


def test_between_two_states_stands_what_the_method_gives_with_half_a_step(drawn, runs, engines):
    curve = runs[FREE.name, "rk4", 64]
    coarse = frames.drawn_motion(FREE, engines, {key: run for key, run in runs.items() if key[2] == 64})
    assert len(coarse.t) == 129
    for name, method in (("tmt", "rk4"), ("mujoco", "RK4")):
        of = compared(engines, FREE)[name]
        half = of.run(curve[name][0][5], curve[name][1][5], FREE.tau, FREE.duration / 128, 1, method).q[1]
        np.testing.assert_allclose(coarse.points[name][11], seen([half])[0], atol=1e-12)
    assert np.abs(coarse.points["tmt"] - drawn.points["tmt"])[:20].max() < 1e-2  # and it is near a finer run


def test_after_divergence_an_engine_is_not_drawn(runs, engines):
    curve = runs[FREE.name, "rk4", 64] | {"ended": {"tmt": None, "mujoco": 2.5}}
    scene = frames.drawn_motion(FREE, engines, {(FREE.name, "rk4", 64): curve})
    gone = np.isnan(scene.points["mujoco"]).all(axis=(1, 2))
    np.testing.assert_array_equal(gone, scene.t >= 2.5)
    assert np.isfinite(scene.points["tmt"]).all() and np.isnan(scene.apart[gone]).all() and "2.50 s" in scene.seen


def test_first_comes_what_is_held_and_left_then_what_is_let_go_from_there(drawn):
    names = ["bent, held", "bent, free", "zero, free", "ball catch, held", "ball catch, free"]
    stays = {name: drawn._replace(scene=name) for name in names}
    leaves = stays | {"ball catch, held": stays["ball catch, held"]._replace(left={"tmt": None, "mujoco": 4.0})}
    expected = ["ball catch, held", "ball catch, free", "bent, held", "bent, free", "zero, free"]
    assert [one.scene for one in frames.in_order(list(leaves.values()), ARM)] == expected
    assert [one.scene for one in frames.in_order(list(stays.values()), ARM)][:2] == ["bent, held", "bent, free"]
    assert frames.in_order([], ARM) == []


def test_a_stick_figure_stands_where_the_joints_are_and_a_free_body_has_a_cross_that_turns_with_it(rng):
    points, links = stick_figure(ARM, rng.uniform(-3.0, 3.0, (4, 3)))
    assert points.shape == (4, 3, 3) and links == [(0, 1), (1, 2)]
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.tile([0.3, 0.375], (4, 1)), atol=1e-15)
    mjcf = """<mujoco><worldbody><body name="stone"><freejoint name="root"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.05 0.05 0.05"/></body></worldbody></mujoco>"""
    robot, half = robot_of(reading.read(mjcf), "stone.xml"), np.sqrt(0.5)
    q = np.array([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, half, 0.0, 0.0, half]])  # a quarter turn about z
    points, links = stick_figure(robot, q, crosses=True)
    assert points.shape == (2, 5, 3) and links == [(0, 1), (0, 2), (0, 3), (0, 4)]
    radius = np.sqrt(0.15 / (1.2 * 2.0))
    np.testing.assert_allclose(points[0, 2:] - points[0, 0], radius * np.eye(3), atol=1e-15)
    turned = radius * np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(points[1, 2:] - [0.0, 0.0, 2.0], turned, atol=1e-15)


# the GIF


def pixels_of(picture, colour) -> np.ndarray:
    """Where pixels below the names have a colour, to the right and up, (pixels, 2)."""
    pixels = np.asarray(picture.convert("RGB"), int)[gif.TOP : -gif.BOTTOM]
    found = np.abs(pixels - [int(colour[i : i + 2], 16) for i in (1, 3, 5)]).max(axis=2) < 8
    return np.argwhere(found)[:, ::-1] * [1, -1]


def test_the_gif_shows_both_engines_until_one_has_diverged(drawn, tmp_path):
    points = {name: path[:40].copy() for name, path in drawn.points.items()}
    points["mujoco"][30:] = np.nan
    scene = drawn._replace(t=drawn.t[:40], apart=drawn.apart[:40], points=points)
    name, figure, caption = gif.draw_motion(Result("trajectory", curves={"drawn": [scene]}))
    assert (name, figure.suffix) == ("motion", ".gif") and caption.count("RK4, dt = 5/") == 1
    figure.savefig(tmp_path / "motion.gif")
    with Image.open(tmp_path / "motion.gif") as image:
        assert image.size == gif.PIXELS and image.info["loop"] == 0 and image.n_frames >= 40
        found = []
        for k in (0, 20, image.n_frames - 1):
            image.seek(k)
            found.append((len(pixels_of(image, gif.BLUE)) > 300, len(pixels_of(image, gif.ORANGE)) > 100))
    assert found == [(True, True), (True, True), (True, False)]


def test_each_engine_is_drawn_where_it_is(drawn):
    high, right = np.array([[-1.0, 1.0], [-1.0, 1.5], [-1.0, 2.0]]), np.array([[1.0, -1.0], [1.5, -1.0], [2.0, -1.0]])
    scene = drawn._replace(t=drawn.t[:2], points={"tmt": np.stack([high, high]), "mujoco": np.stack([right, high])})
    place = gif.place_of(scene)
    still = gif.text_of_scene(scene, "TMT", place)
    first, second = (gif.one_picture(scene, k, still, place) for k in range(2))
    for picture, apart in ((first, place[0] * (right - high).mean(axis=0)), (second, np.zeros(2))):
        away = pixels_of(picture, gif.ORANGE).mean(axis=0) - pixels_of(picture, gif.BLUE).mean(axis=0)
        np.testing.assert_allclose(away, apart, atol=3.0)
