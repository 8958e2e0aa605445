"""Every experiment agrees with MuJoCo on the arm."""

import numpy as np
import pytest

import tmt
from compare.engines.mujoco.parameters import parameters
from compare.experiments import EXPERIMENTS, skipped
from compare.experiments.parameters import stated
<<<<<<< HEAD
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from compare.robots import Robot
=======
>>>>>>> a1bfe780 (Fewer tests of the tests' own models; a point mass, and the tolerance of series)
from compare.robots.arm import ARM


@pytest.mark.parametrize("experiment", [name for name in EXPERIMENTS if not skipped(name, ARM)])
def test_experiment_agrees(experiment, small):
    """Every path of a full run, with few states and steps."""
    result = small(experiment)
    assert result.checks
    assert [str(check) for check in result.checks if not check.passed] == []


def test_the_two_sets_of_numbers_are_one(mujoco):
    """tmt/arm.py and mjcf/arm.xml have the arm's numbers twice; this ties them."""
    compiled = parameters(mujoco.of(ARM.case()))
    for quantity, value in compiled.items():
        assert np.allclose(value, stated(tmt.ARM).get(quantity, 0.0), rtol=1e-15, atol=1e-16), quantity


def test_states_move_and_engines_do_not_have_the_same_bits(setup):
    """Were every difference zero, one engine would be compared with itself."""
    q, qd, tau = setup.random.q, setup.random.qd, setup.random.tau
    assert np.abs(tmt.acceleration(q, qd, tau)).mean() > 10.0 and np.abs(tmt.energy(q, qd)).mean() > 1.0
    ours, theirs = setup.compared().values()
    assert np.abs(ours.mass_matrix(q) - theirs.mass_matrix(q)).max() > 0.0
    assert np.abs(ours.bias(q, qd) - theirs.bias(q, qd)).max() > 0.0 and np.abs(ours.bias(q, qd)).mean() > 1.0
<<<<<<< HEAD


@pytest.mark.parametrize("seed", range(4))
def test_random_trees(seed):
    """Branches, several hinges in a body, products of inertia, CoM off every axis, damping."""
    rng = np.random.default_rng(seed)
    tree = random_tree(rng, bodies=int(rng.integers(1, 6)), damping=1.0)
    n = len(tree.hinge_names)
    engine = parse(mjcf(tree), tree).of(Robot("tree", Path("none"), tree, {}, ()).case())
    q, qd, tau = rng.uniform(-3, 3, (3, 20, n))

    M = tmt.mass_matrix(q, tree)
    size = np.abs(M).max(axis=(1, 2))
    assert (np.abs(M - engine.mass_matrix(q)).max(axis=(1, 2)) < FACTOR * EPS * size).all()
    h, force = tmt.bias(q, qd, tree), Entries(tree, q, qd).bias
    assert (np.abs(h - engine.bias(q, qd)) < FACTOR * EPS * force).all()
    qdd = tmt.acceleration(q, qd, tau, tree)
    values = np.linalg.eigvalsh(M)
    tolerance = FACTOR * EPS * values[:, -1] / values[:, 0] * (force.max(axis=1) + 6.0) / values[:, 0]
    assert (np.abs(qdd - engine.acceleration(q, qd, tau)).max(axis=1) < tolerance).all()
=======
>>>>>>> a1bfe780 (Fewer tests of the tests' own models; a point mass, and the tolerance of series)
