"""Hinges locked on both sides: the smaller model is the sub-block of the whole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trees import random_tree

import tmt
from compare.engine_file import ARM_XML, ModelError, parse
from compare.scenes import SCENES
from compare.sub_blocks import operations

OTHER = """<mujoco>
  <compiler angle="degree"/>
  <option gravity="1 2 -9"><flag contact="disable" constraint="disable"/></option>
  <default><joint damping="0.1"/></default>
  <worldbody>
    <frame pos="0.1 0.2 0.3" euler="10 20 30">
      <body name="upper" pos="0.1 0.2 0.1" euler="40 50 60">
        <frame pos="0 0.1 0" euler="0 0 20"><joint name="alpha" axis="0 1 0" pos="0.1 0.2 0.3" ref="20"/></frame>
        <joint name="beta" axis="1 1 0" pos="0 0.1 0.05"/>
        <geom type="box" size="0.01 0.02 0.03" pos="0.1 0.1 0.1" density="5000"/>
        <frame pos="0.3 0 0" euler="0 90 0">
          <body name="fore">
            <joint name="gamma" axis="0 0.2 1" pos="0.02 0.03 0.04"/>
            <geom type="capsule" size="0.02 0.1" pos="0.1 0.1 0.1"/>
          </body>
        </frame>
      </body>
    </frame>
  </worldbody>
  <actuator><motor joint="gamma"/></actuator>
  <sensor><jointpos joint="gamma"/><jointpos joint="alpha"/></sensor>
  <keyframe><key qpos="1 2 3"/></keyframe>
</mujoco>"""
SWING = next(scene for scene in SCENES if scene.name == "elbow swing")
SUBSETS = (("alpha",), ("beta",), ("gamma",), ("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma"))


def test_a_locked_tree_is_the_sub_block_of_the_whole(rng):
    for _ in range(5):
        tree = random_tree(rng, damping=1.0)
        names = tree.hinge_names
        locked = [int(i) for i in rng.choice(len(names), rng.integers(1, len(names)), replace=False)]
        free = [i for i in range(len(names)) if i not in locked]
        q, qd = rng.uniform(-3.0, 3.0, (2, len(names)))
        qd[locked] = 0.0
        smaller = tree.lock({names[i]: q[i] for i in locked})
        state = q[free], qd[free]
        assert smaller.hinge_names == tuple(names[i] for i in free)
        assert smaller.damping == tuple(tree.damping[i] for i in free)
        assert np.allclose(tmt.mass_matrix(q[free], smaller), tmt.mass_matrix(q, tree)[np.ix_(free, free)], atol=1e-12)
        assert np.allclose(tmt.bias(*state, smaller), tmt.bias(q, qd, tree)[free], atol=1e-11)
        assert np.allclose(tmt.com_positions(q[free], smaller), tmt.com_positions(q, tree), atol=1e-13)
        assert np.isclose(tmt.energy(*state, smaller), tmt.energy(q, qd, tree), atol=1e-11)


@given(st.floats(-10.0, 10.0), st.floats(-10.0, 10.0))
def test_hinges_locked_one_after_the_other_are_hinges_locked_together(one, other):
    together = tmt.ARM.lock({"alpha": one, "beta": other})
    after = tmt.ARM.lock({"beta": other}).lock({"alpha": one})
    assert together.hinge_names == after.hinge_names == ("gamma",)
    for field in ("offset", "axis", "com", "inertia"):
        assert np.allclose(getattr(together, field), getattr(after, field), atol=1e-15)


def test_a_hinge_locked_at_zero_rounds_nothing():
    planar = tmt.ARM.lock({"beta": 0.0})
    for name in ("offset", "axis"):
        assert getattr(planar, name) == (getattr(tmt.ARM, name)[0], getattr(tmt.ARM, name)[2])
    assert (planar.parent, planar.body_hinge) == ((-1, 0), (0, 1))
    assert (planar.com, planar.inertia, planar.mass) == (tmt.ARM.com, tmt.ARM.inertia, tmt.ARM.mass)
    assert tmt.ARM.lock({}) == tmt.ARM


def test_a_smaller_tree_is_less_code():
    whole, planar, elbow = (operations(tree) for tree in (tmt.ARM, tmt.ARM.lock({"beta": 0.0}), SWING.model))
    assert whole > 2 * planar > 4 * elbow > 0


@pytest.mark.parametrize(
    "angles, says",
    [
        ({"wrist": 0.0}, "no hinge 'wrist' to lock; the hinges are alpha, beta, gamma"),
        ({"beta": np.nan}, "finite numbers"),
        ({"beta": "bent"}, "numbers of shape"),
        (dict.fromkeys(tmt.ARM.hinge_names, 0.0), "at least one must be free"),
        (None, "lock is given None; a dict of angles"),
        ("beta", "lock is given 'beta'; a dict of angles"),
        (("beta",), r"lock is given \('beta',\); a dict of angles"),
        ({3: 0.0}, "no hinge 3 to lock"),
        ({"beta": True}, "numbers of shape"),
    ],
)
def test_what_cannot_be_locked(angles, says):
    with pytest.raises(ValueError, match=says) as error:
        tmt.ARM.lock(angles)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", [ARM_XML.read_text(), OTHER], ids=["arm", "other"])
def test_a_locked_engine_is_the_sub_block_of_the_whole(text, rng):
    engine = parse(text).variant(gravity=(1.0, -2.0, -8.0), damping=0.3)
    for locked in SUBSETS:
        q, qd = rng.uniform(-3.0, 3.0, (2, 3))
        free = [i for i, name in enumerate(engine.hinges) if name not in locked]
        qd[[i for i in range(3) if i not in free]] = 0.0
        smaller = engine.lock({name: q[engine.hinges.index(name)] for name in locked})
        assert smaller.hinges == [engine.hinges[i] for i in free] and smaller.model.nv == len(free)
        state = q[free], qd[free]
        assert np.allclose(smaller.mass_matrix(q[free]), engine.mass_matrix(q)[np.ix_(free, free)], atol=1e-14)
        assert np.allclose(smaller.bias(*state), engine.bias(q, qd)[free], atol=1e-13)
        assert np.allclose(smaller.com_positions(q[free]), engine.com_positions(q), atol=1e-14)
        assert np.allclose(smaller.model.dof_damping, engine.model.dof_damping[free])
        assert smaller.model.nu == engine.model.nu * ("gamma" not in locked)
        twice = engine.lock({locked[0]: q[engine.hinges.index(locked[0])]})
        twice = twice.lock({name: q[engine.hinges.index(name)] for name in locked[1:]})
        assert np.allclose(twice.bias(*state), smaller.bias(*state), atol=1e-14)


def test_a_tendon_on_a_locked_hinge_is_refused_in_one_line():
    tendon = '<tendon><fixed><joint joint="gamma" coef="1"/></fixed></tendon><actuator>'
    with pytest.raises(ModelError, match="with gamma locked") as error:
        parse(OTHER.replace("<actuator>", tendon)).lock({"gamma": 0.1})
    assert "\n" not in str(error.value)
