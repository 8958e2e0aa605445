"""Equations of a user's own as an engine: what they may be, how they are asked, and what is said where they are wrong."""

import dataclasses
import time
import types
from pathlib import Path

import numpy as np
import pytest
import sympy
from models import PATHS
from own_states import COORDINATES, NAMES, as_lists, asked, single, states, values
from sympy.physics.mechanics import dynamicsymbols

import tmt
from compare.case import Coordinates
from compare.engines.mujoco import read
from compare.engines.own import ARGUMENTS, Own, OwnEquations, OwnError
from compare.engines.tmt import Tmt
from compare.joint_map import joint_map
from compare.robots.arm import ARM
from compare.robots.file import robot_of

ROOT = Path(__file__).resolve().parents[2]
TWO = Coordinates(("hip", "knee"))


@pytest.mark.parametrize("make", [
    lambda: tmt.ARM, lambda: tmt,
    lambda: types.SimpleNamespace(**{n: getattr(tmt, NAMES.get(n, n)) for n in ARGUMENTS}),
    lambda: {n: single(getattr(tmt, NAMES.get(n, n))) for n in ARGUMENTS},
    lambda: {n: as_lists(getattr(tmt, NAMES.get(n, n))) for n in ARGUMENTS},
])  # fmt: skip
def test_an_object_a_module_a_mapping_and_a_tree_give_the_same(make, rng):
    state = states(rng)
    own = OwnEquations(make(), COORDINATES, joint_map(COORDINATES, None), ARM.tree)
    for name in ("mass_matrix", "bias"):
        assert own.has(name)
    for name in filter(own.has, set(ARGUMENTS) - {"jacobians"}):
        assert np.array_equal(asked(own, name, state), getattr(tmt, NAMES.get(name, name))(*state[: ARGUMENTS[name]]))
    assert own.problems == []


@pytest.mark.parametrize("batch", [(), (1,), (7,), (2, 3)])
@pytest.mark.parametrize("way", [single, lambda f: f])
def test_any_batch_of_functions_that_take_one_state_or_many(batch, way, rng):
    own = OwnEquations({n: way(getattr(tmt, NAMES.get(n, n))) for n in ARGUMENTS}, COORDINATES)
    state = rng.uniform(-2.0, 2.0, (3, *batch, 3))
    found, right = values(own, state), values(OwnEquations(tmt.ARM, COORDINATES), state)
    for name in right:
        assert found[name].shape == right[name].shape and np.array_equal(found[name], right[name]), name
    if np.prod(batch) > 1:
        assert set(own.takes_batches.values()) == {way is not single}


def test_two_states_of_two_joints_are_not_taken_for_components(rng):
    """q[0] of a (2, 2) batch is a state: shapes alone would not show it."""

    def mass_matrix(q):
        c = np.cos(q[1])
        return np.array([[3.0 + 2.0 * c, 1.0 + c], [1.0 + c, 1.0]])

    own = OwnEquations({"mass_matrix": mass_matrix}, TWO, required=())
    for count in (2, 3, 5):
        q = rng.uniform(-2, 2, (count, 2))
        assert np.array_equal(own.mass_matrix(q), [mass_matrix(one) for one in q])
    assert own.takes_batches == {"mass_matrix": False}


def test_a_batch_of_the_right_shape_with_other_values_is_not_taken(rng):
    """A norm of all states is that of none of them."""
    own = OwnEquations({"bias": lambda q, v: np.sin(q) / (1.0 + np.linalg.norm(v))}, COORDINATES, required=())
    q, v, _ = states(rng)
    right = np.sin(q) / (1.0 + np.linalg.norm(v, axis=1, keepdims=True))
    assert np.allclose(own.bias(q, v), right, rtol=1e-14, atol=0.0)
    assert own.takes_batches == {"bias": False}


# SymPy

q1, q2, u1, u2 = sympy.symbols("q1 q2 u1 u2")
M2 = sympy.Matrix([[3 + 2 * sympy.cos(q2), 1 + sympy.cos(q2)], [1 + sympy.cos(q2), 1]])
h2 = sympy.Matrix([-sympy.sin(q2) * (2 * u1 * u2 + u2**2), sympy.sin(q2) * u1**2])


def plain(q, v):
    c, s = np.cos(q[..., 1]), np.sin(q[..., 1])
    one = np.ones_like(c)
    M = np.stack([3 + 2 * c, 1 + c, 1 + c, one], -1).reshape(*c.shape, 2, 2)
    return M, np.stack([-s * (2 * v[..., 0] * v[..., 1] + v[..., 1] ** 2), s * v[..., 0] ** 2], -1)


