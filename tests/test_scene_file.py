"""Scenes of a user's own: what a file may say, and one clear line with file and entry for what it may not."""

import numpy as np
import pytest

from compare.case import Case
from compare.robots.arm import ARM
from compare.scene_file import SceneError, read_scenes

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
        ("[scene]\nname = 'a'", "no list of scenes"),
        ("", "no list of scenes"),
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
        ("[[scene]]\nname = 'a'\ntorque = 'hodl'", "free, hold, or 3 numbers"),
        ("[[scene]]\nname = 'a'\ntorque = [true, 1, 2]", "free, hold, or 3 numbers"),
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
        ("[[scene]]\nname = 3", "name is 3"),
    ],
)
def test_what_cannot_be_is_one_line_with_file_and_entry(tmp_path, text, says):
    with pytest.raises(SceneError, match=says) as error:
        from_text(tmp_path, text)
    assert str(error.value).startswith(("cannot read", str(tmp_path / "my.toml"))) and "\n" not in str(error.value)


def test_a_file_that_cannot_be_read(tmp_path):
    with pytest.raises(SceneError, match=r"cannot read .*no\.toml: No such file"):
        read_scenes(tmp_path / "no.toml", ARM)
    with pytest.raises(SceneError, match=r"cannot read .*: Is a directory"):
        read_scenes(tmp_path, ARM)
    (tmp_path / "bytes.toml").write_bytes(b"\xff\xfe")
    with pytest.raises(SceneError, match="is not TOML"):
        read_scenes(tmp_path / "bytes.toml", ARM)
