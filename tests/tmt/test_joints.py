"""Slides, balls, armature, springs and references in tmt: against Lagrange's equations, in every method, under locks."""

import dataclasses

import mpmath
import numpy as np
import pytest
from lagrange import Body, Joint, equations
from trees import random_state, small_tree, tree_of_kinds, unit_quaternion

import tmt
from tmt.exact.motion import trajectory
from tmt.exact.values import distance, exact
from tmt.methods import METHODS, amplification, one_step
from tmt.model.coordinates import coordinates_of

EPS = np.finfo(float).eps


def lagrange(tree, q, qd):
    """Mbar, h and the force of the springs from energies alone, with 50 digits."""
    at = tree.coordinates.joints
    joints = [
        Joint(
            kind, parent, offset, tree.axis[by] if kind == "ball" else tree.axis[by.start], tree.armature[by.start], k,
            tree.rest[place] if kind == "ball" else tree.rest[place.start] - tree.reference[i],
        )
        for i, ((kind, place, by), parent, offset, k) in enumerate(zip(at, tree.parent, tree.offset, tree.stiffness))
    ]  # fmt: skip
    bodies = list(map(Body, tree.body_hinge, tree.mass, tree.com, tree.inertia))
    q = [
        float(x) - (tree.reference[i] if kind != "ball" else 0.0)
        for i, (kind, place, _) in enumerate(at)
        for x in q[place]
    ]
    return equations(joints, bodies, tree.gravity, q, qd)


def plain_balls(tree):
    """Those of Lagrange's equations: armature is the same about their three axes, which are the coordinate axes."""
    armature, axis = list(tree.armature), list(tree.axis)
    for joint in tree.coordinates.balls:
        armature[joint.qd] = [armature[joint.qd.start]] * 3
        axis[joint.qd] = np.eye(3)
    return dataclasses.replace(tree, armature=armature, axis=axis)


def test_the_method_is_lagranges_equations_for_every_kind_of_joint(rng):
    tree = plain_balls(dataclasses.replace(small_tree(), position_gain=(), speed_gain=()))
    q, qd, _ = random_state(rng, tree)
    expected = lagrange(tree, q, qd)
    M, h, spring = (np.array(values, dtype=float) for values in expected)
    # axes are of length 1 but for an eps, which each side reads in its own way
    assert np.abs(tmt.mass_matrix(q, tree) - M).max() < 64 * EPS * np.abs(M).max()
    assert np.abs(tmt.bias(q, qd, tree) - h).max() < 64 * EPS * (
        np.abs(M).max() * np.square(qd).sum() + np.abs(h).max()
    )
    assert np.abs(tmt.spring_torque(q, tree) + spring).max() < 64 * EPS * 10.0


def test_fifty_digits_of_lagrange_and_of_the_method_meet_along_coordinate_axes(rng):
    tree = plain_balls(tree_of_kinds(rng, bodies=1, along_axes=True))
    tree = dataclasses.replace(tree, reference=())
    q, qd, tau = random_state(rng, tree)
    for joint in tree.coordinates.balls:
        q[joint.q] = rng.choice([-0.5, 0.5], 4)  # of length 1 exactly
    truth = exact(tree, q, qd, tau)
    found = lagrange(tree, q, qd)
    with mpmath.workdps(50):
        assert (
            max(abs(a - b) for a, b in zip(truth.mass_matrix.ravel(), np.ravel(found.mass_matrix)))
            < mpmath.mpf(10) ** -44
        )
        assert max(abs(a - b) for a, b in zip(truth.bias, np.ravel(found.bias))) < mpmath.mpf(10) ** -43


