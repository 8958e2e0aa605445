"""From a file to MuJoCo: what is refused in one line, whose names and frames count, and what is left out of the model."""

import pickle

import mujoco
import numpy as np
import pytest
from crane import TREE
from crane import XML as CRANE
from edited import XML

from compare.engines.mujoco import ModelError, Source, load, parse, read
from compare.engines.mujoco.parameters import parameters
from compare.robots.arm import ARM

JOINTS = 'name="gamma" type="hinge"'
NUMBERS = [f"body_{name}" for name in ("mass", "inertia", "pos", "quat", "ipos", "iquat")]
PIXELS = 3000  # of a texture's edges: 27 MB
STATED = '<inertial pos="0.1 0.2 0.3" mass="7" diaginertia="1 1.1 1.2"/>'
SHAPE = '<geom type="capsule" size="0.1 0.2" pos="0.1 0.02 0.3"/>'
BODIES = f"""<worldbody><geom type="plane" size="1 1 1" material="m"/>
<body><freejoint/>{STATED}<geom type="box" pos="0.2 0 0.1" size="0.1 0.2 0.3"/></body>
<body pos="0 0 3"><joint name="a"/>{STATED}{SHAPE}<body><joint name="b"/>{STATED}{SHAPE}</body>
<body pos="1 0 0"><joint name="c" axis="0 1 0"/>{STATED}{SHAPE}<site name="s"/></body></body></worldbody>
<sensor><rangefinder site="s"/></sensor>"""
ASSETS = f"""<asset><texture name="t" type="2d" builtin="flat" width="{PIXELS}" height="{PIXELS}"/>
<material name="m" texture="t"/></asset>"""


def edited(old, new):
    assert XML.count(old) == 1
    return XML.replace(old, new)


@pytest.mark.parametrize("content, word", [
    (None, r"model\.xml"), (b"\xff\xfe\x00", "MJCF"), (b"<mujoco/>", "none.*alpha, beta, gamma"),
    (b"<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "compile"),
    (edited('name="gamma"', "").encode(), r"joint 2 \(hinge\)"),
    (edited(JOINTS, JOINTS.replace("hinge", "slide")).encode(), r"gamma \(slide\)"),
])  # fmt: skip
def test_a_file_that_is_not_the_arm(tmp_path, content, word):
    path = tmp_path / "model.xml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ModelError, match=word) as error:
        load(path, ARM.tree)
    assert "\n" not in str(error.value)
    # a comment in another encoding is no obstacle
    path.write_bytes(XML.encode().replace(b"<!--", b"<!-- \xe9 ", 1))
    assert load(path, ARM.tree).of(ARM.case()).mass_matrix(np.zeros(3))[0, 0] == pytest.approx(0.2445)


def test_a_body_that_no_hinge_tells_is_found_by_its_name():
    for name in ("foot", "hook"):
        with pytest.raises(ModelError, match=f"'{name}'"):
            parse(CRANE.replace(f'name="{name}"', 'name="other"'), TREE)
    assert parse(CRANE.replace('name="boom"', 'name="other"'), TREE).bodies == [1, 2, 4, 5, 3]
    # hinges that have exchanged their names: the forearm is one of the arm's bodies, no other has mass
    exchanged = XML.replace('"alpha"', '"x"').replace('"gamma"', '"alpha"').replace('"x"', '"gamma"')
    assert parse(exchanged, ARM.tree).bodies == [1, 2]


def test_body_axes_are_those_of_the_world_at_zero(rng):
    """A forearm frame that lies turned in the file describes the same arm."""
    turned = edited('"forearm" pos="0 0 -0.3"', '"forearm" pos="0 0 -0.3" euler="0 0 1.5707963267948966"')
    turned = turned.replace(f'{JOINTS} axis="0 1 0"', f'{JOINTS} axis="1 0 0"')
    turned = turned.replace('pos="0.15 0 0" mass="1.5" diaginertia="0.001 0.019 0.019"',
                            'pos="0 -0.15 0" mass="1.5" diaginertia="0.019 0.001 0.019"')  # fmt: skip
    engine, arm = (parse(text, ARM.tree).of(ARM.case()) for text in (turned, XML))
    q, qd = rng.uniform(-3, 3, (2, 50, 3))
    assert np.allclose(engine.angular_velocities(q, qd), arm.angular_velocities(q, qd), atol=1e-12)
    for name in ("inertia", "com"):
        assert np.allclose(parameters(engine)[name], parameters(arm)[name], atol=1e-15)


@pytest.mark.parametrize("compiler, option", [
    ('inertiafromgeom="auto"', '<option density="1.2"/>'), ('inertiafromgeom="true"', ""),
    ('settotalmass="3"', ""), ('balanceinertia="true" boundmass="8" boundinertia="2"', ""), ('alignfree="true"', ""),
])  # fmt: skip
@pytest.mark.filterwarnings("ignore:compiler attribute")
def test_what_is_taken_out_changes_no_number_of_the_motion(compiler, option):
    assets = ASSETS.replace(str(PIXELS), "2")
    source = Source(f"<mujoco><compiler {compiler}/>{option}{assets}{BODIES}</mujoco>")
    complete = source.spec.copy()
    complete.compiler.fusestatic = False
    whole = complete.compile()
    for lighter in (source.model, source.without({}, bare=True)):
        for name in (*NUMBERS, "dof_M0", "jnt_axis"):
            assert np.array_equal(getattr(whole, name), getattr(lighter, name)), name


def test_the_model_that_is_read_is_small_and_has_its_contacts():
    text = f"<mujoco>{ASSETS}{BODIES}</mujoco>"
    reading = read(text)
    assert mujoco.mj_sizeModel(mujoco.MjModel.from_xml_string(text)) > 3 * PIXELS**2
    assert mujoco.mj_sizeModel(reading.model) < 1e5 and len(pickle.dumps(reading)) < 2e5
    assert reading.model.ngeom == 5
