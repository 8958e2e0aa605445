"""Equations of a user's own as an engine: what they may be, how they are asked, and what is noted where they are wrong."""

import dataclasses
import sys
import time
import types
from functools import partial

import numpy as np
import pytest
import sympy
from sympy.physics.mechanics import dynamicsymbols

import tmt
from compare.engines.own import METHOD_NAMES, QUANTITIES, Own, OwnEquations, OwnError
from compare.engines.tmt import Tmt
from compare.process.interrupt import Now
from compare.robots.arm import ARM
from compare.robots.case import Coordinates
from compare.robots.joint_map import joint_map

COORDINATES = ARM.coordinates
TWO = Coordinates(("hip", "knee"))
OF_TMT = {name: partial(getattr(tmt, method), tmt.ARM) for name, method in METHOD_NAMES.items()}
MODULE = types.ModuleType("mine")
vars(MODULE).update(OF_TMT)
q1, q2, u1, u2 = SYMBOLS = sympy.symbols("q1 q2 u1 u2")
M2 = sympy.Matrix([[3, sympy.cos(q2)], [sympy.cos(q2), 1]])
h2 = sympy.Matrix([u1 * u2, sympy.sin(q2) * u1**2])
MOVING = [*dynamicsymbols("a b"), *dynamicsymbols("a b", 1)]  # functions of time
IN_TIME = dict(zip(SYMBOLS, MOVING))


def single(function):
    """The function of one state alone: as a user writes it."""

    def of_one(*state):
        assert all(part.ndim == 1 for part in state)
        return function(*state)

    return of_one


def states(rng, count=6, n=3):
    return rng.uniform(-2.0, 2.0, (3, count, n))


def asked(own, name, state):
    return getattr(own, METHOD_NAMES[name])(*state[: QUANTITIES[name].arguments])


def of_one(name, function, coordinates=COORDINATES):
    """Own equations that have nothing but this function."""
    return OwnEquations({name: function}, coordinates, required=())


@pytest.mark.parametrize("source", [
    tmt.ARM, MODULE, types.SimpleNamespace(**OF_TMT), {name: single(function) for name, function in OF_TMT.items()},
], ids=["tree", "module", "object", "mapping"])  # fmt: skip
def test_every_form_gives_the_same_in_any_batch(source, rng):
    for batch in ((), (1,), (7,), (2, 3)):
        own = OwnEquations(source, COORDINATES, tree=ARM.tree)
        state = rng.uniform(-2.0, 2.0, (3, *batch, 3))
        for name in filter(own.has, QUANTITIES):
            found, right = asked(own, name, state), OF_TMT[name](*state[: QUANTITIES[name].arguments])
            assert np.allclose(found, right, rtol=1e-13, atol=1e-13), name
        assert own.problems == []


def test_a_function_is_called_once_at_each_state_and_with_one_state(rng):
    (q, v, _), called = states(rng), []

    def bias(q, v):
        called.append(q.tolist())
        return np.sin(q) / (1.0 + np.linalg.norm(v))

    right = np.sin(q) / (1.0 + np.linalg.norm(v, axis=1, keepdims=True))
    assert np.allclose(of_one("bias", bias).bias(q, v), right, rtol=1e-14, atol=0.0) and called == q.tolist()


@pytest.mark.parametrize("source", [
    types.SimpleNamespace(mass_matrix=M2, bias=h2, symbols=sympy.Matrix(SYMBOLS)),
    {"mass_matrix": (M2, [q1, q2]), "bias": (h2, SYMBOLS)},
    {"mass_matrix": (M2.as_immutable(), sympy.ImmutableDenseMatrix(SYMBOLS[:2])), "bias": (h2.T.as_immutable(), SYMBOLS)},
    {"mass_matrix": M2.subs(IN_TIME).tolist(), "bias": list(h2.subs(IN_TIME)), "symbols": [MOVING[:2], MOVING[2:]]},
])  # fmt: skip
def test_sympy_matrices_with_their_symbols(source, rng):
    own = OwnEquations(source, TWO)
    q, v, _ = states(rng, 5, 2)
    assert np.allclose(own.mass_matrix(q), [[[3.0, c], [c, 1.0]] for c in np.cos(q[:, 1])], atol=1e-15)
    right = [[a * b, s * a**2] for (a, b), s in zip(v, np.sin(q[:, 1]))]
    assert np.allclose(own.bias(q, v), right, atol=1e-15)


