"""Scenes of a user's own: what a file may say, and one clear line with file and entry for what it may not."""

import numpy as np
import pytest
from models import PATHS

from compare.case import Case
from compare.reference import compared_with
from compare.robots.arm import ARM
from compare.scene_file import SceneError, read_scenes

PENDULUM = compared_with("model", str(PATHS["pendulum_ball"])).robot
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
duration = 2.0
dt = 0.03125

[[scene]]
name = "as it is"
"""


def from_text(tmp_path, text):
    path = tmp_path / "my.toml"
    path.write_text(text, encoding="utf-8")
    return read_scenes(path, ARM)


def test_every_key_is_read(tmp_path):
    thrown, held, plain = (Case(ARM, scene) for scene in from_text(tmp_path, WHOLE))
    assert np.allclose(thrown.q, np.radians([10, 20.5, -30])) and np.allclose(thrown.v, np.radians([100, 0, -50]))
    assert (
        thrown.tau.tolist() == [0.5, 0, 0] and thrown.tree.gravity == (0, 0, 0) and thrown.tree.damping == (0.05,) * 3
    )
    assert (thrown.duration, thrown.steps) == (1.0, 64)
    assert held.joints == ("alpha", "gamma") and held.is_held and held.scene.dt == 0.03125
    assert plain.q.tolist() == [0, 0, 0] and plain.is_free and plain.scene.gravity and plain.duration == 5.0


@pytest.mark.parametrize(
    "text, says",
    [
        ("x = 1", "x is unknown"),
        ("[scene]\nname = 'a'", "no array of scenes"),
        ("", "no array of scenes"),
        ("[[scene]\n", r"is not TOML: .*line 1"),
        ("[[scene]]\nposture = 'bent'", "scene 1: it has no name"),
        ("[[scene]]\nname = 'a'\nfoo = 1", r"scene 1 \('a'\): foo is unknown; known are name, posture"),
        ("[[scene]]\nname = 'a'\nposture = 'bnt'", "posture is 'bnt'; zero, hanging"),
        ("[[scene]]\nname = 'a'\nposture = [1, 2, 3]", "posture is"),
        ("[[scene]]\nname = 'a'\nposture = 'bent'\nq = [1, 2, 3]", "posture and q are both given"),
        ("[[scene]]\nname = 'a'\nq = [1, 2]", r"q is \[1, 2\]; 3 numbers, one per joint"),
        ("[[scene]]\nname = 'a'\nq = [1, 2, nan]", "3 numbers"),
        ("[[scene]]\nname = 'a'\nspeed = 'fast'", "speed is 'fast'"),
        ("[[scene]]\nname = 'a'\nspeed = []", "3 numbers"),
        ("[[scene]]\nname = 'a'\ntorque = 'hodl'", "free, hold, servos, or 3 numbers"),
        ("[[scene]]\nname = 'a'\ntorque = [true, 1, 2]", "free, hold, servos, or 3 numbers"),
        ("[[scene]]\nname = 'a'\ngravity = 1", "gravity is 1"),
        ("[[scene]]\nname = 'a'\ndamping = -1", "at least 0"),
        ("[[scene]]\nname = 'a'\nlocked = ['delta']", "locked is"),
        ("[[scene]]\nname = 'a'\nlocked = ['alpha', 'beta', 'gamma']", "at most 2"),
        ("[[scene]]\nname = 'a'\nspeed = [1, 0, 0]\nlocked = ['alpha']", "no speed of a locked joint"),
        ("[[scene]]\nname = 'a'\nduration = 'x'", "duration is 'x'"),
        ("[[scene]]\nname = 'a'\nduration = 1.0\ndt = 0.3", "a step that divides 1 s"),
        ("[[scene]]\nname = 'a'\n[[scene]]\nname = 'a'", r"scene 2 \('a'\): the name is that of scene 1"),
        ("[[scene]]\nname = 'bent, free'", "that of a scene of arm"),
        ("[[scene]]\nname = ''", "a text that is not empty"),
        ("[[scene]]\nname = 3", "name is 3; a string in one line is expected"),
        ("[[scene]]\nname = { a = true }", r"name is \{a = true\}; a string in one line is expected"),
        ("[[scene]]\nname = 'a'\nq = { a = [1, nan] }", r"q is \{a = \[1, nan\]\}; 3 numbers"),
        ("[[scene]]\nname = 'a'\nlocked = 'alpha'", "locked is 'alpha'; an array of names is expected"),
        (
            "[[scene]]\nname = 'a'\ngravity = [true]",
            r"gravity is \[true\]; true, the model's own, or false, none is expected",
        ),
        (
            "[[scene]]\nname = 'a'\ndamping = 'x'",
            "damping is 'x'; a number of at least 0 N m s/rad, or an array with one",
        ),
    ],
)
def test_what_cannot_be_is_one_line_with_file_and_entry(tmp_path, text, says):
    with pytest.raises(SceneError, match=says) as error:
        from_text(tmp_path, text)
    assert str(error.value).startswith(("cannot read", str(tmp_path / "my.toml"))) and "\n" not in str(error.value)


@pytest.mark.parametrize("length", [0.99901, 0.9999990001, 1.0, 1.00099])
def test_a_quaternion_of_few_digits_is_made_one_of_length_1(tmp_path, length):
    turn = np.array([0.5, 0.5, -0.5, 0.5])
    (scene,) = balls(tmp_path, [*(length * turn), 1.0, 0.0, 0.0, 0.0])
    assert np.allclose(Case(PENDULUM, scene).q, [*turn, 1.0, 0.0, 0.0, 0.0], rtol=0.0, atol=1e-15)


@pytest.mark.parametrize("length", [0.99899, 1.00101, 0.0])
def test_a_quaternion_of_another_length_is_refused_with_that(tmp_path, length):
    q = [*(length * np.array([0.5, 0.5, -0.5, 0.5])), 1.0, 0.0, 0.0, 0.0]
    said = rf"scene 1 \('a'\): q is \[.*; the quaternion of upper has the length {length:g}, 1 within 0.001 is expected"
    with pytest.raises(SceneError, match=said):
        balls(tmp_path, q)


def balls(tmp_path, q):
    """The scenes of a file with one scene of two balls at this position."""
    path = tmp_path / "my.toml"
    path.write_text(f"[[scene]]\nname = 'a'\nq = {list(map(float, q))}\n")
    return read_scenes(path, PENDULUM)


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match=r"cannot read .*no\.toml: No such file"):
        read_scenes(tmp_path / "no.toml", ARM)
    with pytest.raises(SceneError, match=r"cannot read .*: Is a directory"):
        read_scenes(tmp_path, ARM)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(SceneError, match="is not TOML"):
        read_scenes(tmp_path / "bytes.toml", ARM)
