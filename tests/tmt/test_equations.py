"""What holds of the equations of any tree of hinges, slides and balls at any state; beside Lagrange's see test_lagrange."""

import dataclasses

import mpmath
import numpy as np
from engines.drawn_trees import drawn_trees
from hypothesis import given, settings
from hypothesis import strategies as st

import tmt
from tmt.equations import articulated, composite, method
from tmt.equations.dual import jacobian
from tmt.exact.values import distance

EPS = np.finfo(float).eps
STEP = 1e-5  # of central differences, which are right to about 1e-8 of what is differenced
of_trees = given(drawn_trees())
few = settings(max_examples=20)


def along(tree, function, q, u):
    """The rate of a function of q along the movement u."""
    ahead, behind = (np.array(tree.coordinates.move(list(q), list(h * u))) for h in (STEP, -STEP))
    return (function(ahead) - function(behind)) / (2.0 * STEP)


def by_each(tree, function, q):
    """The derivative of a function of q by each movement, in the last axis."""
    return np.stack([along(tree, function, q, u) for u in np.eye(len(tree.axis))], axis=-1)


def assert_close(found, expected, scale=1.0, digits=1e-7):
    assert np.abs(found - expected).max() <= digits * (scale + np.abs(expected).max())


@few
@of_trees
def test_the_mass_matrix_gives_the_kinetic_energy_and_the_acceleration(drawn):
    tree, q, qd, tau, _ = drawn
    M, qdd = tmt.mass_matrix(q, tree), tmt.acceleration(q, qd, tau, tree)
    assert np.abs(M - M.T).max() <= 64 * EPS * np.abs(M).max() and np.linalg.eigvalsh(M)[0] > 0.0
    kinetic = tmt.energy(q, qd, tree) - tmt.potential_energy(q, tree)
    assert_close(kinetic, qd @ M @ qd / 2, abs(tmt.potential_energy(q, tree)), 64 * EPS)
    right = tau - tree.damping * qd - tmt.spring_torque(q, tree) - tmt.bias(q, qd, tree)
    assert_close(M @ qdd, right, np.abs(M).max() * np.abs(qdd).max(), 256 * EPS)


@few
@of_trees
def test_the_energy_changes_by_the_power_of_the_torque_less_what_dampers_take(drawn):
    tree, q, qd, tau, _ = drawn
    qdd, ends = tmt.acceleration(q, qd, tau, tree), []
    for h in (STEP, -STEP):
        there = np.array(tree.coordinates.move(list(q), list(h * qd)))
        ends.append(tmt.energy(there, qd + h * qdd, tree))
    power = tau @ qd - tree.damping @ qd**2
    assert_close((ends[0] - ends[1]) / (2.0 * STEP), power, np.abs(ends).max() + np.abs(qdd).max() ** 2)


@few
@of_trees
def test_gravity_and_springs_are_the_slope_of_the_potential_energy(drawn):
    tree, q, *_ = drawn
    held = tmt.gravity_balance(q, tree) + tmt.spring_torque(q, tree)
    slope = by_each(tree, lambda q: tmt.potential_energy(q, tree), q)
    assert_close(slope, held, 1.0 + abs(tmt.potential_energy(q, tree)))
    assert_close(tmt.bias(q, 0.0 * drawn.qd, tree), tmt.gravity_balance(q, tree), 100.0, 64 * EPS)


@few
@of_trees
def test_jacobians_and_convective_terms_are_derivatives_of_what_moves(drawn):
    tree, q, qd, *_ = drawn

    def turns(q):
        return np.array([[list(row) for row in method.joint_frames(tree, list(q))[h].turn] for h in tree.body_hinge])

    T, B = tmt.jacobians(q, tree)
    assert_close(T, by_each(tree, lambda q: tmt.com_positions(q, tree), q))
    spin = np.einsum("bji,bjkn->bikn", turns(q), by_each(tree, turns, q))  # R' dR = [omega]x in body axes
    assert_close(B, np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1))
    assert_close(tmt.angular_velocities(q, qd, tree), B @ qd, 10.0, 64 * EPS)
    rates = [along(tree, lambda q, part=part: tmt.jacobians(q, tree)[part] @ qd, q, qd) for part in (0, 1)]
    for found, expected in zip(tmt.convective_terms(q, qd, tree), rates):
        assert_close(found, expected, np.abs(qd).sum() ** 2)


