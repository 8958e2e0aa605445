"""Inverse dynamics, frames and derivatives: those of 31 digits entry by entry, and those of differences of order 8."""

import dataclasses
from functools import cache

import numpy as np
import pytest
from helpers.many_digits import distance, exact
from helpers.trees import random_states, small_tree, tree_of_kinds
from models import PATHS

import tmt
from compare.engines.mujoco import read
from compare.judge.entries import Entries
from compare.judge.scale import EPS, FACTOR
from tmt.compiled.evaluator import Evaluator
from tmt.exact.many import exact_of_many

CENTRAL = {1: 4 / 5, 2: -1 / 5, 3: 4 / 105, 4: -1 / 280}  # weights of the difference of order 8
STEP = 0.02
WITNESS = 1e-9  # truncation STEP^8, and 1e-15 / STEP
FEW = ("free_body", "gripper", "pendulum_ball")
MANY = ("arm6", "arm7", "loop", "mixed", "quadruped", "humanoid29_free")  # long to trace with many digits
STRAIGHT = [name for name, method in tmt.METHODS.items() if not method.solves_stages and method.stages <= 4]


def model(name):
    return tmt.ARM if name == "arm" else read(PATHS[name]).tree


def differences(tree, function, q, qd, tau):
    """The derivative of a function of (q, qd, tau) by tangent vectors, speeds and torques, (..., 3 nv), to order 8."""
    n = len(tree.axis)
    columns = []
    for direction in np.eye(3 * n):
        column = 0.0
        for k, weight in CENTRAL.items():
            ends = []
            for size in (k * STEP, -k * STEP):
                u, dqd, dtau = np.split(size * direction, 3)
                moved = np.array(tree.coordinates.move(q.tolist(), u.tolist()))
                ends.append(function(moved, qd + dqd, tau + dtau))
            column = column + weight / STEP * (ends[0] - ends[1])
        columns.append(column)
    return np.stack(columns, axis=-1)


def close(values, expected, scale=1.0):
    return np.abs(values - expected).max() <= WITNESS * max(scale, np.abs(expected).max())


@cache
def kinds(seed=3):
    return tree_of_kinds(np.random.default_rng(seed), bodies=3)


def assert_exact(tree, quantity, scales, literal, *state):
    """The literal form's numbers and those of machine code, entry by entry."""
    truth = exact_of_many(tree, quantity, *state)
    for found in (literal, Evaluator(tree, quantity).of_any(*state)):
        for k, (values, scale) in enumerate(zip(found, scales, strict=True)):
            assert (truth.part(k).distance(values) <= FACTOR * EPS * scale).all()


SLOW = [pytest.param(name, marks=pytest.mark.slow) for name in MANY]


@pytest.mark.parametrize("name", ["arm", *FEW, *SLOW])
def test_derivatives_are_those_of_31_digits(name, rng):
    tree = model(name)
    q, qd, tau = state = random_states(rng, tree, 3)
    by, entries = tmt.derivatives(tree, *state), Entries(tree, q, qd)
    scales = entries.derivatives(tau, tmt.acceleration(tree, *state), by)
    assert_exact(tree, "derivatives", scales, by, *state)
    inverse = tmt.inverse_dynamics_derivatives(tree, *state)
    assert_exact(tree, "inverse_dynamics_derivatives", entries.force_rates(tau), inverse, *state)


def beside():
    """A free body beside an arm of two hinges, damped, with springs: what implicitfast takes of each is not the same."""
    rng = np.random.default_rng(5)
    tree = tree_of_kinds(rng, bodies=3, kinds=("hinge", "free"), most=1)
    n = len(tree.kind)
    return dataclasses.replace(
        tree, parent=(-1, 0, 1, 2, -1, 4), body_joint=(3, 4, 5), stiffness=[0.0] * 4 + [2.0, 3.0][: n - 4]
    )


@pytest.mark.parametrize("make", [kinds, small_tree, beside])
def test_derivatives_are_the_limits_of_differences(make, rng):
    """Of every kind of joint, with damping, springs, armature and gains of a controller."""
    tree = make()
    (q,), (qd,), (tau,) = random_states(rng, tree, 1)
    by, n = tmt.derivatives(tree, q, qd, tau), len(qd)
    expected = differences(tree, lambda *state: tmt.acceleration(tree, *state), q, qd, tau)
    assert close(np.hstack(by[:3]), expected)
    qdd = tmt.acceleration(tree, q, qd, tau)
    expected = differences(tree, lambda *state: tmt.inverse_dynamics(tree, *state), q, qd, qdd)
    assert close(np.hstack(by[3:]), expected[:, : 2 * n])
    assert close(tmt.mass_matrix(tree, q), expected[:, 2 * n :])
    assert np.allclose(by.dqdd_dtau, tmt.inverse_mass_matrix(tree, q), rtol=1e-12, atol=1e-12)
    assert np.allclose(by.dqdd_dtau @ tmt.mass_matrix(tree, q), np.eye(n), atol=1e-11)
    assert np.abs(tmt.inverse_dynamics(tree, q, qd, qdd) - tau).max() <= 1e-10
    for values, alone in zip(by[3:], tmt.inverse_dynamics_derivatives(tree, q, qd, qdd), strict=True):
        assert np.allclose(values, alone, rtol=1e-11, atol=1e-11)


