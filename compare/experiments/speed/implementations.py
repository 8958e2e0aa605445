"""The implementations of forward dynamics whose growth with the joints is measured: those of tmt, MuJoCo's calls, and others."""

import json
import os
import re
import subprocess
import sys
import time
from collections.abc import Callable, Sequence
from functools import cache, partial
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

import tmt
from tmt import generic, kernels, loop_trees
from tmt.cache import executed, load
from tmt.equations import composite, method
from tmt.source import LANES, evaluator_source

from ...case import SEED
from ...engines.mujoco import engine, read
from ...engines.mujoco.dynamics import MujocoDynamics
from ...engines.pinocchio import PinocchioCalls
from ...robots import Robot
from ...robots.chain import chain
from . import peers
from .evaluations import EQUAL, WHOLE
from .operations import of_source, operations_of
from .ways import FORWARD

ANGLES_AT_ONCE = 16_384  # angles of the states that one call evaluates: they stay in the caches
IN_BATCH = 32  # states of a batch of MuJoCo's
FEW_STATES = 2  # at which accelerations are compared before they are timed
COLD_START = "from compare.experiments.speed.implementations import compilation; compilation()"


class Chain(NamedTuple):
    """A chain of n hinges, and what its implementations are asked."""

    n: int
    mjcf: str
    tree: tmt.Tree  # as it is read from that text
    dynamics: MujocoDynamics  # of the same text
    states: tuple[np.ndarray, ...]  # q, qd, tau, (states, n) each; rad, rad/s, N m
    most: float = np.inf  # operations of straight-line code that is compiled
    cold: bool = False  # whether it is measured what compilation takes


class Made(NamedTuple):
    """An implementation that is made for a chain: run(times) evaluates so many states so many times."""

    run: Callable[[int], object]
    states: int = 1
    compile_s: float | None = None  # processor's seconds from source to code; None: none, or not measured
    operations: int | None = None  # of one state, of floating-point numbers; None: not known


class Implementation(NamedTuple):
    """One way to the accelerations of a chain."""

    name: str  # in growth.csv
    label: str  # in words
    unavailable: Callable[[], str | None]  # why it cannot take part here, or None
    make: Callable[[Chain], Made | str]  # for a chain; or why that is not worth it


