"""What one evaluation of the dynamics costs: MuJoCo three ways, tmt from plain Python to lanes in two threads."""

from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor

import numpy as np

import tmt
from tmt import generic, kernels, literal, method
from tmt.methods import METHODS

from ...case import SEED, Case
from ...judge import timing
from ...setup import Setup
from .affordable import MOST_RESULTS, left_out_in_words, lengths, literal_is_compiled, most_states, states_of
from .settings import coarsest_steps, regular_of

STATES = (1, 1000, 1_000_000)
CALLS = 10_000  # states that are evaluated at least, before the turn of the next
TAKEN = 1e-3  # s: a call that is timed does the same often enough to take so long
MOST_CALLS = 100_000  # of the same in a call that is timed
IN_PYTHON = 12  # up to which the literal form is timed in Python
FORWARD, TERMS, RK4_STEP = "forward_dynamics", "mass_matrix_and_bias", "rk4_step"
WHOLE, EQUAL, MJ_STEP = "MuJoCo, mj_forward", "MuJoCo, equal work", "MuJoCo, mj_step"
LOOP = "generic compiled loop"
WAITING, EACH, IN_LANES = "traced kernel, each waits for the last", "traced kernel", "lanes"


def costs(setup: Setup) -> tuple[list[dict], list[str]]:
    """The rows of evaluations.csv, and sentences about them."""
    from ...engines.mujoco.calls import MinimalCalls  # here, for numba takes its time

    rng = np.random.default_rng([SEED, 2])
    tree = setup.robot.tree
    numbers = list(STATES[: setup.of(3, 2, 2)])
    numbers[-1] = min(setup.of(max(STATES), 1000, 1000), most_states(tree))
    states = states_of(setup.robot.coordinates, rng, setup.of(max(numbers), 10_000, 1000))
    first = [np.ascontiguousarray(a[0]) for a in states]
    repeated, missing = {}, MinimalCalls.unavailable()
    if missing is None:
        minimal = MinimalCalls(setup.engines["mujoco"].of(setup.robot.case()))
        repeated = {(quantity, name, 1, 1): loop for name, (quantity, loop) in minimal.loops(*first).items()}
    repeated |= {(quantity, name, 1, 1): loop for quantity, name, loop in of_one_state(tree, first)}
    calls = {key: counted(loop) for key, loop in repeated.items()}
    with ThreadPoolExecutor(2) as pool:
        for count in numbers:
            for key, run in of_many_states(tree, [a[:count] for a in states], pool).items():
                calls[key] = again(run, CALLS // count, count)
        taken = timing.in_turns([run for run, _ in calls.values()], rounds=setup.of(12, 5, 2))
    nanoseconds = per_state({key: count for key, (_, count) in calls.items()}, taken)
    overhead = simulate_overhead(regular_of(setup.robot))
    words = costs_in_words(nanoseconds, overhead, lengths(tree), setup.robot.name, missing)
    return evaluation_rows(nanoseconds), words + left_out_in_words(tree)


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
    (q, qd, tau), n = state, len(tree.axis)
    floats = [a.tolist() for a in state]
    arrays, out, M, h = generic.arrays(tree), np.empty(n), np.empty(n * n), np.empty(n)
    run, most = kernels.stepper(tree, "rk4"), min(MOST_CALLS, MOST_RESULTS // n)
    paths = [np.zeros((1, most + 1, len(part))) for part in (q, qd)]
    paths[0][0, 0], paths[1][0, 0] = q, qd

    def plain(count):
        for _ in range(count):
            method.acceleration(tree, *floats)

    def steps(count):
        count = min(count, most)
        run(*(path[:, : count + 1].copy() for path in paths), tau[None], 1e-4)

    if n <= IN_PYTHON:
        yield FORWARD, "literal, Python floats", plain
    loops = generic.compiled()
    yield FORWARD, LOOP, lambda count: loops.repeat_forward_dynamics(arrays, q, qd, tau, out, count)
    yield TERMS, LOOP, lambda count: loops.repeat_mass_matrix_and_bias(arrays, q, qd, M, h, count)
    if not kernels.is_evaluated_straight(tree):
        yield RK4_STEP, LOOP, steps
        return
    forward, terms = kernels.evaluator(tree, FORWARD), kernels.evaluator(tree, TERMS)
    if literal_is_compiled(tree):
        literal = kernels.evaluator(tree, FORWARD, method.mass_matrix_and_bias, "library_sincos")
        library = kernels.evaluator(tree, FORWARD, sine="library_sincos")
        yield FORWARD, "literal, traced, library's sine", lambda count: literal.chain(q, qd, tau, count)
        yield FORWARD, "composite, traced, library's sine", lambda count: library.chain(q, qd, tau, count)
    yield FORWARD, WAITING, lambda count: forward.chain(q, qd, tau, count)
    yield TERMS, WAITING, lambda count: terms.chain(q, qd, tau, count)
    yield RK4_STEP, EACH, steps


def of_many_states(tree: tmt.Tree, states: Sequence[np.ndarray], pool: ThreadPoolExecutor) -> dict:
    """{(quantity, implementation, states, threads): run} for many states, (N, nq and nv); memory is bounded by them."""
    q, qd, tau = (np.ascontiguousarray(a) for a in states)
    count, n = qd.shape
    runs = {}
    if not kernels.is_evaluated_straight(tree):
        return runs
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
    if count <= 1000 and n <= IN_PYTHON:
        runs[FORWARD, "literal, NumPy arrays", count, 1] = lambda: literal.acceleration(q, qd, tau, tree)
    if not kernels.is_traced(tree, METHODS["rk4"]):
        return runs
    in_lanes = count // kernels.LANES * kernels.LANES
    paths = [np.zeros((in_lanes, 2, part.shape[1])) for part in (q, qd)]
    for path, part in zip(paths, (q, qd)):
        path[:, 0] = part[:in_lanes]
    step, step_lanes = kernels.stepper(tree, "rk4"), kernels.lane_stepper(tree, "rk4")
    runs[RK4_STEP, EACH, count, 1] = lambda: step(*paths, tau[:in_lanes], 1e-3)
    runs[RK4_STEP, IN_LANES, count, 1] = lambda: step_lanes(*paths, tau[:in_lanes], 1e-3)
    return runs


def simulate_overhead(case: Case) -> tuple[float, float, int]:
    """Seconds of tmt.simulate with the coarsest steps of RK4 of a scene, and of its compiled loop; how many steps."""
    steps = coarsest_steps(case)
    dt, paths = case.duration / steps, [np.zeros((1, steps + 1, len(part))) for part in case.start]
    for path, part in zip(paths, case.start):
        path[0, 0] = part
    run = kernels.stepper(case.tree, "rk4")
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
    ns: dict, overhead: tuple, operations: list | None, name: str, missing: str | None = None
) -> list[str]:
    """The ratios in words.

    overhead: seconds of tmt.simulate and of its loop, and their steps; operations: of the literal and composite form, or None;
    name: of the robot; missing: why MuJoCo's calls were not timed, or None.
    """
    sentences = [f"Processor: {timing.vectors()}."]
    lanes = {
        key[2]: value for key, value in ns.items() if key[:2] == (FORWARD, IN_LANES) and key[2] > 1 and key[3] == 1
    }
    if missing:
        sentences.append(f"{missing}: its calls were not timed in compiled loops.")
    else:
        sentences += beside_mujoco_in_words(ns, lanes, name)
    call, loop, steps = overhead
    sentences.append(
        f"Those are compiled loops. A call of tmt.simulate with {steps} steps takes {1e6 * call:.0f} us, its loop alone "
        f"{1e6 * loop:.0f} us."
    )
    if operations is None:
        return sentences
    literal, composite = operations
    sentences.append(
        f"Straight-line code of the literal method has {literal} operations, that of the composite form {composite}; the kernel "
        f"is made for this one {name}, MuJoCo for any model."
    )
    return sentences


def beside_mujoco_in_words(ns: dict, lanes: dict[int, float], name: str) -> list[str]:
    """The ratios of MuJoCo's times to tmt's in words. lanes: nanoseconds of forward dynamics by the number of states."""
    whole, equal, step = (ns[key, way, 1, 1] for key, way in ((FORWARD, WHOLE), (FORWARD, EQUAL), (RK4_STEP, MJ_STEP)))
    start = f"Forward dynamics of the {name}: mj_forward takes {whole:.0f} ns, "
    start += f"MuJoCo's calls that do the same work {equal:.0f} ns, "
    if not lanes:
        loop, kernel = ns[FORWARD, LOOP, 1, 1], ns[RK4_STEP, LOOP, 1, 1]
        return [
            f"{start}tmt's compiled loop over any tree {loop:.0f} ns ({less(whole, loop)}; than the same work "
            f"{less(equal, loop)}).",
            f"A step of RK4: mj_step {step:.0f} ns, the loop {kernel:.0f} ns ({less(step, kernel)}).",
        ]
    best = min(lanes, key=lanes.get)
    one, apart = ns[FORWARD, WAITING, 1, 1], ns[FORWARD, EACH, 1000, 1]
    kernel = ns[RK4_STEP, EACH, 1, 1]
    of_steps = {states: ns[RK4_STEP, IN_LANES, states, 1] for states in lanes if (RK4_STEP, IN_LANES, states, 1) in ns}
    in_lanes = f", in lanes {lanes_in_words(of_steps)} ns a run" if of_steps else ""
    return [
        f"{start}the kernel {one:.1f} ns where each evaluation waits for the last ({less(whole, one)}; than the "
        f"same work {less(equal, one)}), {apart:.1f} ns where they are independent ({less(whole, apart)}; "
        f"{less(equal, apart)}), in lanes {lanes_in_words(lanes)} ns a state ({less(whole, lanes[best])}).",
        f"A step of RK4: mj_step {step:.0f} ns, the kernel {kernel:.0f} ns ({less(step, kernel)}){in_lanes}.",
    ]


def less(slow: float, fast: float) -> str:
    """How many times less, or more, the second takes than the first, in words."""
    ratio, word = (slow / fast, "less") if slow >= fast else (fast / slow, "more")
    return f"{ratio:.{0 if ratio >= 10 else 1}f} times {word}"
