"""Traced and compiled code: the same numbers as the method, kept where it should be."""

import math
import stat

import numpy as np
import pytest
from trees import random_tree

import tmt
from tmt import kernels, method
from tmt.methods import METHODS
from tmt.trace import Tape


def python_function(text, name):
    scope = {"sin": math.sin, "cos": math.cos}
    exec(text, scope)
    return scope[name]


def test_zeros_and_ones_disappear():
    tape = Tape()
    x, y = tape.inputs("x", "y")
    value = (x * 1.0 + 0.0 * y) - (y - y) + (x + y) * (y + x) / 1.0
    text, operations = tape.function("f", [x, y], [value, 2.0 * 3.0])
    assert operations == 3  # x + y once, its square, the sum
    assert python_function(text, "f")(2.0, 3.0) == (27.0, 6.0)


def test_subtraction_and_division_keep_their_order():
    tape = Tape()
    x, y = tape.inputs("x", "y")
    text, _ = tape.function("f", [x, y], [x - y, y - x, x / y, y / x, 1.0 - x, 1.0 / x])
    assert python_function(text, "f")(2.0, 4.0) == (-2.0, 2.0, 0.5, 2.0, -1.0, 0.5)


@pytest.mark.parametrize("damping", [0.0, 1.0])
def test_traced_acceleration_is_the_method(rng, damping):
    for tree in (tmt.ARM, random_tree(rng, bodies=3, damping=damping)):
        n = len(tree.parent)
        acceleration = python_function(kernels.acceleration_source(tree)[0], "acceleration")
        q, qd, tau = rng.uniform(-3, 3, (3, n)).tolist()
        expected = np.array(method.acceleration(tree, q, qd, tau), dtype=float)
        assert np.abs(expected).max() > 0.1
        assert np.allclose(acceleration(*q, *qd, *tau), expected, rtol=1e-12, atol=1e-12)


def test_the_arm_folds_to_fewer_operations():
    _, operations = kernels.acceleration_source(tmt.ARM)
    assert 100 < operations < 600


def test_compiled_loop_is_the_step_in_python(rng):
    q, qd, tau = rng.uniform(-2, 2, (3, 3))
    _, path_q, path_qd = tmt.simulate(q, qd, tau, 0.01, 5)
    state = q.tolist(), qd.tolist()
    for k in range(1, 6):
        state = METHODS["rk4"].step(lambda q, qd: method.acceleration(tmt.ARM, q, qd, tau.tolist()), *state, 0.01)
        assert np.allclose(state, [path_q[k], path_qd[k]], rtol=0, atol=1e-12)


def test_generated_code_goes_to_the_cache_folder(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "new" / "cache"))
    assert kernels.load("kept = CACHE\n").kept is True
    (file,) = (tmp_path / "new" / "cache").glob("kernel_*.py")
    assert file.read_text() == "kept = True\n"


def test_a_damaged_cache_file_is_written_anew(tmp_path, monkeypatch):
    monkeypatch.setenv("TMT_CACHE", str(tmp_path))
    assert kernels.load("value = 1\n").value == 1
    (file,) = tmp_path.glob("kernel_*.py")
    file.write_text("value = 2\n")
    assert kernels.load("value = 1\n").value == 1


def test_a_folder_that_cannot_be_written_only_costs_time(tmp_path, monkeypatch):
    blocked = tmp_path / "file"
    blocked.write_text("")
    monkeypatch.setenv("TMT_CACHE", str(blocked / "cache"))
    assert kernels.load("value = CACHE\n").value is False
    read_only = tmp_path / "read_only"
    read_only.mkdir()
    read_only.chmod(stat.S_IRUSR | stat.S_IXUSR)
    monkeypatch.setenv("TMT_CACHE", str(read_only))
    assert kernels.load("value = 3\n").value == 3
