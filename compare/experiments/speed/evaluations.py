"""What one evaluation of the dynamics costs: MuJoCo's calls, and the ways of tmt."""

import ctypes
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

import tmt
from tmt.compiled import evaluator, runner_of
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
    out = np.empty(len(qd))
    tmt.prepare(tree)
    run, chain = runner_of(tree, "rk4").follow, chained(tree)
    most = min(MOST_CALLS, MOST_NUMBERS // len(tree.axis))
    paths = [np.zeros((1, most + 1, len(part))) for part in (q, qd)]
    paths[0][0, 0], paths[1][0, 0] = q, qd

    def steps(count):
        run(*(path[:, : min(count, most) + 1].copy() for path in paths), tau[None], 1e-4, 0.0, 1)

    return {
        (FORWARD, CALLED, 1, 1): repeated(lambda: tmt.acceleration(q, qd, tau, tree)),
        (FORWARD, WAITING, 1, 1): lambda count: chain(
            *(part.ctypes.data for part in (q, qd, tau, out)), count
        ),
        (RK4_STEP, EACH, 1, 1): steps,
    }


CHAIN = """
define void @chain(ptr %q, ptr %qd, ptr %tau, ptr %out, i64 %count) {
entry:
  br label %body
body:
  %i = phi i64 [0, %entry], [%next, %body]
  %last = phi i64 [0, %entry], [%wrong, %body]
  %q.i = getelementptr double, ptr %q, i64 %last
  %qd.i = getelementptr double, ptr %qd, i64 %last
  %tau.i = getelementptr double, ptr %tau, i64 %last
  %wrong = call i64 @one(ptr %q.i, ptr %qd.i, ptr %tau.i, ptr %out)
  %next = add i64 %i, 1
  %more = icmp slt i64 %next, %count
  br i1 %more, label %body, label %done
done:
  ret void
}
"""


def chained(tree: tmt.Tree) -> Callable[..., None]:
    """chain(q, qd, tau, out, count): the accelerations at one state again and again, where each call waits for the last.

    It reads the state from the address that is given plus `wrong` of the last call, which is 0 but known only at its end.
    """
    from tmt.compiled import entries, machine  # loads the compiler

    library = machine.Library(entries.source(tree, "acceleration", 1) + CHAIN)
    return library.function("chain", None, *[ctypes.c_void_p] * 4, ctypes.c_int64)


def of_many_states(tree: tmt.Tree, states: Sequence[np.ndarray]) -> dict[tuple, Callable]:
    """Loops of tmt over many states, (N, nq and nv)."""
    q, qd, tau = (np.ascontiguousarray(a) for a in states)
    count, run, compiled = len(qd), runner_of(tree, "rk4").follow, evaluator(tree, "acceleration")
    out = np.empty((count, compiled.size))
    paths = [np.stack([part, part], axis=1) for part in (q, qd)]
    return {
        (FORWARD, EACH, count, 1): repeated(lambda: compiled.fill(False, out, q, qd, tau)),
        (FORWARD, IN_LANES, count, 1): repeated(lambda: compiled.fill(True, out, q, qd, tau)),
        (FORWARD, CALLED, count, cores()): repeated(lambda: tmt.acceleration(q, qd, tau, tree)),
        (RK4_STEP, IN_LANES, count, cores()): repeated(lambda: run(*paths, tau, 1e-3, 0.0, 1)),
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