@pytest.mark.parametrize("tree", [tmt.ARM, tmt.ARM.lock({"alpha": 0.1, "beta": 0.2})])
@pytest.mark.parametrize("form", [  # as SymPy's lambdify, its matrices and lists give it
    lambda x: x[..., None], lambda x: x[None], lambda x: x[None, ..., None], lambda x: x.astype(object), sympy.Matrix,
    sympy.ImmutableDenseMatrix, lambda x: sympy.Matrix(x).tolist(), lambda x: x.T,
])  # fmt: skip
def test_a_value_may_have_further_axes_of_length_1_and_be_of_any_numbers(tree, form, rng):
    M, h = (lambda q: form(tmt.mass_matrix(tree, q))), (lambda q, v: form(tmt.bias(tree, q, v)))
    own = OwnEquations({"mass_matrix": M, "bias": h}, Coordinates(tree.joint_names))
    q, v = rng.uniform(-2.0, 2.0, (2, 7, len(tree.axis)))
    assert np.allclose(own.mass_matrix(q), tmt.mass_matrix(tree, q), rtol=1e-14, atol=1e-15)
    assert np.allclose(own.bias(q, v), tmt.bias(tree, q, v), rtol=1e-13, atol=1e-15)


class Called:
    def mass_matrix(self, q): ...


@pytest.mark.parametrize("source, said", [
    (np, "numpy has no mass_matrix"), (Called, "Called has no bias"), (tmt.ARM.lock({"beta": 0.0}), r"\(alpha, gamma\)"),
    (OF_TMT | {"joint_names": ["alpha", "beta"]}, "joint_names.*gamma"), (OF_TMT | {"joint_names": 3}, "joint_names.*3"),
    ({"mass_matrix": M2, "bias": h2}, "mass_matrix.*SymPy"), ({"mass_matrix": (M2, [q1, q1, q2]), "bias": h2}, "each once"),
    ({"mass_matrix": (M2, [q1, u1, u2]), "bias": h2}, "symbol q2"),
    ({"mass_matrix": (M2 * u2, [*SYMBOLS, *MOVING[:2]]), "bias": h2}, "depends on u2"),
    ({"mass_matrix": (M2, [q1, q2, u1]), "bias": h2}, r"4 entries.*\(3, 3\)"),
])  # fmt: skip
def test_what_is_not_there_or_does_not_fit(source, said):
    with pytest.raises(OwnError, match=said):
        OwnEquations(source, COORDINATES)


@pytest.mark.parametrize("value, said", [
    (lambda q: np.eye(2), r"\(2, 2\).*\(3, 3\).* at q = \["),
    (lambda q: np.eye(9)[None], r"shape \(1, 9, 9\)"), (lambda q: np.eye(3).ravel(), r"shape \(9,\)"),
    (lambda q: np.stack([np.eye(3)] * 3), r"shape \(3, 3, 3\)"), (lambda q: np.ma.masked_equal(np.eye(3), 1), "masked"),
    (lambda q: None, "None"), (lambda q: 1.0, r"shape \(\)"), (lambda q: [[1, 2], [3]], "real numbers"),
    (lambda q: np.eye(3) * 1j, "real numbers"), (lambda q: sys.exit(3), "SystemExit: 3"), (4.0, "4.0.*function"),
    (lambda: 0, r"TypeError.*expected mass_matrix\(q\)"), (Called.mass_matrix, "TypeError"),
    (lambda q: np.linalg.inv(np.zeros((3, 3))), r"LinAlgError: .*test_own.py, line \d+"),
])  # fmt: skip
def test_what_cannot_be_used_is_one_line(value, said, rng):
    with pytest.raises(OwnError, match=said) as error:
        OwnEquations({"mass_matrix": value, "bias": OF_TMT["bias"]}, COORDINATES).mass_matrix(states(rng)[0])
    assert "\n" not in str(error.value) and str(error.value).startswith("mass_matrix ")