def test_a_ball_in_a_turned_frame_is_a_ball_in_other_coordinates(rng):
    """With axes E, quaternion p and speeds omega it does what one along the coordinate axes does at E' p E and E' omega."""
    tree = tree_of_kinds(np.random.default_rng(1), bodies=3)
    tree = dataclasses.replace(tree, armature=())
    q, qd, _ = random_state(rng, tree)
    plain, to_plain = plain_balls(tree), np.eye(len(tree.axis))
    other = q.copy()
    for joint in tree.coordinates.balls:
        frame = np.array(tree.axis[joint.qd])  # its rows are the axes
        to_plain[joint.qd, joint.qd] = frame.T
        other[joint.q][1:] = frame.T @ q[joint.q][1:]
    M, h = tmt.mass_matrix(q, tree), tmt.bias(q, qd, tree)
    M1, h1 = tmt.mass_matrix(other, plain), tmt.bias(other, to_plain @ qd, plain)
    assert np.abs(to_plain.T @ M1 @ to_plain - M).max() < 1e-13 and np.abs(to_plain.T @ h1 - h).max() < 1e-12
    assert np.abs(tmt.com_positions(other, plain) - tmt.com_positions(q, tree)).max() < 1e-13
    assert any(np.abs(np.array(tree.axis[joint.qd]) - np.eye(3)).max() > 0.1 for joint in tree.coordinates.balls)


def test_acceleration_solves_the_equation_of_motion_with_springs_damping_and_armature(rng):
    tree = tree_of_kinds(rng, bodies=3)
    q, qd, tau = random_state(rng, tree)
    qdd = tmt.acceleration(q, qd, tau, tree)
    left = tmt.mass_matrix(q, tree) @ qdd + tmt.bias(q, qd, tree)
    right = tau - np.array(tree.damping) * qd - tmt.spring_torque(q, tree)
    assert np.allclose(left, right, rtol=0, atol=1e-11)
    assert distance(qdd, exact(tree, q, qd, tau).acceleration).max() < 1e-10


def test_energy_is_kept_with_springs_and_armature(rng):
    tree = tree_of_kinds(np.random.default_rng(7), bodies=2)
    tree = dataclasses.replace(tree, damping=(0.0,) * len(tree.axis))
    q, qd, tau = random_state(rng, tree)
    motion = tmt.simulate(q, qd, 0.0 * tau, 0.2 / 64, 64, "dopri8", tree)
    energy = tmt.energy(motion.q, motion.qd, tree)
    assert tree.has_springs and np.abs(energy - energy[0]).max() < 1e-11 * abs(tmt.energy(q, 2.0 * qd, tree))


@pytest.mark.parametrize("name", METHODS)
def test_the_jacobian_of_a_step_is_that_of_small_movements(name):
    """One ball on a slide."""
    rng = np.random.default_rng(3)
    tree = tree_of_kinds(rng, bodies=1, kinds=("ball", "slide"))
    while "ball" not in tree.kind:
        tree = tree_of_kinds(rng, bodies=1, kinds=("ball", "slide"))
    q, qd, tau = random_state(rng, tree)
    stepping, dt, nv = METHODS[name], 0.05, len(tree.axis)
    J, move, h = amplification(stepping, tree, q, qd, tau, dt), tree.coordinates.move, 1e-6
    u = h * np.concatenate([np.eye(2 * nv), -np.eye(2 * nv)]).T  # a column each, all at once
    state = [np.full(4 * nv, x) for x in q], [x + y for x, y in zip(qd, u[nv:])]
    ends = one_step(stepping, tree, move(state[0], list(u[:nv])), state[1], tau.tolist(), dt)
    (q1, q0), (qd1, qd0) = (np.split(np.array(part), 2, axis=1) for part in ends)
    change = np.concatenate([tree.coordinates.difference(q1, q0), qd1 - qd0]) / (2 * h)
    assert np.abs(change - J).max() < 1e-6 * np.abs(J).max()


def test_methods_keep_their_order_with_balls():
    tree = tree_of_kinds(np.random.default_rng(5), bodies=1, kinds=("ball", "free"))
    q, qd, tau = random_state(np.random.default_rng(6), tree)
    truth = trajectory(tree, q, qd, tau, 0.25, 1).high[-1]

    def error(name, steps):
        motion = tmt.simulate(q, qd, tau, 0.25 / steps, steps, name, tree)
        assert abs(np.linalg.norm(motion.q[-1][tree.coordinates.balls[0].q]) - 1.0) < 4 * EPS
        return np.abs(np.concatenate([motion.q[-1], motion.qd[-1]]) - truth).max()

    for name, order in (("rk4", 4), ("rk4_mean_speed", 2), ("implicit_midpoint", 2)):
        assert abs(np.log2(error(name, 16) / error(name, 32)) - order) < 0.3
    assert error("dopri8", 64) < 1e-13


