"""The compiled loops over any tree, function by function: the dynamics and the methods over plain numbers.

Quaternions are of any length: between the stages of a step they need not have length 1, and only so is it seen who brings
them back to it.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from trees import random_state, tree_of_kinds

from tmt import generic, loop_runs, loop_stages, loop_states, loop_trees, loops, templates
from tmt.eight import WIDTH
from tmt.equations import composite, method
from tmt.methods import METHODS, lone_speeds, one_step
from tmt.sine import LIMIT

EPS = np.finfo(float).eps
SEEDS = 1, 2, 3


def branched(seed, bodies=4):
    """A tree with every kind of joint, a lone free body, springs and, of four bodies, a branch inside; its random numbers."""
    for number in range(100 * seed, 100 * seed + 100):
        rng = np.random.default_rng(number)
        tree = tree_of_kinds(rng, bodies)
        sprung = {kind for kind, stiffness in zip(tree.kind, tree.stiffness) if stiffness}
        branches = len({p for p in tree.parent if p >= 0}) < len([p for p in tree.parent if p >= 0])
        if {*tree.kind} == {"hinge", "slide", "ball"} == sprung and lone_speeds(tree) and (branches or bodies < 4):
            return tree, rng
    raise AssertionError("no such tree")


def stretched(rng, tree):
    """A random state whose quaternions have lengths from 0.8 to 1.3."""
    q, qd, tau = random_state(rng, tree)
    for joint in tree.coordinates.balls:
        q[joint.q] *= rng.uniform(0.8, 1.3)
    return q, qd, tau


@pytest.mark.parametrize("seed", SEEDS)
def test_the_loops_have_the_numbers_of_the_composite_form(seed):
    tree, rng = branched(seed)
    numbers, n = loop_trees.arrays(tree), len(tree.axis)
    for _ in range(3):
        q, qd, tau = stretched(rng, tree)
        M, h, qdd, w = np.zeros((n, n)), np.empty(n), np.empty(n), np.full(loops.workspace(numbers), np.nan)
        loops.mass_matrix_and_bias(numbers, q, qd, w, M.ravel(), h)
        expected = [np.array(x) for x in composite.mass_matrix_and_bias(tree, q.tolist(), qd.tolist())]
        assert np.allclose(M, np.tril(expected[0]), rtol=0, atol=64 * EPS * np.abs(expected[0]).max())
        scale = np.abs(expected[0]).max() * np.square(qd).sum() + np.abs(expected[1]).max()
        assert np.allclose(h, expected[1], rtol=0, atol=64 * EPS * scale)
        loops.forward_dynamics(numbers, q, qd, tau, w, qdd)
        solved = np.linalg.solve(expected[0], method.reduced_force(tree, expected[1], q, qd, tau))
        assert np.allclose(qdd, solved, rtol=0, atol=64 * EPS * np.linalg.cond(expected[0]) * np.abs(solved).max())


@pytest.mark.parametrize("seed", SEEDS)
def test_eight_states_side_by_side_have_the_bits_of_one(seed):
    """Mbar, h and qdd; hinges so far out that the library's sine is asked, in some lanes alone."""
    tree, rng = branched(seed)
    numbers, n = loop_trees.arrays(tree), len(tree.axis)
    states = [np.array(values).T.copy() for values in zip(*(stretched(rng, tree) for _ in range(WIDTH)))]
    hinge = next(joint.q.start for joint in tree.coordinates.joints if joint.kind == "hinge")
    states[0][hinge, 3] = 4.0 * LIMIT
    many = [np.full((size, WIDTH), np.nan) for size in (loops.workspace(numbers), n * n, n, n)]
    loops.mass_matrix_and_bias(numbers, *states[:2], *many[:3])
    loops.forward_dynamics(numbers, *states, many[0], many[3])
    for l in range(WIDTH):
        one = [np.full(len(array), np.nan) for array in many]
        q, qd, tau = (array[:, l].copy() for array in states)
        loops.mass_matrix_and_bias(numbers, q, qd, *one[:3])
        loops.forward_dynamics(numbers, q, qd, tau, one[0], one[3])
        for alone, beside in zip(one[1:], many[1:]):
            assert np.array_equal(alone, beside[:, l], equal_nan=True) and np.isfinite(alone).any()
    expected = method.acceleration(tree, *(array[:, 3].tolist() for array in states))
    assert np.allclose(many[3][:, 3], expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize("seed", SEEDS)
def test_far_from_the_world_no_digits_are_lost(seed):
    """A free body, and what it carries, 10 km away along its slides: its motion is the same to the bit."""
    tree, rng = branched(seed)
    numbers, n = loop_trees.arrays(replace(tree, stiffness=())), len(tree.axis)
    q, qd, tau = random_state(rng, tree)
    near, far, w = np.empty(n), np.empty(n), np.empty(loops.workspace(numbers))
    loops.forward_dynamics(numbers, q, qd, tau, w, near)
    assert tree.kind[:3] == ("slide",) * 3 and tree.parent[0] == -1
    q[:3] += 1e4
    loops.forward_dynamics(numbers, q, qd, tau, w, far)
    assert np.array_equal(near, far)


@pytest.mark.parametrize("seed", SEEDS)
def test_positions_move_in_the_loops_as_they_do_elsewhere(seed):
    tree, rng = branched(seed)
    numbers = loop_trees.arrays(tree)
    for size in (1e-9, 1.0):
        q, qd, u = stretched(rng, tree)
        u *= size
        moved, rates = np.empty(len(q)), np.empty(len(qd))
        loop_states.move(numbers, q, u, moved)
        assert np.allclose(moved, tree.coordinates.move(q, u), rtol=0, atol=8 * EPS)
        loop_states.put_rates(numbers, u, qd, rates, 0)
        assert np.allclose(rates, tree.coordinates.rates(u, qd), rtol=1e-12, atol=64 * EPS)


def test_a_state_that_cannot_be_gone_on_from_has_its_reason():
    tree, rng = branched(1)
    numbers, (q, qd, _) = loop_trees.arrays(tree), stretched(rng, tree)
    places = {joint.kind: joint for joint in tree.coordinates.joints}
    cases = [
        ("hinge", 0.9 * LIMIT, 0), ("hinge", -1.1 * LIMIT, templates.TURNED), ("slide", 1.1 * LIMIT, 0),
        ("hinge", math.nan, templates.OVERFLOW), ("slide", math.inf, templates.OVERFLOW), ("ball", math.nan, templates.OVERFLOW),
    ]  # fmt: skip
    for kind, value, why in cases:
        other = q.copy()
        other[places[kind].q.start] = value
        assert loop_states.unsound(numbers, other, qd) == why, (kind, value)
    for value in (math.nan, math.inf):
        assert loop_states.unsound(numbers, q, np.full(len(qd), value)) == templates.OVERFLOW


def followed(tree, stepping, q, qd, tau, dt, steps):
    """The paths (steps + 1, nq and nv) of one run by the loop of a method, and its evaluations."""
    paths = [np.concatenate([[x], np.full((steps, len(x)), np.nan)])[None] for x in (q, qd)]
    count = generic.stepper(tree, stepping)(*paths, tau[None], dt, np.zeros((1, 2), int), 1)
    return paths[0][0], paths[1][0], count


@pytest.mark.parametrize("name", [name for name in METHODS if not METHODS[name].adaptive])
def test_a_step_of_the_loops_is_the_step_of_the_method(name):
    stepping = METHODS[name]
    tree, rng = branched(1, bodies=3 if stepping.solves_stages else 4)
    q, qd, tau = stretched(rng, tree)
    path, speeds, count = followed(tree, stepping, q, qd, tau, 0.02, 2)
    for k in (1, 2):
        q, qd = (np.array(x) for x in one_step(stepping, tree, q.tolist(), qd.tolist(), tau.tolist(), 0.02))
        assert np.allclose(path[k], q, rtol=0, atol=1e-12) and np.allclose(speeds[k], qd, rtol=0, atol=1e-11)
    assert count >= 2 * stepping.stages and (stepping.solves_stages or count == 2 * stepping.stages)
    for joint in tree.coordinates.balls:
        assert abs(np.linalg.norm(path[1][joint.q]) - 1.0) < 4 * EPS


def test_the_error_of_a_step_is_estimated_as_stated():
    """Hairer, Norsett, Wanner, section II.10, in units of the tolerance times 1 + |value|, of a ball's movement 2."""
    stepping, tolerance, dt = METHODS["dopri8_adaptive"], 1e-6, 0.05
    tree, rng = branched(2)
    q, qd, tau = random_state(rng, tree)

    def slope(q, qd):
        return stepping.slope(tree, q, qd, tau.tolist(), dt)

    rates, changes = stepping.stage_slopes(slope, q.tolist(), qd.tolist(), dt, tree.coordinates)
    new_q, new_qd, *estimates = stepping.attempt(slope, q.tolist(), qd.tolist(), dt, tree.coordinates)
    sizes = []
    for kind, at, _ in tree.coordinates.joints:
        sizes += [1.0] * 3 if kind == "ball" else [max(abs(q[at.start]), abs(new_q[at.start]))]
    sizes += np.maximum(np.abs(qd), np.abs(new_qd)).tolist()
    squares = [
        sum((x / (tolerance * (1.0 + size))) ** 2 for x, size in zip([*of_q, *of_qd], sizes))
        for of_q, of_qd in (estimates[:2], estimates[2:])
    ]
    expected = squares[0] / math.sqrt(len(sizes) * (squares[0] + 0.01 * squares[1]))
    found = loop_runs.estimate(
        loop_trees.arrays(tree), np.array(stepping.errors), tolerance, dt, np.ravel(rates), np.ravel(changes), q, qd,
        np.array(new_q), np.array(new_qd),
    )  # fmt: skip
    assert found == pytest.approx(expected, rel=1e-9) and expected > 0.0


def test_the_adaptive_loop_comes_as_near_as_its_tolerance_says():
    tree, rng = branched(1)
    q, qd, tau = random_state(rng, tree)
    run, ended = generic.stepper(tree, METHODS["dopri8_adaptive"]), np.zeros((1, 2), int)
    ends, counts = [], []
    for tolerance in (1e-4, 1e-8, 1e-13):
        paths = [np.array([[x, x]]) for x in (q, qd)]
        counts.append(run(*paths, tau[None], 0.5, tolerance, ended, 1))
        ends.append(np.concatenate([path[0, 1] for path in paths]))
    errors = [np.abs(end - ends[-1]).max() for end in ends[:-1]]
    assert errors[0] < 1e-3 and 0.0 < errors[1] < 1e-7 and counts[0] < counts[1] < counts[2] and not ended.any()


def test_the_slope_of_an_implicit_stage_has_its_exact_derivatives():
    tree, rng = branched(3, bodies=3)
    numbers, n = loop_trees.arrays(tree), len(tree.axis)
    q, qd, tau = random_state(rng, tree)
    value, by_q, by_qd = np.empty(n), np.empty((n, n)), np.empty((n, n))
    loop_stages.slope_and_jacobian(numbers, q, qd, tau, value, by_q, by_qd)

    def qdd(u):
        at = tree.coordinates.move(q, u[:n]), qd + u[n:]
        return np.array(method.acceleration(tree, *at, tau, composite.mass_matrix_and_bias))

    h = 1e-5
    expected = np.array([qdd(h * u) - qdd(-h * u) for u in np.eye(2 * n)]).T / (2 * h)
    assert np.allclose(value, qdd(np.zeros(2 * n)), rtol=0, atol=1e-10 * np.abs(value).max())
    assert np.allclose(np.hstack([by_q, by_qd]), expected, rtol=0, atol=1e-6 * np.abs(expected).max())
