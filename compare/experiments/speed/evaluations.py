"""What one evaluation of the dynamics costs: MuJoCo's calls, tmt from Python to several states side by side, and others."""

from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

import tmt
from tmt.compiled import evaluator, runner
from tmt.equations import method

from ...judge import timing
from ...robots.case import SEED, Case, Coordinates
from ..setup import Setup
from .peers import FEWER, Peers, peers_in_words
from .settings import coarsest_steps, regular_of
from .ways import (
    CALLED,
    EACH,
    FORWARD,
    IN_LANES,
    IN_PYTHON,
    MOST_CALLS,
    MOST_RESULTS,
    NAMES_IN_TMT,
    RK4_STEP,
    WAITING,
    of_many_states,
    of_one_state,
)

STATES = (1, 1000, 1_000_000)
CALLS = 10_000  # states that are evaluated at least, before the turn of the next
TAKEN = 1e-3  # s: a call that is timed does the same often enough to take so long
COLUMNS_OF_COSTS = (
    "quantity", "implementation", "states", "threads", "ns_per_state", "operations", "operations_per_ns", "why_not",
)  # fmt: skip
WHOLE, EQUAL, MJ_STEP = "MuJoCo, mj_forward", "MuJoCo, equal work", "MuJoCo, mj_step"
WHOLE_CALLED = "MuJoCo, mj_forward called from Python"


class Ways(NamedTuple):
    """The ways of one evaluation, made and not yet timed."""

    repeated: Mapping[tuple, Callable]  # {(quantity, implementation, 1, 1): loop(count)}
    of_many: Mapping[tuple, tuple[Callable, int]]  # {(quantity, implementation, states, threads): a call, its states}
    pool: ThreadPoolExecutor  # of two threads
    peers: Peers | None
    missing: str | None  # why MuJoCo's calls are not timed


