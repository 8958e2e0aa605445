"""Pinocchio's algorithms for the same tree: the same numbers, whatever the time they take."""

import dataclasses
from importlib.util import find_spec

import numpy as np
import pytest
from models import PATHS
from trees import random_tree

import tmt
from compare.engines.mujoco import read
from compare.engines.pinocchio import PinocchioCalls
from compare.judge.scale import EPS, FACTOR, acceleration_scale, bias_scale, mass_scale

installed = pytest.mark.skipif(find_spec("pinocchio") is None, reason="Pinocchio is not installed")


def trees(rng):
    """The arm, random axes with dampers, slides with armature and springs, angles that begin elsewhere."""
    slides = read(PATHS["gripper"]).tree
    n = len(tmt.ARM.parent)
    turned = dataclasses.replace(tmt.ARM, reference=(0.1, -0.2, 0.3), rest=(0.4,) * n, stiffness=(2.0,) * n)
    return tmt.ARM, random_tree(rng, bodies=6, damping=0.3), slides, turned, read(PATHS["arm7"]).tree


@installed
def test_quantities_are_those_of_tmt(rng):
    for tree in trees(rng):
        assert PinocchioCalls.unfit(tree) is None
        calls, n = PinocchioCalls(tree), len(tree.axis)
        q, v, tau = rng.uniform(-2.0, 2.0, (3, 20, n))
        M, h = tmt.mass_matrix(q, tree), tmt.bias(q, v, tree)
        force = bias_scale(tree, q, v)
        acting = np.abs(tau) + np.abs(v) * tree.damping + np.abs(q - np.array(tree.rest)) * tree.stiffness
        scale = acceleration_scale(tree, q, force + acting.max(axis=1))
        assert (np.abs(calls.mass_matrix(q) - M).max(axis=(1, 2)) <= FACTOR * EPS * mass_scale(tree, q)).all()
        assert (np.abs(calls.bias(q, v) - h).max(axis=1) <= FACTOR * EPS * force).all()
        expected = tmt.acceleration(q, v, tau, tree)
        for found in (calls.acceleration(q, v, tau), calls.aba_of_many(q, v, tau)()):
            assert found.shape == expected.shape and np.abs(expected).max() > 0.1
            assert (np.abs(found - expected).max(axis=1) <= FACTOR * EPS * scale).all()


def test_it_says_of_which_trees_it_builds_none():
    assert "only trees of hinges and slides" in PinocchioCalls.unfit(read(PATHS["pendulum_ball"]).tree)
    driven = dataclasses.replace(tmt.ARM, position_gain=np.eye(3))
    assert "without a controller" in PinocchioCalls.unfit(driven) and PinocchioCalls.unfit(tmt.ARM) is None


def test_where_it_is_not_installed_it_says_so(monkeypatch):
    monkeypatch.setattr("compare.engines.pinocchio.find_spec", lambda name: None)
    assert "Pinocchio is not installed; the extra `peers` brings it" in PinocchioCalls.unavailable()