@pytest.mark.parametrize("listening", [False, True])  # where the command line listens, Ctrl-C raises nothing
@pytest.mark.parametrize("raised", [KeyboardInterrupt, GeneratorExit, BaseException])
def test_whatever_is_raised_is_one_line_and_ctrl_c_interrupts(raised, listening, rng, monkeypatch):
    def mass_matrix(q):
        raise raised("no")

    monkeypatch.setattr(Now, "is_listening", listening)
    is_interrupt = raised is KeyboardInterrupt and not listening
    with pytest.raises(KeyboardInterrupt if is_interrupt else OwnError, match="no"):
        of_one("mass_matrix", mass_matrix).mass_matrix(states(rng)[0])


def raises_beyond_1(q):
    if q[0] > 1.0:
        raise ValueError("too\nfar")
    return tmt.mass_matrix(tmt.ARM, q)


def infinite_beyond_1(q):
    return np.where(q[..., 0, None, None] > 1.0, np.inf, tmt.mass_matrix(tmt.ARM, q))


@pytest.mark.parametrize("function, said", [
    (raises_beyond_1, "ValueError: too far (test_own.py, line "), (infinite_beyond_1, "is not finite"),
])  # fmt: skip
def test_states_at_which_it_raises_or_is_not_finite_are_noted(function, said, rng):
    q = states(rng)[0]
    q[:, 0] = [0.0, 0.5, 1.5, 0.0, 2.0, 0.0]
    own = of_one("mass_matrix", function)
    assert np.isfinite(own.mass_matrix(q)).all(axis=(1, 2)).tolist() == (q[:, 0] < 1.0).tolist()
    (problem,) = own.problems
    assert problem.quantity == "mass_matrix" and problem.state.startswith("q = [1.5, ")
    assert said in problem.text and problem.text.endswith(f"{problem.state}, and at 1 more state")


def test_one_that_changes_its_argument_is_handed_copies(rng):
    def bias(q, v):
        v += 1.0
        return tmt.bias(tmt.ARM, q, v - 1.0)

    q, own = states(rng)[0], of_one("bias", bias)
    before = q.copy()
    assert np.allclose(own.bias(q, q), tmt.bias(tmt.ARM, before, before), atol=1e-13) and np.array_equal(
        q, before
    )
    (problem,) = own.problems
    assert problem.quantity == "bias" and "argument qd" in problem.text


@pytest.mark.parametrize("skew, found", [(0.9e-9, 0), (1.1e-9, 1)])
def test_a_mass_matrix_that_is_not_symmetric(skew, found, rng):
    M = tmt.mass_matrix(tmt.ARM, np.ones(3))
    M[0, 1] += skew * np.abs(M).max()
    own = of_one("mass_matrix", lambda q: M)
    own.mass_matrix(states(rng)[0])
    assert len(own.problems) == found and all("symmetric" in problem.text for problem in own.problems)


