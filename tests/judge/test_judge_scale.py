"""The scales of tolerances: of the stated arm from its numbers written out, of any robot each entry's own, body by body."""

import dataclasses

import numpy as np
import pytest
from helpers.trees import one_body
from scipy.linalg import expm
from scipy.spatial.transform import Rotation

import tmt
from compare.judge import entries, scale

MOMENTS = ((0.02, 0.03, 0.04), (0.001, 0.002, 0.002), (0.01, 0.01, 0.02))
TREE = tmt.Tree(  # a slide, on it a hinge, on that a ball; and a hinge of its own beside them
    joint_names=("rail", "swing", "wrist", "lid"), parent=(-1, 0, 1, -1),
    offset=((0.0, 0.0, 0.3), (0.0, 0.2, 0.0), (0.4, 0.0, 0.0), (0.0, -0.6, 0.0)),
    axis=((1.0, 0.0, 0.0), (0.0, 0.6, 0.8), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0), (0.0, 0.0, 1.0)),
    damping=(0.4, 0.0, 0.1, 0.1, 0.1, 0.0), body_names=("cart", "bob", "door"), body_joint=(0, 2, 3),
    mass=(2.0, 0.5, 1.5), com=((0.0, 0.0, 0.1), (0.0, 0.0, -0.2), (0.3, 0.0, 0.0)),
    inertia=tuple(tuple(map(tuple, np.diag(moments))) for moments in MOMENTS), gravity=(0.0, 3.0, -4.0),
    kind=("slide", "hinge", "ball", "hinge"), armature=(0.3, 0.02, 0.0, 0.0, 0.0, 0.0),
    stiffness=(20.0, 5.0, 2.0, 0.0), rest=(0.1, -0.3, 1.0, 0.0, 0.0, 0.0, 0.0),
    reference=(0.05, 0.0, 0.0, 0.0),
)  # fmt: skip
SLIDES = np.array([[1, 0, 0, 0, 0, 0], [1, 0, 0, 0, 0, 0], [0, 0, 0, 0, 0, 0]])
TURNS = np.array([[0, 0, 0, 0, 0, 0], [0, 1, 1, 1, 1, 0], [0, 0, 0, 0, 0, 1]])
COUNT = (1, 2, 1)  # of hinges and balls on the way to each body, at least 1
LARGEST = (0.04, 0.002, 0.02)  # moments of inertia
Q = np.array([[-0.7, 0.4, *np.array([1.0, 2.0, 0.0, 2.0]) / 3.0, 1.0], [0.05, -1.0, 1.0, 0.0, 0.0, 0.0, 0.0]])
QD = np.array([[0.5, -1.0, 2.0, 0.0, 1.0, -3.0], [0.0, 0.0, 0.0, 0.0, 0.0, 0.0]])
REACH = np.array([[0.3 + 0.1, 0.3 + 0.2 + 0.4 + 0.2, 0.6 + 0.3]] * 2) + [[0.75, 0.75, 0.0], [0.0, 0.0, 0.0]]
# of each body and speed
LEVERS = np.array([[0, 0, 0, 0, 0, 0], [0, 0.4 + 0.2, 0.2, 0.2, 0.2, 0], [0, 0, 0, 0, 0, 0.3]])


def apart(tree):
    """Of each body the larger of its distances from the centre of mass, m, at both states."""
    places = tmt.com_positions(tree, Q)
    return np.linalg.norm(places - np.average(places, axis=1, weights=tree.mass)[:, None], axis=2).max(axis=0)


MOVES = SLIDES + LEVERS + TURNS * (apart(TREE) / 4 + np.max(REACH, axis=0) / 64)[:, None]
OF = entries.Entries(TREE, Q, QD)


def summed(of_body) -> np.ndarray:
    """The sum over states and bodies of what a body's number gives, each k times."""
    return np.array([sum(COUNT[b] * of_body(b, s) for b in range(3)) for s in range(2)])


def moving_of(b, s):
    """S, V and w of a body at a state."""
    rates = np.abs(QD[s])
    return rates @ TURNS[b], rates @ SLIDES[b], rates @ MOVES[b]


