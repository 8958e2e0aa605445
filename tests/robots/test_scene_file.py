"""Scenes: what a file may say, and what cannot be a scene of a robot; a scene changes what it says and nothing else."""

import os

import numpy as np
import pytest
from helpers.edited import XML
from helpers.runs import posix
from models import PATHS

import tmt
from compare.engines.mujoco import parse
from compare.robots.arm import ARM
from compare.robots.case import Case
from compare.robots.scene_file import SceneError, read_scenes
from compare.run.reference import compared_with

WHOLE = """
[[scene]]
name = "thrown up"
q = [10, 20.5, -30]
speed = [100, 0, -50]
torque = [0.5, 0, 0]
gravity = false
damping = 0.05
duration = 1.0

[[scene]]
name = "held high"
posture = "upright"
torque = "hold"
locked = ["beta"]
dt = 0.03125
"""


def from_text(tmp_path, text, robot=ARM):
    path = tmp_path / "my.toml"
    path.write_text(text, encoding="utf-8")
    return read_scenes(path, robot)


def refused(tmp_path, text, word, robot=ARM):
    with pytest.raises(SceneError, match=word) as error:
        from_text(tmp_path, text, robot)
    assert str(tmp_path / "my.toml") in str(error.value) and "\n" not in str(error.value)


def test_every_key_is_read(tmp_path):
    thrown, held = (Case(ARM, scene) for scene in from_text(tmp_path, WHOLE))
    assert np.allclose(thrown.q, np.radians([10, 20.5, -30]))
    assert np.allclose(thrown.v, np.radians([100, 0, -50]))
    assert thrown.tau.tolist() == [0.5, 0, 0] and thrown.tree.gravity == (0, 0, 0)
    assert thrown.tree.damping == (0.05,) * 3 and (thrown.duration, thrown.steps) == (1.0, 64)
    assert held.joints == ("alpha", "gamma") and held.is_held and held.scene.dt == 0.03125
    assert held.scene.gravity and held.duration == 5.0 and thrown.scene.locked == ()


def test_targets_are_moved_by_degrees_and_metres(tmp_path):
    robot = compared_with("model", str(PATHS["gripper"])).robot
    scene = "[[scene]]\nname = '{0}'\ntorque = 'servos'\ntargets = {0}\n"
    scenes = from_text(tmp_path, "".join(map(scene.format, ("0", "[90, 45, 0.01, 0.01]"))), robot)
    still, moved = (np.array(Case(robot, scene).controller.controls) for scene in scenes)
    assert moved - still == pytest.approx([np.pi / 2, np.pi / 4, 0.01])


@pytest.mark.parametrize("text, word", [
    ("x = 1", "x is"), ("[scene]\nname = 'a'", "array"), ("[[scene]\n", "line 1"),
    ("[[scene]]\nposture = 'bent'", "scene 1: .* name"), ("[[scene]]\nname = 'bent, free'", "of arm"),
    ("[[scene]]\nname = 'a'\n[[scene]]\nname = 'a'", r'scene 2 \("a"\): .* scene 1'),
    ("[[scene]]\nname = { a = true }", r'name is \{"a": true\}'),
    *((f"[[scene]]\nname = 'a'\n{line}", rf'scene 1 \("a"\): .*{word}') for line, word in (
        ("foo = 1", "foo is"), ("posture = 'bnt'", '"bnt"; expected zero, hanging'), ("posture = [1, 2, 3]", "posture is"),
        ("posture = 'bent'\nq = [1, 2, 3]", "posture and q"), ("q = [1, 2]", r"q is \[1, 2\]; expected 3 numbers"),
        ("speed = 'fast'", 'speed is "fast"'), ("gravity = [true]", r"gravity is \[true\]; expected true"),
        ("damping = -1", "damping is -1"), ("locked = ['alpha', 'beta', 'gamma']", "at most 2"),
        ("duration = 'x'", 'duration is "x"'), ("duration = 1.0\ndt = 0.3", "dt is 0.3"),
    )),
])  # fmt: skip
def test_what_is_wrong_is_one_line_with_file_and_entry(tmp_path, text, word):
    refused(tmp_path, text, word)


@pytest.mark.parametrize("length, accepted", [
    (0.99899, False), (0.99901, True), (1.00099, True), (1.00101, False), (0.0, False),
])  # fmt: skip
def test_a_quaternion_of_few_digits_is_made_one_of_length_1(tmp_path, length, accepted):
    robot, turn = compared_with("model", str(PATHS["pendulum_ball"])).robot, np.array([0.5, 0.5, -0.5, 0.5])
    text = f"[[scene]]\nname = 'a'\nq = {[*map(float, length * turn), 1.0, 0.0, 0.0, 0.0]}\n"
    if not accepted:
        return refused(tmp_path, text, f"upper .* {length:g}", robot)
    (scene,) = from_text(tmp_path, text, robot)
    assert np.allclose(Case(robot, scene).q, [*turn, 1.0, 0.0, 0.0, 0.0], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("length, accepted", [(1.0, True), (1.0 + 1e-5, False), (0.0, False)])
def test_a_posture_of_a_case_has_a_quaternion_of_length_1(length, accepted):
    robot = compared_with("model", str(PATHS["pendulum_ball"])).robot
    posture = (*(length * np.array([0.5, 0.5, -0.5, 0.5])).tolist(), 1.0, 0.0, 0.0, 0.0)
    if accepted:
        assert np.array_equal(robot.case(posture=posture).posture, posture)
        return
    with pytest.raises(ValueError, match="length 1"):
        robot.case(posture=posture)


@posix
def test_a_pipe_is_never_waited_for(tmp_path):
    os.mkfifo(tmp_path / "my.toml")
    with pytest.raises(SceneError, match=r"my\.toml .*not a regular file"):
        read_scenes(tmp_path / "my.toml", ARM)


@pytest.mark.parametrize("steps, accepted", [(20_000, True), (20_001, False)])
def test_the_number_of_steps_of_a_run_is_limited(tmp_path, steps, accepted):
    text = f"[[scene]]\nname = 'a'\nduration = 2.0\ndt = {2.0 / steps!r}\n"
    if not accepted:
        return refused(tmp_path, text, "20,000 steps")
    (scene,) = from_text(tmp_path, text)
    assert scene.steps == steps


def test_cases_that_differ_in_one_change_have_their_own_models():
    changes = [
        {}, {"gravity": False}, {"damping": 0.1}, {"damping": 0.1001}, {"locked": ("beta",)}, {"locked": ("gamma",)},
        {"locked": ("beta",), "posture": (0.0, 40.0, 0.0)}, {"locked": ("beta",), "posture": (0.0, 40.001, 0.0)},
        {"locked": ("beta",), "posture": (0.0, 40.0, 0.0), "gravity": False}, {"locked": ("alpha", "beta")},
    ]  # fmt: skip
    engine, cases = parse(XML, ARM.tree), [ARM.case("one", **change) for change in changes]
    for case in cases[::-1] + cases:
        q, v = np.full((2, len(case.joints)), 0.7)
        found = engine.of(case).acceleration(q, v, v)
        assert np.allclose(found, tmt.acceleration(case.tree, q, v, v), rtol=1e-10, atol=1e-10), case.scene
