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
from tmt import composite, generic, kernels, method
from tmt.cache import executed
from tmt.source import LANES, evaluator_source

from ...case import SEED
from ...engines.mujoco import engine, read
from ...engines.mujoco.dynamics import MujocoDynamics
from ...robots import Robot
from ...robots.chain import chain
from .evaluations import EQUAL, FORWARD, WHOLE

ANGLES_AT_ONCE = 32_768  # angles of the states that one call evaluates: they stay in the caches
COLD_START = "from compare.experiments.speed.implementations import compilation; compilation()"


class Chain(NamedTuple):
    """A chain of n hinges, and what its implementations are asked."""

    n: int
    mjcf: str
    tree: tmt.Tree  # as it is read from that text
    dynamics: MujocoDynamics  # of the same text
    states: tuple[np.ndarray, ...]  # q, qd, tau, (states, n) each; rad, rad/s, N m
    most: float = np.inf  # operations of straight-line code that is compiled
    cold: bool = False  # whether it is measured what the loops cost to compile


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
    state = [array[0].tolist() for array in of.states]
    operations = traced_operations(of.tree, method.mass_matrix_and_bias)
    return Made(partial(again_and_again, method.acceleration, (of.tree, *state)), operations=operations)


def straight_line(of: Chain) -> Made | str:
    """Traced code of the composite form, one state at a time, compiled here and now."""
    operations = traced_operations(of.tree)
    if operations is None:
        return "it has so many lines that a loop takes its place"
    if operations > of.most:
        return f"it has more than {of.most:,.0f} operations; `speed --growth` compiles it, unless it is to be quick"
    begin = time.process_time()
    text = one_at_a_time(evaluator_source(of.tree, FORWARD, composite.mass_matrix_and_bias, "sincos"))
    each = executed(f"chain_of_{of.n}", text.replace("CACHE", "False"), f"chain_of_{of.n}").each
    taken = time.process_time() - begin
    arrays = [*of.states, np.empty_like(of.states[0])]
    return Made(partial(again_and_again, each, arrays), len(arrays[0]), taken, operations)


def one_at_a_time(text: str) -> str:
    """Of the source of an evaluator what one state at a time needs: without its other loops."""
    head, *functions = re.split(r"\n\n+(?=@njit)", text)
    others = re.compile(r"^def (chain|lanes|rate|moving)\(", re.MULTILINE)
    return "\n\n\n".join([head, *(function for function in functions if not others.search(function))])


def traced_operations(tree: tmt.Tree, *form: Callable) -> int | None:
    """Of one evaluation as straight-line code (of another form of the dynamics); None: none is made for so many joints."""
    return kernels.slope_source(tree, "rk4", *form).operations if kernels.is_evaluated_straight(tree) else None


def loop(of: Chain) -> Made:
    """The loop over any tree, one state at a time."""
    arrays = [*of.states, np.empty_like(of.states[0])]
    run = partial(again_and_again, generic.compiled().each, (generic.arrays(of.tree), True, *arrays))
    return Made(run, len(arrays[0]), cold_start()["loop"] if of.cold else None)


def loop_lanes(of: Chain) -> Made:
    """The same loop, eight states side by side."""
    arrays = [np.array(array.T, order="C") for array in (*of.states, of.states[0])]
    run = partial(again_and_again, generic.compiled().lanes, (generic.arrays(of.tree), True, *arrays))
    return Made(run, arrays[0].shape[1], cold_start()["loop_lanes"] if of.cold else None)


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
    loops, numbers, taken = generic.compiled(), generic.arrays(tmt.ARM), {}
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


def always() -> None:
    """Nothing keeps it from taking part."""


IMPLEMENTATIONS = (
    Implementation("literal", "the literal form in Python", always, literal),
    Implementation("mj_forward", "mj_forward", without_library, partial(of_mujoco, WHOLE)),
    Implementation("mujoco_equal_work", "MuJoCo's equal work", without_library, partial(of_mujoco, EQUAL)),
    Implementation("straight_line", "straight-line code", always, straight_line),
    Implementation("loop", "the loop", always, loop),
    Implementation("loop_lanes", "the loop in lanes", always, loop_lanes),
)
