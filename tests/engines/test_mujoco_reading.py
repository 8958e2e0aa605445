"""A file read as a Tree: both engines have the same numbers, also with joints locked; what is listed; what a file states."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from helpers.files import PLAIN, TENDON, TWO, URDF, assert_the_same, case_of, mjcf
from helpers.trees import random_state
from hypothesis import given, settings
from hypothesis import strategies as st
from models import KINDS, PATHS, gymnasium_files, random_tree, with_features

import tmt
from compare.engines.mujoco import ModelError, Source, engine, read
from compare.engines.mujoco.inventory import REASONS
from compare.engines.mujoco.parameters import stated_numbers
from compare.judge.scale import EPS

FEW = ("ant.xml", "humanoid.xml", "reacher.xml", "swimmer.xml")
SLOW = [pytest.mark.slow]
PUBLISHED = [pytest.param(path, marks=SLOW * (path.name not in FEW)) for path in gymnasium_files()]
SOME_KINDS = st.lists(st.sampled_from(KINDS), min_size=1, max_size=3, unique=True)
POINT = '<body name="point" pos="0.5 0 0"><inertial pos="0 0 0.1" mass="2" diaginertia="0 0 0"/></body>'
SHEET = '<flexcomp name="f" type="grid" count="2 2 1" spacing=".1 .1 .1" dim="2" mass="1" rigid="true"/>'
FIELDS = {"gravity": "gravity", "damper": "damping", "spring": "stiffness"}  # of the Tree, by the flag
OF_MIXED = [*KINDS, "armature", "damping", "spring", "limit", "clamp", "actuator", "keyframe"]
LIGHT = PLAIN.replace('name="b"', 'name="b" gravcomp="1"').replace('name="j"', 'name="j" axis="0 1 0"')
MOTORS = '<actuator><motor name="a" joint="j"/><motor name="b" joint="j" forcerange="-1 1"/></actuator>'
EQUALITIES = '<equality><weld body1="c"/><joint joint1="j" joint2="k" active="false"/></equality>'
WALLS = """<geom name="floor" type="plane" size="1 1 1"/><geom name="wall" size="1" contype="0" conaffinity="0"/>
<geom name="picture" size="1" contype="0" conaffinity="0"/>"""
KEYS = '<keyframe><key name="up" qpos="inf"/><key name="pushed" ctrl="inf 0"/><key qpos="1"/></keyframe>'
MORE = {  # feature: file, names
    "contact": (mjcf(PLAIN + WALLS, after='<contact><pair geom1="wall" geom2="g"/></contact>'), ("floor", "wall", "g")),
    "armature": (mjcf(after='<actuator><general name="a" joint="j" gear="2" armature="1"/></actuator>'), ("a",)),
    "frictionloss": (mjcf(PLAIN.replace('name="j"', 'name="j" frictionloss="1"')), ("j",)),
    "clamp": (mjcf(PLAIN.replace('name="j"', 'name="j" actuatorfrcrange="-1 1"'), after=MOTORS), ("b", "j")),
    "fluid": (mjcf(before='<option density="1000" viscosity="0.1" wind="3 0 0"/>'), ("density", "viscosity")),
    "gravcomp": (mjcf(LIGHT), ("b",)), "equality": (mjcf(TWO, after=EQUALITIES), ("equality 0",)),
    "unusable keyframe": (mjcf(after=MOTORS + KEYS), ("up", "pushed")),
    "tendon": (mjcf(TWO, after=TENDON.format('stiffness="9" damping="3" springlength="0.3" range="0 1"')), ("t",)),
}  # fmt: skip
OTHERS = {  # what is listed as other: a joint and an option of the file, and the joint of a file without
    "dof_dampingpoly of j": ('damping="1 2 3"', "", 'damping="1"'),
    "jnt_springyield of j": ('stiffness="10" springyield="0.1"', "", 'stiffness="10"'),
    "flag eulerdamp": ('damping="1"', '<option><flag eulerdamp="disable"/></option>', 'damping="1"'),
    "flag invdiscrete": ("", '<option><flag invdiscrete="enable" energy="enable"/></option>', ""),
}
SMALL = 1e-14  # relative; of a tensor up to MuJoCo 3.10: its principal moments are found to about 1e-6
DIGITS = {"inertia": 1e-6}
FRAMES = """<frame pos="0.1 0.2 0.3" euler="10 20 30"><body name="b" pos="1 2 3" euler="40 50 60">
<inertial pos="0.2 0 0.1" mass="1" diaginertia="0.02 0.03 0.04" euler="10 20 30"/>
<frame pos="0.3 0 0" euler="0 90 0"><joint name="j" axis="1 2 0" pos="0.1 0.2 0.3" damping="2" stiffness="3"/></frame>
</body></frame>"""
INERTIAL = """<body name="b"><frame pos="0.1 0.2 0.3" euler="10 20 30"><frame pos="0.3 0 0" euler="0 90 0">
<joint name="j" damping="2" stiffness="3"/>
<inertial pos="0.2 0 0.1" mass="1" fullinertia="0.02 0.03 0.04 0.001 0.002 0.003"/></frame></frame></body>"""
TURNED = pytest.mark.skipif(mujoco.mj_version() < 4_000_000, reason="MuJoCo 3.10 leaves out the rpy")
BASE = """<body name="base"><geom type="mesh" mesh="m" mass="0.7"/><body name="b"><joint name="j" damping="2" stiffness="3"/>
<geom size="0.1" pos="0.2 0 0" mass="1"/></body></body>"""  # which does not move
MESH = '<asset><mesh name="m" vertex="0 0 0 1 0 0 0 1 0 0 0 1"/></asset>'
SOURCES = [PATHS["mixed"], mjcf(FRAMES, '<compiler eulerseq="zyx"/>'), mjcf(INERTIAL), mjcf()]
SOURCES += [mjcf(BASE, MESH), pytest.param(URDF, marks=TURNED)]
BODY = '<body name="b"><joint name="j"/><inertial pos="0.1 0 0" mass="1" diaginertia="{}"/>{}</body>'
OPTIONS = {  # the quantities that it changes: of a file with these principal moments and something in its body
    'boundmass="2"': ({"mass"}, "1 1 1", ""), 'boundinertia="1.9"': ({"inertia"}, "1 1.5 2", ""),
    'balanceinertia="true"': ({"inertia"}, "1 1 3", ""), 'settotalmass="3"': ({"mass", "inertia"}, "1 1 1", ""),
    'inertiafromgeom="true"': ({"mass", "com", "inertia"}, "1 1 1", '<geom size="0.1" pos="0 0.2 0"/>'),
    'springdamper="1 0.5"': ({"damping", "stiffness"}, "1 1 1", ""), 'boundmass="0.5"': (set(), "1 1.5 2", ""),
    'boundinertia="0.5"': (set(), "1 1.5 2", ""), 'settotalmass="1"': (set(), "1 1.5 2", ""),
    'balanceinertia="true" settotalmass="1"': (set(), "1 1.5 2", ""),
}  # fmt: skip


def compared(source, rng, states=2):
    reading = read(source)
    assert_the_same(engine(reading).of(case_of(reading.tree)), reading.tree, rng, states)
    return reading


def assert_locked(reading, names, rng):
    """MuJoCo with these joints locked at random positions is tmt's Tree with them locked there."""
    tree = reading.tree
    q, _, _ = random_state(rng, tree)
    at = dict(zip(tree.joint_names, (q[joint.q] for joint in tree.coordinates.joints)))
    positions = {name: tuple(at[name]) if len(at[name]) > 1 else float(at[name][0]) for name in names}
    smaller = tree.lock(positions)
    dynamics = engine(reading).of(case_of(smaller, positions))
    assert dynamics.model.nv == len(smaller.axis)
    assert_the_same(dynamics, smaller, rng, states=1)
    return dynamics


