"""heyoka's and Pinocchio's algorithms, where they are installed: the numbers of tmt, whatever the time they take."""

import dataclasses
from importlib.util import find_spec

import numpy as np
import pytest
from models import PATHS
from trees import random_tree

import tmt
from compare.engines.heyoka import Heyoka, compiled_accelerations
from compare.engines.mujoco import read
from compare.engines.pinocchio import PinocchioCalls
from compare.judge.scale import EPS, FACTOR, acceleration_scale, bias_scale, mass_scale


@pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka is not installed")
def test_heyokas_compiled_function_has_the_accelerations_of_tmt(rng):
    q, v, tau = rng.uniform(-2.0, 2.0, (3, 21, 3))
    found = np.empty((3, 21))
    compiled_accelerations(tmt.ARM, True)(np.concatenate([q.T, v.T, tau.T]).copy(), outputs=found)
    expected = tmt.acceleration(q, v, tau)
    scale = acceleration_scale(tmt.ARM, q, bias_scale(tmt.ARM, q, v) + np.abs(tau).max(axis=1))
    assert (np.abs(found.T - expected).max(axis=1) <= FACTOR * EPS * scale).all() and np.abs(expected).max() > 1.0


@pytest.mark.skipif(find_spec("pinocchio") is None, reason="Pinocchio is not installed")
@pytest.mark.parametrize("which", range(3))
def test_pinocchios_quantities_are_those_of_tmt(rng, which):
    turned = dataclasses.replace(tmt.ARM, reference=(0.1, -0.2, 0.3), rest=(0.4,) * 3, stiffness=(2.0,) * 3)
    tree = (random_tree(rng, bodies=6, damping=0.3), read(PATHS["gripper"]).tree, turned)[which]
    assert PinocchioCalls.unfit(tree) is None
    calls, n = PinocchioCalls(tree), len(tree.axis)
    q, v, tau = rng.uniform(-2.0, 2.0, (3, 20, n))
    M, h, expected = tmt.mass_matrix(q, tree), tmt.bias(q, v, tree), tmt.acceleration(q, v, tau, tree)
    force = bias_scale(tree, q, v)
    acting = np.abs(tau) + np.abs(v) * tree.damping + np.abs(q - np.array(tree.rest)) * tree.stiffness
    scale = acceleration_scale(tree, q, force + acting.max(axis=1))
    assert (np.abs(calls.mass_matrix(q) - M).max(axis=(1, 2)) <= FACTOR * EPS * mass_scale(tree, q)).all()
    assert (np.abs(calls.bias(q, v) - h).max(axis=1) <= FACTOR * EPS * force).all()
    for found in (calls.acceleration(q, v, tau), calls.aba_of_many(q, v, tau)()):
        assert (np.abs(found - expected).max(axis=1) <= FACTOR * EPS * scale).all() and np.abs(expected).max() > 0.1


def test_pinocchio_takes_no_balls_and_no_controllers():
    assert "hinges and slides" in PinocchioCalls.unfit(read(PATHS["pendulum_ball"]).tree)
    assert "controller" in PinocchioCalls.unfit(dataclasses.replace(tmt.ARM, position_gain=np.eye(3)))


def test_where_they_are_not_installed_they_say_so(monkeypatch):
    for name, engine in (("heyoka", Heyoka()), ("pinocchio", PinocchioCalls)):
        monkeypatch.setattr(f"compare.engines.{name}.find_spec", lambda name: None)
        assert name in engine.unavailable().lower()
