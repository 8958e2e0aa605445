"""What methods of integration say of themselves, and methods of a user's own."""

import dataclasses

import numpy as np
import pytest

import tmt
from tmt.compiled import forms
from tmt.equations import method
from tmt.methods import METHODS, RungeKutta, method_named, one_step
from tmt.methods.stepping import FIELDS, Method

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)


def said(stepping) -> tuple:
    """Order, stages, and the names of the other fields that hold."""
    return (
        stepping.order,
        stepping.stages,
        {name for name, kind in FIELDS.items() if kind is bool and getattr(stepping, name)},
    )


@pytest.mark.parametrize("name", METHODS)
def test_what_a_method_says_is_so(name):
    stepping, damped = METHODS[name], dataclasses.replace(tmt.ARM, damping=(1.0, 2.0, 3.0))
    slopes = [stepping.slope(damped, BENT.tolist(), [1.0] * 3, [0.0] * 3, dt) for dt in (0.0, 0.1)]
    assert (slopes[0] != slopes[1]) == stepping.damps_implicitly


@dataclasses.dataclass(frozen=True)
class Midpoint(Method):
    """The explicit midpoint rule, made from Method."""

    order = 2

    def step(self, slope, q, qd, dt):
        def moved(a, b, by):
            return [x + by * y for x, y in zip(a, b)]

        half_q, half_qd = moved(q, qd, dt / 2), moved(qd, slope(q, qd), dt / 2)
        return moved(q, half_qd, dt), moved(qd, slope(half_q, half_qd), dt)


class Plain:
    """The same, of no known kind."""

    def slope(self, tree, q, qd, tau, dt, terms=method.mass_matrix_and_bias):
        return method.acceleration(tree, q, qd, tau, terms)

    def step(self, slope, q, qd, dt):
        return Midpoint().step(slope, q, qd, dt)


class Talking:
    """A method of tmt's as an object of no known kind that says all of itself."""

    def __init__(self, name, *lacking):
        known = METHODS[name]
        for part in {"slope", "step", "attempt", "stage_states", "finish", *FIELDS} - {*lacking}:
            if hasattr(known, part):
                setattr(self, part, getattr(known, part))


@pytest.mark.parametrize("own, order", [(Midpoint(), 2), (Plain(), 1)], ids=["made from Method", "of no known kind"])
def test_a_method_of_ones_own(own, order, rng, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    monkeypatch.setitem(METHODS, "tableau", RungeKutta(2, ((), (0.5,)), (0.0, 1.0), (0.0, 0.5)))
    assert said(method_named("mine")) == (order, 2, {"lanes"})
    q, qd, tau = rng.uniform(-1, 1, (3, 40, 3))
    mine, same = (tmt.simulate(q, qd, tau, 0.01, 20, name) for name in ("mine", "tableau"))
    assert mine.evaluations == same.evaluations == 40 * 20 * 2
    assert all(np.allclose(a, b, rtol=0, atol=1e-12) for a, b in zip(mine, same))
    assert np.allclose(
        one_step(own, tmt.ARM, q[0], qd[0], tau[0], 0.01), [mine.q[0, 1], mine.qd[0, 1]], rtol=0, atol=1e-12
    )
    alone = tmt.simulate(q[7], qd[7], tau[7], 0.01, 20, "mine")
    assert np.array_equal(alone.q, mine.q[7]) and np.array_equal(alone.qd, mine.qd[7])
    with pytest.raises(ValueError, match="tolerance"):
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine", tolerance=1e-6)


@pytest.mark.parametrize("name", ["rk4", "implicit", "implicit_midpoint", "dopri8_adaptive"])
def test_what_an_object_of_no_known_kind_says_counts(name, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", Talking(name))
    mine = method_named("mine")
    assert said(mine) == said(METHODS[name])
    start = [np.array([BENT] * 9), np.ones((9, 3)), np.zeros((9, 3)), 0.01, 5]
    found, wanted = (tmt.simulate(*start, one) for one in ("mine", name))
    assert np.allclose(found.q, wanted.q, rtol=0, atol=1e-13) and found.evaluations == wanted.evaluations


@dataclasses.dataclass(frozen=True)
class Longer(RungeKutta):
    """A step that is another than the tableau says."""

    def step(self, slope, q, qd, dt, *joints):
        return super().step(slope, q, qd, 2.0 * dt, *joints)


@dataclasses.dataclass(frozen=True)
class Weaker(RungeKutta):
    """Half the accelerations."""

    def slope(self, tree, q, qd, tau, dt, terms=method.mass_matrix_and_bias):
        return [0.5 * a for a in super().slope(tree, q, qd, tau, dt, terms)]


@pytest.mark.parametrize("few", [5, 0])  # speeds, beyond which articulated bodies are asked
def test_another_step_or_slope_is_taken(few, folder, monkeypatch):
    monkeypatch.setattr(forms, "FEW", few)
    rk4 = METHODS["rk4"]
    for own in (Longer, Weaker):
        stepping = own(rk4.order, rk4.A, rk4.b, rk4.c)
        monkeypatch.setitem(METHODS, own.__name__, stepping)
        motion = tmt.simulate(BENT, [1.0] * 3, REST, 0.01, 2, own.__name__)
        state = BENT.tolist(), [1.0] * 3
        for k in (1, 2):
            state = one_step(stepping, tmt.ARM, *state, [0.0] * 3, 0.01)
            assert np.allclose(state, [motion.q[k], motion.qd[k]], rtol=0, atol=1e-12)


class Changed(Plain):
    """A method with further fields."""

    def __init__(self, **fields):
        vars(self).update(fields)


class Unhashable(Plain):
    __hash__ = None


class Failing(Midpoint):
    def step(self, slope, q, qd, dt):
        raise RuntimeError("no\nstep")


@pytest.mark.parametrize(
    "own, word",
    [
        ("no method", "'no method'"),
        (None, "None"),
        (Unhashable(), "hashable"),
        (Method(), "step"),
        (Midpoint, "True or False"),
        (Changed(adaptive="yes"), "adaptive is 'yes'"),
        (Changed(lanes=1), "lanes is 1"),
        (Changed(order=0), "order is 0"),
        (Changed(order=True), "order is True"),
        (Changed(stages=1.5), "stages is 1.5"),
        (Changed(adaptive=True), "attempt"),
        (Talking("implicit_midpoint", "finish"), "finish"),
        (Talking("implicit_midpoint", "stages"), "how many"),
        (Failing(), "RuntimeError"),
    ],
)
def test_what_is_no_method_is_refused(own, word, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    with pytest.raises(ValueError) as error:
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine")
    message = str(error.value)
    assert message.startswith("METHODS['mine']") and word in message and "\n" not in message


def test_a_method_that_is_replaced_is_used_at_once(monkeypatch):
    before, euler = (tmt.simulate(BENT, REST, REST, 0.01, 5, name).q for name in ("rk4", "semi_implicit_euler"))
    monkeypatch.setitem(METHODS, "rk4", METHODS["semi_implicit_euler"])
    assert np.array_equal(tmt.simulate(BENT, REST, REST, 0.01, 5, "rk4").q, euler)
    monkeypatch.undo()
    assert np.array_equal(tmt.simulate(BENT, REST, REST, 0.01, 5).q, before) and not np.array_equal(before, euler)