@settings(max_examples=20)
@given(st.integers(0, 2**32 - 1), SOME_KINDS, st.integers(3, 6))
def test_a_random_tree_is_the_same_in_both(seed, kinds, joints):
    """And MuJoCo's own mass matrix and bias are the same, whatever else the file has on."""
    text, rng = with_features(random_tree(seed, kinds, joints), seed), np.random.default_rng(seed)
    reading, model = compared(text, rng), mujoco.MjModel.from_xml_string(text)
    dynamics = engine(reading).of(case_of(reading.tree))
    data, M = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    q, v, _ = random_state(rng, reading.tree)
    data.qpos[dynamics.qpos], data.qvel[dynamics.dofs] = q, v
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, M)
    for found, expected in ((M, dynamics.mass_matrix(q)), (data.qfrc_bias, dynamics.bias(q, v))):
        assert np.allclose(found[np.ix_(*[dynamics.dofs] * found.ndim)], expected, rtol=1e-10, atol=1e-10)


@pytest.mark.parametrize("source", [PATHS["mixed"], random_tree(0), URDF], ids=["mixed", "random", "URDF"])
def test_a_file_is_the_same_in_both_and_a_change_of_the_case_reaches_mujoco(source, rng):
    reading = compared(source, rng)
    tree = replace(reading.tree, gravity=(0.0,) * 3, damping=np.add(reading.tree.damping, 0.4))
    assert_the_same(engine(reading).of(case_of(tree, damping=0.4, gravity=False)), tree, rng, states=1)


