"""A Tree with a linear controller: its generalized force in every form, the implicit entries of its gains, what is refused."""

import dataclasses

import numpy as np
import pytest
import sympy
from trees import random_state, small_tree

import tmt
from tmt.compiled import evaluator
from tmt.equations import composite, method
from tmt.exact.values import distance, exact
from tmt.methods import METHODS
from tmt.methods.derivatives import linear_system

FORK = dataclasses.replace(  # a hinge that carries two more on branches of their own
    tmt.ARM,
    parent=(-1, 0, 0),
    damping=(0.1, 0.0, 0.2),
    stiffness=(0.0, 3.0, 0.0),
    armature=(0.0, 0.1, 0.0),
    reference=(0.2, 0.0, -0.3),
)
P = np.array([[40.0, 0.0, 0.0], [0.0, 30.0, 12.0], [0.0, 12.0, 20.0]])
S = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 2.0], [0.0, 2.0, 5.0]])
DRIVEN = dataclasses.replace(FORK, position_gain=P, speed_gain=S)
q, qd, tau = np.array([0.4, -0.7, 1.1]), np.array([1.2, -0.5, 2.0]), np.array([3.0, -1.0, 0.5])


@pytest.fixture(scope="module")
def kinds():
    """A tree with hinges, slides and balls, and gains at all but the balls."""
    return small_tree()


def torque_of(tree, q, qd):
    """P q + S qd in plain NumPy, q of hinges and slides."""
    places = [at.start for _, at, by in tree.coordinates.joints for _ in range(by.start, by.stop)]
    return np.array(tree.position_gain) @ q[places] + np.array(tree.speed_gain) @ qd


def test_a_tree_without_a_controller_says_nothing_of_it():
    zeros = dataclasses.replace(tmt.ARM, position_gain=np.zeros((3, 3)), speed_gain=np.zeros((3, 3)))
    assert zeros == tmt.ARM and zeros.position_gain == () and not zeros.has_gains and "gain" not in repr(tmt.ARM)
    assert "position_gain=((40.0" in repr(DRIVEN) and eval(repr(DRIVEN), {"Tree": tmt.Tree}) == DRIVEN
    assert hash(DRIVEN) != hash(FORK)


def test_the_generalized_force_is_that_of_lagrange():
    """-d/dq of the energy q' P q / 2 and -d/dqd of Rayleigh's function qd' S qd / 2, by SymPy."""
    x, v = sympy.symbols("x:3"), sympy.symbols("v:3")
    energy = sum(p * a * b for row, a in zip(P.tolist(), x) for p, b in zip(row, x)) / 2
    lost = sum(s * a * b for row, a in zip(S.tolist(), v) for s, b in zip(row, v)) / 2
    found = method.fed_back(DRIVEN, list(x), list(v))
    for i in range(3):
        assert sympy.expand(found[i] - sympy.diff(energy, x[i]) - sympy.diff(lost, v[i])) == 0


def test_every_form_of_the_dynamics_has_it(kinds, rng):
    for tree in (DRIVEN, kinds):
        place, speed, torque = random_state(rng, tree)
        plain = dataclasses.replace(tree, position_gain=(), speed_gain=())
        wanted = tmt.acceleration(place, speed, torque - torque_of(tree, place, speed), plain)
        assert np.allclose(tmt.acceleration(place, speed, torque, tree), wanted, rtol=1e-10, atol=1e-10)
        assert np.allclose(composite_acceleration(tree, place, speed, torque), wanted, rtol=1e-10, atol=1e-10)
        assert distance(wanted, exact(tree, place, speed, torque).acceleration).max() < 1e-9 * (1 + abs(wanted).max())
        out = np.empty((1, len(speed)))
        evaluator(tree, "acceleration").each(place[None], speed[None], torque[None], out)
        assert np.allclose(out[0], wanted, rtol=1e-9, atol=1e-9)


def composite_acceleration(tree, q, qd, tau):
    return method.acceleration(tree, list(q), list(qd), list(tau), composite.mass_matrix_and_bias)


@pytest.mark.parametrize(
    "name, speed, position",
    [
        ("semi_implicit_euler", np.zeros((3, 3)), np.zeros((3, 3))),
        ("implicitfast", S * [[1, 1, 1], [1, 1, 0], [1, 0, 1]], np.zeros((3, 3))),
        ("implicit", S * [[1, 1, 1], [1, 1, 0], [1, 0, 1]], np.zeros((3, 3))),
        ("discrete", S, P),
    ],
)
def test_which_gains_are_implicit(name, speed, position):
    """The matrix and the force of the linear system, written out."""
    stepping, dt, k = METHODS[name], 0.01, np.diag(FORK.stiffness) * (name == "discrete")
    A, force = linear_system(stepping, DRIVEN, list(q[:, None]), list(qd[:, None]), list(tau), dt)
    bias = np.array(method.bias_rates(FORK, q, qd)) * (name == "implicit")
    wanted = tmt.mass_matrix(q, FORK) + dt * (np.diag(FORK.damping) + bias + speed) + dt**2 * (k + position)
    assert np.allclose(A[0], wanted, atol=1e-13)
    assert np.allclose(stepping.matrix(DRIVEN, list(q), list(qd), dt), wanted, atol=1e-13)
    pull = (
        tau
        - tmt.bias(q, qd, FORK)
        - np.array(FORK.damping) * qd
        - tmt.spring_torque(q, FORK)
        - torque_of(DRIVEN, q, qd)
    )
    assert np.allclose(force[0], pull - dt * (k + position) @ qd, atol=1e-13)
    slope = stepping.slope(DRIVEN, list(q), list(qd), list(tau), dt)
    assert np.allclose(slope, np.linalg.solve(wanted, force[0]), atol=1e-11)


def test_a_locked_joint_takes_its_gains_along_unless_others_feel_its_position():
    left = DRIVEN.lock({"alpha": 0.3})
    assert left.position_gain == tuple(map(tuple, P[1:, 1:])) and left.speed_gain == tuple(map(tuple, S[1:, 1:]))
    assert DRIVEN.lock({"beta": 0.0}).position_gain == ((40.0, 0.0), (0.0, 20.0))
    with pytest.raises(ValueError, match=r"'beta' cannot be locked at 0\.3: its position makes a torque at 'gamma'"):
        DRIVEN.lock({"beta": 0.3})
