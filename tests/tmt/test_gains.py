"""A Tree with a linear controller: its generalized force in every form, the implicit entries of its gains, what is refused."""

import dataclasses
import math

import numpy as np
import pytest
import sympy
from trees import random_state, small_tree

import tmt
from tmt.compiled import evaluator
from tmt.equations import composite, method
from tmt.exact.values import distance, exact
from tmt.methods import METHODS
from tmt.methods.derivatives import amplification, linear_system, one_step

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


@pytest.mark.parametrize("name", ["position_gain", "speed_gain"])
@pytest.mark.parametrize(
    "value, says",
    [
        ((1.0, 2.0, 3.0), r"has shape \(3,\); \(3, 3\) is expected"),
        (np.zeros((2, 3)), r"has shape \(2, 3\)"),
        (1.0, r"has shape \(\); \(3, 3\)"),
        (np.full((3, 3), np.nan), "finite numbers are expected"),
        ("stiff", "numbers of shape"),
    ],
)
def test_what_is_no_gain_is_refused_in_one_line(name, value, says):
    with pytest.raises(ValueError, match=f"Tree.{name} .*{says}") as error:
        dataclasses.replace(tmt.ARM, **{name: value})
    assert "\n" not in str(error.value)


def test_a_ball_has_no_gain(kinds):
    (ball,) = {joint.qd.start for joint in kinds.coordinates.balls[:1]}
    for place in ((ball, 0), (0, ball)):
        gain = np.array(kinds.speed_gain)
        gain[place] = 1.0
        with pytest.raises(ValueError, match=r"has an entry of joint .*, a ball; of hinges and slides alone"):
            dataclasses.replace(kinds, speed_gain=gain)


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


@pytest.mark.parametrize("name", ["implicitfast", "implicit", "discrete", "rk4"])
def test_the_derivative_of_a_step_is_that_of_differences(name):
    stepping, dt, nudge = METHODS[name], 0.01, 1e-6
    J, state = amplification(stepping, DRIVEN, q, qd, tau, dt), np.concatenate([q, qd])
    for k, unit in enumerate(np.eye(6)):
        ends = [
            np.concatenate(one_step(stepping, DRIVEN, *np.split(state + sign * nudge * unit, 2), tau, dt))
            for sign in (1, -1)
        ]
        assert np.allclose((ends[0] - ends[1]) / (2 * nudge), J[:, k], atol=1e-7)


def test_a_locked_joint_takes_its_gains_along_unless_others_feel_its_position():
    left = DRIVEN.lock({"alpha": 0.3})
    assert left.position_gain == tuple(map(tuple, P[1:, 1:])) and left.speed_gain == tuple(map(tuple, S[1:, 1:]))
    assert DRIVEN.lock({"beta": 0.0}).position_gain == ((40.0, 0.0), (0.0, 20.0))
    with pytest.raises(ValueError, match=r"'beta' cannot be locked at 0\.3: its position makes a torque at 'gamma'"):
        DRIVEN.lock({"beta": 0.3})


def test_a_tree_without_gains_has_no_operation_for_them():
    assert evaluator(FORK, "acceleration").operations < evaluator(DRIVEN, "acceleration").operations


def test_a_servo_settles_where_its_torque_balances_the_weight():
    held = dataclasses.replace(DRIVEN, speed_gain=S + 30.0 * np.eye(3))
    end = tmt.simulate(q, 0 * q, tau, 2e-3, 20_000, "implicitfast", held).q[-1]
    left = tau - tmt.gravity_balance(end, held) - tmt.spring_torque(end, held) - P @ end
    assert math.isclose(np.abs(left).max(), 0.0, abs_tol=1e-6)
