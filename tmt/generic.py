"""The composite form as one compiled loop for any tree: nothing to trace and compile for a new model, but slower code.

Straight-line code grows with the number of hinges, and so does the time to compile it; for large trees this loop is used.
It does what composite.py says; the loops themselves are in loops.py.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from typing import NamedTuple

import numpy as np

from .composite import carried_by_joint


class Arrays(NamedTuple):
    """A Tree as contiguous arrays, its masses handed inward."""

    parent: np.ndarray  # (n,) int
    offset: np.ndarray  # (n, 3)
    axis: np.ndarray  # (n, 3)
    mass: np.ndarray  # (n,)
    moment: np.ndarray  # (n, 3)
    second: np.ndarray  # (n, 3, 3)
    damping: np.ndarray  # (n,)
    gravity: np.ndarray  # (3,)


@lru_cache(maxsize=64)
def arrays(tree) -> Arrays:
    """The Tree as arrays."""
    carried = [d.rounded(float) for d in carried_by_joint(tree)]
    return Arrays(
        np.array(tree.parent),
        np.array(tree.offset),
        np.array(tree.axis),
        np.array([d.mass for d in carried], dtype=float),
        np.array([list(d.moment) for d in carried]),
        np.array([[list(row) for row in d.second] for d in carried]),
        np.array(tree.damping),
        np.array(tree.gravity),
    )


def compiled():
    """The module of the compiled loops; imported when it is first asked for, as numba takes its time."""
    from . import loops

    return loops


def stepper(tree, stepping) -> Callable:
    """run(q, qd, tau, dt, ended) of a Tree and a method that has `loop`, as in kernels.stepper."""
    stages = len(stepping.b)
    A = np.array([[*row, *[0.0] * (stages - len(row))] for row in stepping.A])
    loop = compiled().run_tableau
    run = partial(loop, arrays(tree), A, np.array(stepping.b))
    # of no run: compiled for these types and then for no others, which it would take as they are (whole numbers, say)
    run(*np.empty((2, 0, 1, len(tree.parent))), np.empty((0, len(tree.parent))), 0.0, np.empty(0, np.int8))
    loop.disable_compile()
    return run