def made_ways(setup: Setup) -> Ways:
    """All that is compiled for `costs`."""
    from ...engines.mujoco.calls import MinimalCalls  # here, for MuJoCo takes its time

    rng = np.random.default_rng([SEED, 2])
    tree = setup.robot.tree
    numbers = list(STATES[: setup.of(3, 2, 2)])
    numbers[-1] = min(setup.of(max(STATES), 1000, 1000), most_states(tree))
    states = states_of(setup.robot.coordinates, rng, setup.of(max(numbers), 10_000, 1000))
    first = [np.ascontiguousarray(a[0]) for a in states]
    peers = None if setup.is_quick else Peers(setup, states)
    repeated, missing = {}, MinimalCalls.unavailable()
    if missing is None:
        minimal = MinimalCalls(setup.engines["mujoco"].of(setup.robot.case()))
        repeated = {(quantity, name, 1, 1): loop for name, (quantity, loop) in minimal.loops(*first).items()}
    for ways in (of_one_state(tree, first), peers.of_one_state(first) if peers else ()):
        repeated |= {(quantity, name, 1, 1): loop for quantity, name, loop in ways}
    for loop in repeated.values():
        loop(1)  # what it does only once
    pool, of_many = ThreadPoolExecutor(2), {}
    for count in numbers:
        for key, run in of_many_states(tree, [a[:count] for a in states], pool).items():
            of_many[key] = again(run, CALLS // count, count)
    for key, run in (peers.of_many_states(states) if peers else {}).items():
        of_many[key] = again(run, key[2] // FEWER, key[2])
    return Ways(repeated, of_many, pool, peers, missing)


def costs(setup: Setup, made: Ways) -> tuple[list[dict], list[str]]:
    """The rows of evaluations.csv, and sentences about them."""
    repeated, of_many, pool, peers, missing = made
    tree, calls = setup.robot.tree, {key: counted(loop) for key, loop in repeated.items()}
    calls |= of_many
    with pool:
        taken = timing.in_turns([run for run, _ in calls.values()], rounds=setup.of(12, 5, 2))
    nanoseconds = per_state({key: count for key, (_, count) in calls.items()}, taken)
    overhead = simulate_overhead(regular_of(setup.robot))
    words = costs_in_words(nanoseconds, overhead, lengths(tree), setup.robot.name, missing)
    words += peers_in_words(nanoseconds, in_lanes_of(nanoseconds), peers) if peers else []
    return evaluation_rows(nanoseconds, known_operations(tree), peers.absent if peers else {}), words


def known_operations(tree: tmt.Tree) -> dict[tuple[str, str], int]:
    """Operations of one state, {(quantity, implementation): so many}, of compiled code."""
    found = {quantity: evaluator(tree, name).operations for quantity, name in NAMES_IN_TMT.items()}
    return {(quantity, name): found[quantity] for quantity in found for name in (IN_LANES, EACH, WAITING)}


def lengths(tree: tmt.Tree) -> tuple[int, int] | None:
    """The operations of an acceleration in the literal form and in the one that is compiled; None of many speeds."""
    if len(tree.axis) > IN_PYTHON:
        return None
    literal = evaluator(tree, "acceleration", method.mass_matrix_and_bias)
    return literal.operations, evaluator(tree, "acceleration").operations


def states_of(coordinates: Coordinates, rng: np.random.Generator, count: int) -> list[np.ndarray]:
    """Random positions (count, nq), speeds and torques (count, nv)."""
    if set(coordinates.all_kinds) == {"hinge"}:
        return list(rng.uniform(-3.0, 3.0, (3, count, coordinates.nv)))
    return [coordinates.random(rng, count), *rng.uniform(-3.0, 3.0, (2, count, coordinates.nv))]


def most_states(tree: tmt.Tree) -> int:
    """How many states are evaluated at once at most, a power of ten."""
    n = len(tree.axis)
    return int(10.0 ** np.floor(np.log10(MOST_RESULTS / (n * (n + 3) // 2))))


def in_lanes_of(ns: Mapping[tuple, float], name: str = IN_LANES) -> dict[int, float]:
    """Nanoseconds of a state's forward dynamics in lanes, on one thread, by the number of states."""
    return {key[2]: value for key, value in ns.items() if key[:2] == (FORWARD, name) and key[2] > 1 and key[3] == 1}


def per_state(counts: dict, times: list[list[float]]) -> dict:
    """Nanoseconds of one state for each key of `counts`, {key: states in a call}, from the seconds of its calls."""
    return {key: 1e9 * min(taken) / count for (key, count), taken in zip(counts.items(), times)}


def evaluation_rows(
    ns: Mapping, operations: Mapping = MappingProxyType({}), absent: Mapping = MappingProxyType({})
) -> list:
    """The rows of evaluations.csv, by quantity, the slowest first, then those that do not take part.

    operations: of one state, absent: why it does not, by quantity and implementation.
    """
    rows = []
    for key, value in sorted(ns.items(), key=lambda item: (item[0][0], -item[1])):
        count = operations.get(key[:2])
        rows.append((*key, value, count, count / value if count else None, None))
    rows += [(*key, *[None] * 5, why) for key, why in absent.items()]
    return [dict(zip(COLUMNS_OF_COSTS, row)) for row in rows]


def again(run: Callable, calls: int, count: int) -> tuple[Callable, int]:
    """So many calls one after the other, at least one, that caches are as warm as in use; and the states in them."""
    calls = max(1, calls)
    return (lambda: [run() for _ in range(calls)]), calls * count


def counted(loop: Callable[[int], object]) -> tuple[Callable, int]:
    """A call that does the same so often that it takes a millisecond, or very often, and how often."""
    loop(1)
    (once,) = timing.in_turns([lambda: loop(4)], 5)
    count = min(max(1, int(TAKEN / (min(once) / 4))), MOST_CALLS)
    return lambda: loop(count), count


def simulate_overhead(case: Case) -> tuple[float, float, int]:
    """Seconds of tmt.simulate with the coarsest steps of RK4 of a scene, and of its compiled loop; how many steps."""
    steps = coarsest_steps(case)
    dt, paths = case.duration / steps, [np.zeros((1, steps + 1, len(part))) for part in case.start]
    for path, part in zip(paths, case.start):
        path[0, 0] = part
    run = runner(case.tree, "rk4")
    calls = {
        "call": lambda: tmt.simulate(*case.start, case.tau, dt, steps, model=case.tree),
        "loop": lambda: run(*paths, case.tau[None], dt),
    }
    times = timing.fastest(calls, 50)  # fewer if they take long
    return times["call"], times["loop"], steps


def lanes_in_words(by_states: dict[int, float]) -> str:
    """Times by the number of states in words, the least first."""
    (best, least), *others = sorted(by_states.items(), key=lambda pair: pair[1])
    return (
        f"{least:.1f} (of {best:,} states" + "".join(f"; {value:.1f} of {states:,}" for states, value in others) + ")"
    )


def costs_in_words(
    ns: dict, overhead: tuple, operations: tuple | None, name: str, missing: str | None = None
) -> list[str]:
    """The ratios in words.

    overhead: seconds of tmt.simulate and of its loop, and their steps; operations: of the literal form and of the compiled one,
    or None; name: of the robot; missing: why MuJoCo's calls were not timed, or None.
    """
    sentences = [f"Processor: {timing.vectors()}."]
    lanes = in_lanes_of(ns)
    if missing:
        sentences.append(f"{missing}: its calls were not timed in compiled loops.")
    else:
        sentences += beside_mujoco_in_words(ns, lanes, name)
    call, loop, steps = overhead
    sentences.append(
        f"Those are compiled loops. A call of tmt.simulate with {steps} steps takes {1e6 * call:.0f} us, its loop alone "
        f"{1e6 * loop:.0f} us."
    )
    sentences += called_in_words(ns)
    if operations is None:
        return sentences
    literal, composite = operations
    sentences.append(
        f"The literal method has {literal} operations, the form that is compiled {composite}; that code is made for this one "
        f"{name}, MuJoCo for any model."
    )
    return sentences


def called_in_words(ns: Mapping[tuple, float]) -> list[str]:
    """What calls from Python take."""
    calls = {key[2:]: value for key, value in ns.items() if key[:2] == (FORWARD, CALLED)}
    if (1, 1) not in calls:
        return []
    one = 1e-3 * calls.pop((1, 1))
    text = f"Called from Python, tmt.acceleration, once compiled code answers, takes {one:.1f} us for one state"
    if (whole := ns.get((FORWARD, WHOLE_CALLED, 1, 1))) is not None:
        text += f" (mj_forward {1e-3 * whole:.1f} us)"
    text += "".join(
        f"; of {states:,} states in one call {value:.1f} ns a state" for (states, _), value in sorted(calls.items())
    )
    return [f"{text}."]


def beside_mujoco_in_words(ns: dict, lanes: dict[int, float], name: str) -> list[str]:
    """The ratios of MuJoCo's times to tmt's in words. lanes: nanoseconds of forward dynamics by the number of states."""
    whole, equal, step = (ns[key, way, 1, 1] for key, way in ((FORWARD, WHOLE), (FORWARD, EQUAL), (RK4_STEP, MJ_STEP)))
    start = f"Forward dynamics of the {name}: mj_forward takes {whole:.0f} ns, "
    start += f"MuJoCo's calls that do the same work {equal:.0f} ns, "
    best = min(lanes, key=lanes.get)
    one, apart = ns[FORWARD, WAITING, 1, 1], ns[FORWARD, EACH, 1000, 1]
    kernel = ns[RK4_STEP, EACH, 1, 1]
    of_steps = {key[2]: value for key, value in ns.items() if key[:2] == (RK4_STEP, IN_LANES)}
    in_lanes = f", side by side on all cores {lanes_in_words(of_steps)} ns a run" if of_steps else ""
    return [
        f"{start}tmt's compiled code {one:.1f} ns where each evaluation waits for the last ({less(whole, one)}; than the "
        f"same work {less(equal, one)}), {apart:.1f} ns where they are independent ({less(whole, apart)}; "
        f"{less(equal, apart)}), side by side {lanes_in_words(lanes)} ns a state ({less(whole, lanes[best])}).",
        f"A step of RK4: mj_step {step:.0f} ns, tmt {kernel:.0f} ns ({less(step, kernel)}){in_lanes}.",
    ]


def less(slow: float, fast: float) -> str:
    """How many times less, or more, the second takes than the first, in words."""
    ratio, word = (slow / fast, "less") if slow >= fast else (fast / slow, "more")
    return f"{ratio:.{0 if ratio >= 10 else 1}f} times {word}"
