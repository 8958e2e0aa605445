"""Files that cannot be compared, and what a newer MuJoCo brings: one line each."""

import pytest
from files import PLAIN, TENDON, TWO, mjcf

from compare.engines.mujoco import ModelError, read, refused

ALONG = '<actuator><general name="a" tendon="t" armature="1"/></actuator>'
BALL = '<body><joint type="ball" name="w"/><geom size="0.1"/><body><joint name="w x"/><geom size="0.1"/></body></body>'
REFUSED = {  # a word of why, and the file
    "tendon 't'": mjcf(TWO, after=TENDON.format('armature="1"')),
    "actuator 'a'": mjcf(TWO, after=TENDON.format("") + ALONG),
    "flex 'soft'": mjcf(
        PLAIN + '<flexcomp name="soft" type="grid" count="3 3 1" spacing=".1 .1 .1" radius="0.01" dim="2" mass="1"/>'
    ),
    "mass": mjcf("<body><joint/></body>"),
    "pos of body 'far'": mjcf('<body name="far" pos="inf 0 0"><geom size="1"/></body>' + PLAIN),
    "damping of joint 'j' is -1": mjcf(PLAIN.replace('name="j"', 'name="j" damping="-1"')),
    "keyframe 'up'": mjcf(after='<keyframe><key name="up" qpos="inf"/></keyframe>'),
    "gain of actuator 's'": mjcf(after='<actuator><position name="s" joint="j" kp="nan"/></actuator>'),
    "together": mjcf(PLAIN.replace('<joint name="j"/>', "<joint/><joint/>")),
    "'w x'": mjcf(BALL),
    "MJCF": "hello",
}


@pytest.mark.parametrize("why", REFUSED)
def test_what_cannot_be_compared_is_refused_in_one_line(why, capfd):
    with pytest.raises(ModelError, match=why) as error:
        read(REFUSED[why])
    assert "\n" not in str(error.value) and capfd.readouterr() == ("", "")


@pytest.mark.parametrize("name, content", [
    ("No such file", None), ("gone.xml", "<mujoco><include file='gone.xml'/></mujoco>"),
])  # fmt: skip
def test_a_file_that_cannot_be_read_is_named_in_one_line(name, content, tmp_path):
    path = tmp_path / "robot.xml"
    if content:
        path.write_text(content)
    with pytest.raises(ModelError, match=rf"robot\.xml.*{name}") as error:
        read(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text, names, name", [
    (mjcf(TWO, after=TENDON.format("")), "KNOWN_COUNTS", "ntendon"),
    (mjcf(PLAIN.replace('name="j"', 'name="j" stiffness="1"')), "KNOWN_FIELDS", "jnt_stiffness"),
    (mjcf(before='<option wind="1 0 0"/>'), "KNOWN_OPTIONS", "wind"),
    (mjcf(before='<option><flag spring="disable"/></option>'), "KNOWN_DISABLING", "SPRING"),
    (mjcf(before='<option><flag energy="enable"/></option>'), "KNOWN_ENABLING", "ENERGY"),
])  # fmt: skip
def test_what_a_newer_mujoco_brings_is_refused_by_name_where_it_is_used(text, names, name, monkeypatch):
    read(text)
    monkeypatch.setattr(refused, names, getattr(refused, names) - {name})
    with pytest.raises(ModelError, match=name.lower()):
        read(text)
    read(mjcf())