def chain_of(n: int, **limits) -> Chain:
    """A chain, and random states of it."""
    text = chain(n)
    reading = read(text)
    robot = Robot(f"chain of {n}", Path("chain.xml"), reading.tree, {}, ())
    count = max(LANES, ANGLES_AT_ONCE // n // LANES * LANES)
    states = np.random.default_rng([SEED, n]).uniform(-3.0, 3.0, (3, count, n))
    return Chain(n, text, reading.tree, engine(reading).of(robot.case()), tuple(states), **limits)


def again_and_again(evaluate: Callable, arguments: Sequence, times: int) -> None:
    """The same call so many times."""
    for _ in range(times):
        evaluate(*arguments)


def literal(of: Chain) -> Made:
    """The method as it stands, on Python's floats."""
    run = partial(again_and_again, method.acceleration, (of.tree, *(array[0].tolist() for array in of.states)))
    if not kernels.is_evaluated_straight(of.tree):
        return Made(run)
    text = kernels.slope_source(of.tree, "rk4", method.mass_matrix_and_bias).text
    count, _ = of_source(text, "slope", [*of.tree.zero, *[0.1] * (2 * of.n), 0.0])
    return Made(run, operations=count)


def straight_line_of(of: Chain) -> Made | str:
    """Traced code of the composite form, one state at a time: from the cache folder, or compiled here and now."""
    count = operations_of(of.tree).get("straight_line")
    if count is None:
        return "it has so many lines that a loop takes its place"
    if count > of.most:
        return f"it has more than {of.most:,.0f} operations; `speed --growth` compiles it, unless it is to be quick"
    begin = time.process_time()
    text = one_at_a_time(evaluator_source(of.tree, FORWARD, composite.mass_matrix_and_bias, "sincos"))
    name, in_memory = f"chain_of_{of.n}", text.replace("CACHE", "False")
    each = (executed(name, in_memory, name) if of.cold else load(text)).each
    taken = time.process_time() - begin if of.cold else None
    arrays = [*of.states, np.empty_like(of.states[0])]
    return Made(partial(again_and_again, each, arrays), len(arrays[0]), taken, count)


def one_at_a_time(text: str) -> str:
    """Of the source of an evaluator what one state at a time needs: without its other loops."""
    head, *functions = re.split(r"\n\n+(?=@njit)", text)
    others = re.compile(r"^def (chain|lanes|rate|moving)\(", re.MULTILINE)
    return "\n\n\n".join([head, *(function for function in functions if not others.search(function))])


def loop(of: Chain, lanes: bool = False) -> Made:
    """The loop over any tree: one state at a time, or eight side by side."""
    arrays = [np.array(array.T if lanes else array, order="C") for array in (*of.states, of.states[0])]
    evaluate = generic.compiled().lanes if lanes else generic.compiled().each
    run = partial(again_and_again, evaluate, (loop_trees.arrays(of.tree), True, *arrays))
    taken = cold_start()["loop_lanes" if lanes else "loop"] if of.cold else None
    return Made(run, len(of.states[0]), taken, operations_of(of.tree)["loop"])


@cache
def cold_start() -> dict[str, float]:
    """Processor's seconds that the loops take to compile, by their names: in a process of its own, with an empty cache."""
    with TemporaryDirectory() as folder:
        environment = os.environ | {"TMT_CACHE": folder}
        run = subprocess.run(
            [sys.executable, "-c", COLD_START], env=environment, capture_output=True, text=True, check=True
        )
    return json.loads(run.stdout)


def compilation() -> None:
    """Print what compiling the loops takes in this process, the second after the first."""
    from numba import njit

    njit("f8(f8)")(lambda x: x)  # what numba itself takes to begin
    loops, numbers, taken = generic.compiled(), loop_trees.arrays(tmt.ARM), {}
    for name, function, shape in (("loop", loops.each, (0, 3)), ("loop_lanes", loops.lanes, (3, 0))):
        begin = time.process_time()
        function(numbers, True, *(np.empty(shape) for _ in range(4)))
        taken[name] = time.process_time() - begin
    print(json.dumps(taken))


def of_mujoco(way: str, of: Chain) -> Made:
    """One of MuJoCo's ways, its calls in a compiled loop."""
    from ...engines.mujoco.calls import MinimalCalls  # here, for numba takes its time

    _, run = MinimalCalls(of.dynamics).loops(*(array[0] for array in of.states))[way]
    return Made(run)


def without_library() -> str | None:
    """Why MuJoCo's calls cannot be timed here, or None."""
    from ...engines.mujoco.calls import MinimalCalls

    return MinimalCalls.unavailable()


def mujoco_batch(of: Chain) -> Made:
    """mj_forward of many states by MuJoCo's own batches, on one thread."""
    from ...engines.mujoco.batch import BatchedCalls

    return Made(BatchedCalls(of.dynamics, *(array[:IN_BATCH] for array in of.states)).forward_loop(), IN_BATCH)


def without_batch() -> str | None:
    """Why MuJoCo has no batches here, or None."""
    from ...engines.mujoco.batch import BatchedCalls

    return BatchedCalls.unavailable()


def pinocchio_aba(of: Chain) -> Made | str:
    """Pinocchio's aba, if it finds the accelerations of tmt."""
    calls = PinocchioCalls(of.tree)
    differs = peers.differs_in_words(peers.difference(calls, [array[:FEW_STATES] for array in of.states]))
    return differs or Made(calls.aba_loop(*(array[0] for array in of.states)))


def always() -> None:
    """Nothing keeps it from taking part."""


IMPLEMENTATIONS = (
    Implementation("literal", "the literal form in Python", always, literal),
    Implementation("mj_forward", "mj_forward", without_library, partial(of_mujoco, WHOLE)),
    Implementation("mujoco_equal_work", "MuJoCo's equal work", without_library, partial(of_mujoco, EQUAL)),
    Implementation("straight_line", "straight-line code", always, straight_line_of),
    Implementation("loop", "the loop", always, loop),
    Implementation("loop_lanes", "the loop in lanes", always, partial(loop, lanes=True)),
    Implementation("mujoco_batch", "MuJoCo's batch", without_batch, mujoco_batch),
    Implementation("pinocchio_aba", "Pinocchio's aba called from Python", PinocchioCalls.unavailable, pinocchio_aba),
)
