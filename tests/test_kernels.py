"""Traced and compiled code: the same numbers as the method, kept where it should be."""

import dataclasses
import math
import re

import numpy as np
import pytest
from cache_folder import new_folder as new_folder
from trees import random_tree

import tmt
from compare.judge.scale import EPS, FACTOR, bias_scale
from compare.judge.timing import vectors
from tmt import kernels
from tmt.compiled.trace import Tape
from tmt.equations import composite, method
from tmt.methods import METHODS, one_step
from tmt.source import evaluator_source, lanes_source


def python_function(text, name):
    scope = {"sincos": lambda x: (math.sin(x), math.cos(x)), "fma": lambda a, b, c: a * b + c}
    exec(text, scope)
    return scope[name]


def test_zeros_and_ones_disappear():
    tape = Tape()
    x, y = tape.inputs("x", "y")
    value = (x * 1.0 + 0.0 * y) - (y - y) + (x + y) * (y + x) / 1.0
    text, operations, _ = tape.function("f", [x, y], [value, 2.0 * 3.0])
    assert operations == 3  # x + y once, its square, the sum
    assert python_function(text, "f")(2.0, 3.0) == (27.0, 6.0)


def test_subtraction_and_division_keep_their_order():
    tape = Tape()
    x, y = tape.inputs("x", "y")
    text, *_ = tape.function("f", [x, y], [x - y, y - x, x / y, y / x, 1.0 - x, 1.0 / x])
    assert python_function(text, "f")(2.0, 4.0) == (-2.0, 2.0, 0.5, 2.0, -1.0, 0.5)


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_traced_acceleration_is_the_method(rng, damping):
    for tree in (tmt.ARM, random_tree(rng, bodies=3, damping=damping)):
        n = len(tree.parent)
        acceleration = python_function(kernels.slope_source(tree, "rk4").text, "slope")
        q, qd, tau = rng.uniform(-3, 3, (3, n)).tolist()
        expected = np.array(method.acceleration(tree, q, qd, tau), dtype=float)
        assert np.abs(expected).max() > 0.1
        force = bias_scale(tree, np.array([q]), np.array([qd]))[0] + 10.0
        eigenvalues = np.linalg.eigvalsh(tmt.mass_matrix(q, tree))
        allowed = FACTOR * EPS * eigenvalues[-1] / eigenvalues[0] * force / eigenvalues[0]
        assert np.abs(np.array(acceleration(*q, *qd, *tau, 0.01)) - expected).max() < allowed


@pytest.mark.parametrize("name", METHODS)
def test_compiled_loop_is_the_step_in_python(rng, name):
    model = dataclasses.replace(tmt.ARM, damping=(0.1, 0.2, 0.3))
    q, qd, tau = rng.uniform(-2, 2, (3, 3))
    _, path_q, path_qd = tmt.simulate(q, qd, tau, 0.01, 5, name, model)
    state = q.tolist(), qd.tolist()
    for k in range(1, 6):
        state = one_step(METHODS[name], model, *state, tau.tolist(), 0.01)
        assert np.allclose(state, [path_q[k], path_qd[k]], rtol=0, atol=1e-12)


def test_a_tree_of_one_hinge_compiles_in_every_form(rng):
    tree = tmt.ARM.lock({"alpha": 0.1, "beta": 0.2})
    q, qd, tau = states = rng.uniform(-2, 2, (3, 40, 1))  # more than the lanes, and a rest
    columns = [np.ascontiguousarray(a.T) for a in states]
    expected = {
        "forward_dynamics": tmt.acceleration(q, qd, tau, tree),
        "mass_matrix_and_bias": np.hstack([tmt.mass_matrix(q, tree)[:, 0], tmt.bias(q, qd, tree)]),
    }
    for quantity, values in expected.items():
        compiled, rows = kernels.evaluator(tree, quantity), np.empty(values.shape)
        compiled.each(*states, rows)
        assert np.allclose(rows, values, rtol=1e-12, atol=1e-12)
        in_lanes = np.empty(values.T.shape)
        compiled.lanes(*columns, in_lanes)
        assert np.array_equal(in_lanes.T, rows)
        assert np.isfinite(compiled.chain(q[0], qd[0], tau[0], 3))
    rate = kernels.evaluator(tree, "forward_dynamics").rate
    assert np.allclose(rate(np.append(q[0], qd[0]), tau[0]), [qd[0, 0], expected["forward_dynamics"][0, 0]], rtol=1e-12)
    for name in (name for name, stepping in METHODS.items() if stepping.lanes):
        one, side_by_side = paths = np.zeros((2, 2, kernels.LANES, 4, 1))
        paths[:, :, :, 0] = [s[: kernels.LANES] for s in (q, qd)]
        kernels.stepper(tree, name)(*one, tau[: kernels.LANES], 0.01)
        kernels.lane_stepper(tree, name)(*side_by_side, tau[: kernels.LANES], 0.01)
        assert np.array_equal(one, side_by_side) and np.isfinite(one).all(), name


def test_lanes_lie_in_the_widest_registers():
    register = {"AVX-512": "zmm", "AVX2": "ymm"}.get(vectors().rpartition(" ")[2])
    if not register:
        pytest.skip(f"what the registers of {vectors()} are called is not known here")
    tree, known = tmt.ARM.lock({"alpha": 0.1, "beta": 0.2}), {"__name__": "known"}
    for text in (
        evaluator_source(tree, "mass_matrix_and_bias", composite.mass_matrix_and_bias, "sincos"),
        lanes_source(tree, METHODS["semi_implicit_euler"]),
    ):
        exec(text.replace("cache=CACHE", "cache=False"), known)  # numba keeps no text of what it reads from a cache
    for name in ("lanes", "slopes", "run"):
        (code,) = known[name].inspect_asm().values()
        fused = [line for line in code.splitlines() if line.strip().startswith(("vfmadd", "vfnmadd")) and "pd" in line]
        assert fused and all(register in line for line in fused), name


def test_the_machine_code_of_a_tree_is_read_without_that_of_another(folder):
    """It names no other generated module: numba takes functions of the same lines for one, and would keep its name."""
    for beta in (0.2, 0.3):
        kernels._evaluator.__wrapped__(
            tmt.ARM.lock({"alpha": 0.1, "beta": beta}), "mass_matrix_and_bias", composite.mass_matrix_and_bias, "sincos"
        )
    kept = list(folder.glob("__pycache__/kernel_*.nbc"))
    assert len(kept) == 6
    for path in kept:
        named = {name.decode() for name in re.findall(rb"kernel_[0-9a-f]{16}", path.read_bytes())}
        assert named == {path.name.partition(".")[0]}
