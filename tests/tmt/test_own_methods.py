"""Methods of integration of a user's own."""

import numpy as np
import pytest

import tmt
from tmt.compiled import forms
from tmt.derivation import method
from tmt.methods import METHODS, RungeKutta, SemiImplicitEuler, amplification, method_named, one_step
from tmt.methods.stepping import FIELDS, Method, advance

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)


class Midpoint(Method):
    """The explicit midpoint rule, made from Method."""

    order = 2

    def step(self, slope, q, qd, dt):
        half = advance(q, dt / 2, (1.0,), [qd]), advance(qd, dt / 2, (1.0,), [slope(q, qd)])
        return advance(q, dt, (1.0,), [half[1]]), advance(qd, dt, (1.0,), [slope(*half)])


class Plain:
    """The same, of no known kind; and what else of itself it is to say."""

    def __init__(self, **fields):
        vars(self).update(fields)

    def slope(self, tree, q, qd, tau, dt, terms=method.mass_matrix_and_bias):
        return method.acceleration(tree, q, qd, tau, terms)

    def step(self, slope, q, qd, dt):
        return Midpoint().step(slope, q, qd, dt)


@pytest.mark.parametrize("own, order", [(Midpoint(), 2), (Plain(), 1)], ids=["of Method", "of no known kind"])
def test_a_method_of_ones_own(own, order, rng, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    monkeypatch.setitem(METHODS, "tableau", RungeKutta(2, ((), (0.5,)), (0.0, 1.0), (0.0, 0.5)))
    fields = {name: getattr(method_named("mine"), name) for name in FIELDS}
    assert fields == dict.fromkeys(FIELDS, False) | {"order": order, "stages": 2, "lanes": True}
    q, qd, tau = rng.uniform(-1, 1, (3, 9, 3))
    mine, same = (tmt.simulate(q, qd, tau, 0.01, 20, name) for name in ("mine", "tableau"))
    assert mine.evaluations == same.evaluations == 9 * 20 * 2
    assert all(np.allclose(a, b, rtol=0, atol=1e-12) for a, b in zip(mine, same))
    with pytest.raises(ValueError, match="tolerance"):
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine", tolerance=1e-6)
    monkeypatch.setitem(METHODS, "mine", METHODS["explicit_euler"])  # is used at once
    assert not np.allclose(tmt.simulate(q, qd, tau, 0.01, 20, "mine").q, same.q, rtol=0, atol=1e-6)


class Longer(RungeKutta):
    """A step that is another than the tableau says."""

    def step(self, slope, q, qd, dt, *joints):
        return super().step(slope, q, qd, 2.0 * dt, *joints)


class Weaker(RungeKutta):
    """Half the accelerations."""

    def slope(self, tree, q, qd, tau, dt, terms=method.mass_matrix_and_bias):
        return [0.5 * a for a in super().slope(tree, q, qd, tau, dt, terms)]


@pytest.mark.parametrize("own, form", [(Longer, 0), (Weaker, 0), (Weaker, 1)])  # composite; articulated
def test_another_step_or_slope_is_taken_and_not_kept(own, form, folder, monkeypatch):
    monkeypatch.setattr(forms, "FORMS", forms.FORMS[form : form + 1])
    rk4 = METHODS["rk4"]
    stepping = own(rk4.order, rk4.A, rk4.b, rk4.c)
    monkeypatch.setitem(METHODS, "mine", stepping)
    motion = tmt.simulate(BENT, [1.0] * 3, REST, 0.01, 2, "mine")
    state = BENT.tolist(), [1.0] * 3
    for k in (1, 2):
        state = one_step(stepping, tmt.ARM, *state, [0.0] * 3, 0.01)
        assert np.allclose(state, [motion.q[k], motion.qd[k]], rtol=0, atol=1e-12)
    assert not list(folder.glob("*"))  # it may be another tomorrow, with the same name


def test_the_jacobian_of_a_step_is_that_of_its_own_slope():
    class Floating(SemiImplicitEuler):
        def slope(self, tree, q, qd, tau, dt):
            return [0.0 * x for x in qd]

    J = amplification(Floating(False), tmt.ARM, BENT, REST, REST, 0.5)
    assert np.array_equal(J, np.block([[np.eye(3), 0.5 * np.eye(3)], [np.zeros((3, 3)), np.eye(3)]]))


@pytest.mark.parametrize("own, word", [
    (Method(), "step"), (Midpoint, "True or False"), (Plain(adaptive="yes"), "adaptive is 'yes'"),
    (Plain(order=0), "order is 0"), (Plain(adaptive=True), "attempt"),
    (Plain(solves_stages=True), "how many"), (Plain(solves_stages=True, stages=2), "stage_states"),
])  # fmt: skip
def test_what_is_no_method_is_refused(own, word, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    with pytest.raises(ValueError, match=r"^METHODS\['mine'\].*" + word) as error:
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine")
    assert "\n" not in str(error.value)
