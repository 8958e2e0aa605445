"""From a file to MuJoCo: what is refused, whose names and frames count, what is left out, and what is said of all that."""

import os
import pickle

import mujoco
import numpy as np
import pytest
from helpers.crane import TREE
from helpers.crane import XML as CRANE
from helpers.edited import XML, edited
from helpers.files import PLAIN, TENDON, TWO, mjcf
from helpers.runs import posix

import compare
from compare.core.text import say
from compare.engines.mujoco import ModelError, Source, engine, parse, read
from compare.engines.mujoco.parameters import remarks
from compare.robots.arm import ARM

JOINTS = 'name="gamma" type="hinge"'
FIELDS = [f"body_{name}" for name in ("mass", "inertia", "pos", "quat", "ipos", "iquat")]
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
ALONG = '<actuator><general name="a" tendon="t" armature="1"/></actuator>'
BALL = '<body><joint type="ball" name="w"/><geom size="0.1"/><body><joint name="w x"/><geom size="0.1"/></body></body>'
FUSED = '<compiler fusestatic="true" inertiafromgeom="true"/>'
LINK = f'<body name="c" pos="0.5 0 0">{STATED}</body>'
REFUSED = {  # a word of why, and the file
    "leaves out the <inertial>": mjcf(PLAIN.replace("</body>", f"{LINK}</body>"), FUSED),
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
BODY = '<body name="b"><joint name="j" axis="0 1 0"/><inertial pos="0.1 0 0" mass="1" diaginertia="1 1.5 2"/></body>'
INERTIAL = '<inertial><mass value="2"/><inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
MESH = '<collision><geometry><mesh filename="{}"/></geometry></collision>'
TETRAHEDRON = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"


@pytest.mark.parametrize("content, word", [
    (None, r"model\.xml"), (b"\xff\xfe\x00", "MJCF"), (b"<mujoco/>", "none.*alpha, beta, gamma"),
    (b"<mujoco><worldbody><body><joint/></body></worldbody></mujoco>", "compile"),
    (edited(('name="gamma"', "")).encode(), r"joint 2 \(hinge\)"),
    (edited((JOINTS, JOINTS.replace("hinge", "slide"))).encode(), r"gamma \(slide\)"),
])  # fmt: skip
def test_a_file_that_is_not_the_arm(tmp_path, content, word):
    path = tmp_path / "model.xml"
    if content is not None:
        path.write_bytes(content)
    with pytest.raises(ModelError, match=word) as error:
        parse(path, ARM.tree)
    assert "\n" not in str(error.value)
    # a comment in another encoding is no obstacle
    path.write_bytes(XML.encode().replace(b"<!--", b"<!-- \xe9 ", 1))
    assert parse(path, ARM.tree).of(ARM.case()).mass_matrix(np.zeros(3))[0, 0] == pytest.approx(0.2445)


def test_a_body_that_no_hinge_tells_is_found_by_its_name():
    for name in ("foot", "hook"):
        with pytest.raises(ModelError, match=f"'{name}'"):
            parse(CRANE.replace(f'name="{name}"', 'name="other"'), TREE)
    assert parse(CRANE.replace('name="boom"', 'name="other"'), TREE).bodies == [1, 2, 4, 5, 3]
    # hinges that have exchanged their names: the forearm is one of the arm's bodies, no other has mass
    exchanged = XML.replace('"alpha"', '"x"').replace('"gamma"', '"alpha"').replace('"x"', '"gamma"')
    assert parse(exchanged, ARM.tree).bodies == [1, 2]


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
        for name in (*FIELDS, "dof_M0", "jnt_axis"):
            assert np.array_equal(getattr(whole, name), getattr(lighter, name)), name
        if mujoco.mj_version() >= 4_000_000:  # before, a material asks for its texture
            assert lighter.ntexdata == 0 < whole.ntexdata


def test_the_rotor_of_a_joint_stays_where_a_tendon_of_its_name_goes():
    rotor = '<actuator><motor joint="t" armature="0.1"/><motor tendon="t"/></actuator>'
    named = mjcf(TWO, after=TENDON.format("") + rotor).replace('"j"', '"t"')
    model = Source(named).without({}, bare=True)
    assert model.ntendon == 0 and model.actuator_armature.tolist() == [0.1]


def test_what_never_moves_has_its_part_of_a_total_mass():
    mesh = '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>'
    still = '<body><geom type="mesh" mesh="m"/></body>'
    source = Source(mjcf(PLAIN + still, f'<compiler settotalmass="3"/>{mesh}'))
    assert source.without_meshes().body("b").mass == source.model.body("b").mass < 3.0


@pytest.mark.parametrize("why", REFUSED)
def test_what_cannot_be_compared_is_refused_in_one_line(why, capfd):
    if why == "leaves out the <inertial>" and mujoco.__version__ < "4":
        pytest.skip("3.10 keeps it")
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


def urdf(base: str, kind: str = "continuous", inertial: str = "", mesh: str = "") -> str:
    links = f'<link name="{base}">{inertial}</link><link name="rod">{INERTIAL}{mesh}</link>'
    joint = f'<parent link="{base}"/><child link="rod"/><axis xyz="0 0 1"/>'
    return f'<robot name="r">{links}<joint name="j" type="{kind}">{joint}</joint></robot>'


def said(source) -> dict:
    found = remarks(read(source), True)
    assert all(map(say, found))
    return {one.kind: one.values for one in found}


def test_what_is_off_or_changed_is_said_where_equations_differ_and_nothing_where_they_agree():
    text = mjcf(BODY.replace('name="b"', 'name="b" gravcomp="1"'))
    assert list(said(text)) == ["switched_off"] and said(mjcf(BODY)) == {}
    key = mjcf(BODY).replace("</mujoco>", '<keyframe><key name="k" qpos="nan"/></keyframe></mujoco>')
    assert [one.feature for one in said(key)["switched_off"]["features"]] == ["unusable keyframe"]
    total = said(mjcf(BODY, '<compiler settotalmass="3"/>'))
    assert total["changed"] == {"why": "settotalmass", "places": {"mass": ["b"], "inertia": ["b"]}}
    compare.assert_agrees(text, mass_matrix=[[[1.51]]], q=[[0.3]])
    with pytest.raises(AssertionError, match="gravcomp"):
        compare.assert_agrees(text, gravity=[[0.0]], q=[[0.3]])


@pytest.mark.parametrize("base, kind, inertial, joints, fixed", [
    ("trunk", "continuous", INERTIAL, 1, {"link": "trunk", "mass": 2.0}), ("trunk", "continuous", "", 1, None),
    ("world", "floating", INERTIAL, 4, None), ("trunk", "floating", "", 4, None), ("trunk", "planar", "", 3, None),
])  # fmt: skip
def test_a_base_that_no_joint_frees_is_said_to_be_fixed(base, kind, inertial, joints, fixed, tmp_path):
    (tmp_path / "r.urdf").write_text(urdf(base, kind, inertial))
    assert len(read(tmp_path / "r.urdf").tree.joint_names) == joints
    assert said(tmp_path / "r.urdf").get("fixed_base") == fixed


@pytest.mark.parametrize("folder, place", [
    ("robot/urdf", "robot/meshes/a.obj"), (".", "robot/meshes/a.obj"), ("mine", "mine/a.obj"), ("robot/urdf", "a.obj"),
])  # fmt: skip
def test_a_mesh_of_a_package_is_found_above_the_file_or_beside_it(folder, place, tmp_path):
    file = tmp_path / folder / "r.urdf"
    robot = urdf("base", mesh=MESH.format("package://robot/meshes/a.obj"))
    for path, text in ((file, robot), (tmp_path / place, TETRAHEDRON)):
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    if place != "a.obj":
        assert read(file).model.nmesh == 1
        return
    assert read(file).source.missing == ("package://robot/meshes/a.obj",)


BOX = """<mujoco><asset><mesh name="m" file="hull.stl"/><hfield name="h" file="hill.png" size="1 1 1 1"/></asset><worldbody>
<geom type="hfield" hfield="h"/><body name="b"><joint name="j" axis="0 1 0"/>{}
<geom name="hull" type="mesh" mesh="m"/><geom name="ball" size="0.1"/></body></worldbody>
<contact><pair geom1="hull" geom2="ball"/></contact></mujoco>"""
STATED = '<inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.01"/>'


def test_meshes_that_are_not_there_are_left_out_and_said():
    source = Source(BOX.format(STATED))
    assert source.missing == ("hull.stl", "hill.png") and said(source)["missing"] == {"files": source.missing}
    model = Source(BOX.format(STATED).replace("hull.stl", "hull.dae")).without({})
    for m in (source.model, model, pickle.loads(pickle.dumps(source)).without({}, bare=False)):
        assert m.ngeom == 1 and m.npair == 0 and m.body("b").mass == 2.0


@pytest.mark.parametrize("inertial", ["", "inertiafromgeom"])
def test_a_mesh_that_is_not_there_cannot_give_an_inertia(inertial):
    text = BOX.format(STATED if inertial else "")
    text = text.replace("<asset>", f'<compiler {inertial}="true"/><asset>') if inertial else text
    with pytest.raises(ModelError, match=r"'b' is that of its mesh hull\.stl, which cannot be read$"):
        Source(text)
    with pytest.raises(ModelError, match=r"body 1, .* is that of its mesh hull\.stl"):
        Source(text.replace(' name="b"', ""))
    with pytest.raises(ModelError, match=r"mesh package://?r/hull\.stl, .* beside the file"):
        Source(text.replace("hull.stl", "package://r/hull.stl"))


def test_the_base_of_a_urdf_floats_where_that_is_asked():
    fixed, floating = (Source(urdf("base", inertial=INERTIAL), flag) for flag in (False, True))
    assert (fixed.model.nv, floating.model.nv) == (1, 7)
    assert "fixed_base" in said(fixed) and "fixed_base" not in said(floating)
    assert pickle.loads(pickle.dumps(floating)).without({"j": 0.0}).nv == 6
    with pytest.raises(ModelError, match="only the base of a URDF"):
        Source(BOX.format(STATED), True)


LINKS = """<mujoco><worldbody><body name="a"><joint name="j" axis="0 1 0"/>{}
  <body name="b" pos="0.3 0 0"><joint name="k" axis="0 1 0"/>
  <inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/></body></body></worldbody></mujoco>"""
MASS = '<inertial pos="0.1 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>'


def test_a_file_with_a_body_more_on_a_joint_than_the_solution_is_refused_with_both_numbers():
    more, less = read(LINKS.format(MASS)), read(LINKS.format(""))
    assert len(engine(more, more).bodies) == 2 and len(engine(less, less).bodies) == 1
    for file, solution, found, stated in ((more, less, 1, 0), (less, more, 0, 1)):
        with pytest.raises(ModelError, match=f"on joint j: {found}, in the solution {stated}"):
            engine(file, solution)


def test_bodies_whose_joints_are_in_another_order_are_known_by_their_names():
    yaw, pitch = '<joint name="yaw" axis="0 0 1"/>', '<joint name="pitch" axis="0 1 0"/>'
    tip = f'<body name="{{}}"><joint name="tip" axis="1 0 0"/>{MASS}</body>'
    text = f'<mujoco><worldbody><body name="a">{{}}{MASS}{tip}</body></worldbody></mujoco>'
    orders = (pitch + yaw, "b"), (yaw + pitch, "b"), (yaw + pitch, "c")
    here, there, other = (read(text.format(*parts)) for parts in orders)
    assert [here.model.body(body).name for body in engine(here, there).bodies] == ["a", "b"]
    with pytest.raises(ModelError, match="on joint yaw: 1, in the solution 0"):
        engine(here, other)
