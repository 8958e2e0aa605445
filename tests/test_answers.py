"""The public functions answer by compiled loops once these are worth getting, with what the literal form returns and raises."""

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest
from trees import random_state, tree_of_kinds

import tmt
from tmt import answers, literal
from tmt.compiled import cores

EPS = np.finfo(float).eps
OF_Q = "com_positions", "jacobians", "mass_matrix", "gravity_balance", "spring_torque", "potential_energy"
OF_STATE = "angular_velocities", "convective_terms", "bias", "energy"
QUANTITIES = *OF_Q, *OF_STATE, "acceleration"


def given_to(quantity, q, qd, tau):
    """The arguments of a function among these."""
    return (q,) if quantity in OF_Q else (q, qd) if quantity in OF_STATE else (q, qd, tau)


def in_parts(found):
    return found if isinstance(found, tuple) else (found,)


@pytest.fixture
def loops():
    """The loops answer for a Tree from now on."""

    def got(tree):
        answers.remembered(tree).get_loops()
        return tree

    return got


def states(seed, count):
    """A tree with every kind of joint, and its states: q, qd, tau of shape (count, ...)."""
    rng = np.random.default_rng(seed)
    tree = tree_of_kinds(rng, bodies=5)
    return tree, [np.array(rows) for rows in zip(*(random_state(rng, tree) for _ in range(count)))]


@pytest.mark.parametrize("seed", range(6))
def test_what_the_loops_answer_is_what_the_literal_form_returns(seed, loops):
    tree, given = states(seed, 21)
    loops(tree)
    condition = np.linalg.cond(literal.mass_matrix(given[0], tree)).max()
    for quantity in QUANTITIES:
        expected = in_parts(getattr(literal, quantity)(*given_to(quantity, *given), tree))
        for batch in ((), (1,), (21,), (3, 7), (0,), (2, 0)):
            size = int(np.prod(batch))
            some = [rows[0] if batch == () else rows[:size].reshape(*batch, rows.shape[1]) for rows in given]
            found = in_parts(getattr(tmt, quantity)(*given_to(quantity, *some), tree))
            assert len(found) == len(expected)
            for one, all_of_it in zip(found, expected):
                other = all_of_it[0] if batch == () else all_of_it[:size].reshape(*batch, *all_of_it.shape[1:])
                assert type(one) is np.ndarray and one.shape == other.shape and one.dtype == other.dtype
                assert one.flags.c_contiguous and one.flags.writeable
                slack = 64 * EPS * (condition if quantity == "acceleration" else 1.0)
                assert np.abs(one - other).max(initial=0.0) <= slack * np.abs(all_of_it).max()


def test_a_controllers_gains_are_those_of_the_model(loops):
    rng = np.random.default_rng(5)
    for fields in (("position_gain", "speed_gain"), ("position_gain",), ("speed_gain",)):
        tree = loops(replace(tmt.ARM, **{field: rng.uniform(-2.0, 2.0, (3, 3)) for field in fields}))
        q, qd, tau = rng.uniform(-2.0, 2.0, (3, 11, 3))
        assert tmt.acceleration(q, qd, tau, tree) == pytest.approx(literal.acceleration(q, qd, tau, tree), rel=1e-11)
        assert tmt.mass_matrix(q, tree) == pytest.approx(literal.mass_matrix(q, tree), rel=1e-13)


