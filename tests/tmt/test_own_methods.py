"""Methods of integration of a user's own."""

import numpy as np
import pytest

import tmt
from tmt.compiled import forms
from tmt.methods import METHODS, RungeKutta, SemiImplicitEuler, amplification, method_named, one_step
from tmt.methods.stepping import Method, advance

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)


class Midpoint(Method):
    """The explicit midpoint rule, made from Method."""

    order = 2

    def step(self, slope, q, qd, dt):
        half = advance(q, dt / 2, (1.0,), [qd]), advance(qd, dt / 2, (1.0,), [slope(q, qd)])
        return advance(q, dt, (1.0,), [half[1]]), advance(qd, dt, (1.0,), [slope(*half)])


def test_a_method_of_ones_own(rng, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", Midpoint())
    monkeypatch.setitem(METHODS, "tableau", RungeKutta(2, ((), (0.5,)), (0.0, 1.0), (0.0, 0.5)))
    mine = method_named("mine")
    assert mine.stages == 2 and not (mine.adaptive or mine.solves_stages)
    q, qd, tau = rng.uniform(-1, 1, (3, 9, 3))
    found, same = (tmt.simulate(q, qd, tau, 0.01, 20, name) for name in ("mine", "tableau"))
    assert found.evaluations == same.evaluations == 9 * 20 * 2
    assert all(np.allclose(a, b, rtol=0, atol=1e-12) for a, b in zip(found, same))
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

    def slope(self, tree, q, qd, tau, dt, *dynamics):
        return [0.5 * a for a in super().slope(tree, q, qd, tau, dt, *dynamics)]


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
        def slope(self, tree, q, qd, tau, dt, dynamics):
            return [0.0 * x for x in qd]

    J = amplification(Floating(False), tmt.ARM, BENT, REST, REST, 0.5)
    assert np.array_equal(J, np.block([[np.eye(3), 0.5 * np.eye(3)], [np.zeros((3, 3)), np.eye(3)]]))


@pytest.mark.parametrize("own", [Method(), Midpoint, "rk4", None])
def test_what_is_no_method_is_refused(own, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    with pytest.raises(ValueError, match=r"^METHODS\['mine'\] is .* with a step is expected$"):
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine")
