"""The ways in which tmt evaluates the dynamics, each ready to be timed: from plain Python to lanes in two threads."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import tmt
from tmt import answers, generic, kernels, literal, loop_trees
from tmt.compiled.cores import cores
from tmt.equations import method
from tmt.methods import METHODS

from .affordable import MOST_RESULTS, literal_is_compiled

MOST_CALLS = 100_000  # of the same in a call that is timed
OFTEN = 1e12  # states: after so many questions any code that is faster has been got
IN_PYTHON = 12  # up to which the literal form is timed in Python
# what is evaluated
FORWARD, TERMS, MASS_MATRIX, RK4_STEP = "forward_dynamics", "mass_matrix_and_bias", "mass_matrix", "rk4_step"
LOOP, LOOP_IN_LANES = "generic compiled loop", "generic compiled loop, lanes"
CALLED, MASS_CALLED = "tmt.acceleration, called from Python", "tmt.mass_matrix, called from Python"
WAITING, EACH, IN_LANES = "traced kernel, each waits for the last", "traced kernel", "lanes"


def of_one_state(tree: tmt.Tree, state: list[np.ndarray]) -> Iterator[tuple]:
    """(quantity, implementation, loop(count)) of tmt at one state, each loop compiled but for the plain floats."""
    (q, qd, tau), n = state, len(tree.axis)
    floats = [a.tolist() for a in state]
    arrays, out, M, h = loop_trees.arrays(tree), np.empty(n), np.empty(n * n), np.empty(n)
    run, most = kernels.stepper(tree, "rk4"), min(MOST_CALLS, MOST_RESULTS // n)
    paths = [np.zeros((1, most + 1, len(part))) for part in (q, qd)]
    paths[0][0, 0], paths[1][0, 0] = q, qd

    def plain(count):
        for _ in range(count):
            method.acceleration(tree, *floats)

    def steps(count):
        count = min(count, most)
        run(*(path[:, : count + 1].copy() for path in paths), tau[None], 1e-4)

    if n <= IN_PYTHON:
        yield FORWARD, "literal, Python floats", plain
    answers.remembered(tree).get_loops()
    yield FORWARD, CALLED, calling(tmt.acceleration, q, qd, tau, tree)
    yield MASS_MATRIX, MASS_CALLED, calling(tmt.mass_matrix, q, tree)
    loops = generic.compiled()
    yield FORWARD, LOOP, lambda count: loops.repeat_forward_dynamics(arrays, q, qd, tau, out, count)
    yield TERMS, LOOP, lambda count: loops.repeat_mass_matrix_and_bias(arrays, q, qd, M, h, count)
    if not kernels.is_evaluated_straight(tree):
        yield RK4_STEP, LOOP, steps
        return
    forward, terms = kernels.evaluator(tree, FORWARD), kernels.evaluator(tree, TERMS)
    if literal_is_compiled(tree):
        as_stated = kernels.evaluator(tree, FORWARD, method.mass_matrix_and_bias, "library_sincos")
        library = kernels.evaluator(tree, FORWARD, sine="library_sincos")
        yield FORWARD, "literal, traced, library's sine", lambda count: as_stated.chain(q, qd, tau, count)
        yield FORWARD, "composite, traced, library's sine", lambda count: library.chain(q, qd, tau, count)
    yield FORWARD, WAITING, lambda count: forward.chain(q, qd, tau, count)
    yield TERMS, WAITING, lambda count: terms.chain(q, qd, tau, count)
    yield RK4_STEP, EACH, steps


def calling(function: Callable, *given) -> Callable:
    """loop(count): a function called so many times from Python."""

    def loop(count):
        for _ in range(count):
            function(*given)

    return loop


def of_many_states(tree: tmt.Tree, states: Sequence[np.ndarray], pool: ThreadPoolExecutor) -> dict:
    """{(quantity, implementation, states, threads): run} for many states, (N, nq and nv); memory is bounded by them."""
    q, qd, tau = (np.ascontiguousarray(a) for a in states)
    count, n = qd.shape
    runs = {}
    if count > 1:
        answers.remembered(tree).asked[FORWARD] = OFTEN  # timed is the code that answers in the end
        runs[FORWARD, CALLED, count, cores()] = lambda: tmt.acceleration(q, qd, tau, tree)
    if 1 < count <= 1000:
        loops, numbers, slots = (
            generic.compiled(),
            loop_trees.arrays(tree),
            [np.ascontiguousarray(a.T) for a in (q, qd, tau)],
        )
        found = np.empty((n, count))
        loops.lanes(numbers, True, *slots, found)  # it may be compiled, which is not timed
        runs[FORWARD, LOOP_IN_LANES, count, 1] = lambda: loops.lanes(numbers, True, *slots, found)
    if not kernels.is_evaluated_straight(tree):
        return runs
    for quantity, columns in ((FORWARD, n), (TERMS, n * (n + 3) // 2)):
        compiled, out = kernels.evaluator(tree, quantity), np.ones((count, columns))
        wide = [np.ascontiguousarray(a.T) for a in (q, qd, tau, out)]
        halves = [[np.ascontiguousarray(part) for part in np.array_split(a, 2, axis=1)] for a in wide]

        def both(compiled=compiled, halves=halves):
            list(pool.map(compiled.lanes, *halves))

        runs[quantity, IN_LANES, count, 1] = lambda compiled=compiled, wide=wide: compiled.lanes(*wide)
        if count > 1:
            runs[quantity, EACH, count, 1] = lambda compiled=compiled, out=out: compiled.each(q, qd, tau, out)
            runs[quantity, IN_LANES, count, 2] = both
    if count == 1:  # a call from Python for one state: what it costs is the call
        return runs
    if count <= 1000 and n <= IN_PYTHON:
        runs[FORWARD, "literal, NumPy arrays", count, 1] = lambda: literal.acceleration(q, qd, tau, tree)
    if not kernels.is_traced(tree, METHODS["rk4"]):
        return runs
    in_lanes = count // kernels.LANES * kernels.LANES
    paths = [np.zeros((in_lanes, 2, part.shape[1])) for part in (q, qd)]
    for path, part in zip(paths, (q, qd)):
        path[:, 0] = part[:in_lanes]
    step, step_lanes = kernels.stepper(tree, "rk4"), kernels.lane_stepper(tree, "rk4")
    runs[RK4_STEP, EACH, count, 1] = lambda: step(*paths, tau[:in_lanes], 1e-3)
    runs[RK4_STEP, IN_LANES, count, 1] = lambda: step_lanes(*paths, tau[:in_lanes], 1e-3)
    return runs