@pytest.mark.parametrize("part, bodies", [(POINT, {"b", "point"}), (SHEET, {"b"})], ids=["point", "flex"])
def test_a_fixed_point_mass_counts_and_a_rigid_flex_does_not(part, bodies, rng):
    tree = compared(mjcf(PLAIN.replace("</body>", f"{part}</body>")), rng).tree
    assert {*tree.body_names} == bodies and tree.mass[1:] in ((), (2.0,))


@pytest.mark.parametrize("path", PUBLISHED, ids=lambda path: path.name)
def test_a_published_file_is_the_same_in_both_and_with_joints_locked(path, rng):
    reading = compared(path, rng, states=1)
    assert_locked(reading, [name for name in reading.tree.joint_names if rng.random() < 0.3], rng)
    for row in stated_numbers(reading.source):
        if row.stated is not None and not row.why:
            assert np.allclose(row.stated, row.compiled, rtol=1e-6, atol=1e-12), row


@pytest.mark.parametrize("flag", FIELDS)
def test_a_flag_of_the_file_counts(flag, rng):
    text = PLAIN.replace('<joint name="j"/>', '<joint name="j" damping="1" stiffness="3"/>')
    reading = compared(mjcf(text, f'<option><flag {flag}="disable"/></option>'), rng)
    assert not any(getattr(reading.tree, FIELDS[flag]))
    # damping that a scene adds acts all the same
    damped = replace(reading.tree, damping=np.add(reading.tree.damping, 0.5))
    assert_the_same(engine(reading).of(case_of(damped, damping=0.5)), damped, rng)


@pytest.mark.parametrize("feature", MORE)
def test_a_feature_is_listed_and_modelled_or_switched_off(feature, rng):
    text, names = MORE[feature]
    reading = compared(text, rng)
    row = next(row for row in reading.features if row.feature == feature)
    assert (row.count, row.names, row.treatment) == (len(names), names, REASONS[feature][0])
    assert REASONS.keys() == {*OF_MIXED, *MORE, "other"}


