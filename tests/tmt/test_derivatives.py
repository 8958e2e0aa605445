"""Derivatives of a step by those of its linear system."""

from dataclasses import dataclass

import numpy as np
import pytest
from trees import random_state, small_tree

from tmt import METHODS
from tmt.methods import SemiImplicitEuler, amplification, derivatives

TREE = small_tree()
STATES = [np.array(part) for part in zip(*(random_state(np.random.default_rng(k), TREE) for k in range(3)))]
DESCRIBED = [name for name, method in METHODS.items() if derivatives.has_residual(method) and "dopri8" not in name]


@pytest.mark.parametrize("name", DESCRIBED)
def test_the_jacobian_of_a_step_is_that_of_dual_numbers_through_all_of_it(name, monkeypatch):
    q, qd, (tau, *_) = STATES
    assert len(TREE.axis) > derivatives.FEW_SPEEDS and TREE.has_springs and TREE.coordinates.balls
    found = amplification(METHODS[name], TREE, q, qd, tau, 0.01)
    monkeypatch.setattr(derivatives, "FEW_SPEEDS", len(TREE.axis))
    assert found == pytest.approx(amplification(METHODS[name], TREE, q, qd, tau, 0.01), abs=1e-11, rel=1e-11)


@pytest.mark.parametrize("name", DESCRIBED)
def test_a_slope_leaves_nothing_of_its_linear_system(name):
    q, qd, (tau, *_) = STATES
    state, stepping = (list(q.T), list(qd.T), list(tau), 0.01), METHODS[name]
    a = stepping.slope(TREE, *state)
    assert np.abs(stepping.residual(TREE, a, *state)).max() < 1e-11
    A, force = derivatives.linear_system(stepping, TREE, *state)
    matrix = stepping.matrix(TREE, *state[:2], 0.01)
    assert A.transpose(1, 2, 0) == pytest.approx(np.array([[x + 0.0 * a[0] for x in row] for row in matrix]), abs=1e-11)
    assert pytest.approx(np.array(a), rel=1e-9) == np.linalg.solve(A, force[..., None])[..., 0].T


def test_many_states_are_the_same_as_each_alone(monkeypatch):
    q, qd, (tau, *_) = STATES
    dt = np.array([0.01, 0.02, 0.03])
    each = [amplification(METHODS["rk4"], TREE, *state, tau, step) for *state, step in zip(q, qd, dt)]
    monkeypatch.setattr(derivatives, "PART", 2 * len(TREE.axis))
    assert amplification(METHODS["rk4"], TREE, q, qd, tau, dt) == pytest.approx(np.array(each), rel=1e-12, abs=1e-14)


def test_a_method_with_a_slope_of_its_own_is_not_taken_for_another():
    @dataclass(frozen=True)
    class Own(SemiImplicitEuler):
        def slope(self, tree, q, qd, tau, dt):
            return [0.0 * x for x in qd]

    assert not derivatives.has_residual(Own(False))
    q, qd, (tau, *_) = STATES
    J = amplification(Own(False), TREE, q, qd, tau, 0.01)
    assert np.array_equal(J[:, len(tau) :, len(tau) :], np.tile(np.eye(len(tau)), (3, 1, 1)))
