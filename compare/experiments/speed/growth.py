"""What forward dynamics cost as a chain grows: the forms of tmt beside MuJoCo's calls, from 1 joint to 64.

The chain is nobody's robot: what is found is of the program and of the machine, whatever robot a report is of.
"""

import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from ...judge import timing
from ...judge.check import Result
from ...setup import Setup
from .evaluations import MOST_CALLS, less
from .implementations import IMPLEMENTATIONS, Implementation, Made, chain_of

ENOUGH = 1e-3  # s: so long a timed call takes, or it is a single evaluation that takes longer
CALLS_IN_A_PASS = 20  # of timed calls in a pass, at most
MANY_JOINTS = 8  # from which a cost is no longer mostly that of a call


class Extent(NamedTuple):
    """How far a chain grows, and what is compiled for it."""

    numbers: tuple[int, ...]  # of joints
    passes: int  # in each of which all are timed
    most: float = np.inf  # operations of straight-line code that is compiled
    cold: bool = False  # whether it is measured what compilation takes


EXTENTS = {
    "whole": Extent((1, 2, 3, 4, 6, 8, 12, 16, 24, 32, 48, 64), 8, cold=True),
    "short": Extent((1, 2, 3, 4, 6, 8), 3, most=1200),
    "small": Extent((1, 2, 3), 1, most=200),
}


class Exponent(NamedTuple):
    """A cost grows as n to this power, between so many joints."""

    power: float
    first: int
    last: int


def extent_of(setup: Setup) -> Extent | None:
    """How far the chain grows in a run: as far as was asked; a little in a whole run of a robot whose numbers are stated."""
    if setup.growth:
        return EXTENTS["short" if setup.is_quick else "whole"]
    if setup.is_quick or setup.robot.is_read or setup.robot.own:
        return None
    return EXTENTS["small" if setup.size == "small" else "short"]


class Chains(NamedTuple):
    """What is made and not yet timed: (joints, implementation): Made.

    left_out: by (label, why), with how many joints an implementation has no time; absent: {label: why it is not there}.
    """

    extent: Extent
    taking: Sequence[Implementation]
    made: Mapping[tuple[int, Implementation], Made]
    left_out: Mapping[tuple[str, str], Sequence[int]]
    absent: Mapping[str, str]


def chains_of(setup: Setup) -> Chains | None:
    """The chains of a run, their code compiled; None if none is asked, or they are made elsewhere."""
    extent = None if setup.door else extent_of(setup)
    return made_chains(extent, setup.progress) if extent else None


def add_growth(result: Result, chains: Chains | None, progress: Callable) -> None:
    """The table of costs against joints in a result, their exponents, and what is said of both; nothing if none is asked."""
    if chains:
        add_costs(result, *costs_of_growth(chains, progress))


def add_costs(result: Result, rows: list[dict], reasons: Mapping[str, str]) -> None:
    """The same of costs that are known, see `costs_of_growth`."""
    found = exponents(rows)
    result.tables["growth"], result.curves["exponents"] = rows, found
    result.notes += chain_in_words(rows, found, reasons)


def made_chains(extent: Extent, progress: Callable, known: Sequence[Implementation] = IMPLEMENTATIONS) -> Chains:
    """Each implementation that is there, made for each number of joints."""
    absent = {one.label: why for one in known if (why := one.unavailable())}
    taking = [one for one in known if one.label not in absent]
    made, left_out = {}, {}
    for n in extent.numbers:
        progress(f"speed: a chain of {n}")
        of = chain_of(n, most=extent.most, cold=extent.cold)
        for one in taking:
            found = one.make(of)
            if isinstance(found, Made):
                made[n, one] = found
            else:
                left_out.setdefault((one.label, found), []).append(n)
    return Chains(extent, taking, made, left_out, absent)


def costs_of_growth(chains: Chains, progress: Callable) -> tuple[list[dict], dict[str, str]]:
    """The rows of growth.csv, of each number of joints and each implementation; and {who has no time, and where: why}.

    What is not worth it has a row without a time, what cannot take part has none.
    """
    extent, taking, made, left_out, absent = chains
    progress("speed: timing chains")
    times = nanoseconds(made, extent.passes)
    rows = []
    for n, one in ((n, one) for n in extent.numbers for one in taking):
        found = made.get((n, one), Made(None))
        values = {"ns_per_state": times.get((n, one)), "compile_s": found.compile_s, "operations": found.operations}
        rows.append({"n": n, "implementation": one.name} | values)
    return rows, reasons_in_words(left_out, absent)


def reasons_in_words(left_out: Mapping[tuple[str, str], Sequence[int]], absent: Mapping[str, str]) -> dict[str, str]:
    """{who has no time, and where: why}, see Chains."""
    reasons = {f"{label} takes no part": why for label, why in absent.items()}
    for (label, why), numbers in left_out.items():
        reasons[f"{label} is not timed with {number_in_words(numbers)}"] = why
    return reasons


def nanoseconds(
    made: Mapping[tuple[int, Implementation], Made], passes: int
) -> dict[tuple[int, Implementation], float]:
    """What a state costs at least, by (joints, implementation): those of one number of joints are timed in turns.

    All numbers of joints are gone through in each pass, so that what keeps the machine busy for a while spoils one pass alone.
    """
    times = {key: often_enough(one.run) for key, one in made.items()}
    seconds = dict.fromkeys(made, np.inf)
    for k, n in ((k, n) for k in range(passes) for n in dict.fromkeys(n for n, _ in made)):
        calls = {
            key: partial(one.run, times[key])
            for key, one in made.items()
            if key[0] == n and (k == 0 or seconds[key] < timing.ONCE)
        }
        for key, taken in timing.fastest(calls, CALLS_IN_A_PASS).items():
            seconds[key] = min(taken, seconds[key])
    return {key: 1e9 * taken / (times[key] * made[key].states) for key, taken in seconds.items()}


