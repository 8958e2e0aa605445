"""Methods of integration, also a user's own: tableaus, orders, the derivatives of their steps, what they take implicitly."""

import dataclasses

import numpy as np
import pytest
from helpers.trees import random_state, tree_of_kinds
from scipy.integrate import DOP853

import tmt
from tmt.compiled import forms
from tmt.derivation import form, method
from tmt.exact.motion import trajectory
from tmt.methods import (
    METHODS,
    RungeKutta,
    derivatives,
    dop853,
    method_named,
    one_step,
)
from tmt.methods.stepping import Method, advance

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)
EPS = np.finfo(float).eps


def test_the_coefficients_of_dop853_are_those_of_scipy():
    assert len(dop853.A) == DOP853.n_stages
    assert all(np.array_equal(row, DOP853.A[i, :i]) for i, row in enumerate(dop853.A))
    assert np.array_equal(dop853.B, DOP853.B) and np.array_equal(dop853.C, DOP853.C)
    assert np.array_equal([*dop853.ERRORS[0], 0.0], DOP853.E5)  # with one of the slope at the end of the step
    assert np.array_equal([*dop853.ERRORS[1], 0.0], DOP853.E3)


@pytest.mark.parametrize("name, springs", [("semi_implicit_euler", 0.0), ("discrete", 1.0)])
def test_each_form_takes_damping_and_springs_at_the_end_of_a_step(name, springs):
    """(Mbar + dt D + dt^2 k) a = Qbar - dt k qd, solved by NumPy."""
    tree, dt = tree_of_kinds(np.random.default_rng(5), bodies=5, kinds=("hinge", "slide")), 0.1
    q, qd, tau = random_state(np.random.default_rng(6), tree)
    D, k = np.array(tree.damping), np.array(tree.stiffness)
    force = tau - tmt.bias(tree, q, qd) - D * qd - k * (q - tree.rest)
    matrix = tmt.mass_matrix(tree, q) + np.diag(dt * D + springs * dt**2 * k)
    expected = np.linalg.solve(matrix, force - springs * dt * k * qd)
    for of in (form.LITERAL, form.COMPOSITE, form.ARTICULATED, form.BY_BODIES):
        found = METHODS[name].slope(tree, q.tolist(), qd.tolist(), tau.tolist(), dt, of)
        assert np.allclose(found, expected, rtol=1e-9, atol=1e-9)


def test_methods_keep_their_order_with_balls():
    tree = tree_of_kinds(np.random.default_rng(5), bodies=1, kinds=("ball",))
    q, qd, tau = random_state(np.random.default_rng(6), tree)
    truth = trajectory(tree, q, qd, tau, 0.25, 1).high[-1]

    def error(name, steps):
        state = q.tolist(), qd.tolist()
        for _ in range(steps):
            state = one_step(METHODS[name], tree, *state, tau.tolist(), 0.25 / steps)
        assert abs(np.linalg.norm(np.array(state[0])[tree.coordinates.balls[0].q]) - 1.0) < 4 * EPS
        return np.abs(np.concatenate(state) - truth).max()

    for name, order in (("rk4", 4), ("rk4_mean_speed", 2), ("implicit_midpoint", 2), ("dopri8", 8)):
        assert abs(np.log2(error(name, 8) / error(name, 16)) - order) < 0.4


FORK = dataclasses.replace(  # a hinge that carries two more on branches of their own
    tmt.ARM, parent=(-1, 0, 0), damping=(0.1, 0.0, 0.2), stiffness=(0.0, 3.0, 0.0), armature=(0.0, 0.1, 0.0),
    reference=(0.2, 0.0, -0.3),
)  # fmt: skip
P = np.array([[40.0, 0.0, 0.0], [0.0, 30.0, 12.0], [0.0, 12.0, 20.0]])
S = np.array([[4.0, 1.0, 0.0], [1.0, 3.0, 2.0], [0.0, 2.0, 5.0]])
ON_ONE_PATH = np.array([[1, 1, 1], [1, 1, 0], [1, 0, 1]])
DRIVEN = dataclasses.replace(FORK, position_gain=P, speed_gain=S)
q, qd, tau = np.array([0.4, -0.7, 1.1]), np.array([1.2, -0.5, 2.0]), np.array([3.0, -1.0, 0.5])


