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
    """Of the held scene and of one let go, by the scene's own steps and finer ones."""
    found = {}
    for case in (HELD, FREE):
        found |= follow(case, engines, (1, 4)).curves
    return found


@pytest.fixture(scope="module")
def drawn(runs, engines):
    return {case.name: frames.drawn_motion(case, engines, runs) for case in (HELD, FREE)}


def test_what_is_let_go_is_drawn_by_the_finest_run_and_every_picture_is_a_state_of_it(drawn, runs):
    scene, curve = drawn[FREE.name], runs[FREE.name, "rk4", 256]
    np.testing.assert_array_equal(scene.t, curve["t"][::2])
    for name in ("tmt", "mujoco"):
        arm = np.array([list(landmarks(q).values()) for q in curve[name][0][::2]])
        np.testing.assert_allclose(scene.points[name], as_seen(arm), atol=1e-15)
    np.testing.assert_array_equal(scene.apart, np.abs(curve["tmt"][0] - curve["mujoco"][0]).max(axis=1)[::2])
    assert f"at most {scene.apart.max():.2g} rad apart in 5 s" in scene.seen and "dt/" not in scene.seen
    assert scene.left == {"tmt": None, "mujoco": None}  # there is no posture to leave


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
    assert f"followed beyond the scene's {case.duration:g} s until both have left" in scene.seen
    for name in left:  # what was run is drawn as it was
        arm = np.array([list(landmarks(q).values()) for q in curve[name][0]])
        parts = 128 // case.steps
        np.testing.assert_allclose(scene.points[name][: parts * case.steps + 1 : parts], as_seen(arm), atol=1e-12)
        assert f"the arm leaves at {scene.left[name]:.2f} s (predicted: " in scene.seen


def test_between_two_states_stands_what_the_method_gives_with_half_a_step(drawn, runs, engines):
    scene, curve = drawn[FREE.name], runs[FREE.name, "rk4", 64]
    coarse = frames.drawn_motion(FREE, engines, {key: run for key, run in runs.items() if key[2] == 64})
    assert len(coarse.t) == 129 and "its own method's steps of dt/2" in coarse.seen
    for name, method in (("tmt", "rk4"), ("mujoco", "RK4")):
        of = compared(engines, FREE)[name]
        half = of.run(curve[name][0][5], curve[name][1][5], FREE.tau, FREE.duration / 128, 1, method).q[1]
        arm = np.array(list(landmarks(half).values()))
        np.testing.assert_allclose(coarse.points[name][11], as_seen(arm), atol=1e-12)
    assert np.abs(coarse.points["tmt"] - scene.points["tmt"])[:20].max() < 1e-2  # and it is near a finer run


def test_after_divergence_an_engine_is_not_drawn_and_words_say_so(runs, engines):
    curve = dict(runs[FREE.name, "rk4", 64])
    curve["ended"] = {"tmt": None, "mujoco": 2.5}
    scene = frames.drawn_motion(FREE, engines, {(FREE.name, "rk4", 64): curve})
    gone = np.isnan(scene.points["mujoco"]).all(axis=(1, 2))
    np.testing.assert_array_equal(gone, scene.t >= 2.5)
    assert np.isfinite(scene.points["tmt"]).all() and np.isnan(scene.apart[gone]).all()
    assert (
        scene.seen.count("MuJoCo has diverged at 2.50 s and is drawn no longer.") == 1 and "TMT has" not in scene.seen
    )


@pytest.mark.parametrize("sign, side", [(1.0, "the same side"), (-1.0, "different sides")])
def test_the_sides_to_which_both_leave_are_said(sign, side):
    t = np.linspace(0.0, 1.0, 3)
    away = np.array([0.0, 0.05, 0.2])[:, None] * np.array([1.0, 0.1, 0.0])
    paths = {"tmt": [HELD.q + away], "mujoco": [HELD.q + sign * away]}
    words = frames.left_to_in_words(HELD, t, paths, {"tmt": 1.0, "mujoco": 1.0})
    assert words == f", to {side}: α has then moved by +0.20 rad in TMT and {sign * 0.2:+.2f} rad in MuJoCo"


