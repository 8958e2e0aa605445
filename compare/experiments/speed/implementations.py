"""The implementations of the dynamics in tmt, each ready to be timed: from plain Python to several states side by side."""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

import tmt
from tmt import literal
from tmt.compiled import evaluator, runner
from tmt.compiled.cores import cores
from tmt.equations import method

MOST_STEPS, MOST_NUMBERS = 100_000, 10_000_000  # of a timed run; of its results
IN_PYTHON = 12  # nv up to which the literal form is timed
FORWARD, MASS_MATRIX, RK4_STEP = "forward_dynamics", "mass_matrix", "rk4_step"
NAMES_IN_TMT = {FORWARD: "acceleration", "mass_matrix_and_bias": "mass_matrix_and_bias"}  # of tmt.compiled
CALLED, MASS_CALLED = "tmt.acceleration, called from Python", "tmt.mass_matrix, called from Python"
WAITING, EACH, IN_LANES = "compiled, each waits for the last", "compiled", "compiled, side by side"


def of_one_state(tree: tmt.Tree, state: list[np.ndarray]) -> Iterator[tuple]:
    """(quantity, implementation, loop(count)) of tmt at one state."""
    (q, qd, tau), n = state, len(tree.axis)
    run, most = runner(tree, "rk4"), min(MOST_STEPS, MOST_NUMBERS // n)
    paths = [np.zeros((1, most + 1, len(part))) for part in (q, qd)]
    paths[0][0, 0], paths[1][0, 0] = q, qd

    def steps(count):
        count = min(count, most)
        run(*(path[:, : count + 1].copy() for path in paths), tau[None], 1e-4)

    if n <= IN_PYTHON:
        yield FORWARD, "literal, Python floats", calling(method.acceleration, tree, *(a.tolist() for a in state))
    tmt.prepare(tree)
    yield FORWARD, CALLED, calling(tmt.acceleration, q, qd, tau, tree)
    yield MASS_MATRIX, MASS_CALLED, calling(tmt.mass_matrix, q, tree)
    for quantity, name in NAMES_IN_TMT.items():
        chain = evaluator(tree, name).chain
        yield quantity, WAITING, lambda count, chain=chain: chain(q, qd, tau, count)
    yield RK4_STEP, EACH, steps


def calling(function: Callable, *arguments) -> Callable:
    """loop(count): the function called count times from Python."""

    def loop(count):
        for _ in range(count):
            function(*arguments)

    return loop


def of_many_states(tree: tmt.Tree, states: Sequence[np.ndarray]) -> dict:
    """{(quantity, implementation, states, threads): run} for many states, (N, nq and nv); nothing for one state."""
    q, qd, tau = (np.ascontiguousarray(a) for a in states)
    count, n = qd.shape
    runs = {}
    if count == 1:
        return runs
    for quantity, name in NAMES_IN_TMT.items():
        compiled = evaluator(tree, name)
        out = np.ones((count, compiled.size))
        wide = [np.ascontiguousarray(a.T) for a in (q, qd, tau, out)]
        runs[quantity, EACH, count, 1] = lambda compiled=compiled, out=out: compiled.each(q, qd, tau, out)
        runs[quantity, IN_LANES, count, 1] = lambda compiled=compiled, wide=wide: compiled.lanes(*wide)
    runs[FORWARD, CALLED, count, cores()] = lambda: tmt.acceleration(q, qd, tau, tree)
    if count <= 1000 and n <= IN_PYTHON:
        runs[FORWARD, "literal, NumPy arrays", count, 1] = lambda: literal.acceleration(q, qd, tau, tree)
    paths = [np.zeros((count, 2, part.shape[1])) for part in (q, qd)]
    for path, part in zip(paths, (q, qd)):
        path[:, 0] = part
    run = runner(tree, "rk4")
    runs[RK4_STEP, IN_LANES, count, cores()] = lambda: run(*paths, tau, 1e-3)
    return runs