def test_lengths_are_from_the_joint_and_have_what_slides_have_moved():
    from_joints, from_origin = scale.levers(TREE, Q)
    assert np.allclose(from_origin, REACH, rtol=1e-14)
    assert np.allclose(scale.levers(TREE)[1], REACH[1], rtol=1e-14)
    assert np.allclose(from_joints, LEVERS[:, [0, 1, 2, 5]], rtol=1e-14)
    turned = dataclasses.replace(TREE, kind=("hinge", "slide", "ball", "hinge"))  # a slide after a hinge
    lengthened = [0.4 + 0.2 + 0.2 + 0.4, 0.4 + 0.2 + 0.2 + 1.0]
    assert scale.levers(turned, Q)[0][:, 1, 0] == pytest.approx(lengthened, rel=1e-14)
    assert scale.gravity_scale(TREE, Q) == pytest.approx(5.0 * REACH @ TREE.mass, rel=1e-14)
    for b, T in enumerate(np.broadcast_to(OF.T, (2, 3, 3, 6))[0]):
        assert np.allclose(T[1], COUNT[b] * MOVES[b])
        for s in range(2):
            S, _, w = moving_of(b, s)
            assert np.allclose(OF.v_conv[s, b, 0], COUNT[b] * 2.0 * S * w)
            assert np.allclose(OF.w_conv[s, b, 0], COUNT[b] * S**2)
        assert np.allclose(OF.B[0, b], COUNT[b])
        assert np.allclose(OF.positions[:, b, 0], COUNT[b] * REACH[:, b])


def test_the_mass_matrix_sums_every_term_where_it_is_largest():
    def of_body(b, s):
        return TREE.mass[b] * np.outer(MOVES[b], MOVES[b]) + LARGEST[b] * np.outer(TURNS[b], TURNS[b])

    terms = summed(of_body)[:1] + np.diag(TREE.armature)
    root = np.sqrt(np.einsum("sii->si", terms))  # of a structural zero: of its diagonal
    assert np.allclose(OF.added, terms, rtol=1e-13) and (terms == 0.0).any()
    sizes = np.where(terms == 0.0, root[:, :, None] * root[:, None, :], terms)
    assert np.allclose(OF.mass_matrix, sizes, rtol=1e-13)


def test_forces_sum_weight_springs_and_what_moves():
    weight = summed(lambda b, s: 5.0 * TREE.mass[b] * MOVES[b])
    assert np.allclose(OF.weight, weight[:1], rtol=1e-14)
    springs = np.array([[20.0 * 0.8, 5.0 * 0.7, 2 * np.pi, 2 * np.pi, 2 * np.pi, 0.0]])
    assert np.allclose(OF.springs[0], springs[0], rtol=1e-14)

    def moving(b, s):
        S, V, w = moving_of(b, s)
        return 2 * TREE.mass[b] * S * w * MOVES[b] + (TREE.mass[b] * V**2 + LARGEST[b] * S**2) * TURNS[b]

    assert np.allclose(OF.bias, summed(moving) + weight, rtol=1e-13)
    tau, drag = np.full(6, 3.0), np.array(TREE.damping) * np.abs(QD)
    assert np.allclose(OF.force(tau)[0], OF.bias[0] + 3.0 + drag[0] + springs[0], rtol=1e-14)


def test_energies_sum_weight_springs_and_motion():
    """m g times the reach, k (|q| + |rest|)^2 / 2 of each joint, of a ball k pi^2 / 2 for each axis; |qd|' Mbar |qd| / 2."""
    heights = np.array([sum(COUNT[b] * TREE.mass[b] * 5.0 * REACH[s, b] for b in range(3)) for s in range(2)])
    slide = [20.0 * (0.7 + 0.1) ** 2, 20.0 * (0.05 + 0.1) ** 2]
    hinge = [5.0 * (0.4 + 0.3) ** 2, 5.0 * (1.0 + 0.3) ** 2]
    stored = heights + (np.array(slide) + hinge + 3.0 * 2.0 * np.pi**2) / 2.0
    assert np.allclose(OF.potential_energy, stored, rtol=1e-13)
    moving = summed(
        lambda b, s: (
            TREE.mass[b] * (MOVES[b] @ np.abs(QD[s])) ** 2 + LARGEST[b] * (TURNS[b] @ np.abs(QD[s])) ** 2
        )
    )
    assert np.allclose(OF.energy, stored + (moving + np.array(TREE.armature) @ QD.T**2) / 2.0, rtol=1e-13)


