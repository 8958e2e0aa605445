"""What one evaluation of the dynamics costs: MuJoCo's calls, and the ways of tmt."""

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

import tmt
from tmt.compiled import evaluator, runner
from tmt.compiled.cores import cores

from ...core import timing
from ...robots.case import SEED
from ..setup import Setup

FEW, MANY = 1000, 100_000  # states of one call
MOST_OF_MANY = 3  # nv up to which MANY states fit into memory
MOST_CALLS = 100_000  # repetitions in a timed call
MOST_NUMBERS = 10_000_000  # of a path of many steps
FORWARD, RK4_STEP = "forward_dynamics", "rk4_step"
CALLED = "tmt.acceleration, called from Python"
WAITING, EACH, IN_LANES = "compiled, each waits for the last", "compiled", "compiled, side by side"
WHOLE = "MuJoCo, mj_forward"
COLUMNS = ["quantity", "implementation", "states", "threads", "ns_per_state", "operations", "operations_per_ns",
           "why_not"]  # fmt: skip


class Evaluations(NamedTuple):
    """All evaluations, compiled and not yet timed."""

    loops: dict[tuple, Callable]  # {(quantity, implementation, states, threads): loop(count) of calls}
    absent: dict[tuple, str]  # {(quantity, implementation): why it is not timed}


def compiled_evaluations(setup: Setup) -> Evaluations:
    """Everything that `costs` times."""
    from ...engines.mujoco.calls import MinimalCalls  # here, since importing MuJoCo takes long

    tree, coordinates = setup.robot.tree, setup.robot.coordinates
    many = setup.of(MANY if coordinates.nv <= MOST_OF_MANY else 10 * FEW, FEW, FEW)
    rng = np.random.default_rng([SEED, 2])
    states = [coordinates.random(rng, many), *rng.uniform(-3.0, 3.0, (2, many, coordinates.nv))]
    first, few = [np.ascontiguousarray(a[0]) for a in states], [a[:FEW] for a in states]
    loops, absent = of_one_state(tree, first) | of_many_states(tree, few) | of_many_states(tree, states), {}
    if missing := MinimalCalls.unavailable():
        absent[FORWARD, WHOLE] = missing
    else:
        minimal = MinimalCalls(setup.engines["mujoco"].of(setup.robot.case()))
        loops |= {(quantity, name, 1, 1): loop for name, (quantity, loop) in minimal.loops(*first).items()}
    for (_, _, count, _), loop in loops.items():
        if count <= FEW:
            loop(1)  # its code is compiled, or loaded, on the first call
    return Evaluations(loops, absent)


def repeated(call: Callable[[], object]) -> Callable[[int], None]:
    def loop(count):
        for _ in range(count):
            call()

    return loop


def of_one_state(tree: tmt.Tree, state: list[np.ndarray]) -> dict[tuple, Callable]:
    """Loops of tmt at one state."""
    q, qd, tau = state
    tmt.prepare(tree)
    run, chain = runner(tree, "rk4"), evaluator(tree, "acceleration").chain
    most = min(MOST_CALLS, MOST_NUMBERS // len(tree.axis))
    paths = [np.zeros((1, most + 1, len(part))) for part in (q, qd)]
    paths[0][0, 0], paths[1][0, 0] = q, qd

    def steps(count):
        run(*(path[:, : min(count, most) + 1].copy() for path in paths), tau[None], 1e-4)

    return {
        (FORWARD, CALLED, 1, 1): repeated(lambda: tmt.acceleration(q, qd, tau, tree)),
        (FORWARD, WAITING, 1, 1): lambda count: chain(q, qd, tau, count),
        (RK4_STEP, EACH, 1, 1): steps,
    }


def of_many_states(tree: tmt.Tree, states: Sequence[np.ndarray]) -> dict[tuple, Callable]:
    """Loops of tmt over many states, (N, nq and nv)."""
    q, qd, tau = (np.ascontiguousarray(a) for a in states)
    count, run, compiled = len(qd), runner(tree, "rk4"), evaluator(tree, "acceleration")
    out = np.ones((count, compiled.size))
    wide = [np.ascontiguousarray(a.T) for a in (q, qd, tau, out)]
    paths = [np.stack([part, part], axis=1) for part in (q, qd)]
    return {
        (FORWARD, EACH, count, 1): repeated(lambda: compiled.each(q, qd, tau, out)),
        (FORWARD, IN_LANES, count, 1): repeated(lambda: compiled.lanes(*wide)),
        (FORWARD, CALLED, count, cores()): repeated(lambda: tmt.acceleration(q, qd, tau, tree)),
        (RK4_STEP, IN_LANES, count, cores()): repeated(lambda: run(*paths, tau, 1e-3)),
    }


def costs(setup: Setup, made: Evaluations) -> list[dict]:
    """The rows of evaluations.csv, by quantity, the slowest first, then what is not timed."""
    calls = {key: counted(loop) for key, loop in made.loops.items()}
    times = timing.in_turns([call for call, _ in calls.values()], rounds=setup.of(12, 5, 2))
    operations, rows = evaluator(setup.robot.tree, "acceleration").operations, []
    for (key, (_, count)), of_call in zip(calls.items(), times):
        ns = 1e9 * min(of_call) / (count * key[2])
        is_counted = key[0] == FORWARD and key[1] in (WAITING, EACH, IN_LANES)
        rows.append((*key, ns, *((operations, operations / ns) if is_counted else (None, None)), None))
    rows.sort(key=lambda row: (row[0], -row[4]))
    rows += [(*key, *[None] * 5, reason) for key, reason in made.absent.items()]
    return [dict(zip(COLUMNS, row)) for row in rows]


def counted(loop: Callable[[int], None]) -> tuple[Callable, int]:
    """A call that repeats a loop for about a millisecond, and how often it does."""
    loop(1)
    (once,) = timing.in_turns([lambda: loop(4)], 5)
    count = min(max(1, int(1e-3 / (min(once) / 4))), MOST_CALLS)
    return lambda: loop(count), count