def test_what_is_missing_is_made_of_what_is_there(rng):
    springs = {"stiffness": (1.0, 0.0, 2.0), "rest": (0.1, 0.0, 0.2)}
    tree = dataclasses.replace(tmt.ARM, damping=(0.1, 0.2, 0.3), **springs)
    source = {"mass_matrix": lambda q: tmt.mass_matrix(tree, q), "bias": lambda q, v: tmt.bias(tree, q, v)}
    q, v, tau = states(rng)
    own = OwnEquations(source, COORDINATES, tree=tree)
    assert not own.has("acceleration") and not own.has("gravity")
    assert np.allclose(own.acceleration(q, v, tau), tmt.acceleration(tree, q, v, tau), atol=1e-11)
    assert np.allclose(own.gravity_balance(q), tmt.gravity_balance(tree, q), atol=1e-14)
    assert np.isnan(own.acceleration(q * [np.nan, 1.0, 1.0], v, tau)).all()  # where a run has diverged
    with pytest.raises(OwnError, match="energy"):
        own.energy(q, v)
    singular = OwnEquations(source | {"mass_matrix": lambda q: np.zeros((3, 3))}, COORDINATES)
    assert np.isnan(singular.acceleration(q, v, tau)).all() and "singular" in singular.problems[0].text


@pytest.mark.parametrize("changes", [
    {"gravity": False}, {"damping": 0.05}, {"posture": "bent", "locked": ("beta",)},
    {"posture": "bent", "locked": ("alpha",), "gravity": False, "damping": 0.02},
])  # fmt: skip
def test_a_case_changes_own_equations_as_it_changes_the_others(changes, rng):
    case = ARM.case(**changes)
    ours, theirs = Own(OwnEquations(tmt.ARM, COORDINATES, tree=ARM.tree)).of(case), Tmt().of(case)
    state = states(rng, 4, case.coordinates.nv)
    for name in ("mass_matrix", "bias", "gravity", "acceleration"):
        assert np.allclose(asked(ours, name, state), asked(theirs, name, state), atol=1e-11), name


def test_a_run_that_diverges_ends_and_its_function_is_not_asked_of_what_is_no_number():
    def bias(q, v):
        assert np.isfinite(q).all() and np.isfinite(v).all()
        return -1e3 * v[..., :1] ** 3 * np.ones(3)

    own = Own(OwnEquations({"mass_matrix": lambda q: np.eye(3), "bias": bias}, COORDINATES))
    motion = own.of(ARM.case()).run(np.zeros((2, 3)), [[0, 0, 0], [9, 0, 0]], np.zeros(3), 0.1, 20, "rk4")
    assert motion.ended[0] is None and motion.ended[1].endswith("s: a number is not finite")
    assert np.isfinite(motion.q[0]).all() and np.isfinite(motion.q[1, 0]).all()
    assert np.isnan(motion.q[1, -1]).all() and own.equations.problems == []


def test_jacobians_of_joints_in_another_order_and_sense(rng):
    def jacobians(own):  # of gamma turned round, alpha and beta
        T, B = tmt.jacobians(tmt.ARM, np.array([own[1], own[2], -own[0]]))
        return T[..., [2, 0, 1]] * [-1.0, 1.0, 1.0], B[..., [2, 0, 1]] * [-1.0, 1.0, 1.0]

    joints, q = joint_map(COORDINATES, ["-gamma", "alpha", "beta"]), states(rng)[0]
    own = OwnEquations({"jacobians": jacobians}, COORDINATES, joints, required=())
    assert all(map(np.array_equal, own.jacobians(q), tmt.jacobians(tmt.ARM, q)))


def test_a_step_of_rk4_asks_four_times():
    asked = []
    own = Own(OwnEquations({"acceleration": lambda q, v, tau: asked.append(q) or tau - v}, COORDINATES))
    motion = own.of(ARM.case()).run(np.zeros(3), [1.0, 2.0, 3.0], np.ones(3), 0.1, 20, "rk4")
    assert motion.evaluations == len(asked) == 80


def test_the_time_of_a_state_is_that_of_all_functions():
    wait = lambda *state: time.sleep(0.02) or (np.eye(3) if len(state) == 1 else np.zeros(3))  # noqa: E731
    own = OwnEquations({"mass_matrix": wait, "bias": wait}, COORDINATES)
    own.try_at(np.zeros((1, 3)), np.zeros((1, 3)), np.zeros((1, 3)))
    assert 0.04 <= own.seconds < 1.0 and 1 <= own.affordable(1000, 1.0) <= 25
