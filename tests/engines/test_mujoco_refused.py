"""Files that cannot be compared: one line each."""

import os

import pytest
from files import PLAIN, TENDON, TWO, mjcf
from runs import posix

from compare.engines.mujoco import ModelError, parse, read

ALONG = '<actuator><general name="a" tendon="t" armature="1"/></actuator>'
BALL = '<body><joint type="ball" name="w"/><geom size="0.1"/><body><joint name="w x"/><geom size="0.1"/></body></body>'
REFUSED = {  # a word of why, and the file
    "tendon 't'": mjcf(TWO, after=TENDON.format('armature="1"')),
    "actuator 'a'": mjcf(TWO, after=TENDON.format("") + ALONG),
    "flex 'soft'": mjcf(PLAIN + '<flexcomp name="soft" type="grid" count="2 2 2" spacing=".1 .1 .1" dim="3" mass="1">'
                         '<elasticity young="1e3"/></flexcomp>'),
    "mass": mjcf("<body><joint/></body>"),
    "pos of 'far' is inf;": mjcf('<body name="far" pos="inf 0 0"><geom size="1"/></body>' + PLAIN),
    "damping of 'j' is -1;": mjcf(PLAIN.replace('name="j"', 'name="j" damping="-1"')),
    "gainprm of 's'": mjcf(after='<actuator><position name="s" joint="j" kp="nan"/></actuator>'),
    "together": mjcf(PLAIN.replace('<joint name="j"/>', "<joint/><joint/>")), "'w x'": mjcf(BALL),
    "MJCF": "hello", "1,002 speeds": mjcf("<body><freejoint/><geom size='1'/></body>" * 167),
}  # fmt: skip
NUMBERS = """<mujoco><option timestep="{timestep}" gravity="0 0 {gravity}"/><worldbody><body name="b">
  <joint name="j" axis="0 1 0" armature="{armature}" damping="{damping}" stiffness="{stiffness}"/>
  <inertial pos="0 0 {com}" mass="{mass}" diaginertia="1 1 1"/></body></worldbody></mujoco>"""
RANGES = {  # the last that is accepted and the first that is not
    "timestep": [("1e-6", "9e-7"), ("5", "5.1"), ("0.002", "nan"), ("0.002", "0")], "gravity": [("-1e30", "-1.1e30")],
    "armature": [("1e30", "1.1e30")], "damping": [("1e30", "1e300")], "stiffness": [("0", "-1e-300"), ("1e30", "1.1e30")],
    "com": [("-1e30", "1.1e30")], "mass": [("1e30", "1.1e30"), ("1e30", "inf")],
}  # fmt: skip


@pytest.mark.parametrize("why", REFUSED)
def test_what_cannot_be_compared_is_refused_in_one_line(why, capfd):
    with pytest.raises(ModelError, match=why) as error:
        read(REFUSED[why])
    assert "\n" not in str(error.value) and capfd.readouterr() == ("", "")


@pytest.mark.parametrize("why, content", [
    ("No such file", None), ("gone.xml", b"<mujoco><include file='gone.xml'/></mujoco>"),
    ("has names that are not UTF-8", mjcf(PLAIN.replace('"j"', '"h\xfcft"')).encode("latin-1")),
])  # fmt: skip
def test_a_file_that_cannot_be_read_is_named_in_one_line(why, content, tmp_path):
    path = tmp_path / "robot.xml"
    if content:
        path.write_bytes(content)
    with pytest.raises(ModelError, match=rf"robot\.xml.*{why}") as error:
        read(path)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name, inside, outside", [(name, *pair) for name in RANGES for pair in RANGES[name]])
def test_numbers_beyond_the_range_that_is_judged_are_refused_with_the_number(name, inside, outside):
    good = dict.fromkeys(RANGES, "1")
    assert read(NUMBERS.format(**good | {name: inside})).tree
    reading = read(NUMBERS.format(**good))
    for act in (read, lambda source: parse(source, reading.tree)):
        with pytest.raises(ModelError, match=rf" is {float(outside):g}.*; expected from".replace("+", r"\+")):
            act(NUMBERS.format(**good | {name: outside}))


@posix
@pytest.mark.parametrize("text", [
    "", "<mujoco><include file='pipe.stl'/></mujoco>",
    "<mujoco><compiler meshdir='sub'/><asset><mesh name='m' file='a/pipe.stl'/></asset></mujoco>",
    "<mujoco><include file='sub/part.xml'/></mujoco>",
])  # fmt: skip
def test_a_pipe_is_never_waited_for(text, tmp_path):
    (tmp_path / "sub" / "a").mkdir(parents=True)
    for place in (tmp_path, tmp_path / "sub", tmp_path / "sub" / "a"):
        os.mkfifo(place / "pipe.stl")
    part = "<mujoco><asset><hfield name='h' file='pipe.stl'/></asset></mujoco>"
    (tmp_path / "sub" / "part.xml").write_text(part)
    (path := tmp_path / "robot.xml").write_text(text)
    with pytest.raises(ModelError, match=r"pipe\.stl is a pipe"):
        read(path if text else tmp_path / "pipe.stl")
