"""The true motion: beside closed forms, a short run in many digits, and its own second run."""

import dataclasses
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from models import PATHS
from trees import exact_swing, one_body, random_state, small_tree, tree_of_kinds

from compare.engines.mujoco import read
from tmt.derivation import composite
from tmt.derivation.method import acceleration
from tmt.exact import motion as reference_run
from tmt.exact.motion import trajectory, truth
from tmt.exact.tree import exact_tree, of_length_1

DIGITS = 32


def off(path, expected, record=-1):
    """The largest difference of a record from numbers of many digits."""
    with mpmath.workdps(60):
        pairs = zip(path.high[record].tolist(), path.low[record].tolist(), expected)
        return float(max(abs(mpmath.mpf(high) + mpmath.mpf(low) - value) for high, low, value in pairs))


def short_run(tree, q, qd, tau, duration) -> list:
    """The state at the end, by the method over mpmath's numbers and mpmath's own Taylor series: no trace, no pairs."""
    with mpmath.workdps(DIGITS):
        exact, nq = exact_tree(tree, mpmath.mpf), len(q)
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd, tau))

        def rates(_, state):
            q, qd = state[:nq], state[nq:]
            return [*exact.coordinates.component_rates(q, qd), *acceleration(exact, q, qd, tau)]

        return mpmath.odefun(rates, 0, [*of_length_1(tree.coordinates, q), *qd])(duration)


@pytest.mark.parametrize("form", reference_run.FORMS)
@pytest.mark.parametrize("axis, arm", [((0, 1, 0), (0, 0, -1)), ((1, 2, 2), (2, 1, -2))])
def test_a_pendulum_is_its_elliptic_function(axis, arm, form):
    """Pulled along its arm each is that of frequency 2 per second, after many turns; of one axis no double has the direction."""
    square, arm = sum(x * x for x in arm), tuple(map(float, arm))
    tree = one_body([axis], (), arm, square * np.eye(3), gravity=tuple(8.0 * x for x in arm))
    assert (sum(Fraction(x) ** 2 for x in tree.axis[0]) != 1) == (axis == (1, 2, 2))
    path = trajectory(tree, [200.0], [1.5], [0.0], 0.375, 8, form=form)
    expected = exact_swing(0.375 * np.arange(9), 200.0, 1.5, 0.0, 2.0)
    assert max(off(path, [angle], k) for k, angle in enumerate(expected)) < 1e-28


def product(p, q):
    """p o q of quaternions, w first."""
    (a, *u), (b, *v) = p, q
    u, v = np.array(u), np.array(v)
    return [a * b - u @ v, *(a * v + b * u + np.cross(u, v))]


def turned_about(omega, t):
    """The quaternion of a rotation with a constant angular velocity."""
    speed = mpmath.norm(omega)
    return [mpmath.cos(speed * t / 2), *(mpmath.sin(speed * t / 2) / speed * w for w in omega)]


def test_a_symmetric_free_body_precesses_about_its_angular_momentum():
    turn, spin, inertia = (0.5, 0.5, -0.5, 0.5), (4.0, 1.0, 3.0), np.diag([2.0, 2.0, 0.5])
    tree = read(PATHS["free_body"]).tree
    tree = dataclasses.replace(tree, inertia=[inertia], com=[(0.0, 0.0, 0.0)], damping=[0.0] * 6)
    path = trajectory(tree, [0.0] * 3 + list(turn), [1.0, 0.0, 2.0, *spin], [0.0] * 6, 0.25, 4)
    assert np.array_equal(tree.axis[3:], np.eye(3))
    for k in (1, 4):
        with mpmath.workdps(60):
            t, g = mpmath.mpf(0.25 * k), [mpmath.mpf(v) for v in tree.gravity]
            position = [v * t + a * t**2 / 2 for v, a in zip((1, 0, 2), g)]
            speed = [v + a * t for v, a in zip((1, 0, 2), g)]
            rate = (mpmath.mpf(0.5) - 2) / 2 * 3  # of the spin about the axis of symmetry, in the body's axes
            (x, y, z), cosine, sine = spin, mpmath.cos(rate * t), mpmath.sin(rate * t)
            omega = [x * cosine - y * sine, x * sine + y * cosine, z]
            momentum = [4, 1, mpmath.mpf(0.75)]  # over the moment about the other axes
            quaternion = product(product(turn, turned_about(momentum, t)), turned_about([0, 0, -rate], t))
        assert off(path, [*position, *quaternion, *speed, *omega], k) < 1e-29


def test_times_are_exact_multiples_of_the_step():
    """A slide without force moves by speed times time: 0.1, 0.3, 0.7 are not what their doubles are."""
    tree = one_body([(0.0, 1.0, 0.0)], ["slide"], gravity=(0.0, 0.0, 0.0))
    path = trajectory(tree, [0.3], [0.7], [0.0], 0.1, 21, every=3)
    assert path.high.shape == (8, 2) and path.steps == 1
    for k, (high, low) in enumerate(zip(path.high[:, 0].tolist(), path.low[:, 0].tolist())):
        expected = Fraction(0.3) + Fraction(0.7) * 3 * k * Fraction(0.1)
        assert abs(Fraction(high) + Fraction(low) - expected) < Fraction(1, 10**31)


@pytest.mark.parametrize("tree", [small_tree(), tree_of_kinds(np.random.default_rng(1), bodies=1)])
def test_trees_of_every_kind_beside_a_short_run_in_many_digits(tree, rng):
    """Balls, slides and free joints, springs, armature, damping, axes to the last digit, a controller."""
    start = random_state(rng, tree)
    expected = short_run(tree, *start, 2.0**-9)
    for form in reference_run.FORMS:
        assert off(trajectory(tree, *start, 2.0**-9, 1, form=form), expected) < 1e-28, form


def test_two_runs_of_other_forms_and_orders_agree_and_a_seeded_error_sets_them_apart(monkeypatch):
    rng = np.random.default_rng(10)
    tree = tree_of_kinds(rng, bodies=3)
    start = random_state(rng, tree)
    path, apart = truth(tree, *start, 0.0625, 4)
    assert 0.0 < apart < 1e-28 and np.abs(path.low).max() > 0.0
    assert np.all(np.abs(path.low) <= np.spacing(np.abs(path.high)) / 2)

    def wrong(tree, q, qd):
        faster = [v * (1 + mpmath.mpf(2) ** -60) for v in qd]
        return composite.mass_matrix_and_bias(tree, q, faster, mpmath.mpf)

    monkeypatch.setitem(reference_run.FORMS, "literal", wrong)
    assert truth(tree, *start, 0.0625, 4)[1] > 1e-20