@few
@of_trees
def test_composite_and_articulated_bodies_give_the_numbers_of_the_literal_sums(drawn):
    tree, *state, _ = drawn
    q, qd, tau = (part.tolist() for part in state)
    M, h = map(np.array, method.mass_matrix_and_bias(tree, q, qd))
    for form in (composite, articulated):
        for found, expected in zip(form.mass_matrix_and_bias(tree, q, qd), (M, h)):
            assert_close(np.array(found), expected, digits=1e-12)
    assert_close(np.array(articulated.bias(tree, q, qd)), h, digits=1e-12)
    qdd = np.array(articulated.forward_dynamics(tree, q, qd, tau))
    assert_close(M @ qdd, method.reduced_force(tree, h, q, qd, tau), np.abs(M).max() * np.abs(qdd).max(), 1e-12)


@few
@of_trees
def test_the_rates_of_the_bias_are_its_derivatives_by_the_speeds(drawn):
    """The bias has squares of the speeds, of which central differences of any step are exact."""
    tree, q, qd, *_ = drawn
    ends = [tmt.bias(q, qd + sign * np.eye(len(qd)), tree) for sign in (1.0, -1.0)]
    expected = np.subtract(*ends).T / 2.0
    assert_close(method.bias_rates(tree, q.tolist(), qd.tolist()), expected, np.abs(ends).max(), 256 * EPS)


@few
@given(drawn_trees(), st.data())
def test_a_locked_tree_is_the_sub_block_of_the_whole(drawn, data):
    tree, q, qd, *_ = drawn
    joints = tree.coordinates.joints
    locked = data.draw(st.sets(st.integers(0, len(joints) - 1), max_size=len(joints) - 1))
    held = {tree.hinge_names[i]: q[joints[i].q] if tree.kind[i] == "ball" else float(q[joints[i].q][0]) for i in locked}
    free = [joint for i, joint in enumerate(joints) if i not in locked]
    at = [k for joint in free for k in range(joint.q.start, joint.q.stop)]
    by = [k for joint in free for k in range(joint.qd.start, joint.qd.stop)]
    qd[[k for k in range(len(qd)) if k not in by]] = 0.0
    smaller, state = tree.lock(held), (q[at], qd[by])
    assert smaller.hinge_names == tuple(name for i, name in enumerate(tree.hinge_names) if i not in locked)
    assert smaller.damping == tuple(tree.damping[k] for k in by)
    for found, whole in (
        (tmt.mass_matrix(q[at], smaller), tmt.mass_matrix(q, tree)[np.ix_(by, by)]),
        (tmt.bias(*state, smaller), tmt.bias(q, qd, tree)[by]),
        (tmt.spring_torque(q[at], smaller), tmt.spring_torque(q, tree)[by]),
        (tmt.com_positions(q[at], smaller), tmt.com_positions(q, tree)),
    ):
        assert_close(found, whole, digits=1e-12)


def test_a_body_fixed_to_the_world_does_not_count():
    fixed = dataclasses.replace(tmt.ARM, body_hinge=(-1, 2))
    light = dataclasses.replace(tmt.ARM, mass=(0.0, 1.5), inertia=(np.zeros((3, 3)), tmt.ARM.inertia[1]))
    q = np.array([0.3, 0.2, 0.5])
    assert np.array_equal(tmt.mass_matrix(q, fixed), tmt.mass_matrix(q, light))
    assert np.array_equal(tmt.com_positions(q, fixed)[0], [0, 0, -0.15])


def test_nested_dual_numbers_are_not_confused():
    """d/dx (x d/dy (x y)) = 2 x at any y: the inner derivative is a constant of the outer one and the reverse."""
    (outer,) = jacobian(lambda x: [x[0] * jacobian(lambda y: [x[0] * y[0]], [3.0])[0][0]], [5.0])
    assert outer[0] == 10.0


def test_the_distance_from_many_digits_is_that_of_all_digits():
    with mpmath.workdps(50):
        off = distance(np.array([3.0]), np.array([mpmath.mpf("3.0000000000000000001")]))
    assert abs(off[0] - 1e-19) < 1e-28
