"""Slides, balls and free joints, or parts of these, locked in MuJoCo: the smaller model is the Tree without them."""

import pytest
from files import EVERYTHING, TENDON, TWO, assert_the_same, case_of, mjcf
from models import random_tree
from trees import random_state

from compare.engines.mujoco import ModelError, engine, read


def assert_locked(reading, names, rng):
    """MuJoCo with these joints locked at random positions is tmt's Tree with them locked there."""
    tree = reading.tree
    q, _, _ = random_state(rng, tree)
    at = dict(zip(tree.hinge_names, (q[joint.q] for joint in tree.coordinates.joints)))
    positions = {name: tuple(at[name]) if len(at[name]) > 1 else float(at[name][0]) for name in names}
    smaller = tree.lock(positions)
    dynamics = engine(reading).of(case_of(smaller, positions))
    assert dynamics.model.nv == len(smaller.axis)
    assert_the_same(dynamics, smaller, rng, states=1)
    return dynamics


@pytest.mark.parametrize("name", ["float x", "float turn", "joint 1", "rail", "shoulder", "elbow"])
def test_a_joint_alone_and_left_alone(name, rng):
    reading = read(EVERYTHING)
    assert_locked(reading, [name], rng)
    assert_locked(reading, [other for other in reading.tree.hinge_names if other != name], rng)


@pytest.mark.parametrize("parts", [["x", "z"], ["y", "turn"], ["x", "y", "z"], ["x", "y", "z", "turn"]])
def test_parts_of_a_free_joint_and_others(parts, rng):
    reading = read(EVERYTHING)
    assert_locked(reading, [f"float {part}" for part in parts] + ["joint 1", "shoulder"], rng)


def test_random_joints_of_random_files(rng):
    for seed in range(3):
        reading = read(random_tree(seed))
        names = list(reading.tree.hinge_names)
        assert_locked(reading, rng.choice(names, rng.integers(1, len(names)), replace=False).tolist(), rng)


def test_what_refers_to_a_locked_joint_goes_too(rng):
    more = TENDON.format('stiffness="3"') + (
        '<equality><joint joint1="j" joint2="k"/></equality><sensor><tendonpos tendon="t"/><jointpos joint="j"/></sensor>'
        '<actuator><position joint="j" kp="9"/><motor tendon="t"/><general joint="k" armature="0.3" gear="2"/></actuator>'
        '<custom><tuple name="u"><element objtype="joint" objname="j"/></tuple></custom><keyframe><key qpos="1 2"/></keyframe>'
    )
    reading = read(mjcf(TWO, after=more))
    assert assert_locked(reading, ["j"], rng).model.nu == 1  # the one with armature
    assert_locked(reading, ["k"], rng)


def test_a_free_body_aligned_with_its_inertia_is_compared_and_not_locked(rng):
    body = '<body euler="10 20 30"><freejoint name="f" align="true"/><geom type="box" size="0.1 0.2 0.3" pos="0.1 0 0"/></body>'
    reading = read(mjcf(body))
    assert_the_same(engine(reading).of(case_of(reading.tree)), reading.tree, rng)
    with pytest.raises(ModelError, match="free joint 'f' is aligned with the inertia of its body") as error:
        assert_locked(reading, ["f x"], rng)
    assert "\n" not in str(error.value)