def test_a_scene_without_a_run_of_rk4_is_not_drawn(runs, engines):
    assert frames.drawn_motion(FREE, engines, {key: run for key, run in runs.items() if key[1] != "rk4"}) is None


def test_first_comes_what_is_held_and_left_then_what_is_let_go_from_there(drawn):
    names = ["bent, held", "bent, free", "zero, free", "ball catch, held", "ball catch, free"]
    stays = {name: drawn[FREE.name]._replace(scene=name, left=dict.fromkeys(("tmt", "mujoco"))) for name in names}
    leaves = stays | {"ball catch, held": stays["ball catch, held"]._replace(left={"tmt": None, "mujoco": 4.0})}
    expected = ["ball catch, held", "ball catch, free", "bent, held", "bent, free", "zero, free"]
    assert [one.scene for one in frames.in_order(list(leaves.values()), ARM)] == expected
    assert [one.scene for one in frames.in_order(list(stays.values()), ARM)][:2] == ["bent, held", "bent, free"]
    assert [one.scene for one in frames.in_order([stays["zero, free"]], ARM)] == ["zero, free"]
    assert frames.in_order([], ARM) == []


def test_a_stick_figure_stands_where_the_joints_are(rng):
    q = rng.uniform(-3.0, 3.0, (4, 3))
    points, links = stick_figure(ARM, q)
    assert points.shape == (4, 3, 3) and links == [(0, 1), (1, 2)]
    lengths = np.linalg.norm(np.diff(points, axis=1), axis=2)
    np.testing.assert_allclose(lengths, np.tile([0.3, 0.375], (4, 1)), atol=1e-15)


def close_to(picture, colour) -> int:
    """How many pixels below the names have a colour."""
    pixels = np.asarray(picture.convert("RGB"), int)[gif.TOP : -gif.BOTTOM]
    return int((np.abs(pixels - [int(colour[i : i + 2], 16) for i in (1, 3, 5)]).max(axis=2) < 8).sum())


def test_the_gif_shows_both_engines_in_every_picture_and_is_small(drawn, tmp_path):
    result = Result("trajectory", curves={"drawn": [drawn[HELD.name], drawn[FREE.name]]})
    name, figure, caption = gif.draw_motion(result)
    assert (name, figure.suffix) == ("motion", ".gif") and caption.count("RK4, dt = 5/") == 2
    figure.savefig(tmp_path / "motion.gif")
    assert (tmp_path / "motion.gif").stat().st_size < 600_000
    with Image.open(tmp_path / "motion.gif") as image:
        assert image.size == gif.PIXELS and image.info["loop"] == 0 and image.n_frames > 200
        seconds = 0.0
        for k in range(image.n_frames):
            image.seek(k)
            seconds += image.info["duration"] / 1000.0
            if k % 40 == 0:
                assert close_to(image, gif.BLUE) > 300 and close_to(image, gif.ORANGE) > 100, k
        assert 10.0 < seconds < 20.0


def test_the_gif_draws_no_engine_that_has_diverged(drawn, tmp_path):
    scene = drawn[FREE.name]
    points = {name: path[:9].copy() for name, path in scene.points.items()}
    points["mujoco"][5:] = np.nan
    gif.Animation([scene._replace(t=scene.t[:9], points=points)], "TMT").savefig(tmp_path / "motion.gif")
    with Image.open(tmp_path / "motion.gif") as image:
        found = []
        for k in range(image.n_frames):
            image.seek(k)
            found.append((close_to(image, gif.BLUE) > 300, close_to(image, gif.ORANGE) > 100))
    assert found[0] == (True, True) and found[-1] == (True, False)


