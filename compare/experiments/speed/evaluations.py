"""What one evaluation of the dynamics costs: MuJoCo three ways, tmt from plain Python to lanes in two threads."""

from collections.abc import Callable, Iterator
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import tmt
from tmt import generic, kernels, method

from ...case import SEED, Case
from ...judge import timing
from ...setup import Setup
from .settings import coarsest_steps, regular_of

STATES = (1, 1000, 1_000_000)
CALLS = 10_000  # states that are evaluated at least, before the turn of the next
TAKEN = 1e-3  # s: a call that is timed does the same often enough to take so long
MOST_CALLS = 100_000  # of the same in a call that is timed
FORWARD, TERMS, RK4_STEP = "forward_dynamics", "mass_matrix_and_bias", "rk4_step"
WHOLE, EQUAL, MJ_STEP = "MuJoCo, mj_forward", "MuJoCo, equal work", "MuJoCo, mj_step"
WAITING, EACH, IN_LANES = "traced kernel, each waits for the last", "traced kernel", "lanes"


def costs(setup: Setup) -> tuple[list[dict], list[str]]:
    """The rows of evaluations.csv, and sentences about them."""
    from ...engines.mujoco.calls import MinimalCalls  # here, for numba takes its time

    rng = np.random.default_rng([SEED, 2])
    most, tree = setup.of(max(STATES), 10_000, 1000), setup.robot.tree
    states = rng.uniform(-3.0, 3.0, (3, most, len(tree.parent)))
    first = [np.ascontiguousarray(a[0]) for a in states]
    repeated, missing = {}, MinimalCalls.unavailable()
    if missing is None:
        minimal = MinimalCalls(setup.engines["mujoco"].of(setup.robot.case()))
        repeated = {(quantity, name, 1, 1): loop for name, (quantity, loop) in minimal.loops(*first).items()}
    repeated |= {(quantity, name, 1, 1): loop for quantity, name, loop in of_one_state(tree, first)}
    calls = {key: counted(loop) for key, loop in repeated.items()}
    with ThreadPoolExecutor(2) as pool:
        for count in STATES[: setup.of(3, 2, 2)]:
            for key, run in of_many_states(tree, states[:, :count], pool).items():
                calls[key] = again(run, CALLS // count, count)
        taken = timing.in_turns([run for run, _ in calls.values()], rounds=setup.of(12, 5, 2))
    nanoseconds = per_state({key: count for key, (_, count) in calls.items()}, taken)
    operations = [kernels.slope_source(tree, "rk4", *form).operations for form in ((method.mass_matrix_and_bias,), ())]
    overhead = simulate_overhead(regular_of(setup.robot))
    return evaluation_rows(nanoseconds), costs_in_words(nanoseconds, overhead, operations, setup.robot.name, missing)


def per_state(counts: dict, times: list[list[float]]) -> dict:
    """Nanoseconds of one state for each key of `counts`, {key: states in a call}, from the seconds of its calls."""
    return {key: 1e9 * min(taken) / count for (key, count), taken in zip(counts.items(), times)}


def evaluation_rows(nanoseconds: dict) -> list[dict]:
    """The rows of evaluations.csv, by quantity, the slowest first."""
    return [
        dict(zip(("quantity", "implementation", "states", "threads"), key)) | {"ns_per_state": value}
        for key, value in sorted(nanoseconds.items(), key=lambda item: (item[0][0], -item[1]))
    ]


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


def of_one_state(tree: tmt.Tree, state: list[np.ndarray]) -> Iterator[tuple]:
    """(quantity, implementation, loop(count)) of tmt at one state, each loop compiled but for the plain floats."""
    (q, qd, tau), n = state, len(tree.parent)
    floats = [a.tolist() for a in state]
    forward = kernels.evaluator(tree, FORWARD)
    literal = kernels.evaluator(tree, FORWARD, method.mass_matrix_and_bias, "library_sincos")
    library = kernels.evaluator(tree, FORWARD, sine="library_sincos")
    terms = kernels.evaluator(tree, TERMS)
    arrays, out, M, h = generic.arrays(tree), np.empty(n), np.empty((n, n)), np.empty(n)
    path = np.zeros((2, 1, MOST_CALLS + 1, n))
    path[:, 0, 0] = q, qd
    run = kernels.stepper(tree, "rk4")

    def plain(count):
        for _ in range(count):
            method.acceleration(tree, *floats)

    def steps(count):
        run(path[0, :, : count + 1].copy(), path[1, :, : count + 1].copy(), tau[None], 1e-4)

    yield FORWARD, "literal, Python floats", plain
    loops = generic.compiled()
    yield FORWARD, "generic compiled loop", lambda count: loops.repeat_forward_dynamics(arrays, q, qd, tau, out, count)
    yield TERMS, "generic compiled loop", lambda count: loops.repeat_mass_matrix_and_bias(arrays, q, qd, M, h, count)
    yield FORWARD, "literal, traced, library's sine", lambda count: literal.chain(q, qd, tau, count)
    yield FORWARD, "composite, traced, library's sine", lambda count: library.chain(q, qd, tau, count)
    yield FORWARD, WAITING, lambda count: forward.chain(q, qd, tau, count)
    yield TERMS, WAITING, lambda count: terms.chain(q, qd, tau, count)
    yield RK4_STEP, EACH, steps


def of_many_states(tree: tmt.Tree, states: np.ndarray, pool: ThreadPoolExecutor) -> dict:
    """{(quantity, implementation, states, threads): run} for many states of shape (3, N, n); memory is bounded by them."""
    q, qd, tau = (np.ascontiguousarray(a) for a in states)
    count, n = q.shape
    runs = {}
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
    if count <= 1000:
        runs[FORWARD, "literal, NumPy arrays", count, 1] = lambda: tmt.acceleration(q, qd, tau, tree)
    in_lanes = count // kernels.LANES * kernels.LANES
    paths = np.zeros((2, in_lanes, 2, n))
    paths[:, :, 0] = q[:in_lanes], qd[:in_lanes]
    step, step_lanes = kernels.stepper(tree, "rk4"), kernels.lane_stepper(tree, "rk4")
    runs[RK4_STEP, EACH, count, 1] = lambda: step(*paths, tau[:in_lanes], 1e-3)
    runs[RK4_STEP, IN_LANES, count, 1] = lambda: step_lanes(*paths, tau[:in_lanes], 1e-3)
    return runs


def simulate_overhead(case: Case) -> tuple[float, float, int]:
    """Seconds of tmt.simulate with the coarsest steps of RK4 of a scene, and of its compiled loop; how many steps."""
    steps = coarsest_steps(case)
    dt, path = case.duration / steps, np.zeros((2, 1, steps + 1, len(case.q)))
    path[:, 0, 0] = case.start
    run = kernels.stepper(case.tree, "rk4")
    calls = {
        "call": lambda: tmt.simulate(*case.start, case.tau, dt, steps, model=case.tree),
        "loop": lambda: run(*path, case.tau[None], dt),
    }
    times = timing.fastest(calls, 50)
    return times["call"], times["loop"], steps


def lanes_in_words(by_states: dict[int, float]) -> str:
    """Times by the number of states in words, the least first."""
    (best, least), *others = sorted(by_states.items(), key=lambda pair: pair[1])
    return (
        f"{least:.1f} (of {best:,} states" + "".join(f"; {value:.1f} of {states:,}" for states, value in others) + ")"
    )


def costs_in_words(ns: dict, overhead: tuple, operations: list, name: str, missing: str | None = None) -> list[str]:
    """The ratios in words.

    overhead: seconds of tmt.simulate and of its loop, and their steps; operations: of the literal and composite form; name: of
    the robot; missing: why MuJoCo's calls were not timed, or None.
    """
    many = sorted({key[2] for key in ns} - {1})
    lanes = {states: ns[FORWARD, IN_LANES, states, 1] for states in many}
    best = min(lanes, key=lanes.get)
    sentences = [f"Processor: {timing.vectors()}."]
    if missing:
        sentences.append(f"{missing}: its calls were not timed in compiled loops.")
    else:
        whole, equal, step = (
            ns[key, way, 1, 1] for key, way in ((FORWARD, WHOLE), (FORWARD, EQUAL), (RK4_STEP, MJ_STEP))
        )
        one, apart = ns[FORWARD, WAITING, 1, 1], ns[FORWARD, EACH, 1000, 1]
        sentences.append(
            f"Forward dynamics of the {name}: mj_forward takes {whole:.0f} ns, MuJoCo's calls that do the same work "
            f"{equal:.0f} ns, the kernel {one:.1f} ns where each evaluation waits for the last ({less(whole, one)}; than the "
            f"same work {less(equal, one)}), {apart:.1f} ns where they are independent ({less(whole, apart)}; "
            f"{less(equal, apart)}), in lanes {lanes_in_words(lanes)} ns a state ({less(whole, lanes[best])})."
        )
        kernel = ns[RK4_STEP, EACH, 1, 1]
        sentences.append(
            f"A step of RK4: mj_step {step:.0f} ns, the kernel {kernel:.0f} ns ({less(step, kernel)}), in lanes "
            f"{lanes_in_words({states: ns[RK4_STEP, IN_LANES, states, 1] for states in many})} ns a run."
        )
    call, loop, steps = overhead
    literal, composite = operations
    sentences.append(
        f"Those are compiled loops. A call of tmt.simulate with {steps} steps takes {1e6 * call:.0f} us, its loop alone "
        f"{1e6 * loop:.0f} us."
    )
    sentences.append(
        f"Straight-line code of the literal method has {literal} operations, that of the composite form {composite}; the kernel "
        f"is made for this one {name}, MuJoCo for any model."
    )
    return sentences


def less(slow: float, fast: float) -> str:
    """How many times less, or more, the second takes than the first, in words."""
    ratio, word = (slow / fast, "less") if slow >= fast else (fast / slow, "more")
    return f"{ratio:.{0 if ratio >= 10 else 1}f} times {word}"
