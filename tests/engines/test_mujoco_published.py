"""Files that packages bring: gymnasium's and MuJoCo's own, the same in both engines, and with joints locked."""

from pathlib import Path

import mujoco
import numpy as np
import pytest
from files import assert_the_same, case_of
from models import gymnasium_files
from trees import random_state

from compare.engines.mujoco import engine, read
from compare.engines.mujoco.stated import stated_numbers

OWN = Path(mujoco.__file__).parent / "testdata" / "model.xml"
FEW = ("ant.xml", "humanoid.xml", "reacher.xml", "swimmer.xml", "model.xml")
FILES = [
    pytest.param(path, marks=() if path.name in FEW else pytest.mark.slow)
    for path in (*gymnasium_files(), OWN)
    if path.exists()
]


@pytest.mark.parametrize("path", FILES, ids=lambda path: path.name)
def test_a_published_file_is_the_same_in_both_and_with_joints_locked(path, rng):
    reading = read(path)
    tree = reading.tree
    assert_the_same(engine(reading).of(case_of(tree)), tree, rng, states=1)
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
