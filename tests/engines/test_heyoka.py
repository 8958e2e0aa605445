"""heyoka takes part where it can be compiled in seconds."""

from importlib.util import find_spec

import pytest
from models import PATHS, chain

import tmt
from compare.engines.heyoka import Heyoka
from compare.engines.mujoco import read


@pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka is not installed")
def test_it_says_of_which_robots_its_compilation_would_take_minutes():
    assert Heyoka().unavailable() is None
    for tree in (tmt.ARM, read(PATHS["gripper"]).tree, read(PATHS["free_body"]).tree):
        assert Heyoka().too_long(tree) is None
    assert "7 speeds its compilation would take minutes: its equations have" in Heyoka().too_long(
        read(PATHS["arm7"]).tree
    )
    assert "30 speeds its compilation would take minutes" in Heyoka().too_long(read(chain(30)).tree)


def test_where_it_is_not_installed_it_says_so(monkeypatch):
    monkeypatch.setattr("compare.engines.heyoka.find_spec", lambda name: None)
    assert "not installed" in Heyoka().unavailable()
