"""The compiled loops for any tree: the same numbers as the method, and as straight-line code."""

import numpy as np
import pytest
from trees import random_state, random_tree, tree_of_kinds

import tmt
from tmt import generic, kernels, loop_trees
from tmt.equations import method
from tmt.methods import METHODS


@pytest.mark.parametrize("bodies", [0, 1, 4, 9])
def test_generic_loop_is_the_method(rng, bodies):
    tree = random_tree(rng, bodies=bodies, damping=0.3) if bodies else tmt.ARM
    n = len(tree.parent)
    for q, qd, tau in rng.uniform(-3, 3, (5, 3, n)):
        M, h, qdd = np.zeros((n, n)), np.empty(n), np.empty(n)
        generic.compiled().repeat_mass_matrix_and_bias(loop_trees.arrays(tree), q, qd, M.ravel(), h, 1)
        expected = tmt.mass_matrix(q, tree), tmt.bias(q, qd, tree)
        assert np.allclose(M, np.tril(expected[0]), rtol=0, atol=1e-13 * np.abs(expected[0]).max())
        assert np.allclose(h, expected[1], rtol=0, atol=1e-12 * np.abs(expected[1]).max())
        generic.compiled().repeat_forward_dynamics(loop_trees.arrays(tree), q, qd, tau, qdd, 1)
        assert np.allclose(qdd, tmt.acceleration(q, qd, tau, tree), rtol=1e-9, atol=1e-9)


def test_large_trees_take_the_generic_loop(rng, monkeypatch):
    tree = random_tree(rng, bodies=1)
    q, qd, tau = rng.uniform(-1, 1, (3, 4, len(tree.parent)))
    qd[1] = 1e200  # diverges
    traced = tmt.simulate(q, qd, tau, 0.01, 20, "explicit_euler", tree, form="straight_line")
    monkeypatch.setattr(kernels, "LONGEST", 0)
    looped = tmt.simulate(q, qd, tau, 0.01, 20, "explicit_euler", tree)
    assert looped.ended[1] is not None and [looped.ended[i] for i in (0, 2, 3)] == [None] * 3
    for a, b in zip(traced[1:], looped[1:]):
        assert np.allclose(a, b, rtol=1e-9, atol=1e-9, equal_nan=True) and not np.array_equal(a, b, equal_nan=True)
    assert np.isnan(looped.q[1, -1]).all()


def test_the_generic_loop_takes_its_own_arrays_only(monkeypatch):
    """Those of other types would be taken as they are: whole numbers would stay whole."""
    monkeypatch.setattr(kernels, "LONGEST", 0)
    run, tau = kernels.stepper(tmt.ARM, "rk4"), np.zeros((1, 3))
    assert run(np.ones((1, 5, 3)), np.ones((1, 5, 3)), tau, 0.1) == 16
    for kind in (int, np.float32, np.complex128):
        with pytest.raises(
            ValueError, match=r"q has shape \(1, 5, 3\) and numbers of type .*; a contiguous array of float64"
        ):
            run(np.ones((1, 5, 3), kind), np.ones((1, 5, 3)), tau, 0.1)
    with pytest.raises(ValueError, match="qd is not contiguous"):
        run(np.ones((1, 5, 3)), np.ones((1, 10, 3))[:, ::2], tau, 0.1)


@pytest.mark.parametrize("name", METHODS)
def test_the_loops_follow_every_method(name, rng, monkeypatch):
    q, qd, tau = rng.uniform(-1, 1, (3, 5, 3))
    dt, steps = (0.5, 2) if METHODS[name].adaptive else (0.01, 20)  # some of its own steps are refused
    traced = tmt.simulate(q, qd, tau, dt, steps, name, form="straight_line")
    monkeypatch.setattr(kernels, "LONGEST", 0)
    looped = tmt.simulate(q, qd, tau, dt, steps, name)
    assert looped.evaluations == traced.evaluations >= 5 * steps * METHODS[name].stages
    assert np.allclose(traced.q, looped.q, rtol=0, atol=1e-11) and not kernels.is_traced(tmt.ARM, METHODS[name])