def test_the_whole_robot_sums_its_bodies():
    """The centre of mass and its Jacobian are for a unit of mass; a momentum has the lever from the common centre."""
    total, far = sum(TREE.mass), apart(TREE) + np.max(REACH, axis=0) / 64
    linear = summed(lambda b, s: TREE.mass[b] * MOVES[b])
    angular = summed(lambda b, s: TREE.mass[b] * far[b] * MOVES[b] + LARGEST[b] * TURNS[b])
    com = summed(lambda b, s: TREE.mass[b] * REACH[s, b])
    assert np.allclose(OF.com, com[:, None] / total, rtol=1e-13)
    assert np.allclose(OF.com_jacobian[:, 0], linear / total, rtol=1e-13)
    rows = OF.centroidal_momentum_matrix
    assert np.allclose(rows[:, :3], linear[:, None], rtol=1e-13)
    assert np.allclose(rows[:, 3:], angular[:, None], rtol=1e-13)


def test_a_coriolis_matrix_has_no_damping_and_a_balls_brackets():
    def by_speed(b, s):
        S, V, w = moving_of(b, s)
        of_point = TREE.mass[b] * (S * np.outer(MOVES[b], MOVES[b]) + w * np.outer(MOVES[b], TURNS[b]))
        of_turn = LARGEST[b] * S * TURNS[b] + TREE.mass[b] * V * SLIDES[b]
        return 2.0 * (of_point + np.outer(TURNS[b], of_turn))

    brackets = np.zeros((2, 6, 6))
    brackets[:, 2:5, 2:5] = np.abs(QD[:, 2:5]).sum(axis=1)[:, None, None]
    assert np.allclose(OF.coriolis_matrix, summed(by_speed) + OF.added @ brackets, rtol=1e-13)


def test_a_column_of_the_regressor_is_what_a_unit_of_its_number_pushes():
    qdd = np.array([[1.0, -2.0, 3.0, -4.0, 5.0, -6.0], [0.5, 0.0, -1.0, 0.0, 2.0, 7.0]])
    found = OF.regressor(qdd).reshape(2, 6, 3, 10)
    for s, b in np.ndindex(2, 3):
        (S, V, w), sizes = moving_of(b, s), np.abs(qdd[s])
        turning, a = TURNS[b] @ sizes + S**2, MOVES[b] @ sizes + 2.0 * S * w + V * S + 5.0
        columns = [a * MOVES[b], *3 * [turning * MOVES[b] + a * TURNS[b]], *6 * [turning * TURNS[b]]]
        assert np.allclose(found[s, :, b], COUNT[b] * np.transpose(columns), rtol=1e-13)


def test_rates_of_the_force_of_a_pendulum_are_at_most_a_few_of_its_own():
    """d(tau)/dq of a bob of 2 kg at 0.5 m is at most m g l, d(tau)/dqd is 0: neither scale is far above the terms."""
    bob = one_body([(0.0, 1.0, 0.0)], com=(0.0, 0.0, -0.5), mass=[2.0], inertia=1e-9 * np.eye(3))
    q, lever = np.linspace(-3.0, 3.0, 13)[:, None], 0.5 + 0.5 / 64
    by_q, by_qd = entries.Entries(bob, q, 3.0).force_rates(0.0)
    assert np.abs(2.0 * 9.81 * 0.5 * np.cos(q)).max() < by_q.min()
    assert by_q == pytest.approx(4.0 * 2.0 * lever * (9.81 + 2.0 * 3.0**2 * lever), rel=1e-6)
    assert by_qd == pytest.approx(2.0 * 2.0 * 2.0 * 3.0 * lever**2, rel=1e-6)


def test_derivatives_of_accelerations_go_through_the_inverse():
    """Mbar d(qdd) = right - dMbar qdd: |Mbar^-1| times the terms of both sides, at |qdd| and what rounding may add to it."""
    by = tmt.derivatives(TREE, Q[0], QD[0], np.ones(6))
    by = by._replace(**{name: getattr(by, name)[None] for name in ("dqdd_dq", "dqdd_dqd", "dqdd_dtau")})
    alone, M = entries.Entries(TREE, Q[:1], QD[:1]), tmt.mass_matrix(TREE, Q[0])
    qdd = tmt.acceleration(TREE, Q[0], QD[0], np.ones(6))
    inverse, factored = np.abs(np.linalg.inv(M)), OF.added[0] + np.outer(*[np.sqrt(np.diag(M))] * 2)
    sizes = np.abs(qdd) + inverse @ (factored @ np.abs(qdd) + OF.force(1.0)[0])
    by_q, by_qd = (part[0] for part in alone.force_rates(sizes))
    found = alone.derivatives(1.0, qdd[None], by)
    assert np.allclose(found[3][0], by_q, rtol=1e-12) and np.allclose(found[4][0], by_qd, rtol=1e-12)
    for size, right, slope in zip(found[:3], (by_q, by_qd, np.eye(6)), by[:3]):
        assert np.allclose(size[0], inverse @ (right + factored @ np.abs(slope[0])), rtol=1e-12)