def test_movements_of_balls(rng):
    coordinates = coordinates_of(("ball", "slide", "ball"))
    q = np.concatenate([unit_quaternion(rng), [0.3], unit_quaternion(rng)])
    for size in (0.0, 1e-200, 1e-9, 1.0, 3.0):
        u = rng.uniform(-1.0, 1.0, 7)
        u *= size / np.linalg.norm(u)
        assert np.allclose(coordinates.difference(coordinates.move(q, u), q), u, rtol=1e-12, atol=1e-15)
    assert (
        np.abs(coordinates.difference(-q + 2 * q * np.array([0, 0, 0, 0, 1, 0, 0, 0, 0]), q)).max() < 1e-15
    )  # p and -p
    # along a motion with constant speed in space of the body the rates of the movement are exact: a series in dt
    omega = rng.uniform(-1.0, 1.0, 7)
    u, n = np.zeros(7), 2000
    for _ in range(n):  # the midpoint rule
        half = u + 0.5 / n * np.array(coordinates.rates(u, omega))
        u = u + np.array(coordinates.rates(half, omega)) / n
    assert np.allclose(u, omega, rtol=0, atol=1e-12)


def test_a_locked_tree_of_every_kind_is_the_sub_block(rng):
    for seed in range(4):
        tree = tree_of_kinds(np.random.default_rng(seed), bodies=3)
        q, qd, _ = random_state(rng, tree)
        joints = tree.coordinates.joints
        names = list(rng.choice(tree.hinge_names, 3, replace=False))
        chosen = [i for i, name in enumerate(tree.hinge_names) if name in names]
        for i in chosen:
            qd[joints[i].qd] = 0.0
        held = {
            tree.hinge_names[i]: q[joints[i].q] if tree.kind[i] == "ball" else float(q[joints[i].q][0]) for i in chosen
        }
        locked = tree.lock(held)
        at = [k for i in range(len(joints)) if i not in chosen for k in range(joints[i].q.start, joints[i].q.stop)]
        by = [k for i in range(len(joints)) if i not in chosen for k in range(joints[i].qd.start, joints[i].qd.stop)]
        M = tmt.mass_matrix(q, tree)
        assert np.abs(tmt.mass_matrix(q[at], locked) - M[np.ix_(by, by)]).max() < 64 * EPS * np.abs(M).max()
        h = tmt.bias(q, qd, tree)
        assert np.abs(tmt.bias(q[at], qd[by], locked) - h[by]).max() < 1e-13 * (1.0 + np.abs(h).max())


WRONG = {
    "kind": (("hinge", "screw"), "Tree.kind is"),
    "axis": ([[1, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1, 0]], "a right-handed frame is expected"),
    "reference": ([1.0, 0.0], "0 is expected of a ball"),
    "rest": ([1.0, 1.0, 0.0, 0.0, 0.0], "a quaternion of length 1 is expected"),
    "armature": ([-1.0, 0.0, 0.0, 0.0], "values of at least 0"),
    "stiffness": ([0.0, -1.0], "values of at least 0"),
}


@pytest.mark.parametrize("field", WRONG)
def test_what_no_joint_can_be_is_refused(field):
    value, message = WRONG[field]
    tree = tmt.Tree(
        ("b", "s"), (-1, 0), ((0, 0, 0), (0, 0, 1)), np.eye(3)[[0, 1, 2, 1]], (0,) * 4, ("body",), (1,), (1.0,), ((0, 0, 1),),
        (np.eye(3),), (0, 0, -9.81), kind=("ball", "slide"),
    )  # fmt: skip
    with pytest.raises(ValueError, match=message):
        dataclasses.replace(tree, **{field: value})


def test_a_quaternion_that_is_none_is_refused_by_name():
    tree = tree_of_kinds(np.random.default_rng(5), bodies=1, kinds=("ball", "free"))
    q = np.array(tree.zero)
    q[3] = 1.1
    with pytest.raises(ValueError, match=r"q of 'ball3' is .*; a quaternion w, x, y, z of length 1 is expected"):
        tmt.mass_matrix(q, tree)
    with pytest.raises(
        ValueError, match=r"q has shape \(6,\); \(..., 7\) is expected, one number per slide, four per ball"
    ):
        tmt.mass_matrix(q[1:], tree)