def test_straight_line_code_answers_many_states_once_it_is_worth_it(loops, monkeypatch):
    known = answers.remembered(loops(replace(tmt.ARM, mass=(2.25, 1.5))))
    q, qd, tau = np.random.default_rng(6).uniform(-2.0, 2.0, (3, 1100, 3))
    by_loops = [
        tmt.acceleration(q, qd, tau, known.tree),
        tmt.mass_matrix(q, known.tree),
        tmt.bias(q, qd[0], known.tree),
    ]
    assert not known.lanes
    known.asked = dict.fromkeys({*answers.OF_STRAIGHT_LINES.values()}, 1e12)
    by_lines = [
        tmt.acceleration(q, qd, tau, known.tree),
        tmt.mass_matrix(q, known.tree),
        tmt.bias(q, qd[0], known.tree),
    ]
    assert len(known.lanes) == 2
    for one, other in zip(by_loops, by_lines):
        assert one.shape == other.shape and other == pytest.approx(one, rel=1e-10, abs=1e-12)
    assert np.array_equal(by_lines[1], by_lines[1].transpose(0, 2, 1))
    assert tmt.gravity_balance(q, known.tree) == pytest.approx(literal.gravity_balance(q, known.tree), abs=1e-12)
    few = tmt.acceleration(q[:31], qd[:31], tau[:31], known.tree)  # too few for its lanes
    assert np.array_equal(few, by_loops[0][:31])
    enough = tmt.acceleration(q[:32], qd[:32], tau[:32], known.tree)
    assert np.array_equal(enough, by_lines[0][:32]) and not np.array_equal(enough, by_loops[0][:32])
    tau[700, 1] = np.nan
    with pytest.raises(ValueError, match="tau has values that are not finite"):
        tmt.acceleration(q, qd, tau, known.tree)


def test_one_row_of_speeds_or_torques_may_stand_for_all(loops):
    tree, (q, qd, tau) = states(2, 9)
    loops(tree)
    repeated = np.broadcast_to(qd[0], qd.shape), np.broadcast_to(tau[0], tau.shape)
    assert np.array_equal(tmt.acceleration(q, qd[0], tau[0], tree), tmt.acceleration(q, *repeated, tree))
    assert tmt.acceleration(q[0], qd[:, None], tau, tree).shape == (9, 9, qd.shape[1])


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_a_state_has_the_same_bits_alone_and_among_others(quantity, loops):
    tree, given = states(3, 19)
    loops(tree)
    together = in_parts(getattr(tmt, quantity)(*given_to(quantity, *given), tree))
    for k in range(19):
        alone = in_parts(getattr(tmt, quantity)(*given_to(quantity, *(rows[k] for rows in given)), tree))
        assert all(np.array_equal(rows[k], one) for rows, one in zip(together, alone))


def test_threads_change_no_bit(loops, monkeypatch):
    tree, (q, qd, tau) = states(4, 200)
    loops(tree)
    alone = tmt.acceleration(q, qd, tau, tree)
    used = []
    monkeypatch.setattr(cores, "cores", lambda: 3)
    monkeypatch.setattr(cores, "ThreadPoolExecutor", lambda n: used.append(n) or ThreadPoolExecutor(n))
    monkeypatch.setattr(cores, "APART", 1e-9)
    assert np.array_equal(tmt.acceleration(q, qd, tau, tree), alone)
    assert used and {*used} == {3}


@pytest.mark.parametrize(
    "convert", [np.ndarray.tolist, np.asfortranarray, np.float32, lambda a: a[..., ::-1].copy()[..., ::-1]]
)
def test_numbers_in_any_form_are_taken(convert, loops):
    loops(tmt.ARM)
    q, qd, tau = np.random.default_rng(0).integers(-8, 9, (3, 5, 3)) / 8.0
    expected = tmt.acceleration(q, qd, tau)
    assert np.array_equal(tmt.acceleration(convert(q), convert(qd), tau), expected)
    assert np.array_equal(tmt.acceleration(convert(q[0]), convert(qd[0]), tau[0]), expected[0])
    for rows in (q, qd, tau):
        rows.flags.writeable = False
    assert np.array_equal(tmt.acceleration(q, qd, tau), expected)
    assert np.array_equal(tmt.acceleration(q[0], qd[0], tau[0]), expected[0])


