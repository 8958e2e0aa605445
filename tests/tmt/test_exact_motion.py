"""Motions: what simulate gives back and why a run ended; the true motion beside closed forms and many digits."""

import copy
import dataclasses
import pickle
from fractions import Fraction

import mpmath
import numpy as np
import pytest
from helpers.trees import one_body, random_state, small_tree, tree_of_kinds, wrist

import tmt
from tmt.derivation import composite
from tmt.derivation.method import acceleration
from tmt.exact import motion as reference_run
from tmt.exact.motion import trajectory, truth
from tmt.exact.tree import exact_tree, of_length_1
from tmt.methods import METHODS, one_step
from tmt.simulation import reasons

DIGITS = 32


def exact_swing(t: np.ndarray, q: float, qd: float, frequency: float) -> list:
    """The angle of a pendulum that hangs at zero, with 50 digits of mpmath's elliptic functions."""
    with mpmath.workdps(50):
        q, qd, frequency = (mpmath.mpf(float(v)) for v in (q, qd, frequency))
        theta = q - 2 * mpmath.pi * mpmath.floor(q / (2 * mpmath.pi) + 0.5)
        height, speed = mpmath.sin(theta / 2), qd / (2 * frequency)
        m = height**2 + speed**2
        begin = mpmath.ellipf(mpmath.atan2(height, speed), m)
        sn = [mpmath.ellipfun("sn", u=frequency * mpmath.mpf(float(time)) + begin, m=m) for time in t]
        return [q - theta + 2 * mpmath.asin(mpmath.sqrt(m) * s) for s in sn]


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


def test_times_are_exact_multiples_of_what_the_double_is():
    """A disc that nothing turns: 3 rad/s, after 1, 2, 3 times 0.1 s, of which no double is the third."""
    path = trajectory(one_body([(0.0, 0.0, 1.0)], gravity=(0.0, 0.0, 0.0)), [0.0], [3.0], [0.0], 0.1, 3)
    for k, (high, low) in enumerate(zip(path.high[:, 0], path.low[:, 0])):
        assert abs(Fraction(high) + Fraction(low) - 3 * k * Fraction(0.1)) < Fraction(1, 10**30)


@pytest.mark.parametrize("form", reference_run.FORMS)
@pytest.mark.parametrize("axis, arm", [((0, 1, 0), (0, 0, -1)), ((1, 2, 2), (2, 1, -2))])
def test_a_pendulum_is_its_elliptic_function(axis, arm, form):
    """Pulled along its arm each is that of frequency 2 per second, after many turns; of one axis no double has the direction."""
    square, arm = sum(x * x for x in arm), tuple(map(float, arm))
    tree = one_body([axis], (), arm, square * np.eye(3), gravity=tuple(8.0 * x for x in arm))
    assert (sum(Fraction(x) ** 2 for x in tree.axis[0]) != 1) == (axis == (1, 2, 2))
    path = trajectory(tree, [200.0], [1.5], [0.0], 0.375, 8, form=form)
    expected = exact_swing(0.375 * np.arange(9), 200.0, 1.5, 2.0)
    assert max(off(path, [angle], k) for k, angle in enumerate(expected)) < 1e-28


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


BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)
FAST = 2.0**49 - 1.0
ENDS = {
    "overflow": ("rk4", (BENT, REST, [1e308] * 3), {}, "diverges"),
    "diverged": ("rk4", (BENT, [1e3] * 3, REST), {"dt": 10.0}, "diverges"),
    "turned": ("rk4", ([FAST, 0, 0], [50, 0, 0], REST), {}, "2^49"),
    "adaptive, turned": ("dopri8_adaptive", ([FAST, 0, 0], [50, 0, 0], REST), {}, "2^49"),
    "too small a tolerance": ("dopri8_adaptive", (BENT, REST, REST), {"tolerance": 1e-300}, "1e-300"),
    "no stages": ("implicit_midpoint", (BENT, REST, REST), {"dt": 0.5}, "Newton"),
    "singular": ("rk4", ([0.5, 0, 1], [1, 0, 0], REST), {"model": wrist()}, "'a', 'c'"),
    "stages of a singular state": ("implicit_midpoint", (REST, [0.1, 0.2, 0.3], [1, 0, 0]), {"model": wrist()}, "'a', 'c'"),
    "a series that overflows": ("taylor", (BENT, [1e200, -1e200, 0.0], REST), {}, ""),
}  # fmt: skip