# which take other terms of a free body
LONE = "rk4", "semi_implicit_euler", "implicit", "implicitfast", "discrete"


@pytest.mark.parametrize("method, make", [
    *((method, small_tree) for method in tmt.METHODS), *((method, beside) for method in LONE),
])  # fmt: skip
def test_a_and_b_are_the_limits_of_differences_of_a_step(method, make, rng):
    tree, dt = make(), 0.05
    (q,), (qd,), (tau,) = random_states(rng, tree, 1)
    A, B = tmt.step_derivatives(tree, q, qd, tau, dt, method)
    fixed = "dopri8" if method == "dopri8_adaptive" else method  # one step of that size

    def after(*state):
        _, q_path, qd_path = tmt.simulate(tree, *state, dt, 1, fixed)
        return np.concatenate([tree.coordinates.difference(q_path[1], reached), qd_path[1]])

    reached = tmt.simulate(tree, q, qd, tau, dt, 1, fixed).q[1]
    assert close(np.hstack([A, B]), differences(tree, after, q, qd, tau))


@pytest.mark.parametrize(
    "method, tree", [*((name, tmt.ARM) for name in STRAIGHT), ("implicitfast", beside())]
)
def test_a_compiled_step_has_the_derivatives_of_31_digits(method, tree, rng):
    q, qd, tau = random_states(rng, tree, 2)
    by, entries = tmt.derivatives(tree, q, qd, tau), Entries(tree, q, qd)
    scale = entries.step(0.02, by, entries.derivatives(tau, tmt.acceleration(tree, q, qd, tau), by))
    both = np.concatenate(tmt.step_derivatives(tree, q, qd, tau, 0.02, method), axis=2)
    dt, name = np.full((2, 1), 0.02), f"step_derivatives:{method}"
    truth = exact_of_many(tree, name, q, qd, tau, dt)
    for found in (both, Evaluator(tree, name).of_any(q, qd, tau, dt)):
        assert (truth.distance(found) <= FACTOR * EPS * scale).all()


def test_stages_that_are_solved_for_have_the_derivatives_of_50_digits(rng):
    tree = tmt.ARM.lock({"alpha": 0.5})
    q, qd, tau = (values[0] for values in random_states(rng, tree, 1))
    truth = exact(tree, q, qd, tau, step=("implicit_midpoint", 0.02)).step_derivatives
    found = np.hstack(tmt.step_derivatives(tree, q, qd, tau, 0.02, "implicit_midpoint"))
    assert distance(found, truth).max() <= FACTOR * EPS * np.abs(found).max()


def with_site(tree, joint, rng):
    turn, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    turns = {"site_offset": rng.normal(size=(1, 3)), "site_rotation": [turn * np.linalg.det(turn)]}
    return dataclasses.replace(tree, site_names=["tool"], site_joint=[joint], **turns)


def test_a_frame_moves_as_its_jacobian_says(rng):
    tree = with_site(kinds(), len(kinds().kind) - 1, rng)
    (q,), (qd,), (tau,) = random_states(rng, tree, 1)
    found, n = tmt.frame(tree, "tool", q, qd), len(qd)
    rates = differences(tree, lambda q, *_: tmt.frame(tree, "tool", q).position, q, qd, tau)
    assert close(found.jacobian[:3], rates[:, :n])
    turned = differences(tree, lambda q, *_: tmt.frame(tree, "tool", q).rotation, q, qd, tau)
    spin = np.einsum("ijk,lj->ilk", turned, found.rotation)
    assert close(found.jacobian[3:], np.stack([spin[2, 1], spin[0, 2], spin[1, 0]])[:, :n])
    changes = differences(tree, lambda q, *_: tmt.frame(tree, "tool", q).jacobian @ qd, q, qd, tau)
    assert close(found.convective, changes[:, :n] @ qd)
    assert np.array_equal(tmt.frame(tree, "tool", q).convective, np.zeros(6))
    body = tmt.frame(tree, tree.body_names[-1], q)
    assert np.allclose(body.position + body.rotation @ tree.site_offset[0], found.position, atol=1e-13)


def test_a_locked_tree_keeps_its_sites(rng):
    tree = with_site(tmt.ARM, 2, rng)
    forearm = tree.lock({"alpha": 0.7, "beta": -0.4})
    found, expected = tmt.frame(forearm, "tool", [0.3]), tmt.frame(tree, "tool", [0.7, -0.4, 0.3])
    for part, whole in zip(found[:2], expected[:2]):
        assert np.allclose(part, whole, atol=1e-14)
