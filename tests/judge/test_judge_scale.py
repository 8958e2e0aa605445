"""The scales of tolerances, from the stated numbers written out."""

import dataclasses

import numpy as np
import pytest

import tmt
from compare.judge import scale
from tmt import literal

TREE = tmt.ARM
Q = np.random.default_rng(3).uniform(-3, 3, (20, 3))
QD = np.random.default_rng(4).uniform(-5, 5, (20, 3))


def test_reaches_and_the_scale_of_gravity():
    assert np.allclose(scale.reaches(TREE), [0.15, 0.3 + 0.15], rtol=1e-15)
    assert scale.gravity_scale(TREE) == pytest.approx(9.81 * (1.9 * 0.15 + 1.5 * 0.45), rel=1e-15)
    doubled = dataclasses.replace(tmt.ARM, gravity=(0.0, 3.0, -4.0))
    assert scale.gravity_scale(doubled) == pytest.approx(5.0 * (1.9 * 0.15 + 1.5 * 0.45), rel=1e-15)


def test_the_scale_of_the_bias_is_the_sum_of_its_absolute_terms():
    """State by state and body by body, without the sums of the code under test."""
    for q, qd, size in zip(Q, QD, scale.bias_scale(TREE, Q, QD)):
        T, B = tmt.jacobians(q)
        v, w = tmt.convective_terms(q, qd)
        terms = np.zeros(3)
        for b in range(2):
            inertia, omega = np.array(tmt.ARM.inertia[b]), B[b] @ qd
            moment = np.abs(inertia @ w[b]) + np.abs(np.cross(omega, inertia @ omega))
            terms += np.abs(T[b]).T @ (tmt.ARM.mass[b] * np.abs(v[b])) + np.abs(B[b]).T @ moment
        assert size == pytest.approx(terms.max() + 9.4176, rel=1e-12)
    at_rest = scale.bias_scale(TREE, Q, 0.0 * QD)
    assert np.allclose(at_rest, 9.4176, rtol=1e-14)


def test_the_scales_of_mass_and_acceleration():
    M = literal.mass_matrix(Q)
    assert np.array_equal(scale.mass_scale(TREE, Q), [abs(m).max() for m in M])
    assert np.allclose(
        scale.condition(TREE, Q), [np.linalg.norm(m, 2) * np.linalg.norm(np.linalg.inv(m), 2) for m in M]
    )
    inverse, norm = (np.array([np.linalg.norm(f(m), 2) for m in M]) for f in (np.linalg.inv, lambda m: m))
    force = np.linspace(1.0, 20.0, 20)
    assert np.allclose(scale.acceleration_scale(TREE, Q, force), (inverse * norm + 1.0) * inverse * force)
    assert np.allclose(scale.acceleration_scale(TREE, Q, force, 2.0), inverse * (norm * 2.0 + force))
