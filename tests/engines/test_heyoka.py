"""heyoka takes part where it can: hinges and slides, and not so many that each tolerance would take minutes to compile."""

from importlib.util import find_spec

import pytest
from models import PATHS, chain

import tmt
from compare.engines.heyoka import MOST_JOINTS, Heyoka
from compare.engines.mujoco import read
from compare.engines.scipy import Scipy
from compare.setup import engines


@pytest.mark.skipif(find_spec("heyoka") is None, reason="heyoka is not installed")
def test_it_says_of_which_robots_it_takes_no_part():
    few, many = (read(chain(n)).tree for n in (MOST_JOINTS, MOST_JOINTS + 1))
    for tree in (None, tmt.ARM, few, read(PATHS["loop"]).tree):
        assert Heyoka(tree).unavailable() is None
    assert "minutes for more than 3 joints" in Heyoka(many).unavailable()
    assert "there are balls" in Heyoka(read(PATHS["pendulum_ball"]).tree).unavailable()
    assert engines(Scipy(), many)["heyoka"].unavailable()


def test_where_it_is_not_installed_it_says_so(monkeypatch):
    monkeypatch.setattr("compare.engines.heyoka.find_spec", lambda name: None)
    assert "not installed" in Heyoka(tmt.ARM).unavailable()
