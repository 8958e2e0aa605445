"""What one evaluation of the dynamics costs: MuJoCo's calls, and the ways of tmt."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, cast

import numpy as np

from tmt.compiled import Evaluator

from ...core import timing
from ...core.rows import Row
from ...robots.case import SEED
from ..setup import Setup

FEW, MANY = 1000, 100_000  # states of one call
MOST_OF_MANY = 3  # nv up to which MANY states fit into memory
MOST_CALLS = 100_000  # repetitions in a timed call
FORWARD = "forward_dynamics"
ONE_BY_ONE, SIDE_BY_SIDE = "compiled", "compiled, side by side"


@dataclass
class EvaluationRow(Row):
    """The time of one evaluation of the forward dynamics."""

    quantity: str
    implementation: str
    states: int = 1  # of one call
    ns_per_state: float | None = None
    operations: int | None = None
    operations_per_ns: float | None = None


class Loop(NamedTuple):
    """A way to evaluate: its row, and run(count), which repeats it."""

    row: EvaluationRow
    run: Callable[[int], object]


def loops(setup: Setup) -> list[Loop]:
    """All ways, compiled and not yet timed; of MuJoCo none where its library is not found."""
    from ...engines.mujoco import calls  # here, as importing MuJoCo takes long
    from ...engines.mujoco.dynamics import MujocoDynamics

    tree, coordinates = setup.robot.tree, setup.robot.coordinates
    many = setup.of(MANY if coordinates.nv <= MOST_OF_MANY else 10 * FEW, FEW, FEW)
    rng = np.random.default_rng([SEED, 2])
    states = [coordinates.random(rng, many), *rng.uniform(-3.0, 3.0, (2, many, coordinates.nv))]
    compiled = Evaluator(tree, "acceleration")
    operations = compiled.operations
    ready = at_many_states(compiled, operations, *(values[:FEW] for values in states))
    dynamics = cast(MujocoDynamics, setup.engines["mujoco"].of(setup.robot.case()))
    of_mujoco = calls.loops(dynamics, *(values[0] for values in states)).items()
    ready += [Loop(EvaluationRow(FORWARD, name), run) for name, run in of_mujoco]
    for loop in ready:
        loop.run(1)  # its code is compiled, or loaded, on the first call
    return ready + (at_many_states(compiled, operations, *states) if many > FEW else [])


def at_many_states(compiled: Evaluator, operations: int, *states: np.ndarray) -> list[Loop]:
    """The ways of tmt over many states, q (N, nq), qd and tau (N, nv)."""
    out, ways = np.empty((len(states[0]), compiled.size)), []
    for name, in_lanes in ((ONE_BY_ONE, False), (SIDE_BY_SIDE, True)):
        row = EvaluationRow(FORWARD, name, len(out), operations=operations)
        ways.append(Loop(row, repeated(partial(compiled.fill, in_lanes, out, *states))))
    return ways


def repeated(call: Callable[[], object]) -> Callable[[int], None]:
    def loop(count: int) -> None:
        for _ in range(count):
            call()

    return loop


def costs(ready: Sequence[Loop], rounds: int) -> list[EvaluationRow]:
    """The rows of ways that are timed, the slowest first."""
    counts = [repetitions(loop.run) for loop in ready]
    calls: list[Callable[..., Any]] = [partial(loop.run, count) for loop, count in zip(ready, counts)]
    for (row, _), count, seconds in zip(ready, counts, timing.in_turns(calls, rounds)):
        row.ns_per_state = 1e9 * min(seconds) / (count * row.states)
        row.operations_per_ns = row.operations and row.operations / row.ns_per_state
    return sorted((loop.row for loop in ready), key=lambda row: -(row.ns_per_state or 0.0))


def repetitions(run: Callable[[int], object]) -> int:
    """How often a loop repeats in about a millisecond."""
    run(1)
    (times,) = timing.in_turns([partial(run, 4)], 5)
    return min(max(1, int(1e-3 / (min(times) / 4))), MOST_CALLS)