@pytest.mark.filterwarnings("error")
@pytest.mark.parametrize("method, start, more, says", ENDS.values(), ids=ENDS)
def test_a_run_says_why_it_ended(method, start, more, says):
    """Alone, between the states that are kept, and among others, which go on."""
    arguments = {"dt": 0.1, "steps": 200, "method": method} | more
    model = arguments.pop("model", tmt.ARM)
    motion = tmt.simulate(model, *start, **arguments)
    last = int(np.isfinite(motion.q).all(axis=1).sum()) - 1
    assert motion.ended.startswith(f"at t = {last * arguments['dt']:g} s") and says in motion.ended
    assert 0 <= last < 200 and np.isnan(motion.q[last + 1 :]).all() and np.isnan(motion.qd[last + 1 :]).all()
    some = tmt.simulate(model, *start, **arguments, every=40)
    assert some.ended == motion.ended and np.array_equal(some.q, motion.q[::40], equal_nan=True)
    if method == "rk4":
        rows = np.tile(np.array([[0.5, 1.0, 1.0], REST, REST])[:, None], (1, 9, 1))
        rows[:, 4] = start
        short = arguments | {"steps": min(200, last + 2)}
        among = tmt.simulate(model, *rows, **short)
        assert among.ended[4] == motion.ended and (among.ended[0] is None or "dt" in more or "model" in more)
        assert np.array_equal(among.q[4], motion.q[: short["steps"] + 1], equal_nan=True)


def test_a_hinge_whose_motion_does_not_depend_on_its_angle_ends_at_the_limit():
    alone = one_body([(0.0, 1.0, 0.0)], gravity=(0.0, 0.0, 0.0))
    assert "2^49" in tmt.simulate(alone, [FAST], [50.0], [0.0], 0.1, 5).ended


def test_where_newton_fails_one_step_is_an_error():
    with pytest.raises(ArithmeticError, match="Newton's method"):
        one_step(METHODS["implicit_midpoint"], tmt.ARM, BENT.tolist(), [1e6] * 3, [0.0] * 3, 10.0)


@pytest.mark.parametrize("beta, where", [
    ([1.0, 0.8, 0.6, 0.4, 0.0, -0.4, -0.6, -0.8, -1.0], 4), ([1.0, 0.5, 0.0], 2), ([1.0, 0.5], None),
])  # fmt: skip
def test_a_singular_state_before_the_rates_jump_is_found_and_so_is_the_last(beta, where):
    q, qd = np.zeros((2, 1, len(beta), 3))
    q[0, :, 1], qd[0, (len(beta) + 1) // 2 :] = beta, 1.0
    (why,) = reasons(wrist(), q, qd, np.zeros((1, 2), int), 0.1, 1e-9)
    if where is None:
        assert why is None
    else:
        assert why.startswith(f"at t = {0.1 * where:g} s: ") and "'a', 'c'" in why
        assert np.isfinite(q[0, :, 0]).tolist() == [k <= where for k in range(len(beta))]


def test_a_motion_is_three_arrays_and_more():
    batch = tmt.simulate(tmt.ARM, [[BENT, BENT]], [[REST, [1e200] * 3]], REST, 0.1, 5)
    t, q, qd = batch
    assert isinstance(batch, tuple) and t is batch.t is batch[0] and q is batch.q and qd is batch.qd
    assert batch.evaluations == 4 * (5 + 1) and batch.ended.shape == (1, 2)
    assert batch.ended[0, 0] is None and "2^49" in batch.ended[0, 1]
    for again in (copy.deepcopy(batch), pickle.loads(pickle.dumps(batch))):
        assert type(again) is tmt.Motion and again.evaluations == batch.evaluations
        assert np.array_equal(again.ended, batch.ended) and np.array_equal(again.q, q, equal_nan=True)


def test_taylor_is_the_true_motion_of_each_run(rng):
    starts, tau = rng.uniform(-1, 1, (2, 3)), rng.uniform(-1, 1, (2, 3))
    motion = tmt.simulate(tmt.ARM, starts, REST, tau, 0.1, 6, "taylor", every=2)
    assert motion.ended.tolist() == [None, None] and np.array_equal(motion.q[:, 0], starts)
    near = tmt.simulate(tmt.ARM, starts, REST, tau, 0.1 / 256, 6 * 256, "dopri8", every=512)
    assert np.abs(near.q - motion.q).max() < 1e-13 and np.array_equal(near.t, motion.t)
    loose = tmt.simulate(tmt.ARM, starts, REST, tau, 0.1, 6, "taylor", tolerance=1e-6)
    assert 2 <= loose.evaluations < motion.evaluations
    stiff = dataclasses.replace(tmt.ARM, damping=(1e6, 0.0, 0.0))
    assert "series" in tmt.simulate(stiff, BENT, REST, REST, 0.1, 5, "taylor").ended