def test_what_the_loops_do_not_take_is_shown_to_them_once(loops, monkeypatch):
    tree = loops(replace(tmt.ARM, mass=(2.5, 1.5)))
    known, z, shown = answers.remembered(tree), np.zeros(3), []
    one = known.loops.one
    monkeypatch.setattr(known.loops, "one", lambda *given: shown.append(given[-5].flags.c_contiguous) or one(*given))
    every_second = np.arange(6.0)[::2]
    found = [tmt.acceleration(every_second, z, z, tree) for _ in range(5)]
    assert shown == [False] + [True] * 5  # of the copies
    assert all(np.array_equal(values, tmt.acceleration(np.array([0.0, 2.0, 4.0]), z, z, tree)) for values in found)


BALL = tmt.Tree(
    hinge_names=("ball",), parent=(-1,), offset=((0, 0, 0),), axis=np.eye(3), damping=(0, 0, 0), body_names=("body",),
    body_hinge=(0,), mass=(1,), com=((0, 0, 0.1),), inertia=(np.eye(3),), gravity=(0, 0, -9.81), kind=("ball",),
)  # fmt: skip
WRIST = tmt.Tree(  # three hinges through one point: Mbar is singular where the second is at zero
    hinge_names=("a", "b", "c"), parent=(-1, 0, 1), offset=np.zeros((3, 3)), axis=((0, 0, 1), (0, 1, 0), (0, 0, 1)),
    damping=(0, 0, 0), body_names=("hand",), body_hinge=(2,), mass=(1,), com=((0.1, 0, 0.2),), inertia=(np.eye(3),),
    gravity=(0, 0, -9.81),
)  # fmt: skip
WRONG = {
    "no numbers": (tmt.ARM, (["a"] * 3, [0.0] * 3, [0.0] * 3)),
    "truth values": (tmt.ARM, ([True] * 3, [0.0] * 3, [0.0] * 3)),
    "masked": (tmt.ARM, (np.ma.array([0.0] * 3, mask=[1, 0, 0]), np.zeros(3), np.zeros(3))),
    "nothing": (tmt.ARM, (None, None, None)),
    "no speeds": (tmt.ARM, (np.zeros(3), None, np.zeros(3))),
    "no torques of many": (tmt.ARM, (np.zeros((40, 3)), np.zeros(3), None)),
    "no position": (tmt.ARM, (None, np.zeros(3), np.zeros(3))),
    "too few": (tmt.ARM, (np.zeros(2), np.zeros(3), np.zeros(3))),
    "too few speeds": (tmt.ARM, (np.zeros(3), np.zeros(2), np.zeros(3))),
    "a number": (tmt.ARM, (0.0, np.zeros(3), np.zeros(3))),
    "not finite": (tmt.ARM, (np.array([0.0, np.nan, 0.0]), np.zeros(3), np.zeros(3))),
    "a speed that is not finite": (tmt.ARM, (np.zeros(3), np.array([0.0, np.inf, 0.0]), np.zeros(3))),
    "a torque among many": (tmt.ARM, (np.zeros((40, 3)), np.zeros(3), np.full((40, 3), np.inf))),
    "batches that do not fit": (tmt.ARM, (np.zeros((4, 3)), np.zeros((5, 3)), np.zeros(3))),
    "beyond the largest double": (tmt.ARM, (np.zeros(3), np.full(3, 1e200), np.zeros(3))),
    "no unit quaternion": (BALL, (np.array([1.0, 1.0, 0.0, 0.0]), np.zeros(3), np.zeros(3))),
    "one of many no unit quaternion": (BALL, (np.array([[1, 0, 0, 0]] * 9 + [[1, 0.01, 0, 0]]), np.zeros(3), np.zeros(3))),
    "singular": (WRIST, (np.zeros(3), np.zeros(3), np.zeros(3))),
    "singular but for rounding": (WRIST, (np.array([0.3, np.pi, 0.7]), np.zeros(3), np.zeros(3))),
    "one of many singular": (WRIST, (np.eye(3)[[1, 1, 1, 2, 1]], np.zeros(3), np.zeros(3))),
    "no model": ("arm", (np.zeros(3), np.zeros(3), np.zeros(3))),
}  # fmt: skip