def often_enough(run: Callable[[int], object]) -> int:
    """How many times take a millisecond or a little more, but not for ever; 1 where once takes longer."""
    times = 1
    run(times)  # what it does only once
    while True:
        begin = time.perf_counter()
        run(times)
        taken = time.perf_counter() - begin
        if taken >= ENOUGH or times >= MOST_CALLS:
            return times
        times = int(np.clip(1.2 * times * ENOUGH / max(taken, 1e-9), 2 * times, 100 * times))


def cost_by_joints(rows: Sequence[dict], name: str) -> dict[int, float]:
    """The nanoseconds of an implementation by the number of joints, where it was timed."""
    return {r["n"]: r["ns_per_state"] for r in rows if r["implementation"] == name and r["ns_per_state"]}


def exponents(rows: Sequence[dict]) -> dict[str, Exponent]:
    """Of each implementation that was timed for three numbers of joints: of the straight line through the logarithms.

    By least squares, from 8 joints on where three numbers are; else over all.
    """
    found = {}
    for name in dict.fromkeys(row["implementation"] for row in rows):
        times = cost_by_joints(rows, name)
        many = {n: value for n, value in times.items() if n >= MANY_JOINTS}
        times = many if len(many) > 2 else times
        if len(times) > 2:
            power, _ = np.polyfit(np.log(list(times)), np.log(list(times.values())), 1)
            found[name] = Exponent(float(power), min(times), max(times))
    return found


# what the rows say


def chain_in_words(rows: Sequence[dict], found: Mapping[str, Exponent], reasons: Mapping[str, str]) -> list[str]:
    """How costs grow, where straight-line code wins, what most joints cost, what compilation takes, and what is left out."""
    said = [*powers_in_words(found), *most_joints_in_words(rows), *straight_in_words(rows), *compilation_in_words(rows)]
    return said + [f"Growth: {what}: {why}." for what, why in reasons.items()]


def label(name: str) -> str:
    """What an implementation is called in words."""
    return next((one.label for one in IMPLEMENTATIONS if one.name == name), name)


def powers_in_words(found: Mapping[str, Exponent]) -> list[str]:
    """How costs grow, those over the same numbers of joints together."""
    ranges = {}
    for name, (power, first, last) in found.items():
        ranges.setdefault((first, last), []).append(f"{label(name)} as n^{power:.2f}")
    parts = [f"from {first} to {last} joints {', '.join(of_range)}" for (first, last), of_range in ranges.items()]
    start = "Forward dynamics of a chain of n hinges, none of them along a coordinate axis, grow"
    return [f"{start} {'; '.join(parts)}."] if parts else []


def most_joints_in_words(rows: Sequence[dict]) -> list[str]:
    """What the longest chain costs, where MuJoCo's equal work was timed beside it."""
    n = max((row["n"] for row in rows), default=0)
    costs = {row["implementation"]: row["ns_per_state"] for row in rows if row["n"] == n and row["ns_per_state"]}
    equal = costs.pop("mujoco_equal_work", None)
    if not equal or not costs:
        return []
    others = [f"{label(name)} {less(equal, value)}" for name, value in sorted(costs.items(), key=lambda pair: -pair[1])]
    return [
        f"With {number_in_words([n])} {label('mujoco_equal_work')} takes {equal:,.0f} ns a state, and {', '.join(others)}."
    ]


def straight_in_words(rows: Sequence[dict]) -> list[str]:
    """Where straight-line code is faster than the loop, one state at a time."""
    straight, looped = cost_by_joints(rows, "straight_line"), cost_by_joints(rows, "loop")
    ratios = {n: looped[n] / straight[n] for n in straight if n in looped}
    faster = {n: ratio for n, ratio in ratios.items() if ratio > 1.0}
    others = [n for n in ratios if n not in faster]
    if not ratios:
        return []
    start = "One state at a time, straight-line code takes"
    if not faster:
        return [f"{start} no less time than the loop with {number_in_words(others)}."]
    times = " to ".join(dict.fromkeys(f"{ratio:.2g}" for ratio in (max(faster.values()), min(faster.values()))))
    rest = f", and no less with {number_in_words(others)}" if others else ""
    return [f"{start} {times} times less than the loop with {number_in_words(faster)}{rest}."]


def compilation_in_words(rows: Sequence[dict]) -> list[str]:
    """What compilation takes, and after how many evaluations that of the longest straight-line code has paid."""
    taken = {(row["implementation"], row["n"]): row for row in rows if row["compile_s"] is not None}
    last = max((n for name, n in taken if name == "straight_line"), default=None)
    parts = []
    if last is not None:
        row = taken["straight_line", last]
        words = (
            f"straight-line code of {number_in_words([last])}, {row['operations']} operations, {row['compile_s']:.2g} s"
        )
        gained = cost_by_joints(rows, "loop").get(last, 0.0) - row["ns_per_state"]
        parts.append(words + (f" (won back in {1e9 * row['compile_s'] / gained:.1e} states)" if gained > 0.0 else ""))
    for name, more in (("loop", "once for all trees"), ("loop_lanes", "after it")):
        seconds = [row["compile_s"] for (of, _), row in taken.items() if of == name]
        parts += [f"{label(name)} {seconds[0]:.2g} s, {more}"] if seconds else []
    return [f"To compile takes, of the processor's time: {'; '.join(parts)}."] if parts else []


def number_in_words(numbers: Iterable[int]) -> str:
    """So many joints."""
    numbers = list(numbers)
    return f"{', '.join(map(str, numbers))} joint{'' if numbers == [1] else 's'}"
