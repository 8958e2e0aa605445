"""The equations of motion beside Lagrange's, beside closed forms and in 50 digits; for any tree see test_properties."""

import dataclasses

import mpmath
import numpy as np
import pytest
from lagrange import Body, Joint, equations, free_body, spherical_pendulum
from trees import possible_tensor, random_state, small_tree, tree_of_kinds, unit_quaternion

import tmt
from compare.judge.scale import acceleration_scale, bias_scale, gravity_scale
from tmt.equations import articulated, composite, method
from tmt.equations.dual import jacobian
from tmt.exact.tree import exact_tree
from tmt.exact.values import distance, exact
from tmt.model.coordinates import coordinates_of

EPS = np.finfo(float).eps
ALLOWED = 64 * EPS  # times the scale of each quantity, as in the experiments


def test_fifty_digits_contain_the_floats(rng):
    q, qd, tau = rng.uniform(-3, 3, (3, 3))
    truth = exact(tmt.ARM, q, qd, tau)
    force = bias_scale(tmt.ARM, q[None], qd[None]) + np.abs(tau).max()
    of_acceleration = acceleration_scale(tmt.ARM, q[None], force)
    assert distance(tmt.mass_matrix(q), truth.mass_matrix).max() < ALLOWED * tmt.mass_matrix(q).max()
    assert distance(tmt.bias(q, qd), truth.bias).max() < ALLOWED * force
    assert distance(tmt.acceleration(q, qd, tau), truth.acceleration).max() < ALLOWED * of_acceleration
    assert distance(tmt.potential_energy(q), truth.potential_energy) < ALLOWED * gravity_scale(tmt.ARM)
    assert distance(truth.mass_matrix.astype(float), truth.mass_matrix).max() > 0.0  # the truth has more digits


def test_the_distance_from_many_digits_is_that_of_all_digits():
    with mpmath.workdps(50):
        assert distance(np.array([3.0]), np.array([mpmath.mpf("3.0000000000000000001")]))[0] == pytest.approx(
            1e-19, rel=1e-9, abs=0.0
        )


def test_nested_dual_numbers_are_not_confused():
    """d/dx (x d/dy (x y)) = 2 x at any y: the inner derivative is a constant of the outer one and the reverse."""
    (outer,) = jacobian(lambda x: [x[0] * jacobian(lambda y: [x[0] * y[0]], [3.0])[0][0]], [5.0])
    assert outer[0] == 10.0


def test_a_body_fixed_to_the_world_does_not_count():
    fixed = dataclasses.replace(tmt.ARM, body_hinge=(-1, 2))
    light = dataclasses.replace(tmt.ARM, mass=(0.0, 1.5), inertia=(np.zeros((3, 3)), tmt.ARM.inertia[1]))
    q = np.array([0.3, 0.2, 0.5])
    assert np.array_equal(tmt.mass_matrix(q, fixed), tmt.mass_matrix(q, light))
    assert np.array_equal(tmt.com_positions(q, fixed)[0], [0, 0, -0.15])


# Lagrange's equations: energies alone


def test_lagranges_equations_of_a_spherical_pendulum_and_a_free_body_are_those_of_newton_and_euler(rng):
    """Mbar = J, h = omega x J omega - r x m R'g to 50 digits; a free body has m r crossed with both beside."""
    m, r, inertia = 1.25, np.array([0.5, -0.25, 0.75]), possible_tensor(rng)
    with mpmath.workdps(50):
        exactly = np.vectorize(mpmath.mpf, otypes=[object])
        p, w, r, inertia, gravity = map(exactly, (rng.normal(size=4), rng.normal(size=3), r, inertia, (1, -2, -9)))
        R = rotation_matrix(p / mpmath.norm(p))
        J = inertia + m * (np.dot(r, r) * exactly(np.eye(3)) - np.outer(r, r))
        turning = np.cross(w, J @ w) - m * np.cross(r, R.T @ gravity)
        found = spherical_pendulum(p, w, m, r, inertia, gravity)
        assert abs(found.mass_matrix - J).max() < 1e-49 and abs(found.bias - turning).max() < 1e-48

        r_cross = np.array([[0, -r[2], r[1]], [r[2], 0, -r[0]], [-r[1], r[0], 0]])
        M = np.block([[m * exactly(np.eye(3)), -m * R @ r_cross], [m * r_cross @ R.T, J]])
        h = [*(R @ (m * np.cross(w, np.cross(w, r))) - m * gravity), *turning]
        found = free_body((1, 2, 3), p, (3, 2, 1), w, m, r, inertia, gravity)
        assert abs(found.mass_matrix - M).max() < 1e-49 and abs(found.bias - h).max() < 1e-48


