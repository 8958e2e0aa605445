"""What methods of integration say of themselves, and methods of a user's own."""

import ast
import dataclasses
from pathlib import Path

import numpy as np
import pytest

import tmt
from tmt import kernels, source
from tmt.equations import method
from tmt.methods import METHODS, RungeKutta, method_named, one_step
from tmt.methods.stepping import FIELDS, Method

BENT = np.radians([30.0, 20.0, 60.0])
REST = np.zeros(3)
# order, stages, and what else holds
KNOWN = {
    "rk4": (4, 4, {"lanes"}),
    "rk4_mean_speed": (2, 4, {"lanes"}),
    "dopri8": (8, 12, {"lanes"}),
    "dopri8_adaptive": (8, 12, {"adaptive"}),
    "explicit_euler": (1, 1, {"lanes"}),
    "semi_implicit_euler": (1, 1, {"lanes", "damps_implicitly"}),
    "implicit": (1, 1, {"lanes", "damps_implicitly"}),
    "implicitfast": (1, 1, {"lanes", "damps_implicitly"}),
    "discrete": (1, 1, {"lanes", "damps_implicitly"}),
    "implicit_midpoint": (2, 1, {"solves_stages"}),
    "gauss_legendre_4": (4, 2, {"solves_stages"}),
}


def said(stepping) -> tuple:
    """Order, stages, and the names of the other fields that hold."""
    return (
        stepping.order,
        stepping.stages,
        {name for name, kind in FIELDS.items() if kind is bool and getattr(stepping, name)},
    )


def test_methods_say_what_they_can():
    assert {name: said(stepping) for name, stepping in METHODS.items()} == KNOWN
    assert all(method_named(name) is stepping for name, stepping in METHODS.items())
    assert all(stepping.loop.startswith("run_") for stepping in METHODS.values())


@pytest.mark.parametrize("name", METHODS)
def test_what_a_method_says_is_so(name):
    stepping, damped = METHODS[name], dataclasses.replace(tmt.ARM, damping=(1.0, 2.0, 3.0))
    if not stepping.solves_stages:
        assert stepping.stages == source.lanes_source(tmt.ARM, stepping).count("= stage_")
    slopes = [stepping.slope(damped, BENT.tolist(), [1.0] * 3, [0.0] * 3, dt) for dt in (0.0, 0.1)]
    assert (slopes[0] != slopes[1]) == stepping.damps_implicitly
    if not stepping.lanes:
        with pytest.raises(ValueError, match="has no lanes"):
            kernels.lane_stepper(tmt.ARM, name)


def test_nothing_in_tmt_asks_of_what_kind_a_method_is():
    kinds = {kind.__name__ for stepping in METHODS.values() for kind in type(stepping).__mro__} - {"object"}
    assert "RungeKutta" in kinds and "Method" in kinds
    for path in Path(tmt.__file__).parent.glob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, (ast.Call, ast.Compare)):
                asked = {name.id for name in ast.walk(node) if isinstance(name, ast.Name)}
                assert not (asked & {"isinstance", "issubclass", "type"} and asked & kinds), (
                    f"{path.name}:{node.lineno}"
                )


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
        for part in {"slope", "step", "attempt", "start", "newton", "finish", "looped", *FIELDS} - {*lacking}:
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
    lanes = tmt.simulate(q, qd, tau, 0.01, 20, "mine", form="straight_line_lanes")
    assert np.array_equal(lanes.q, mine.q) and np.array_equal(lanes.qd, mine.qd)
    with pytest.raises(ValueError, match="'mine' has a fixed step and takes no tolerance"):
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine", tolerance=1e-6)


@pytest.mark.parametrize("name", METHODS)
def test_what_an_object_of_no_known_kind_says_counts(name, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", Talking(name))
    mine = method_named("mine")
    assert said(mine) == KNOWN[name]
    assert source.run_source(tmt.ARM, mine) == source.run_source(tmt.ARM, METHODS[name])


@dataclasses.dataclass(frozen=True)
class Longer(RungeKutta):
    """A step that is another than the tableau says."""

    def step(self, slope, q, qd, dt):
        return super().step(slope, q, qd, 2.0 * dt)


def test_another_step_is_not_followed_by_the_loop_of_the_tableau(monkeypatch):
    rk4 = METHODS["rk4"]
    monkeypatch.setitem(METHODS, "longer", Longer(rk4.order, rk4.A, rk4.b, rk4.c))
    expected = tmt.simulate(BENT, REST, REST, 0.02, 10).q
    assert rk4.loop and not METHODS["longer"].loop
    assert np.allclose(tmt.simulate(BENT, REST, REST, 0.01, 10, "longer").q, expected, rtol=0, atol=1e-12)
    monkeypatch.setattr(kernels, "LONGEST", 0)
    with pytest.raises(ValueError, match="'longer' has no loop"):
        tmt.simulate(BENT, REST, REST, 0.01, 10, "longer")


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
    "own, says",
    [
        ("no method", "METHODS['mine'] is 'no method'; a hashable method with a slope and a step is expected"),
        (None, "a hashable method with a slope and a step is expected"),
        (Unhashable(), "a hashable method with a slope and a step is expected"),
        (Method(), "a hashable method with a slope and a step is expected"),
        (Midpoint, "where True or False is expected"),
        (Changed(adaptive="yes"), "its adaptive is 'yes', where True or False is expected"),
        (Changed(lanes=1), "its lanes is 1, where True or False is expected"),
        (Changed(order=0), "its order is 0, where a whole number of at least 1 is expected"),
        (Changed(order=True), "its order is True, where a whole number"),
        (Changed(stages=1.5), "its stages is 1.5, where a whole number"),
        (Changed(adaptive=True), "its adaptive is True, but it has no attempt"),
        (Changed(loop="run_tableau"), "its loop is run_tableau, but it has no looped"),
        (Changed(loop=True), "its loop is True, where a name is expected"),
        (Talking("implicit_midpoint", "newton"), "its solves_stages is True, but it has no newton"),
        (Talking("implicit_midpoint", "stages"), "does not say how many they are"),
        (Failing(), "its stages cannot be counted, as its step of one hinge fails: RuntimeError"),
    ],
)
def test_what_is_no_method_is_refused(own, says, monkeypatch):
    monkeypatch.setitem(METHODS, "mine", own)
    with pytest.raises(ValueError) as error:
        tmt.simulate(BENT, REST, REST, 0.1, 1, "mine")
    message = str(error.value)
    assert message.startswith("METHODS['mine'] is ") and says in message and "\n" not in message


def test_a_method_that_is_replaced_is_used_at_once(monkeypatch):
    before, euler = (tmt.simulate(BENT, REST, REST, 0.01, 5, name).q for name in ("rk4", "semi_implicit_euler"))
    monkeypatch.setitem(METHODS, "rk4", METHODS["semi_implicit_euler"])
    assert np.array_equal(tmt.simulate(BENT, REST, REST, 0.01, 5, "rk4").q, euler)
    for made in (kernels.slope_source, kernels.lane_stepper):
        assert made(tmt.ARM, "rk4") == made(tmt.ARM, "semi_implicit_euler")
    monkeypatch.undo()
    assert np.array_equal(tmt.simulate(BENT, REST, REST, 0.01, 5).q, before) and not np.array_equal(before, euler)
    monkeypatch.setitem(METHODS, "rk4", "no method")
    with pytest.raises(ValueError, match=r"METHODS\['rk4'\] is 'no method'"):
        tmt.simulate(BENT, REST, REST, 0.01, 5)
