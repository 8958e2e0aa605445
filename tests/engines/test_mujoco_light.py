"""A model is read without textures, visual meshes and geoms, and moves the same; the full one is compiled once."""

import pickle

import mujoco
import pytest

from compare.engines.mujoco.light import moves_the_same, without_geoms, without_visuals
from compare.engines.mujoco.lock import editable
from compare.engines.mujoco.reading import read

PIXELS = 3000  # of a texture's edges: 27 MB
STATED = '<inertial pos="0.1 0.2 0.3" mass="7" diaginertia="1 1.1 1.2"/>'
SHAPE = '<geom type="capsule" size="0.1 0.2" pos="0.1 0.02 0.3"/>'
BODIES = f"""<worldbody><geom type="plane" size="1 1 1" material="m"/>
<body><freejoint/>{STATED}<geom type="box" pos="0.2 0 0.1" size="0.1 0.2 0.3"/></body>
<body pos="0 0 3"><joint name="a"/>{STATED}{SHAPE}<body><joint name="b"/>{STATED}{SHAPE}</body>
<body pos="1 0 0"><joint name="c" axis="0 1 0"/>{STATED}{SHAPE}<site name="s"/></body></body></worldbody>
<sensor><rangefinder site="s"/></sensor>"""
TEXTURE = f'<asset><texture name="t" type="2d" builtin="flat" width="{PIXELS}" height="{PIXELS}"/>'
MATERIAL = '<material name="m" texture="t"/></asset>'
OPTIONS = [
    'inertiafromgeom="auto"', 'inertiafromgeom="true"', 'inertiafromgeom="false"', 'settotalmass="5"',
    'inertiafromgeom="true" settotalmass="3"', 'balanceinertia="true" boundmass="8" boundinertia="2"', 'alignfree="true"',
]  # fmt: skip


def text(compiler: str = "", more: str = "") -> str:
    return f"<mujoco><compiler {compiler}/>{TEXTURE}{MATERIAL}{more}{BODIES}</mujoco>"


@pytest.mark.parametrize(
    "compiler, option", [*((compiler, "") for compiler in OPTIONS), (OPTIONS[0], '<option density="1.2"/>')]
)
@pytest.mark.filterwarnings("ignore:compiler attribute")
def test_what_is_taken_out_changes_no_number_of_the_motion(compiler, option):
    source = text(compiler, option)
    spec = editable(source)
    spec.compiler.fusestatic = False
    whole = spec.compile()
    for lighter in (without_visuals, without_geoms):
        assert moves_the_same(whole, lighter(editable(source)).compile())


def test_a_changed_number_is_seen():
    one, other = (without_geoms(editable(text(compiler))).compile() for compiler in ("", 'boundmass="7.0000001"'))
    assert not moves_the_same(one, other)


def test_the_model_that_is_read_is_small_and_the_full_one_has_its_contacts():
    reading = read(text())
    assert mujoco.mj_sizeModel(mujoco.MjModel.from_xml_string(text())) > 3 * PIXELS**2
    assert mujoco.mj_sizeModel(reading.model) < 1e5
    assert reading.model.ngeom == 0 and reading.full_model.ngeom == 5
    assert reading.full_model is reading.full_model
    assert len(pickle.dumps(reading)) < 2e5


def test_a_geom_that_a_tendon_wraps_around_stays():
    wrapping = """<mujoco><worldbody><site name="p"/><body pos="0 0 1"><joint/><geom name="g" size="0.1"/>
    <geom size="0.2" mass="0"/><site name="q" pos="0.5 0 0"/></body></worldbody>
    <tendon><spatial stiffness="2"><site site="p"/><geom geom="g"/><site site="q"/></spatial>
    </tendon></mujoco>"""
    reading = read(wrapping)
    assert [reading.model.geom(i).name for i in range(reading.model.ngeom)] == ["g"]
    assert moves_the_same(reading.model, reading.full_model)
