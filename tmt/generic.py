"""The composite form as one compiled loop for any tree: nothing to trace and compile for a new model, but slower code.

Straight-line code grows with the number of hinges, and so does the time to compile it; for large trees this loop is used.
It does what composite.py says; the loops themselves are in loops.py.
"""

from collections.abc import Callable
from functools import lru_cache, partial
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

from .composite import carried_by_joint
from .coordinates import KINDS


class Arrays(NamedTuple):
    """A Tree as contiguous arrays, its masses handed inward."""

    kind: np.ndarray  # (n,) 0 hinge, 1 slide, 2 ball
    parent: np.ndarray  # (n,) int
    at: np.ndarray  # (n + 1,) where each joint begins in q
    by: np.ndarray  # (n + 1,) where each joint begins in qd
    before: np.ndarray  # (nv,) the speed before each on its path to the world, or -1
    offset: np.ndarray  # (n, 3)
    axis: np.ndarray  # (nv, 3)
    mass: np.ndarray  # (n,)
    moment: np.ndarray  # (n, 3)
    second: np.ndarray  # (n, 3, 3)
    damping: np.ndarray  # (nv,)
    armature: np.ndarray  # (nv,)
    stiffness: np.ndarray  # (n,)
    rest: np.ndarray  # (nq,)
    reference: np.ndarray  # (n,)
    gravity: np.ndarray  # (3,)
    position_gain: np.ndarray  # (nv, nv), or (0, 0) where there is none
    speed_gain: np.ndarray


@lru_cache(maxsize=64)
def arrays(tree) -> Arrays:
    """The Tree as arrays."""
    carried, joints = [d.rounded(float) for d in carried_by_joint(tree)], tree.coordinates.joints
    before = [v - 1 for v in range(len(tree.axis))]
    for parent, joint in zip(tree.parent, joints):
        before[joint.qd.start] = joints[parent].qd.stop - 1 if parent >= 0 else -1
    return Arrays(
        np.array([tuple(KINDS).index(kind) for kind in tree.kind]),
        np.array(tree.parent),
        np.array([*(joint.q.start for joint in joints), tree.coordinates.nq]),
        np.array([*(joint.qd.start for joint in joints), tree.coordinates.nv]),
        np.array(before),
        np.array(tree.offset),
        np.array(tree.axis),
        np.array([d.mass for d in carried], dtype=float),
        np.array([list(d.moment) for d in carried]),
        np.array([[list(row) for row in d.second] for d in carried]),
        *(
            np.array(getattr(tree, name))
            for name in ("damping", "armature", "stiffness", "rest", "reference", "gravity")
        ),
        *(matrix(gain) for gain in (tree.position_gain, tree.speed_gain)),
    )


def matrix(rows) -> np.ndarray:
    """Rows as an array of two dimensions, whatever their number."""
    return np.array(rows, dtype=float).reshape(len(rows), len(rows))


def compiled():
    """The module of compiled evaluations; imported when it is first asked for, as numba takes its time."""
    from . import loop_calls

    return loop_calls


def stepper(tree, stepping) -> Callable:
    """run(q, qd, tau, dt, ended) of a Tree and a method that has `loop`, as in kernels.stepper."""
    from . import loop_runs, loop_stages

    loop = getattr(loop_stages if stepping.solves_stages else loop_runs, stepping.loop)
    run = partial(loop, arrays(tree), *stepping.looped(tree))
    # of no run: compiled for these types and then for no others, which it would take as they are (whole numbers, say)
    nothing = (
        np.empty((0, 1, tree.coordinates.nq)),
        np.empty((0, 1, tree.coordinates.nv)),
        np.empty((0, len(tree.axis))),
    )
    run(*nothing, 0.0, *([1.0] if stepping.adaptive else []), np.empty(0, np.int8))
    loop.disable_compile()
    return run


def evaluator(tree, dynamics: bool) -> SimpleNamespace:
    """each, lanes, chain and rate of a Tree, as in kernels.evaluator; dynamics: of qdd, else of Mbar and h."""
    loops, numbers = compiled(), arrays(tree)
    nq, nv = tree.coordinates.nq, tree.coordinates.nv
    m = nv if dynamics else nv * (nv + 3) // 2
    sizes = nq, nv, nv, m
    loops.each(numbers, dynamics, *(np.empty((0, size)) for size in sizes))
    loops.lanes(numbers, dynamics, *(np.empty((size, 0)) for size in sizes))
    loops.chain(numbers, dynamics, m, np.array(tree.zero), np.zeros(nv), np.zeros(nv), 0)
    found = {name: partial(getattr(loops, name), numbers, dynamics) for name in ("each", "lanes")}
    found["chain"] = partial(loops.chain, numbers, dynamics, m)
    used = [loops.each, loops.lanes, loops.chain]
    if dynamics:
        loops.rate(numbers, np.array([*tree.zero, *[0.0] * nv]), np.zeros(nv))
        found["rate"] = partial(loops.rate, numbers)
        used.append(loops.rate)
    for loop in used:
        loop.disable_compile()
    return SimpleNamespace(**found)
