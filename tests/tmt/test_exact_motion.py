"""The true motion: beside closed forms, a short run in many digits, heyoka in quad precision, and its own second run."""

import dataclasses
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from many_digits import short_run
from models import PATHS
from trees import random_state, small_tree, tree_of_kinds

import tmt
from compare.engines.mujoco import read
from compare.truth.free_body import free_turning
from compare.truth.pendulum import exact_swing
from tmt.equations import composite
from tmt.exact import motion as reference_run
from tmt.exact.motion import trajectory, truth

BENT = (0.5, 0.3, 1.0)
ONE_HINGE = tmt.Tree(
    hinge_names=["swing"], parent=[-1], offset=[(0.0, 0.0, 0.0)], axis=[(0.0, 1.0, 0.0)], damping=[0.0], body_names=["bob"],
    body_hinge=[0], mass=[1.0], com=[(0.0, 0.0, -0.5)], inertia=[np.diag([1.0, 0.75, 0.5])], gravity=(0.0, 0.0, -8.0),
)  # fmt: skip


def off(path, expected, record=-1):
    """The largest difference of a record from numbers of many digits."""
    with mpmath.workdps(60):
        found = [mpmath.mpf(h) + mpmath.mpf(l) for h, l in zip(path.high[record].tolist(), path.low[record].tolist())]
        return float(max(abs(a - b) for a, b in zip(found, expected)))


# what is known without an integrator


@pytest.mark.parametrize("form", reference_run.FORMS)
def test_a_pendulum_is_its_elliptic_function(form):
    path = trajectory(ONE_HINGE, [2.0], [1.5], [0.0], 0.375, 8, form=form)
    expected = exact_swing(0.375 * np.arange(9), 2.0, 1.5, 0.0, 2.0)
    assert max(off(path, [angle], k) for k, angle in enumerate(expected)) < 1e-29


@pytest.mark.parametrize("form", reference_run.FORMS)
@pytest.mark.parametrize("axis, arm", [((1, 2, 2), (2, 1, -2))])
def test_an_axis_has_length_1_in_all_digits(axis, arm, form):
    """Of these no double has the direction; pulled along its arm each is the pendulum of frequency 2 per second."""
    square, arm = sum(x * x for x in arm), tuple(map(float, arm))
    tree = dataclasses.replace(
        ONE_HINGE, axis=[axis], com=[arm], inertia=[square * np.eye(3)], gravity=tuple(8.0 * x for x in arm)
    )
    assert sum(Fraction(x) ** 2 for x in tree.axis[0]) != 1
    path = trajectory(tree, [2.0], [1.5], [0.0], 0.375, 8, form=form)
    expected = exact_swing(0.375 * np.arange(9), 2.0, 1.5, 0.0, 2.0)
    assert max(off(path, [angle], k) for k, angle in enumerate(expected)) < 1e-28


def test_a_free_body_turns_by_elliptic_functions():
    tree = read(PATHS["free_body"]).tree
    moments, turn, spin = np.diag(tree.inertia[0]), (0.5, 0.5, -0.5, 0.5), (4.0, 1.0, 3.0)
    tree = dataclasses.replace(tree, inertia=[np.diag(moments)], com=[(0.0, 0.0, 0.0)], damping=[0.0] * 6)
    path = trajectory(tree, [0.0] * 3 + list(turn), [1.0, 0.0, 2.0, *spin], [0.0] * 6, 0.25, 4)
    axes = np.array(tree.axis[3:])
    assert np.array_equal(axes, np.eye(3)) and np.ptp(moments) > 0.0
    for k in range(5):
        speeds, quaternions = free_turning([0.25 * k], moments, spin, turn)
        t, g = mpmath.mpf(0.25 * k), [mpmath.mpf(v) for v in tree.gravity]
        with mpmath.workdps(60):
            start = [1, 0, 2]
            fallen = [v * t + a * t**2 / 2 for v, a in zip(start, g)]
            speed = [v + a * t for v, a in zip(start, g)]
        assert off(path, [*fallen, *quaternions[0], *speed, *speeds[0]], k) < 1e-29


def test_times_are_exact_multiples_of_the_step():
    """A slide without force moves by speed times time: 0.1, 0.3, 0.7 are not what their doubles are."""
    tree = dataclasses.replace(ONE_HINGE, kind=["slide"], gravity=(0.0, 0.0, 0.0))
    path = trajectory(tree, [0.3], [0.7], [0.0], 0.1, 21, every=3)
    assert path.high.shape == (8, 2) and path.steps == 1
    for k, (high, low) in enumerate(zip(path.high[:, 0].tolist(), path.low[:, 0].tolist())):
        expected = Fraction(0.3) + Fraction(0.7) * 3 * k * Fraction(0.1)
        assert abs(Fraction(high) + Fraction(low) - expected) < Fraction(1, 10**31)


# beside runs of other kinds


def test_the_arm_beside_a_short_run_in_many_digits():
    tree = dataclasses.replace(tmt.ARM, damping=(0.1, 0.2, 0.3))
    start = BENT, (1.0, -2.0, 3.0), (0.1, 0.2, -0.3)
    expected = short_run(tree, *start, 0.0078125)
    for form in reference_run.FORMS:
        path = trajectory(tree, *start, 0.0078125, 1, form=form)
        assert off(path, expected) < 1e-29, form
        assert off(path, [*start[0], *start[1]], 0) == 0.0


@pytest.mark.parametrize("seed", range(2))
def test_trees_of_every_kind_beside_a_short_run_in_many_digits(seed):
    """Balls, slides and free joints, springs, armature, damping, axes to the last digit, and a controller."""
    rng = np.random.default_rng(seed)
    tree = [small_tree(), tree_of_kinds(rng, bodies=1)][seed]
    start = random_state(rng, tree)
    expected = short_run(tree, *start, 2.0**-9)
    for form in reference_run.FORMS:
        assert off(trajectory(tree, *start, 2.0**-9, 1, form=form), expected) < 1e-28, form


@pytest.mark.parametrize("seed", range(2))
def test_two_runs_of_other_forms_and_orders_agree(seed):
    rng = np.random.default_rng(10 + seed)
    tree = tree_of_kinds(rng, bodies=3)
    path, apart = truth(tree, *random_state(rng, tree), 0.0625, 4)
    assert 0.0 < apart < 1e-28 and np.abs(path.low).max() > 0.0
    assert np.all(np.abs(path.low) <= np.spacing(np.abs(path.high)) / 2)


def test_a_seeded_error_in_one_form_sets_the_two_runs_apart(monkeypatch):
    def wrong(tree, q, qd):
        return composite.mass_matrix_and_bias(tree, q, [v * (1 + mpmath.mpf(2) ** -60) for v in qd], mpmath.mpf)

    monkeypatch.setitem(reference_run.FORMS, "literal", wrong)
    assert truth(tmt.ARM, BENT, [1.0] * 3, [0.0] * 3, 0.25, 2)[1] > 1e-20
