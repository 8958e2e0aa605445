"""What gravity and springs do to a posture, in closed form, beside tmt's sums over bodies and dual numbers."""

import numpy as np
import pytest
from trees import random_state, tree_of_kinds

import tmt
from compare.truth.derivative import stiffness
from compare.truth.weight import spring_slope, weight


def test_torque_and_slope_are_those_of_the_method(rng):
    for bodies in (1, 3, 6, 6):
        tree = tree_of_kinds(rng, bodies)
        q, _, _ = random_state(rng, tree)
        found = weight(tree, q, tree.mass, tree.gravity)
        assert found.torque == pytest.approx(tmt.gravity_balance(q, tree), abs=1e-13 * found.size)
        K = stiffness(tree, q)
        assert found.slope + spring_slope(tree, q) == pytest.approx(K, abs=1e-13 * np.abs(K).max())
        assert np.abs(found.torque).max() <= found.size


def test_without_gravity_there_is_nothing(rng):
    tree = tree_of_kinds(rng, 3)
    q, _, _ = random_state(rng, tree)
    found = weight(tree, q, tree.mass, (0.0, 0.0, 0.0))
    assert not found.torque.any() and not found.slope.any() and found.size == 0.0