def rotation_matrix(p):
    w, v = p[0], p[1:]
    cross = np.array([[0, -v[2], v[1]], [v[2], 0, -v[0]], [-v[1], v[0], 0]])
    return np.eye(3, dtype=int) + 2 * w * cross + 2 * cross @ cross


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
    M, h, spring = (np.array(values, dtype=float) for values in lagrange(tree, q, qd))
    # axes are of length 1 but for an eps, which each side reads in its own way
    force = np.abs(M).max() * np.square(qd).sum() + np.abs(h).max()
    assert np.abs(tmt.mass_matrix(q, tree) - M).max() < ALLOWED * np.abs(M).max()
    assert np.abs(tmt.bias(q, qd, tree) - h).max() < ALLOWED * force
    assert np.abs(tmt.spring_torque(q, tree) + spring).max() < ALLOWED * 10.0


def test_fifty_digits_of_lagrange_and_of_the_method_meet_along_coordinate_axes(rng):
    tree = plain_balls(tree_of_kinds(rng, bodies=1, along_axes=True))
    tree = dataclasses.replace(tree, reference=())
    q, qd, tau = random_state(rng, tree)
    for joint in tree.coordinates.balls:
        q[joint.q] = rng.choice([-0.5, 0.5], 4)  # of length 1 exactly
    truth, found = exact(tree, q, qd, tau), lagrange(tree, q, qd)
    with mpmath.workdps(50):
        assert abs(truth.mass_matrix - np.array(found.mass_matrix)).max() < mpmath.mpf(10) ** -44
        assert abs(truth.bias - np.array(found.bias)).max() < mpmath.mpf(10) ** -43


# composite and articulated bodies: the sums of the method regrouped


@pytest.mark.parametrize("seed", range(2))
def test_every_form_in_50_digits(seed, monkeypatch):
    rng = np.random.default_rng(seed)
    tree = tree_of_kinds(rng, bodies=3, along_axes=True)
    assert set(tree.kind) >= {"slide", "ball"}
    # the articulated form has what joints carry in doubles alone: for an exact tree, in numbers of mpmath
    rounded = composite.rounded_once
    monkeypatch.setattr(articulated, "rounded_once", lambda tree, _: rounded(tree.plain, mpmath.mpf))
    with mpmath.workdps(50):
        truth = exact_tree(tree, mpmath.mpf)
        truth.plain = tree
        q, qd, tau = ([mpmath.mpf(v) for v in values.tolist()] for values in random_state(rng, tree))
        M, h = map(np.array, method.mass_matrix_and_bias(truth, q, qd))
        regrouped = composite.mass_matrix_and_bias(tree, q, qd, mpmath.mpf)
        for form in (regrouped, articulated.mass_matrix_and_bias(truth, q, qd)):
            assert abs(np.array(form[0]) - M).max() < 1e-43 and abs(np.array(form[1]) - h).max() < 1e-43
        assert abs(np.array(articulated.bias(truth, q, qd)) - h).max() < 1e-43
        force = method.reduced_force(truth, list(h), q, qd, tau)
        assert abs(M @ np.array(articulated.forward_dynamics(truth, q, qd, tau)) - force).max() < 1e-43
        assert abs(M).max() > 0.1 and abs(h).max() > 0.1


# balls


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


def test_movements_of_balls(rng):
    coordinates = coordinates_of(("ball", "slide", "ball"))
    q = np.concatenate([unit_quaternion(rng), [0.3], unit_quaternion(rng)])
    for size in (0.0, 1e-200, 1e-9, 1.0, 3.0):
        u = rng.uniform(-1.0, 1.0, 7)
        u *= size / np.linalg.norm(u)
        assert np.allclose(coordinates.difference(coordinates.move(q, u), q), u, rtol=1e-12, atol=1e-15)
    same = -q
    same[4] = q[4]  # p and -p are one turn
    assert np.abs(coordinates.difference(same, q)).max() < 1e-15
    # along a motion with constant speed in space of the body the rates of the movement are exact: a series in dt
    omega = rng.uniform(-1.0, 1.0, 7)
    u, n = np.zeros(7), 500
    for _ in range(n):  # the midpoint rule
        half = u + 0.5 / n * np.array(coordinates.rates(u, omega))
        u = u + np.array(coordinates.rates(half, omega)) / n
    assert np.allclose(u, omega, rtol=0, atol=1e-12)