@pytest.mark.parametrize("name, speed, position", [
    ("semi_implicit_euler", 0.0 * S, 0.0 * P), ("implicitfast", S * ON_ONE_PATH, 0.0 * P),
    ("implicit", S * ON_ONE_PATH, 0.0 * P), ("discrete", S, P),
])  # fmt: skip
def test_which_gains_are_implicit(name, speed, position):
    """The matrix and the force of the linear system, written out."""
    stepping, dt, k = METHODS[name], 0.01, np.diag(FORK.stiffness) * (name == "discrete")
    bias = np.array(method.bias_rates(FORK, q, qd)) * (name == "implicit")
    matrix = tmt.mass_matrix(FORK, q) + dt * (np.diag(FORK.damping) + bias + speed) + dt**2 * (k + position)
    force = tau - P @ q - S @ qd - tmt.bias(FORK, q, qd) - FORK.damping * qd - tmt.spring_torque(FORK, q)
    force -= dt * (k + position) @ qd
    dynamics = derivatives.Linearized()
    a = stepping.slope(DRIVEN, list(q), list(qd), list(tau), dt, dynamics)
    assert np.allclose(np.array(dynamics.last.matrix), matrix, atol=1e-13)
    for slope in (a, stepping.slope(DRIVEN, list(q), list(qd), list(tau), dt)):
        assert np.allclose(slope, np.linalg.solve(matrix, force), atol=1e-11)


def free_and_hinge(parent, body_joint, first):
    """Three slides and a ball with one body, from joint `first`, and a hinge with another."""
    kind, axis = ["hinge"] * 5, [[(0.0, 1.0, 0.0)]] * 5
    kind[first : first + 4], axis[first : first + 4] = (
        ["slide"] * 3 + ["ball"],
        [*np.eye(3)[:, None], np.eye(3)],
    )
    inertia = np.diag([0.02, 0.03, 0.04])
    return tmt.Tree(
        list("abcde"), parent, np.zeros((5, 3)), np.concatenate(axis), [0.1] * 7, ["one", "two"], body_joint, [1.0, 2.0],
        [(0.1, 0.2, 0.3)] * 2, [inertia] * 2, (0.0, 0.0, -9.81), kind,
    )  # fmt: skip


@pytest.mark.parametrize("tree, lone", [
    (free_and_hinge((-1, 0, 1, 2, -1), (3, 4), 0), range(6)),  # beside it
    (free_and_hinge((-1, 0, 1, 2, 3), (3, 4), 0), ()),  # which it carries
    (free_and_hinge((-1, 0, 1, 2, 3), (0, 4), 1), ()),  # on which it is
    (free_and_hinge((-1, -1, 1, 2, 3), (0, 4), 1), range(1, 7)),
])  # fmt: skip
def test_implicitfast_takes_the_bias_of_a_free_body_implicitly_if_it_is_alone(tree, lone):
    """The linear system, with differences of the bias, which is a square of the speeds."""
    q = np.array(tree.coordinates.move(list(tree.zero), [0.3, -0.2, 0.5, 0.4, 0.1, -0.6, 0.2]))
    qd, tau, dt = np.array([0.5, -1.0, 2.0, 1.5, -0.7, 0.3, 1.1]), np.linspace(-1.0, 1.0, 7), 0.1
    rates = [(tmt.bias(tree, q, qd + u) - tmt.bias(tree, q, qd - u)) / 2.0 for u in np.eye(7)]
    matrix = tmt.mass_matrix(tree, q) + dt * np.diag(tree.damping)
    matrix[list(lone)] += dt * np.transpose(rates)[list(lone)]
    force = tau - 0.1 * qd - tmt.bias(tree, q, qd)
    expected = qd + dt * np.linalg.solve(matrix, force)
    assert np.abs(tmt.simulate(tree, q, qd, tau, dt, 1, "implicitfast").qd[1] - expected).max() < 1e-10


