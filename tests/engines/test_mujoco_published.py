"""Files that packages bring: gymnasium's and MuJoCo's own, compared or refused by name."""

from importlib.util import find_spec
from pathlib import Path

import mujoco
import numpy as np
import pytest
from files import assert_the_same, case_of
from trees import random_state

from compare.engines.mujoco import engine, read
from compare.engines.mujoco.stated import stated_numbers

GYMNASIUM = find_spec("gymnasium")
ASSETS = Path(GYMNASIUM.origin).parent / "envs" / "mujoco" / "assets" if GYMNASIUM else Path("gymnasium")
OWN = Path(mujoco.__file__).parent / "testdata" / "model.xml"
FILES = [*sorted(ASSETS.glob("*.xml")), *([OWN] if OWN.exists() else [])]


FEW = ("ant.xml", "half_cheetah.xml", "humanoid.xml", "pusher.xml", "reacher.xml", "swimmer.xml", "model.xml")


@pytest.mark.parametrize(
    "path",
    [path if path.name in FEW else pytest.param(path, marks=pytest.mark.slow) for path in FILES],
    ids=lambda path: path.name,
)
def test_a_published_file_is_the_same_in_both_and_with_joints_locked(path, rng):
    reading = read(path)
    tree = reading.tree
    assert_the_same(engine(reading).of(case_of(tree)), tree, rng)
    q, _, _ = random_state(rng, tree)
    positions = {
        name: float(q[joint.q.start]) if joint.kind != "ball" else tuple(q[joint.q])
        for name, joint in zip(tree.hinge_names, tree.coordinates.joints)
        if rng.random() < 0.3
    }
    smaller = tree.lock(positions)
    assert_the_same(engine(reading).of(case_of(smaller, positions)), smaller, rng, states=1)
    for row in stated_numbers(reading):
        if row.stated is not None and not row.why:
            assert np.allclose(row.stated, row.compiled, rtol=1e-6, atol=1e-12), row


def test_gymnasium_brings_fourteen_files():
    if not GYMNASIUM:
        pytest.skip("gymnasium is not installed; the extra `test` brings it")
    assert len(FILES) - OWN.exists() == 14
