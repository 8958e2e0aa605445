"""Traced and compiled code: the same numbers as the method, kept where it should be."""

import dataclasses
import math
import stat

import numpy as np
import pytest
from trees import random_tree

import tmt
from compare.agreement import EPS, FACTOR, bias_scale
from tmt import cache, kernels, method
from tmt.methods import METHODS, one_step
from tmt.trace import Tape


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
        force = bias_scale(np.array([q]), np.array([qd]), tree)[0] + 10.0
        eigenvalues = np.linalg.eigvalsh(tmt.mass_matrix(q, tree))
        bar = FACTOR * EPS * eigenvalues[-1] / eigenvalues[0] * force / eigenvalues[0]
        assert np.abs(np.array(acceleration(*q, *qd, *tau, 0.01)) - expected).max() < bar


@pytest.mark.parametrize("name", METHODS)
def test_compiled_loop_is_the_step_in_python(rng, name):
    model = dataclasses.replace(tmt.ARM, damping=(0.1, 0.2, 0.3))
    q, qd, tau = rng.uniform(-2, 2, (3, 3))
    _, path_q, path_qd = tmt.simulate(q, qd, tau, 0.01, 5, name, model)
    state = q.tolist(), qd.tolist()
    for k in range(1, 6):
        state = one_step(METHODS[name], model, *state, tau.tolist(), 0.01)
        assert np.allclose(state, [path_q[k], path_qd[k]], rtol=0, atol=1e-12)


def test_generated_code_goes_to_the_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "new" / "cache"))
    assert cache.load("kept = CACHE\n").kept is True
    (file,) = (tmp_path / "new" / "cache").glob("kernel_*.py")
    assert file.read_text() == "kept = True\n"


def test_a_damaged_cache_file_is_written_anew(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    assert cache.load("value = 1\n").value == 1
    (file,) = tmp_path.glob("kernel_*.py")
    file.write_text("value = 2\n")
    assert cache.load("value = 1\n").value == 1


@pytest.mark.parametrize("suffix", ["nbi", "nbc"])
def test_damaged_machine_code_is_compiled_anew(tmp_path, monkeypatch, suffix):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    text = 'from numba import njit\n\n@njit("float64(float64)", cache=CACHE)\ndef f(x):\n    return 2.0 * x\n'
    assert cache.load(text).f(1.5) == 3.0
    damaged = list(tmp_path.glob(f"__pycache__/*.{suffix}"))
    assert damaged
    for file in damaged:
        file.write_bytes(b"junk")
    assert cache.load(text).f(1.5) == 3.0
    assert cache.load(text).f(2.5) == 5.0
    assert all(file.read_bytes() != b"junk" for file in damaged)


def test_an_empty_setting_is_no_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", "")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    assert cache.cache_folder() == tmp_path / "tmt"


def test_a_folder_that_cannot_be_written_only_costs_time(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("TMT_CACHE", str(blocked / "cache"))
    assert cache.load("value = CACHE\n").value is False
    read_only = tmp_path / "read_only"
    read_only.mkdir()
    read_only.chmod(stat.S_IRUSR | stat.S_IXUSR)
    monkeypatch.setenv("TMT_CACHE", str(read_only))
    assert cache.load("value = 3\n").value == 3