@pytest.mark.parametrize("name", OTHERS)
def test_what_else_changes_a_motion_is_switched_off_by_name(name, rng):
    joint, option, plain = OTHERS[name]
    if "yield" in name and mujoco.__version__ < "4":
        pytest.skip("this MuJoCo has no springs that yield")
    paths = []
    for part, before in ((joint, option), (plain, "")):
        reading = compared(mjcf(PLAIN.replace('name="j"', f'name="j" {part}'), before), rng)
        assert [row.names for row in reading.features if row.feature == "other"] == [(name,)] * (not paths)
        dynamics = engine(reading).of(case_of(reading.tree))
        assert dynamics.model.opt.enableflags == 0
        q, v, tau = np.array([[1.2], [2.0], [0.1]])
        paths.append(dynamics.run(q, v, tau, 0.01, 50, "Euler").states)
    assert np.array_equal(*paths)


def test_what_has_no_name_is_called_by_its_kind_and_number_but_not_as_another():
    body = '<body><joint name="w" type="ball"/><joint type="slide"/><geom size="0.1" pos="0.1 0 0"/></body>'
    keys = '<keyframe><key name="k" qpos="0 0 2 0 0"/><key qpos="2 0 0 0 0"/></keyframe>'
    found = read(mjcf(body, after=keys))
    assert found.tree.joint_names == ("w", "joint 1")
    keys = {"k": [0.0, 0.0, 1.0, 0.0, 0.0], "key 1": [1.0, 0.0, 0.0, 0.0, 0.0]}  # quaternions of length 1
    assert {name: q.tolist() for name, q in found.keyframes.items()} == keys
    text = mjcf(TWO.replace('name="j"', "").replace('name="k"', 'name="joint 0"'))
    assert read(text).tree.joint_names[1] == "joint 0"


@pytest.mark.parametrize("parts", [["x", "z"], ["y", "turn"], ["x", "y", "z"], ["x", "y", "z", "turn"]])
def test_parts_of_a_free_joint_and_others(parts, rng):
    heavy = '<joint name="base" type="free" armature="0.1"/>'
    text = PATHS["mixed"].read_text(encoding="utf-8").replace('<freejoint name="base"/>', heavy)
    assert_locked(read(text), [f"base {part}" for part in parts] + ["joint 2", "tail"], rng)


def test_what_refers_to_a_locked_joint_goes_too(rng):
    more = TENDON.format('stiffness="3"') + (
        '<equality><joint joint1="j" joint2="k"/></equality><sensor><tendonpos tendon="t"/><jointpos joint="j"/></sensor>'
        '<actuator><position joint="j" kp="9"/><motor tendon="t"/><general joint="k" armature="0.3" gear="2"/></actuator>'
        '<custom><tuple name="u"><element objtype="joint" objname="j"/></tuple></custom><keyframe><key qpos="1 2"/></keyframe>'
    )
    by_inertia = TWO.replace('name="j"', 'name="j" springdamper="1 0.5"')  # which k, locked aside, changes
    reading = read(mjcf(by_inertia.replace('name="h"', 'name="h" pos="0.3 0 0"'), after=more))
    assert assert_locked(reading, ["j"], rng).model.nu == 1  # the one with armature
    assert_locked(reading, ["k"], rng)


def test_a_free_body_aligned_with_its_inertia_is_compared_and_not_locked(rng):
    body = '<body euler="10 20 30"><freejoint name="f" align="true"/><geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0"/></body>'
    reading = compared(mjcf(body), rng)
    with pytest.raises(ModelError, match="free joint 'f' is aligned with the inertia of its body") as error:
        assert_locked(reading, ["f x"], rng)
    assert "\n" not in str(error.value)


def difference(row):
    """Of a row that states something, relative to what was compiled."""
    return np.abs(np.subtract(row.stated, row.compiled)).max() / max(np.abs(row.compiled).max(), 1e-3)


def rows_of(text):
    return {(row.place, row.quantity): row for row in stated_numbers(Source(text))}


@pytest.mark.parametrize("source", SOURCES)
def test_a_file_that_asks_for_no_change_states_what_is_compiled(source):
    rows = rows_of(source)
    known = {"pos", "mass", "com", "inertia", "axis", "armature", "damping", "stiffness"}
    assert known <= {quantity for _, quantity in rows}
    for row in rows.values():
        if row.stated is None:
            assert row.why == "inertia from geoms"
        else:
            assert difference(row) <= DIGITS.get(row.quantity, SMALL) and not row.why


