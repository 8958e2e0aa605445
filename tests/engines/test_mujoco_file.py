"""From a file to MuJoCo: what is read, what is refused in one line, whose names and frames count."""

import numpy as np
import pytest

from compare.engines.mujoco import ModelError, load, parse
from compare.engines.mujoco.parameters import parameters
from compare.robots.arm import ARM

XML = ARM.mjcf.read_text(encoding="utf-8")


def edited(old, new):
    assert XML.count(old) == 1
    return XML.replace(old, new)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ModelError, match=r"no\.xml"):
        load(tmp_path / "no.xml", ARM.tree)


JOINTS = 'name="gamma" type="hinge"'


@pytest.mark.parametrize(
    "content, word",
    [
        (b"not xml", "MJCF"),
        (b"\xff\xfe\x00", "MJCF"),
        (b"<robot/>", "none"),
        (b"<mujoco/>", "none.*alpha, beta, gamma"),
        (b"<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "compile"),
        (edited('name="gamma"', 'name="elbow"').encode(), r"elbow \(hinge\)"),
        (edited('name="gamma"', "").encode(), r"joint 2 \(hinge\)"),
        (edited(JOINTS, JOINTS.replace("hinge", "slide")).encode(), r"gamma \(slide\)"),
        (edited('"upper_arm" pos="0 0 0">', '"upper_arm"><freejoint name="loose"/>').encode(), "compile|loose"),
    ],
)
def test_a_file_that_is_not_the_arm(tmp_path, content, word):
    path = tmp_path / "model.xml"
    path.write_bytes(content)
    with pytest.raises(ModelError, match=word) as error:
        load(path, ARM.tree)
    assert "\n" not in str(error.value)


def test_body_axes_are_those_of_the_world_at_zero(rng):
    """A forearm frame that lies turned in the file describes the same arm."""
    turned = edited(
        '<body name="forearm" pos="0 0 -0.3">', '<body name="forearm" pos="0 0 -0.3" euler="0 0 1.5707963267948966">'
    )
    turned = turned.replace('name="gamma" type="hinge" axis="0 1 0"', 'name="gamma" type="hinge" axis="1 0 0"')
    turned = turned.replace('pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"',
                            'pos="0 -0.15 0" mass="1.5" diaginertia="0.019 0.001 0.019"')  # fmt: skip
    engine, arm = (parse(text, ARM.tree).of(ARM.case()) for text in (turned, XML))
    q, qd = rng.uniform(-3, 3, (2, 50, 3))
    assert np.allclose(engine.angular_velocities(q, qd), arm.angular_velocities(q, qd), atol=1e-12)
    assert np.allclose(engine.jacobians(q)[1], arm.jacobians(q)[1], atol=1e-12)
    assert np.allclose(parameters(engine)["inertia"], parameters(arm)["inertia"], atol=1e-15)
    assert np.allclose(parameters(engine)["com"], parameters(arm)["com"], atol=1e-15)


def test_a_comment_in_another_encoding_is_no_obstacle(tmp_path):
    path = tmp_path / "model.xml"
    path.write_bytes(XML.encode().replace(b"<!--", b"<!-- \xe9 ", 1))
    assert load(path, ARM.tree).of(ARM.case()).mass_matrix(np.zeros(3))[0, 0] == pytest.approx(0.2445)