def test_the_loop_evaluates_as_straight_line_code_does(rng, monkeypatch):
    tree = tree_of_kinds(rng, bodies=2)
    states = [np.array(values) for values in zip(*(random_state(rng, tree) for _ in range(5)))]
    nv = len(tree.axis)
    for quantity, size in (("forward_dynamics", nv), ("mass_matrix_and_bias", nv * (nv + 3) // 2)):
        monkeypatch.setattr(kernels, "LONGEST", 14_000)
        straight, expected = kernels.evaluator(tree, quantity), np.empty((5, size))
        straight.each(*states, expected)
        monkeypatch.setattr(kernels, "LONGEST", 0)
        loop, found = kernels.evaluator(tree, quantity), np.empty((5, size))
        loop.each(*states, found)
        assert np.allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
        columns = [np.ascontiguousarray(values.T) for values in (*states, found)]
        columns[-1][:] = 0.0
        loop.lanes(*columns)
        assert np.array_equal(columns[-1].T, found)
        first = [values[0] for values in states]
        assert loop.chain(*first, 3) == pytest.approx(found[0].sum(), rel=1e-9)
        with pytest.raises(ValueError, match="q of shape"):
            loop.each(states[0], states[1], states[2], np.empty((5, size + 1)))
        if quantity == "forward_dynamics":
            y = np.concatenate(first[:2])
            assert np.allclose(loop.rate(y, first[2]), straight.rate(y, first[2]), rtol=0, atol=1e-11)
            with pytest.raises(ValueError, match="shares memory"):
                loop.each(*states, states[1])
    with pytest.raises(ValueError, match="loop over any tree alone"):
        kernels.evaluator(tree, "forward_dynamics", method.mass_matrix_and_bias)


@pytest.mark.parametrize("name", [name for name in METHODS if METHODS[name].lanes])
def test_runs_side_by_side_have_the_bits_of_each_alone(name, rng, monkeypatch):
    """In loops, with balls and slides; runs that diverge end as they do alone."""
    monkeypatch.setattr(kernels, "LONGEST", 0)
    tree = tree_of_kinds(rng, bodies=3)
    q, qd, tau = (np.array(values) for values in zip(*(random_state(rng, tree) for _ in range(kernels.LANES))))
    qd[5] = 1e200
    found = []
    for made in (kernels.stepper, kernels.lane_stepper):
        paths = [np.concatenate([x[:, None], np.zeros((len(x), 4, x.shape[1]))], axis=1) for x in (q, qd)]
        ended = np.zeros((len(q), 2), int)
        count = made(tree, name)(*paths, tau, 0.01, ended)
        found.append([*paths, ended, count])
    for alone, beside in zip(*found):
        assert np.array_equal(alone, beside, equal_nan=True)
    assert found[0][2][5, 0] and np.count_nonzero(found[0][2][:, 0]) == 1 and np.isfinite(found[0][0][4]).all()


@pytest.mark.parametrize("quantity", kernels.QUANTITIES)
def test_many_states_of_a_loop_side_by_side_have_the_bits_of_each(quantity, rng, monkeypatch):
    monkeypatch.setattr(kernels, "LONGEST", 0)
    tree = tree_of_kinds(rng, bodies=3)
    states = [
        np.array(values) for values in zip(*(random_state(rng, tree) for _ in range(19)))
    ]  # two blocks and a rest
    n = len(tree.axis)
    size = n if quantity == "forward_dynamics" else n * (n + 3) // 2
    rows, columns = np.empty((19, size)), np.empty((size, 19))
    loop = kernels.evaluator(tree, quantity)
    loop.each(*states, rows)
    loop.lanes(*(np.ascontiguousarray(x.T) for x in states), columns)
    assert np.array_equal(rows, columns.T) and np.isfinite(rows).all()
