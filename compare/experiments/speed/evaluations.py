"""What one evaluation of the dynamics costs: MuJoCo's calls, and the ways of tmt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np

import tmt
from tmt.compiled import Evaluator, runner_of
from tmt.compiled.cores import cores

from ...core import timing
from ...core.rows import Row
from ...robots.case import SEED
from ..setup import Setup

FEW, MANY = 1000, 100_000  # states of one call
MOST_OF_MANY = 3  # nv up to which MANY states fit into memory
MOST_CALLS = 100_000  # repetitions in a timed call
MOST_NUMBERS = 10_000_000  # of a path of many steps
FORWARD, RK4_STEP = "forward_dynamics", "rk4_step"
CALLED = "tmt.acceleration, called from Python"
ONE_BY_ONE, SIDE_BY_SIDE = "compiled", "compiled, side by side"


@dataclass
class EvaluationRow(Row):
    """The time of one evaluation, or why it is not measured."""

    quantity: str
    implementation: str
    states: int | None = 1  # of one call
    threads: int | None = 1
    ns_per_state: float | None = None
    operations: int | None = None
    operations_per_ns: float | None = None
    why_not: str | None = None


class Loop(NamedTuple):
    """A way to evaluate: its row, and run(count), which repeats it."""

    row: EvaluationRow
    run: Callable[[int], object]


def loops(setup: Setup) -> tuple[list[Loop], list[EvaluationRow]]:
    """All ways, compiled and not yet timed; and a row for what cannot be timed."""
    from ...engines.mujoco.calls import MinimalCalls  # here, as importing MuJoCo takes long
    from ...engines.mujoco.dynamics import MujocoDynamics

    tree, coordinates = setup.robot.tree, setup.robot.coordinates
    many = setup.of(MANY if coordinates.nv <= MOST_OF_MANY else 10 * FEW, FEW, FEW)
    rng = np.random.default_rng([SEED, 2])
    states = [coordinates.random(rng, many), *rng.uniform(-3.0, 3.0, (2, many, coordinates.nv))]
    first = [values[0] for values in states]
    tmt.prepare(tree)
    ready, absent = [called(tree, *first), steps(tree, *first)], []
    ready += at_many_states(tree, *(values[:FEW] for values in states))
    if missing := MinimalCalls.unavailable():
        absent.append(EvaluationRow(FORWARD, "MuJoCo, mj_forward", None, None, why_not=missing))
    else:
        dynamics = cast(MujocoDynamics, setup.engines["mujoco"].of(setup.robot.case()))
        of_mujoco = MinimalCalls(dynamics).loops(*first).items()
        ready += [Loop(EvaluationRow(quantity, name), run) for name, (quantity, run) in of_mujoco]
    for loop in ready:
        loop.run(1)  # its code is compiled, or loaded, on the first call
    return ready + (at_many_states(tree, *states) if many > FEW else []), absent


def called(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> Loop:
    """Accelerations called from Python, at one state or at many."""
    row = EvaluationRow(FORWARD, CALLED) if q.ndim == 1 else EvaluationRow(FORWARD, CALLED, len(q), cores())
    return Loop(row, repeated(lambda: tmt.acceleration(q, qd, tau, tree)))


def steps(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> Loop:
    """Steps of RK4 from one state, each of which waits for the last."""
    run, most = runner_of(tree, "rk4").follow, min(MOST_CALLS, MOST_NUMBERS // len(qd))
    paths = [np.zeros((1, most + 1, len(part))) for part in (q, qd)]
    paths[0][0, 0], paths[1][0, 0] = q, qd

    def loop(count: int) -> None:
        positions, speeds = (path[:, : min(count, most) + 1].copy() for path in paths)
        run(positions, speeds, tau[None], 1e-4, 0.0, 1)

    return Loop(EvaluationRow(RK4_STEP, ONE_BY_ONE), loop)


def at_many_states(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> list[Loop]:
    """The ways of tmt over many states, (N, nq) and (N, nv)."""
    count, run, compiled = len(qd), runner_of(tree, "rk4").follow, Evaluator(tree, "acceleration")
    out = np.empty((count, compiled.size))
    positions, speeds = (np.stack([part, part], axis=1) for part in (q, qd))
    step = EvaluationRow(RK4_STEP, SIDE_BY_SIDE, count, cores())
    ways = [called(tree, q, qd, tau), Loop(step, repeated(lambda: run(positions, speeds, tau, 1e-3, 0.0, 1)))]
    for name, in_lanes in ((ONE_BY_ONE, False), (SIDE_BY_SIDE, True)):
        row = EvaluationRow(FORWARD, name, count, operations=compiled.operations)
        ways.append(Loop(row, repeated(partial(compiled.fill, in_lanes, out, q, qd, tau))))
    return ways


def repeated(call: Callable[[], object]) -> Callable[[int], None]:
    def loop(count: int) -> None:
        for _ in range(count):
            call()

    return loop


def costs(ready: Sequence[Loop], rounds: int) -> list[EvaluationRow]:
    """The rows of ways that are timed, by quantity, the slowest first."""
    counts = [repetitions(loop.run) for loop in ready]
    calls: list[Callable[..., Any]] = [partial(loop.run, count) for loop, count in zip(ready, counts)]
    for (row, _), count, seconds in zip(ready, counts, timing.in_turns(calls, rounds)):
        row.ns_per_state = 1e9 * min(seconds) / (count * (row.states or 1))
        row.operations_per_ns = row.operations and row.operations / row.ns_per_state
    return sorted((loop.row for loop in ready), key=lambda row: (row.quantity, -(row.ns_per_state or 0.0)))


def repetitions(run: Callable[[int], object]) -> int:
    """How often a loop repeats in about a millisecond."""
    run(1)
    (times,) = timing.in_turns([partial(run, 4)], 5)
    return min(max(1, int(1e-3 / (min(times) / 4))), MOST_CALLS)
