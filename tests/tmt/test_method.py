"""The physics of TMT alone: no engine is asked."""

import dataclasses

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from trees import random_tree

import tmt
from compare.judge.scale import acceleration_scale, bias_scale, gravity_scale, reaches
from tmt.equations import method
from tmt.equations import vectors as space
from tmt.equations.dual import jacobian
from tmt.exact.values import distance, exact

ALLOWED = 64 * np.finfo(float).eps  # times the scale of each quantity, as in the experiments
TINY = 1e-30
states = arrays(float, 3, elements=st.floats(-10, 10))


def complex_step(function, q, direction):
    """d function / d q . direction, exact to rounding."""
    return np.imag(np.array(function(list(q + 1j * TINY * direction)), dtype=complex)) / TINY


@pytest.fixture(params=["arm", "tree"])
def model(request, rng):
    return tmt.ARM if request.param == "arm" else random_tree(rng)


@pytest.fixture
def state(model, rng):
    n = len(model.hinge_names)
    return rng.uniform(-3, 3, n), rng.uniform(-5, 5, n), rng.uniform(-5, 5, n)


def test_T_is_the_derivative_of_the_position(model, state):
    q, *_ = state
    T, _ = tmt.jacobians(q, model)
    for j, direction in enumerate(np.eye(len(q))):
        dx = complex_step(lambda q: [list(b.x) for b in method.bodies(model, q)], q, direction)
        assert np.abs(T[:, :, j] - dx).max() < ALLOWED * reaches(model).max()


def test_B_is_the_derivative_of_the_rotation(model, state):
    q, *_ = state
    _, B = tmt.jacobians(q, model)
    turns = np.array([[list(row) for row in method.joint_frames(model, list(q))[h].turn] for h in model.body_hinge])
    for j, direction in enumerate(np.eye(len(q))):
        rates = complex_step(
            lambda q: [[list(row) for row in method.joint_frames(model, q)[h].turn] for h in model.body_hinge],
            q,
            direction,
        )
        spin = turns.transpose(0, 2, 1) @ rates  # R' dR = [omega]x in body axes
        omega = np.stack([spin[:, 2, 1], spin[:, 0, 2], spin[:, 1, 0]], axis=1)
        assert np.abs(B[:, :, j] - omega).max() < ALLOWED


def test_convective_terms_are_derivatives_of_velocities(model, state):
    q, qd, _ = state
    v_conv, w_conv = tmt.convective_terms(q, qd, model)

    def velocities(q):
        parts = method.bodies(model, q, list(qd))
        return [[sum((c * v for c, v in zip(b.T, qd)), space.ZERO), b.omega] for b in parts]

    rates = complex_step(lambda q: [[list(x) for x in pair] for pair in velocities(q)], q, qd)
    scale = np.abs(qd).sum() ** 2
    assert np.abs(rates[:, 0] - v_conv).max() < ALLOWED * scale * reaches(model).max()
    assert np.abs(rates[:, 1] - w_conv).max() < ALLOWED * scale
    assert np.abs(v_conv).max() > 0.1 and np.abs(w_conv).max() > 0.1


# energy, power, momentum


def test_kinetic_energy_is_that_of_the_mass_matrix(model, state):
    q, qd, _ = state
    M = tmt.mass_matrix(q, model)
    kinetic = tmt.energy(q, qd, model) - tmt.potential_energy(q, model)
    assert kinetic > 0.1
    size = gravity_scale(model) + np.abs(qd) @ np.abs(M) @ np.abs(qd) / 2
    assert abs(kinetic - qd @ M @ qd / 2) < ALLOWED * size


def test_gravity_balance_is_the_gradient_of_potential_energy(model, state):
    q, *_ = state
    for j, direction in enumerate(np.eye(len(q))):
        slope = complex_step(lambda q: method.potential(method.bodies(model, q), model.gravity), q, direction)
        assert abs(tmt.gravity_balance(q, model)[j] - slope) < ALLOWED * gravity_scale(model)


def test_power_of_the_torque_is_the_rate_of_the_energy(model, state):
    q, qd, tau = state
    model = dataclasses.replace(model, damping=np.full(len(q), 0.3))
    qdd = tmt.acceleration(q, qd, tau, model)
    parts = [list(a + 1j * TINY * b) for a, b in ((q, qd), (qd, qdd))]
    bodies = method.bodies(model, *parts)
    rate = np.imag(method.potential(bodies, model.gravity) + method.kinetic(bodies, parts[1])) / TINY
    power = tau @ qd - 0.3 * qd @ qd
    assert abs(power) > 0.1
    force = bias_scale(model, q[None], qd[None])[0] + np.abs(tau).max() + 0.3 * np.abs(qd).max()
    cond = np.linalg.cond(tmt.mass_matrix(q, model))
    assert abs(rate - power) < ALLOWED * cond * force * np.abs(qd).sum()


