"""A file read as a Tree: MuJoCo and tmt have the same numbers of every kind of joint, and what differs is listed."""

from dataclasses import replace

import mujoco
import numpy as np
import pytest
from files import EVERYTHING, PLAIN, TENDON, TWO, assert_the_same, case_of, mjcf
from models import random_tree

from compare.engines.mujoco import engine, read
from compare.engines.mujoco.inventory import REASONS


def compared(text, rng, states=2):
    reading = read(text)
    assert_the_same(engine(reading).of(case_of(reading.tree)), reading.tree, rng, states)
    return reading


def test_a_file_with_everything_is_the_same_in_both(rng):
    reading = compared(EVERYTHING, rng)
    tree, degree = reading.tree, np.pi / 180
    assert ", ".join(tree.hinge_names[:8]) == "float x, float y, float z, float turn, joint 1, rail, turn, shoulder"
    assert tree.kind == ("slide",) * 3 + ("ball", "hinge", "slide", "hinge", "ball", "hinge", "ball")
    assert tree.body_names == ("base", "upper", "body 4", "arm", "hand")
    assert tree.parent == (-1, 0, 1, 2, 3, 4, 5, -1, 7, 8)
    assert np.allclose(tree.armature, [0.01] * 8 + [0.01 + 0.02 * 9] + [0.01] * 7)
    assert tree.stiffness == (3.0,) * 4 + (2.0, 0.0, 0.0, 4.0, 0.0, 0.0)
    assert np.allclose(tree.reference, [0, 0, 0, 0, np.radians(20), 0.2, 0, 0, 0, 0])
    assert np.allclose(tree.rest[7], np.radians(-30)) and np.allclose(tree.rest[:7], reading.qpos0[:7])
    assert reading.ranges[4:7] == (None, (-0.5, 0.5), (-90 * degree, 45 * degree)) and reading.ranges[0] is None
    assert list(reading.keyframes) == ["home", "key 1"] and reading.keyframes["home"].shape == (len(tree.rest),)
    assert reading.keyframes["home"][3] == 1.0  # a quaternion of length 2 in the file
    assert (reading.integrator, reading.dt, reading.warnings) == ("Euler", 0.002, ())
    assert [f.feature for f in reading.features] == OF_EVERYTHING


@pytest.mark.parametrize("seed", range(5))
def test_a_random_file_is_the_same_in_both_and_a_change_of_the_case_reaches_mujoco(seed, rng):
    reading = compared(random_tree(seed), rng)
    tree = replace(reading.tree, gravity=(0.0,) * 3, damping=np.add(reading.tree.damping, 0.4))
    assert_the_same(engine(reading).of(case_of(tree, damping=0.4, gravity=False)), tree, rng, states=1)


@pytest.mark.parametrize("flag, field", [("gravity", "gravity"), ("damper", "damping"), ("spring", "stiffness")])
def test_a_flag_of_the_file_counts(flag, field, rng):
    text = PLAIN.replace('<joint name="j"/>', '<joint name="j" damping="1" stiffness="3"/>')
    reading = compared(mjcf(text, f'<option><flag {flag}="disable"/></option>'), rng)
    assert not any(getattr(reading.tree, field))
    # damping that a scene adds acts all the same
    damped = replace(reading.tree, damping=np.add(reading.tree.damping, 0.5))
    assert_the_same(engine(reading).of(case_of(damped, damping=0.5)), damped, rng)


OF_EVERYTHING = [
    "hinge", "slide", "ball", "free", "armature", "damping", "spring", "contact", "limit", "actuator", "keyframe",
]  # fmt: skip
MORE = {  # feature: file, names
    "frictionloss": (mjcf(PLAIN.replace("name=\"j\"", "name=\"j\" frictionloss=\"1\"")), ("j",)),
    "clamp": (
        mjcf(PLAIN.replace("name=\"j\"", "name=\"j\" actuatorfrcrange=\"-1 1\""),
             after='<actuator><motor name="a" joint="j"/><motor name="b" joint="j" forcerange="-1 1"/></actuator>'),
        ("b", "j"),
    ),
    "fluid": (mjcf(before='<option density="1000" viscosity="0.1" wind="3 0 0"/>'), ("density", "viscosity")),
    "gravcomp": (mjcf(PLAIN.replace("\"b\"", "\"b\" gravcomp=\"1\"").replace("\"j\"", "\"j\" axis=\"0 1 0\"")), ("b",)),
    "equality": (
        mjcf(TWO, after='<equality><weld body1="c"/><joint joint1="j" joint2="k" active="false"/></equality>'),
        ("equality 0",),
    ),
    "tendon": (mjcf(TWO, after=TENDON.format('stiffness="9" damping="3" springlength="0.3" range="0 1"')), ("t",)),
}  # fmt: skip


@pytest.mark.parametrize("feature", MORE)
def test_a_feature_is_listed_and_modelled_or_switched_off(feature, rng):
    text, names = MORE[feature]
    reading = compared(text, rng)
    row = next(row for row in reading.features if row.feature == feature)
    assert (row.count, row.names, row.treatment) == (len(names), names, REASONS[feature][0])
    assert reading.open_tree == names * (feature == "equality")
    assert REASONS.keys() == {*OF_EVERYTHING, *MORE, "other"}


OTHERS = {  # what is listed as other: a joint and an option of the file, and the joint of a file without
    "polynomial damping of j": ('damping="1 2 3"', "", 'damping="1"'),
    "spring yield of j": ('stiffness="10" springyield="0.1"', "", 'stiffness="10"'),
    "flag eulerdamp": ('damping="1"', '<option><flag eulerdamp="disable"/></option>', 'damping="1"'),
    "flag invdiscrete": ("", '<option><flag invdiscrete="enable" energy="enable"/></option>', ""),
}


def run_of(text):
    """What MuJoCo makes of a file from one state."""
    reading = read(text)
    run = engine(reading).of(case_of(reading.tree)).run
    return run(np.array([1.2]), np.array([2.0]), np.array([0.1]), 0.01, 50, "Euler").states


@pytest.mark.parametrize("name", OTHERS)
def test_what_else_changes_a_motion_is_switched_off_by_name(name, rng):
    joint, option, plain = OTHERS[name]
    if "yield" in name and mujoco.__version__ < "4":
        pytest.skip("this MuJoCo has no springs that yield")
    text, without = (
        mjcf(PLAIN.replace('name="j"', f'name="j" {part}'), before) for part, before in ((joint, option), (plain, ""))
    )
    reading = compared(text, rng)
    assert [row.names for row in reading.features if row.feature == "other"] == [(name,)]
    assert engine(reading).of(case_of(reading.tree)).model.opt.enableflags == 0
    assert np.array_equal(run_of(text), run_of(without))


def test_what_has_no_name_is_called_as_nothing_else():
    body = '<body><joint name="joint 1" axis="0 1 0"/><joint/><geom size="0.1" pos="0.1 0 0"/></body>'
    found = read(mjcf(body, after='<keyframe><key name="key 1" qpos="1 0"/><key qpos="2 0"/></keyframe>'))
    assert found.tree.hinge_names == ("joint 1", "unnamed joint 1")
    assert {name: q[0] for name, q in found.keyframes.items()} == {"key 1": 1.0, "unnamed key 1": 2.0}


def test_what_the_compiler_warns_of_is_one_line(capfd):
    (line,) = read(mjcf(PLAIN.replace('size="0.1"', 'size="0.1" mass="nan"'))).warnings
    assert "NaN" in line and "\n" not in line and capfd.readouterr() == ("", "")