@pytest.mark.parametrize("option", OPTIONS)
def test_an_option_that_asks_for_a_change_is_named_where_it_changes_something(option):
    (quantities, *body), name = OPTIONS[option], option.split("=")[0]
    of_joint = name == "springdamper"
    text = BODY.format(*body).replace('name="j"', f'name="j" {option if of_joint else ""}')
    rows = rows_of(mjcf(text, "" if of_joint else f"<compiler {option}/>"))
    assert {row.quantity for row in rows.values() if row.why == name} == quantities
    for row in rows.values():
        assert row.why in ("", name) and (difference(row) > 0.1) == (row.quantity in quantities)
    stated = {"mass": 1.0, "com": [0.1, 0.0, 0.0], "inertia": np.diag(np.array(body[0].split(), float))}
    for quantity, number in stated.items():  # those of the text
        assert rows["b", quantity].stated == pytest.approx(np.array(number), abs=1e-15)


def test_what_is_stated_is_in_the_axes_of_the_body_whatever_else_the_file_asks_for():
    """A tensor about turned axes and an aligned free body, to which settotalmass gives half of its mass."""
    body = """<body name="b" pos="1 2 3"><freejoint align="true"/><inertial pos="0.1 0 0.2" mass="2" quat="0.8 0 0.6 0"
      diaginertia="0.1 0.2 0.25"/></body>"""
    rows = rows_of(mjcf(body, '<compiler settotalmass="1" alignfree="true"/>'))
    cosine, sine = 0.8**2 - 0.6**2, 2.0 * 0.8 * 0.6
    R = np.array([[cosine, 0.0, sine], [0.0, 1.0, 0.0], [-sine, 0.0, cosine]])
    assert rows["b", "inertia"].stated == pytest.approx(R @ np.diag([0.1, 0.2, 0.25]) @ R.T)
    assert rows["b", "pos"].stated == pytest.approx([1.0, 2.0, 3.0])
    assert rows["b", "com"].stated == pytest.approx([0.1, 0.0, 0.2]) and rows["b", "mass"].stated == 2.0
    reasons = {quantity: rows["b", quantity].why for quantity in ("pos", "com", "mass", "inertia")}
    both = "settotalmass, alignfree"
    assert reasons == {"pos": "alignfree", "com": "alignfree", "mass": "settotalmass", "inertia": both}


def test_a_tensor_may_be_off_by_rounding_of_the_sum_of_its_moments():
    row = rows_of(mjcf(BODY.format("1 1.5 2", "")))["b", "inertia"]
    assert row.tolerance == pytest.approx(64 * EPS * 4.5, rel=1e-9, abs=0.0)


ROD = """<mujoco><worldbody><body><joint name="j" axis="0 1 0" {}/>
  <inertial pos="0 0 -0.5" mass="2" diaginertia="0.1 0.1 0.1"/></body></worldbody></mujoco>"""


@pytest.mark.parametrize("ref", [0.0, 25.0, -70.0])
def test_a_pendulum_hangs_at_the_position_that_the_file_calls_its_reference(ref):
    """In degrees in the file; about its axis gravity turns it back with m g l sin(q - ref)."""
    reading = read(ROD.format(f'ref="{ref}" stiffness="3" springref="10"'))
    q = np.array([[-0.4], [0.0], [1.3]])
    weight = 2.0 * 9.81 * 0.5 * np.sin(q - np.radians(ref))
    assert tmt.gravity_balance(reading.tree, q) == pytest.approx(weight)
    assert tmt.spring_torque(reading.tree, q) == pytest.approx(3.0 * (q - np.radians(10.0)))
    dynamics = engine(reading).of(case_of(reading.tree))
    assert dynamics.gravity_balance(q) == pytest.approx(weight)
    assert reading.qpos0 == pytest.approx([np.radians(ref)])
