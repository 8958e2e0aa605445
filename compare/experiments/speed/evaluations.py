"""What one evaluation of the dynamics costs: MuJoCo's calls, the ways of tmt, and other engines."""

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

import tmt
from tmt.compiled import evaluator

from ...judge import timing
from ...judge.check import Result
from ...robots.case import SEED, Coordinates
from ..setup import Setup
from .implementations import EACH, FORWARD, IN_LANES, NAMES_IN_TMT, RK4_STEP, WAITING, of_many_states, of_one_state
from .peers import Peers

STATES = (1, 1000, 1_000_000)
CALLS = 10_000  # states that a timed call evaluates at least
CALL_SECONDS = 1e-3  # a timed call repeats the evaluation for about so long
MOST_CALLS = 100_000  # repetitions in a timed call
MOST_RESULTS = 10_000_000  # numbers that the results of many states may have
WHOLE, EQUAL, MJ_STEP = "MuJoCo, mj_forward", "MuJoCo, equal work", "MuJoCo, mj_step"
COLUMNS = ["quantity", "implementation", "states", "threads", "ns_per_state", "operations", "operations_per_ns",
           "why_not"]  # fmt: skip


class Evaluations(NamedTuple):
    """All evaluations, compiled and not yet timed. Keys: (quantity, implementation, states, threads)."""

    loops: Mapping[tuple, Callable]  # {key: loop(count)} of one state
    of_many: Mapping[tuple, tuple[Callable, int]]  # {key: (call, states in it)}
    absent: Mapping[tuple, str]  # {(quantity, implementation): why it is not timed}


def compiled_evaluations(setup: Setup) -> Evaluations:
    """Everything that `costs` times."""
    from ...engines.mujoco.calls import MinimalCalls  # here, since importing MuJoCo takes long

    rng, tree = np.random.default_rng([SEED, 2]), setup.robot.tree
    numbers = list(STATES[: setup.of(3, 2, 2)])
    numbers[-1] = min(setup.of(max(STATES), 1000, 1000), most_states(tree))
    states = states_of(setup.robot.coordinates, rng, setup.of(max(numbers), 10_000, 1000))
    first = [np.ascontiguousarray(a[0]) for a in states]
    peers = None if setup.is_quick else Peers(setup, states)
    absent, loops = dict(peers.absent) if peers else {}, {}
    if missing := MinimalCalls.unavailable():
        absent[FORWARD, WHOLE] = missing
    else:
        minimal = MinimalCalls(setup.engines["mujoco"].of(setup.robot.case()))
        loops = {(quantity, name, 1, 1): loop for name, (quantity, loop) in minimal.loops(*first).items()}
    for implementations in (of_one_state(tree, first), peers.of_one_state(first) if peers else ()):
        loops |= {(quantity, name, 1, 1): loop for quantity, name, loop in implementations}
    for loop in loops.values():
        loop(1)  # warm up
    of_many = {}
    for count in numbers:
        for key, call in of_many_states(tree, [a[:count] for a in states]).items():
            if count == STATES[1]:
                call()  # its code is compiled, or loaded, on the first call
            of_many[key] = repeated(call, CALLS // count, count)
    for key, call in (peers.of_many_states(states) if peers else {}).items():
        of_many[key] = repeated(call, key[2] // 1000, key[2])
    return Evaluations(loops, of_many, absent)


def costs(result: Result, setup: Setup, made: Evaluations) -> list[dict]:
    """The rows of evaluations.csv, and findings about them."""
    calls = {key: counted(loop) for key, loop in made.loops.items()} | made.of_many
    times = timing.in_turns([call for call, _ in calls.values()], rounds=setup.of(12, 5, 2))
    ns = per_state({key: count for key, (_, count) in calls.items()}, times)
    find_ratios(result, ns, setup.robot.name)
    operations = {quantity: evaluator(setup.robot.tree, name).operations for quantity, name in NAMES_IN_TMT.items()}
    of_compiled = {(q, name): count for q, count in operations.items() for name in (IN_LANES, EACH, WAITING)}
    return evaluation_rows(ns, of_compiled, made.absent)


def find_ratios(result: Result, ns: Mapping[tuple, float], name: str) -> None:
    """MuJoCo's times of an evaluation and of a step over tmt's. ns: nanoseconds of a state by key."""
    if (FORWARD, WHOLE, 1, 1) not in ns:
        return
    lanes = {
        key[2]: value for key, value in ns.items() if key[:2] == (FORWARD, IN_LANES) and key[2] > 1 and key[3] == 1
    }
    best = min(lanes, key=lanes.get)
    ours = {"waiting": ns[FORWARD, WAITING, 1, 1], "independent": ns[FORWARD, EACH, 1000, 1], "lanes": lanes[best]}
    result.find(
        "evaluation_costs", robot=name, processor=timing.vectors(), whole=ns[FORWARD, WHOLE, 1, 1],
        equal=ns[FORWARD, EQUAL, 1, 1], ours=ours, states=best, mj_step=ns[RK4_STEP, MJ_STEP, 1, 1],
        rk4=ns[RK4_STEP, EACH, 1, 1],
    )  # fmt: skip


def states_of(coordinates: Coordinates, rng: np.random.Generator, count: int) -> list[np.ndarray]:
    """Random positions (count, nq), speeds and torques (count, nv)."""
    if set(coordinates.all_kinds) == {"hinge"}:
        return list(rng.uniform(-3.0, 3.0, (3, count, coordinates.nv)))
    return [coordinates.random(rng, count), *rng.uniform(-3.0, 3.0, (2, count, coordinates.nv))]


def most_states(tree: tmt.Tree) -> int:
    """A power of ten whose results fit into MOST_RESULTS numbers."""
    n = len(tree.axis)
    return int(10.0 ** np.floor(np.log10(MOST_RESULTS / (n * (n + 3) // 2))))


def per_state(counts: dict, times: list[list[float]]) -> dict:
    """Nanoseconds of one state for each key of `counts`, {key: states in a call}, from the seconds of its calls."""
    return {key: 1e9 * min(of_call) / count for (key, count), of_call in zip(counts.items(), times)}


def evaluation_rows(
    ns: Mapping, operations: Mapping = MappingProxyType({}), absent: Mapping = MappingProxyType({})
) -> list:
    """The rows of evaluations.csv, by quantity, the slowest first, then what is not timed.

    operations: of one state, absent: the reason, both by (quantity, implementation).
    """
    rows = []
    for key, value in sorted(ns.items(), key=lambda item: (item[0][0], -item[1])):
        count = operations.get(key[:2])
        rows.append((*key, value, count, count / value if count else None, None))
    rows += [(*key, *[None] * 5, reason) for key, reason in absent.items()]
    return [dict(zip(COLUMNS, row)) for row in rows]


def repeated(call: Callable, times: int, count: int) -> tuple[Callable, int]:
    """The call repeated, so that caches are as warm as in use, and the states in it; count: of one call."""
    times = max(1, times)
    return (lambda: [call() for _ in range(times)]), times * count


def counted(loop: Callable[[int], object]) -> tuple[Callable, int]:
    """A call that repeats a loop for about a millisecond, and how often it does."""
    loop(1)
    (once,) = timing.in_turns([lambda: loop(4)], 5)
    count = min(max(1, int(CALL_SECONDS / (min(once) / 4))), MOST_CALLS)
    return lambda: loop(count), count