@pytest.mark.parametrize("source", [
    {"mass_matrix": M2, "bias": h2, "symbols": [q1, q2, u1, u2]},
    types.SimpleNamespace(mass_matrix=M2, bias=h2, symbols=sympy.Matrix([q1, q2, u1, u2])),
    {"mass_matrix": (M2, [q1, q2]), "bias": (h2, (q1, q2, u1, u2))},
    {"mass_matrix": M2.tolist(), "bias": list(h2), "symbols": [[q1, q2], [u1, u2]]},
])  # fmt: skip
def test_sympy_matrices_with_their_symbols(source, rng):
    own = OwnEquations(source, TWO)
    q, v, _ = states(rng, 5, 2)
    M, h = plain(q, v)
    assert np.allclose(own.mass_matrix(q), M, atol=1e-15) and np.allclose(own.bias(q, v), h, atol=1e-14)
    assert own.mass_matrix(q[0]).shape == (2, 2) and own.takes_batches["bias"]


def test_sympy_symbols_may_be_functions_of_time(rng):
    moving = dynamicsymbols("a b")
    rates = [x.diff() for x in moving]
    changed = dict(zip((q1, q2, u1, u2), (*moving, *rates)))
    source = {"mass_matrix": M2.subs(changed), "bias": h2.subs(changed), "symbols": [*moving, *rates]}
    q, v, _ = states(rng, 5, 2)
    assert np.allclose(OwnEquations(source, TWO).bias(q, v), plain(q, v)[1], atol=1e-14)


@pytest.mark.parametrize("source, said", [
    ({"mass_matrix": M2}, "mass_matrix.*SymPy"),
    ({"mass_matrix": M2 * sympy.Symbol("m"), "symbols": [q1, q2]}, "symbol m"),
    ({"mass_matrix": M2 * u1, "symbols": [q1, q2, u1, u2]}, "u1"),
    ({"mass_matrix": M2, "symbols": [q1, q2, u1]}, "q1, q2, u1"),
    ({"mass_matrix": M2, "symbols": [q1, q1]}, "each once"),
    ({"mass_matrix": M2[:1, :], "symbols": [q1, q2]}, r"2 entries.*\(2, 2\)"),
])  # fmt: skip
def test_sympy_that_does_not_fit(source, said):
    with pytest.raises(OwnError, match=said) as error:
        OwnEquations(source, TWO, required=())
    assert "\n" not in str(error.value)


# joints

STATED = ["gamma+90deg", "-beta in deg", "alpha"]


def turned(of):
    """The arm's equations in other joints."""
    return {
        "mass_matrix": lambda q: of.own_mass_matrix(tmt.mass_matrix(of.positions(q))),
        "bias": lambda q, v: of.own_forces(tmt.bias(of.positions(q), of.speeds(v))),
        "acceleration": lambda q, v, t: of.own_forces(tmt.acceleration(of.positions(q), of.speeds(v), of.forces(t))),
        "jacobians": lambda q: tuple(of.own_forces(part) for part in tmt.jacobians(of.positions(q))),
    }


@pytest.mark.parametrize("how", ["joints", "joint_names"])
def test_joints_as_they_are_stated_or_as_the_object_names_them(how, rng):
    state, of = states(rng), joint_map(COORDINATES, STATED)
    source = turned(of) | ({"joint_names": tuple(STATED)} if how == "joint_names" else {})
    own = OwnEquations(source, COORDINATES, of if how == "joints" else None, ARM.tree)
    right = OwnEquations(tmt.ARM, COORDINATES, None, ARM.tree)
    for name in ("mass_matrix", "bias", "acceleration"):
        assert np.allclose(asked(own, name, state), asked(right, name, state), atol=1e-11), name
    for found, known in zip(own.jacobians(state[0]), right.jacobians(state[0])):
        assert np.allclose(found, known, atol=1e-14)


@pytest.mark.parametrize("source, said", [
    ({"joint_names": ["a", "b", "c"]}, "joint_names.*'a'"), ({"joint_names": 3}, "joint_names.*3"),
    ({"joint_names": "alpha"}, "joint_names.*'alpha'"),
    ({"joint_names": ["alpha", "beta"]}, "joint_names.*gamma"),
])  # fmt: skip
def test_names_that_do_not_fit(source, said):
    with pytest.raises(OwnError, match=said):
        OwnEquations({"mass_matrix": tmt.mass_matrix, "bias": tmt.bias} | source, COORDINATES)


