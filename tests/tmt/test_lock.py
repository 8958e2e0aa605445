"""Hinges of a Tree locked: the smaller model is the sub-block of the whole."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from trees import random_tree

import tmt


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