def test_a_locked_joint_takes_its_gains_along_unless_others_feel_its_position():
    left = DRIVEN.lock({"alpha": 0.3})
    assert np.array_equal(left.position_gain, P[1:, 1:]) and np.array_equal(left.speed_gain, S[1:, 1:])
    assert DRIVEN.lock({"beta": 0.0}).position_gain == ((40.0, 0.0), (0.0, 20.0))
    with pytest.raises(ValueError, match=r"'beta' cannot be locked at 0\.3"):
        DRIVEN.lock({"beta": 0.3})


class Midpoint(Method):
    """The explicit midpoint rule, made from Method."""

    order = 2

    def step(self, slope, q, qd, dt, joints):
        half = advance(q, dt / 2, (1.0,), [qd]), advance(qd, dt / 2, (1.0,), [slope(q, qd)])
        return advance(q, dt, (1.0,), [half[1]]), advance(qd, dt, (1.0,), [slope(*half)])


def test_a_method_of_ones_own(rng, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", Midpoint())
    monkeypatch.setitem(METHODS, "tableau", RungeKutta(2, ((), (0.5,)), (0.0, 1.0), (0.0, 0.5)))
    mine = method_named("mine")
    assert mine.stages == 2 and not (mine.adaptive or mine.solves_stages)
    q, qd, tau = rng.uniform(-1, 1, (3, 9, 3))
    found, same = (tmt.simulate(tmt.ARM, q, qd, tau, 0.01, 20, name) for name in ("mine", "tableau"))
    assert found.evaluations == same.evaluations == 9 * 20 * 2
    assert all(np.allclose(a, b, rtol=0, atol=1e-12) for a, b in zip(found, same))
    with pytest.raises(ValueError, match="tolerance"):
        tmt.simulate(tmt.ARM, BENT, REST, REST, 0.1, 1, "mine", tolerance=1e-6)
    monkeypatch.setitem(METHODS, "mine", METHODS["explicit_euler"])  # is used at once
    assert not np.allclose(tmt.simulate(tmt.ARM, q, qd, tau, 0.01, 20, "mine").q, same.q, rtol=0, atol=1e-6)


class Weaker(RungeKutta):
    """Half the accelerations."""

    def slope(self, tree, q, qd, tau, dt, *dynamics):
        return [0.5 * a for a in super().slope(tree, q, qd, tau, dt, *dynamics)]


@pytest.mark.parametrize("own, form", [(Weaker, 0), (Weaker, 1)])  # composite; articulated
def test_another_step_or_slope_is_taken_and_not_kept(own, form, folder, monkeypatch):
    monkeypatch.setattr(forms, "FORMS", forms.FORMS[form : form + 1])
    rk4 = METHODS["rk4"]
    stepping = own(rk4.order, rk4.A, rk4.b, rk4.c)
    monkeypatch.setitem(METHODS, "mine", stepping)
    motion = tmt.simulate(tmt.ARM, BENT, [1.0] * 3, REST, 0.01, 2, "mine")
    state = BENT.tolist(), [1.0] * 3
    for k in (1, 2):
        state = one_step(stepping, tmt.ARM, *state, [0.0] * 3, 0.01)
        assert np.allclose(state, [motion.q[k], motion.qd[k]], rtol=0, atol=1e-12)
    assert not list(folder.glob("*"))  # it may be another tomorrow, with the same name


@pytest.mark.parametrize("own", [Midpoint, "rk4", None])
def test_what_is_no_method_is_refused(own, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    with pytest.raises(ValueError, match=r"^METHODS\['mine'\] is .* is expected$"):
        tmt.simulate(tmt.ARM, BENT, REST, REST, 0.1, 1, "mine")