# what is missing


def test_what_is_missing_is_made_of_what_is_there(rng):
    tree = dataclasses.replace(tmt.ARM, damping=(0.1, 0.2, 0.3), stiffness=(1.0, 0.0, 2.0), rest=(0.1, 0.0, 0.2))
    source = {"mass_matrix": lambda q: tmt.mass_matrix(q, tree), "bias": lambda q, v: tmt.bias(q, v, tree)}
    q, v, tau = states(rng)
    own = OwnEquations(source, COORDINATES, tree=tree)
    assert not own.has("acceleration") and not own.has("gravity")
    assert np.allclose(own.acceleration(q, v, tau), tmt.acceleration(q, v, tau, tree), atol=1e-11)
    assert np.allclose(own.gravity_balance(q), tmt.gravity_balance(q, tree), atol=1e-14)
    with pytest.raises(OwnError, match="energy"):
        own.energy(q, v)


def test_a_case_changes_own_equations_as_it_changes_the_others(rng):
    own, right = Own(OwnEquations(tmt.ARM, COORDINATES, tree=ARM.tree)), Tmt()
    for changes in ({}, {"gravity": False}, {"damping": 0.05}, {"posture": "bent", "locked": ("beta",)},
                    {"posture": "bent", "locked": ("alpha",), "gravity": False, "damping": 0.02}):  # fmt: skip
        case = ARM.case(**changes)
        ours, theirs = own.of(case), right.of(case)
        state = states(rng, 4, case.coordinates.nv)
        for name in ("mass_matrix", "bias", "gravity", "acceleration"):
            assert np.allclose(asked(ours, name, state), asked(theirs, name, state), atol=1e-11), (changes, name)
        if changes.keys() != {"damping"}:
            continue  # what is compiled for them takes its time
        motion, known = (d.run(*(part[:2] for part in state), 0.005, 20, "rk4") for d in (ours, theirs))
        assert np.allclose(motion.states, known.states, atol=1e-10) and list(motion.ended) == [None, None]


# motion


def test_it_runs_by_the_same_rk4_as_tmt_balls_too(rng):
    reading = read(PATHS["pendulum_ball"])
    robot = robot_of(reading, "a ball")
    own = Own(OwnEquations(reading.tree, robot.coordinates, tree=reading.tree), ("rk4_mean_speed",)).of(robot.case())
    start = robot.coordinates.random(rng, 2), *rng.normal(size=(2, 2, robot.coordinates.nv))
    for method in ("rk4", "rk4_mean_speed"):
        motion = own.run(*start, 0.01, 10, method)
        known = Tmt(("rk4_mean_speed",)).of(robot.case()).run(*start, 0.01, 10, method)
        assert np.allclose(motion.states, known.states, atol=1e-11)
        assert np.array_equal(motion.t, known.t) and motion.evaluations == known.evaluations == 2 * 10 * 4


def test_a_run_that_diverges_ends_and_its_function_is_not_asked_of_what_is_no_number():
    def bias(q, v):
        assert np.isfinite(q).all() and np.isfinite(v).all()
        return -1e3 * v[..., :1] ** 3 * np.ones(3)

    own = Own(OwnEquations({"mass_matrix": lambda q: np.eye(3), "bias": bias}, COORDINATES))
    motion = own.of(ARM.case()).run(np.zeros((2, 3)), [[0, 0, 0], [9, 0, 0]], np.zeros(3), 0.1, 20, "rk4")
    assert motion.ended[0] is None and motion.ended[1].endswith("s: a number is not finite")
    assert np.isfinite(motion.q[0]).all() and np.isnan(motion.q[1, -1]).all() and np.isfinite(motion.q[1, 0]).all()
    assert own.equations.problems == []


# time


def test_slow_functions_are_asked_of_fewer_states(rng):
    def mass_matrix(q):
        assert q.ndim == 1
        time.sleep(0.02)
        return tmt.mass_matrix(q)

    own = OwnEquations({"mass_matrix": mass_matrix, "bias": tmt.bias}, COORDINATES)
    own.try_at(*states(rng, 100))
    assert own.seconds >= 0.02 and 1 <= own.affordable(10_000, 1.0) <= 50
    assert own.affordable(10_000, 0.0) == 1 and own.affordable(3, 1e9) == 3