def where(picture, colour) -> np.ndarray:
    """The middle of the pixels of a colour below the names, to the right and up."""
    pixels = np.asarray(picture.convert("RGB"), int)[gif.TOP : -gif.BOTTOM]
    found = np.abs(pixels - [int(colour[i : i + 2], 16) for i in (1, 3, 5)]).max(axis=2) < 8
    y, x = np.nonzero(found)
    return np.array([x.mean(), -y.mean()])


def test_each_engine_is_drawn_where_it_is(drawn):
    scene = drawn[FREE.name]
    high, right = np.array([[-1.0, 1.0], [-1.0, 1.5], [-1.0, 2.0]]), np.array([[1.0, -1.0], [1.5, -1.0], [2.0, -1.0]])
    scene = scene._replace(t=scene.t[:2], points={"tmt": np.stack([high, high]), "mujoco": np.stack([right, high])})
    place = gif.place_of(scene)
    still = gif.text_of_scene(scene, "TMT", place)
    first, second = (gif.one_picture(scene, k, still, place) for k in range(2))
    away = where(first, gif.ORANGE) - where(first, gif.BLUE)
    np.testing.assert_allclose(away, place[0] * (right - high).mean(axis=0), atol=3.0)
    np.testing.assert_allclose(where(second, gif.ORANGE), where(second, gif.BLUE), atol=3.0)


def test_each_name_stands_beside_its_stick(drawn):
    place = gif.place_of(drawn[FREE.name])
    for label in ("TMT", ""):
        text = np.asarray(gif.text_of_scene(drawn[FREE.name], label, place))[52:72]
        first, second = (text[:, at + 48 : at + 80].any() for at in gif.NAMES_AT)
        assert first == bool(label) and second  # MuJoCo's is the second, as in the pictures


def test_a_picture_of_the_gif_says_what_is_so_at_its_time(drawn):
    scene = drawn[FREE.name]
    points, left = {name: path[:3].copy() for name, path in scene.points.items()}, {"tmt": 0.75, "mujoco": 0.5}
    t, apart = np.array([0.0, 0.5, 1.0]), np.array([1e-9, 2e-9, np.nan])
    scene = scene._replace(t=t, apart=apart, unit="rad", left=left, points=points)
    scene.points["mujoco"][2] = np.nan
    assert [gif.words_of_picture(scene, k) for k in range(3)] == [
        ("t = 0.00 s", "apart in any joint by at most 1e-09 rad", ""),
        ("t = 0.50 s", "apart in any joint by at most 2e-09 rad", "MuJoCo has left at 0.50 s"),
        ("t = 1.00 s", "MuJoCo has diverged", "MuJoCo has left at 0.50 s; TMT has left at 0.75 s"),
    ]


@pytest.mark.parametrize("dt, words", [(0.04, ""), (0.02, ", shown 2 times slower"), (0.08, ", shown 2 times faster")])
def test_a_scene_that_is_not_shown_at_its_own_speed_says_so(drawn, dt, words):
    assert gif.slower(drawn[FREE.name]._replace(t=dt * np.arange(3))) == words


def test_a_free_body_has_a_cross_that_turns_with_it():
    mjcf = """<mujoco><worldbody><body name="stone"><freejoint name="root"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.05 0.05 0.05"/></body></worldbody></mujoco>"""
    robot = robot_of(reading.read(mjcf), "stone.xml")
    half = np.sqrt(0.5)
    q = np.array([[0.0, 0.0, 1.0, 1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 2.0, half, 0.0, 0.0, half]])  # a quarter turn about z
    points, links = stick_figure(robot, q, crosses=True)
    assert points.shape == (2, 5, 3) and links == [(0, 1), (0, 2), (0, 3), (0, 4)]
    radius = np.sqrt(0.15 / (1.2 * 2.0))
    np.testing.assert_allclose(points[0, 2:] - points[0, 0], radius * np.eye(3), atol=1e-15)
    turned = radius * np.array([[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(points[1, 2:] - [0.0, 0.0, 2.0], turned, atol=1e-15)
    assert stick_figure(robot, q)[0].shape == (2, 2, 3)
