"""Files that cannot be compared: one line each."""

import pytest
from files import PLAIN, TENDON, TWO, mjcf

from compare.engines.mujoco import ModelError, read

ALONG = '<actuator><general name="a" tendon="t" armature="1"/></actuator>'
BALL = '<body><joint type="ball" name="w"/><geom size="0.1"/><body><joint name="w x"/><geom size="0.1"/></body></body>'
REFUSED = {  # a word of why, and the file
    "tendon 't'": mjcf(TWO, after=TENDON.format('armature="1"')),
    "actuator 'a'": mjcf(TWO, after=TENDON.format("") + ALONG),
    "flex 'soft'": mjcf(
        PLAIN + '<flexcomp name="soft" type="grid" count="2 2 2" spacing=".1 .1 .1" dim="3" mass="1">'
        '<elasticity young="1e3"/></flexcomp>'
    ),
    "mass": mjcf("<body><joint/></body>"),
    "body_pos of 'far'": mjcf('<body name="far" pos="inf 0 0"><geom size="1"/></body>' + PLAIN),
    "dof_damping of 'j'": mjcf(PLAIN.replace('name="j"', 'name="j" damping="-1"')),
    "actuator_gainprm of 's'": mjcf(after='<actuator><position name="s" joint="j" kp="nan"/></actuator>'),
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
