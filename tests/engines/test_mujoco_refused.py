"""Files that cannot be compared, and what a newer MuJoCo brings: one line each."""

import mujoco
import pytest
from files import PLAIN, TENDON, TWO, mjcf

from compare.engines.mujoco import ModelError, known, read, unknown

REFUSED = {
    "tendon armature": (mjcf(TWO, after=TENDON.format('armature="1"')), "tendon 't'"),
    "armature along a tendon": (
        mjcf(TWO, after=TENDON.format("") + '<actuator><general name="a" tendon="t" armature="1"/></actuator>'),
        "actuator 'a'",
    ),
    "flex": (
        mjcf(PLAIN + '<flexcomp name="soft" type="grid" count="3 3 1" spacing="0.1 0.1 0.1" radius="0.01" dim="2" mass="1"/>'),
        "flex 'soft'",
    ),
    "plugin": (
        mjcf(PLAIN.replace("</body>", '<plugin plugin="mujoco.elasticity.cable"/></body>'),
             '<extension><plugin plugin="mujoco.elasticity.cable"/></extension>'),
        "plugin",
    ),
    "no joint": (mjcf('<body><geom size="0.1"/></body>'), "no joint"),
    "empty": ("<mujoco/>", "no joint"),
    "no mass": (mjcf('<body><joint/></body>'), "mass"),
    "not a number": (mjcf(PLAIN.replace('name="j"', 'name="j" damping="nan"')), "damping of joint 'j'"),
    "no axis": (mjcf(PLAIN.replace('name="j"', 'axis="nan 0 1"')), "axis of joint 'joint 0'"),
    "infinite": (mjcf('<body name="far" pos="inf 0 0"><geom size="1"/></body>' + PLAIN), "pos of body 'far'"),
    "negative damping": (mjcf(PLAIN.replace('name="j"', 'name="j" damping="-1"')), "damping of joint 'j' is -1"),
    "gravity": (mjcf(before='<option gravity="0 nan 0"/>'), "gravity"),
    "posture": (mjcf(after='<keyframe><key name="up" qpos="inf"/></keyframe>'), "keyframe 'up'"),
    "same axis twice": (mjcf(PLAIN.replace('<joint name="j"/>', "<joint/><joint/>")), "together"),
    "a column taken": (
        mjcf('<body><joint type="ball" name="w"/><geom size="0.1"/><body><joint name="w x"/><geom size="0.1"/></body></body>'),
        "'w x'",
    ),
    "a name taken": (
        mjcf('<body><freejoint name="r"/><geom size="0.1"/><body><joint name="r x"/><geom size="0.1"/></body></body>'),
        "'r x'",
    ),
    "broken": ("<mujoco><worldb", "XML"),
    "something else": ("hello", "MJCF"),
}  # fmt: skip


@pytest.mark.parametrize("name", REFUSED)
def test_what_cannot_be_compared_is_refused_in_one_line(name, capfd):
    text, why = REFUSED[name]
    if name == "plugin" and mujoco.__version__ >= "4":
        pytest.skip("this MuJoCo's package brings no plugin with a passive force")
    with pytest.raises(ModelError, match=why) as error:
        read(text)
    assert "\n" not in str(error.value)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize(
    ("content", "why"),
    [
        (None, "No such file"),
        ("<mujoco><worldbody><body><geom type='mesh' mesh='m'/></body></worldbody></mujoco>", "mesh 'm' not found"),
        (
            "<mujoco><asset><mesh name='m' file='gone.stl'/></asset>"
            "<worldbody><body><joint/><geom type='mesh' mesh='m'/></body></worldbody></mujoco>",
            "gone.stl",
        ),
        ("<mujoco><include file='gone.xml'/></mujoco>", "gone.xml"),
    ],
)
def test_a_file_that_cannot_be_read_is_named_in_one_line(content, why, tmp_path):
    path = tmp_path / "robot.xml"
    if content:
        path.write_text(content)
    with pytest.raises(ModelError, match=r"robot\.xml") as error:
        read(path)
    assert why in str(error.value) and "\n" not in str(error.value)


def test_a_callback_is_refused():
    mujoco.set_mjcb_passive(lambda model, data: None)
    try:
        with pytest.raises(ModelError, match="mjcb_passive"):
            read(mjcf())
    finally:
        mujoco.set_mjcb_passive(None)


@pytest.mark.parametrize(
    ("text", "names", "name", "found"),
    [
        (mjcf(TWO, after=TENDON.format("")), "KNOWN_COUNTS", "ntendon", "ntendon"),
        (mjcf(PLAIN.replace('name="j"', 'name="j" stiffness="1"')), "KNOWN_FIELDS", "jnt_stiffness", "jnt_stiffness"),
        (mjcf(before='<option wind="1 0 0"/>'), "KNOWN_OPTIONS", "wind", "the option wind"),
        (mjcf(before='<option><flag spring="disable"/></option>'), "KNOWN_DISABLING", "SPRING", "the flag spring"),
        (mjcf(before='<option><flag energy="enable"/></option>'), "KNOWN_ENABLING", "ENERGY", "the flag energy"),
    ],
)
def test_what_a_newer_mujoco_brings_is_refused_by_name_where_it_is_used(text, names, name, found, monkeypatch):
    read(text)
    monkeypatch.setattr(unknown, names, getattr(known, names) - {name})
    with pytest.raises(ModelError, match=found):
        read(text)
    read(mjcf())
