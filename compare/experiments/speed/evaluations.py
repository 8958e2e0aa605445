"""What one evaluation of the dynamics costs: MuJoCo's calls, and the ways of tmt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import cast

import numpy as np

from tmt.compiled import Evaluator

from ...core import timing
from ...core.rows import Row
from ...robots.case import SEED
from ..setup import Setup

FEW, MANY = 1000, 100_000  # states of one call
MOST_OF_MANY = 3  # nv up to which MANY states fit into memory
FIRST_CALLS, MOST_CALLS, TIMED = 4, 100_000, 1e-3  # repetitions in a timed call; s, of about that call
FORWARD, ONE_BY_ONE, SIDE_BY_SIDE = "forward_dynamics", "compiled", "compiled, side by side"


@dataclass
class EvaluationRow(Row):
    """The time of one evaluation of the forward dynamics."""

    quantity: str
    implementation: str
    states: int = 1  # of one call
    ns_per_state: float | None = None
    operations: int | None = None
    operations_per_ns: float | None = None


Loop = tuple[
    EvaluationRow, Callable[[int], object]
]  # a way to evaluate: its row, and run(count), which repeats it


def loops(setup: Setup) -> list[Loop]:
    """All ways, compiled and not yet timed; of MuJoCo none where its library is not found."""
    from ...engines.mujoco import runs  # here, as importing MuJoCo takes long
    from ...engines.mujoco.dynamics import MujocoDynamics

    tree, coordinates = setup.robot.tree, setup.robot.coordinates
    many = setup.of(MANY if coordinates.nv <= MOST_OF_MANY else 10 * FEW, FEW, FEW)
    rng = np.random.default_rng([SEED, 2])
    states = [coordinates.random(rng, many), *rng.uniform(-3.0, 3.0, (2, many, coordinates.nv))]
    dynamics = cast(MujocoDynamics, setup.engines["mujoco"].of(setup.robot.case()))
    of_mujoco = runs.loops(dynamics, *(values[0] for values in states)).items()
    ready: list[Loop] = [(EvaluationRow(FORWARD, name), run) for name, run in of_mujoco]
    compiled = Evaluator(tree, "acceleration")
    ways = ((ONE_BY_ONE, False), (SIDE_BY_SIDE, True))[: 1 if setup.is_quick else 2]
    for count in dict.fromkeys((FEW, many)):
        out, some = np.empty((count, compiled.size)), [values[:count] for values in states]
        for name, in_lanes in ways:
            row = EvaluationRow(FORWARD, name, count, operations=compiled.operations)
            ready.append((row, partial(repeat, partial(compiled.fill, in_lanes, out, *some))))
    for row, run in ready:
        if row.states <= FEW:  # its code is compiled, or loaded, on the first call
            run(1)
    return ready


def repeat(call: Callable[[], object], count: int) -> None:
    for _ in range(count):
        call()


def costs(ready: Sequence[Loop], rounds: int) -> list[EvaluationRow]:
    """The rows of ways that are timed, the slowest first."""
    some: list[Callable[[], object]] = [partial(run, FIRST_CALLS) for _, run in ready]
    each = [min(seconds) / FIRST_CALLS for seconds in timing.in_turns(some, rounds)]
    counts = [min(max(1, int(TIMED / seconds)), MOST_CALLS) for seconds in each]
    calls: list[Callable[[], object]] = [partial(run, count) for (_, run), count in zip(ready, counts)]
    for (row, _), count, seconds in zip(ready, counts, timing.in_turns(calls, rounds)):
        row.ns_per_state = 1e9 * min(seconds) / (count * row.states)
        row.operations_per_ns = row.operations and row.operations / row.ns_per_state
    return sorted((row for row, _ in ready), key=lambda row: -(row.ns_per_state or 0.0))
