"""Straight-line functions whose instructions are written at once: what numba makes of the same lines."""

import math

import numpy as np
import pytest

import tmt
from tmt.cache import load

LINES = """
    t1, t2 = sincos(x)
    t3 = fma(t1, y, -t2)
    t4 = sqrt(2.0 - t1) / (y - 3.0) + 1.0 / x
    t5 = arctan(t4 * t3) - 0.5 * t1
    return t3, t4, -t5,
"""
MODULE = """
from math import atan as arctan, sqrt
import numpy as np
from numba import njit
from tmt.sine import fma, sincos
from tmt.written import written

{decorator}
def inner(x, y):{lines}

{other}
def outer(x, y):
    t1, t2, t3, = inner(x * {factor}, y)
    return t1 + t2, t3 - 7.0, 0.25,

@njit("void(f8[::1], f8[::1], f8[:, ::1])", cache=CACHE, error_model="numpy")
def run(x, y, out):
    for i in range(len(x)):
        out[i, 0], out[i, 1], out[i, 2] = outer(x[i], y[i])
"""


def module(decorator, other, factor=0.7):
    return load(MODULE.format(decorator=decorator, other=other, lines=LINES, factor=factor))


def outputs(decorator, other, factor=0.7):
    run = module(decorator, other, factor).run
    x, y = np.random.default_rng(5).uniform(0.1, 2.0, (2, 50))
    out = np.empty((50, 3))
    run(x, y, out)
    return out


def test_they_have_the_bits_of_compiled_lines():
    by_numba = outputs(*['@njit(error_model="numpy")'] * 2)
    for inline in ("", ", inline=True"):
        assert np.array_equal(outputs(f"@written(3{inline})", f"@written(3{inline})"), by_numba)
    assert np.isfinite(by_numba).all() and np.ptp(by_numba[:, 0]) > 0.1


def test_functions_of_the_same_name_and_size_are_not_taken_for_each_other():
    first, second, again = (outputs("@written(3)", "@written(3)", factor) for factor in (0.7, 0.8, 0.7))
    assert np.array_equal(first, again) and not np.array_equal(first, second)


def test_the_machine_code_of_another_process_has_other_names():
    """By the module, whose name is made from its source: in a process alone they would all be told apart by a count."""
    made = [module("@written(3)", "@written(3)", factor) for factor in (0.7, 0.8)]
    for one in made:
        for function in (one.inner, one.outer):
            assert one.__name__ in function.py_func.__name__ and function.py_func.__module__ == one.__name__
    assert made[0].__name__ != made[1].__name__


def test_a_tree_is_not_followed_by_the_code_of_another():
    """Of as many speeds, in one process: a pendulum of twice the length swings slower."""

    def ends(length):
        tree = tmt.Tree(
            hinge_names=["a"], parent=[-1], offset=[(0.0, 0.0, 0.0)], axis=[(0.0, 1.0, 0.0)], damping=[0.0],
            body_names=["bob"], body_hinge=[0], mass=[1.0], com=[(0.0, 0.0, -length)], inertia=[np.eye(3) * 1e-9],
            gravity=(0.0, 0.0, -9.81),
        )  # fmt: skip
        return tmt.simulate([0.01], [0.0], [0.0], 1e-2, 50, model=tree, form="straight_line").q[-1, 0]

    for length in (1.0, 2.0, 1.5):
        assert ends(length) == pytest.approx(0.01 * math.cos(math.sqrt(9.81 / length) * 0.5), abs=1e-6)
