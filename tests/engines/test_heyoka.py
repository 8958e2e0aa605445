"""heyoka takes part where it can be compiled in seconds."""

from importlib.util import find_spec

import numpy as np
import pytest
from models import PATHS, chain

import tmt
from compare.engines.heyoka import Heyoka, compiled_accelerations
from compare.engines.mujoco import read
from compare.judge.scale import EPS, FACTOR, acceleration_scale, bias_scale


@pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka is not installed")
def test_it_says_of_which_robots_its_compilation_would_take_minutes():
    assert Heyoka().unavailable() is None
    for tree in (tmt.ARM, read(PATHS["gripper"]).tree, read(PATHS["free_body"]).tree):
        assert Heyoka().too_long(tree) is None
    assert "7 speeds its compilation would take minutes: its equations have" in Heyoka().too_long(
        read(PATHS["arm7"]).tree
    )
    assert "30 speeds its compilation would take minutes" in Heyoka().too_long(read(chain(30)).tree)


@pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka is not installed")
@pytest.mark.parametrize("fastest", [False, True])
def test_a_compiled_function_has_the_accelerations_of_tmt(rng, fastest):
    q, v, tau = rng.uniform(-2.0, 2.0, (3, 21, 3))
    found = np.empty((3, 21))
    compiled_accelerations(tmt.ARM, fastest)(np.concatenate([q.T, v.T, tau.T]).copy(), outputs=found)
    expected = tmt.acceleration(q, v, tau)
    scale = acceleration_scale(tmt.ARM, q, bias_scale(tmt.ARM, q, v) + np.abs(tau).max(axis=1))
    assert (np.abs(found.T - expected).max(axis=1) <= FACTOR * EPS * scale).all() and np.abs(expected).max() > 1.0


def test_where_it_is_not_installed_it_says_so(monkeypatch):
    monkeypatch.setattr("compare.engines.heyoka.find_spec", lambda name: None)
    assert "not installed" in Heyoka().unavailable()