@pytest.mark.parametrize("name", WRONG)
def test_what_is_wrong_is_said_in_the_same_words(name, loops):
    model, given = WRONG[name]
    if isinstance(model, tmt.Tree):
        loops(model)
    with pytest.raises(ValueError) as expected:
        literal.acceleration(*given, model)
    with pytest.raises(ValueError) as found:
        tmt.acceleration(*given, model)
    assert str(found.value) == str(expected.value)


@pytest.mark.filterwarnings("error")
def test_numbers_beyond_the_largest_double_are_refused_without_a_warning(loops):
    loops(tmt.ARM)
    for q in (np.full(3, 1e300, np.longdouble) ** 10, np.full((2, 3), 1e300, np.longdouble) ** 10):
        with pytest.raises(ValueError, match="q has values that are not finite"):
            tmt.mass_matrix(q)


def test_threads_ask_of_models_that_come_and_go(loops, monkeypatch):
    loops(tmt.ARM)
    monkeypatch.setattr(answers, "REMEMBERED", 1)
    monkeypatch.setattr(answers, "_known", {})
    before = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)

    def masses(seed):
        models = [replace(tmt.ARM, mass=(1.0 + seed + k, 1.0)) for k in range(2)]
        return [(tmt.mass_matrix(np.zeros((1, 3)), model), model) for _ in range(100) for model in models]

    try:
        with ThreadPoolExecutor(8) as pool:
            found = [one for of_thread in pool.map(masses, range(8)) for one in of_thread]
    finally:
        sys.setswitchinterval(before)
    expected = {model: literal.mass_matrix(np.zeros((1, 3)), model) for _, model in found}
    assert all(np.abs(M - expected[model]).max() <= 1e-12 * np.abs(M).max() for M, model in found)


AT_THE_END = """
import atexit, numpy as np, tmt
from tmt import answers, following
from tmt.compiled import cores
answers.remembered(tmt.ARM).get_loops()
cores.cores = following.cores = lambda: 3
following.SPREAD = 0.0
q = np.random.default_rng(0).uniform(-1, 1, (50_000, 3))
before = tmt.acceleration(q, q, q), tmt.simulate(q[:40], q[:40], q[:40], 0.01, 5, form="loop").q
def late():
    after = tmt.acceleration(q, q, q), tmt.simulate(q[:40], q[:40], q[:40], 0.01, 5, form="loop").q
    print(all(map(np.array_equal, before, after)))
atexit.register(late)
"""


def test_many_states_are_answered_where_no_thread_can_be_started(loops):
    loops(tmt.ARM)
    run = subprocess.run([sys.executable, "-c", AT_THE_END], capture_output=True, text=True, check=True)
    assert run.stdout == "True\n"


def test_what_is_within_a_millionth_of_a_unit_quaternion_is_one(loops):
    loops(BALL)
    inside, outside = (np.array([1.0 + off, 0.0, 0.0, 0.0]) for off in (0.99e-6, 1.01e-6))
    assert np.isfinite(tmt.acceleration(inside, np.zeros(3), np.zeros(3), BALL)).all()
    with pytest.raises(ValueError, match="quaternion"):
        tmt.acceleration(outside, np.zeros(3), np.zeros(3), BALL)


def test_an_energy_beyond_the_largest_double_is_infinite_for_both(loops):
    loops(tmt.ARM)
    assert tmt.energy(np.zeros(3), np.full(3, 1e200)) == literal.energy(np.zeros(3), np.full(3, 1e200)) == np.inf


def test_of_two_models_each_has_its_own_answer(loops):
    for seed in range(answers.REMEMBERED + 5):  # more than are remembered
        heavy = loops(replace(tmt.ARM, mass=(2.0 + seed, 1.5)))
        assert np.array_equal(tmt.mass_matrix(np.zeros(3), heavy), tmt.mass_matrix(np.zeros((1, 3)), heavy)[0])
        assert tmt.mass_matrix(np.zeros(3), heavy) == pytest.approx(literal.mass_matrix(np.zeros(3), heavy), rel=1e-13)
    assert len(answers._known) <= answers.REMEMBERED