@pytest.mark.parametrize("dt", [0.01, 0.1])
def test_the_scale_of_a_step_is_carried_through_its_exponential(dt):
    """Of a damped spring, qdd = -a q - b qd + c tau: beside SciPy's matrix exponential."""
    spring = one_body([(1.0, 0.0, 0.0)], ("slide",), stiffness=(4.0,), damping=(0.5,), rest=(0.0,))
    by, sizes = ([np.full((1, 1, 1), x) for x in row] for row in ((-2.0, -0.25, 0.5), (30.0, 7.0, 11.0)))
    rates = np.array([[0.0, 1.0, 0.0], [2.0, 0.25, 0.5], [0.0, 0.0, 0.0]])
    carried = expm(dt * rates)
    expected = carried + dt * carried @ [[0.0, 1.0, 0.0], [30.0, 7.0, 11.0], [0.0, 0.0, 0.0]] @ carried
    found = entries.Entries(spring, np.zeros((1, 1))).step(dt, (*by, None, None), (*sizes, None, None))
    assert np.allclose(found[0], expected[:2], rtol=1e-4, atol=0.0)


@pytest.mark.parametrize("dt", [1e-4, 0.02])
def test_the_derivatives_of_a_small_turn_are_judged_as_products_of_quaternions(dt):
    """Of a sphere that spins freely: exp(-dt [w]) by SciPy; rounding is of sums of 1, however small a turn is."""
    sphere, spin = one_body(np.eye(3), ("ball",), gravity=(0.0, 0.0, 0.0)), np.array([0.98, 1.2, 0.87])
    turns = np.random.default_rng(7).normal(size=(200, 4))
    q, qd = turns / np.linalg.norm(turns, axis=1, keepdims=True), np.tile(spin, (200, 1))
    A, _ = tmt.step_derivatives(sphere, q, qd, np.zeros_like(qd), dt, "semi_implicit_euler")
    of, by = entries.Entries(sphere, q, qd), tmt.derivatives(sphere, q, qd, np.zeros_like(qd))
    sizes = of.step(dt, by, of.derivatives(0.0, np.zeros_like(qd), by))[:, :3, :3]
    difference = np.abs(A[:, :3, :3] - Rotation.from_rotvec(-dt * spin).as_matrix())
    assert difference.max() > 0.0 and (difference <= 64 * 2.0**-52 * sizes).all()
    assert sizes.min() >= 1.0 and sizes.max() <= 2.0 + 10.0 * dt


def test_errors_go_through_the_inverse_entry_by_entry():
    M, force = tmt.mass_matrix(TREE, Q)[0], OF.force(1.0)
    qdd = np.array([[1.0, -2.0, 3.0, -4.0, 5.0, -6.0]] * 2)
    root = np.sqrt(np.diag(M))
    residual = (OF.added[0] + np.outer(root, root)) @ np.abs(qdd[0]) + force[0]
    assert np.allclose(OF.acceleration(force, qdd)[0], np.abs(np.linalg.inv(M)) @ residual, rtol=1e-12)
    assert np.allclose(OF.closing(force, qdd)[0], 2 * residual, rtol=1e-13)


# the stated arm: one number for each state

ANGLES, RATES = np.random.default_rng(3).uniform(-4, 4, (2, 20, 3))


def test_what_moves_is_the_sum_of_its_absolute_terms():
    """State by state and body by body, without the sums of the code under test."""
    for q, qd, sizes in zip(ANGLES, RATES, scale.motion_scale(tmt.ARM, ANGLES, RATES)):
        T, B = tmt.jacobians(tmt.ARM, q)
        v, w = tmt.convective_terms(tmt.ARM, q, qd)
        terms = np.zeros(3)
        for b in range(2):
            inertia, omega = np.array(tmt.ARM.inertia[b]), B[b] @ qd
            moment = np.abs(inertia @ w[b]) + np.abs(np.cross(omega, inertia @ omega))
            terms += np.abs(T[b]).T @ (tmt.ARM.mass[b] * np.abs(v[b])) + np.abs(B[b]).T @ moment
        assert sizes == pytest.approx(terms, rel=1e-12)