def test_alpha_momentum_is_constant_without_gravity_and_torque(rng):
    weightless = dataclasses.replace(tmt.ARM, gravity=(0, 0, 0))
    q, qd = rng.uniform(-3, 3, (2, 3))
    _, path_q, path_qd = tmt.simulate(q, qd, np.zeros(3), 1e-3, 1000, model=weightless)
    momentum = np.einsum("sj,sj->s", tmt.mass_matrix(path_q)[:, 0], path_qd)
    assert np.ptp(path_qd[:, 0]) > 0.1
    coarse = np.abs(momentum - momentum[0]).max()
    _, path_q, path_qd = tmt.simulate(q, qd, np.zeros(3), 5e-4, 2000, model=weightless)
    momentum = np.einsum("sj,sj->s", tmt.mass_matrix(path_q)[:, 0], path_qd)
    assert 0.0 < np.abs(momentum - momentum[0]).max() < coarse / 2**3.5  # drift falls at the order of RK4


@given(states)
def test_mass_matrix_is_symmetric_positive_definite(q):
    M = tmt.mass_matrix(q)
    assert np.abs(M - M.T).max() <= ALLOWED * M.max()
    assert np.linalg.cond(M) < 126.84 and np.linalg.eigvalsh(M)[0] > 0.0


@given(states, states, states)
def test_forward_and_inverse_dynamics_close(q, qd, tau):
    qdd = tmt.acceleration(q, qd, tau)
    back = tmt.mass_matrix(q) @ qdd + tmt.bias(q, qd)
    force = np.abs(tau).max() + bias_scale(tmt.ARM, q[None], qd[None])[0]
    assert np.abs(back - tau).max() <= ALLOWED * np.linalg.cond(tmt.mass_matrix(q)) * force


@settings(max_examples=8)
@given(arrays(float, (2, 4, 3), elements=st.floats(-4, 4)))
def test_a_batch_is_its_states_one_by_one(q):
    for function in (tmt.mass_matrix, tmt.com_positions, tmt.gravity_balance, tmt.potential_energy):
        batch = function(q)
        single = np.array([[function(state) for state in row] for row in q])
        assert batch.shape == single.shape
        assert np.abs(batch - single).max() < 1e-14  # NumPy's vector sine may differ in the last bit


def test_a_body_fixed_to_the_world_does_not_count():
    fixed = dataclasses.replace(tmt.ARM, body_hinge=(-1, 2))
    light = dataclasses.replace(tmt.ARM, mass=(0.0, 1.5), inertia=(np.zeros((3, 3)), tmt.ARM.inertia[1]))
    q = np.array([0.3, 0.2, 0.5])
    assert np.array_equal(tmt.mass_matrix(q, fixed), tmt.mass_matrix(q, light))
    assert np.array_equal(tmt.com_positions(q, fixed)[0], [0, 0, -0.15])


# many digits, and an independent derivation


def test_fifty_digits_contain_the_floats(rng):
    q, qd, tau = rng.uniform(-3, 3, (3, 3))
    truth = exact(tmt.ARM, q, qd, tau)
    force = bias_scale(tmt.ARM, q[None], qd[None]) + np.abs(tau).max()
    assert distance(tmt.mass_matrix(q), truth.mass_matrix).max() < ALLOWED * tmt.mass_matrix(q).max()
    assert distance(tmt.bias(q, qd), truth.bias).max() < ALLOWED * force
    assert distance(tmt.acceleration(q, qd, tau), truth.acceleration).max() < ALLOWED * acceleration_scale(
        tmt.ARM, q[None], force
    )
    assert distance(tmt.potential_energy(q), truth.potential_energy) < ALLOWED * gravity_scale(tmt.ARM)
    assert distance(truth.mass_matrix.astype(float), truth.mass_matrix).max() > 0.0  # the truth has more digits


def test_derivative_of_the_bias_is_that_of_a_complex_step(model, state):
    q, qd, _ = state
    rates = np.array(method.bias_rates(model, list(q), list(qd)))
    for j, direction in enumerate(np.eye(len(q))):
        slope = complex_step(lambda qd: method.bias(method.bodies(model, list(q), qd), model.gravity), qd, direction)
        scale = bias_scale(model, q[None], qd[None])[0] + np.abs(tmt.mass_matrix(q, model)).max() * np.abs(qd).sum()
        assert np.abs(rates[:, j] - slope).max() < ALLOWED * scale
    assert np.abs(rates).max() > 1e-3


def test_nested_dual_numbers_are_not_confused():
    """d/dx (x d/dy (x y)) = 2 x at any y: the inner derivative is a constant of the outer one and the reverse."""
    (outer,) = jacobian(lambda x: [x[0] * jacobian(lambda y: [x[0] * y[0]], [3.0])[0][0]], [5.0])
    assert outer[0] == 10.0
