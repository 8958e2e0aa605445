"""The growing chain where it is timed in other processes, on this machine or on others: each number of joints is one call."""

import platform
from collections.abc import Mapping, Sequence
from typing import NamedTuple

from ...judge import timing
from ...judge.check import ENDS, About, Result
from ...setup import Setup, nothing
from .growth import Extent, add_costs, costs_of_growth, extent_of, made_chains, number_in_words, reasons_in_words


class TimedChain(NamedTuple):
    """What was found of the chain of one number of joints, and by which processor; see growth.Chains."""

    rows: list[dict]
    left_out: Mapping[tuple[str, str], Sequence[int]]
    absent: Mapping[str, str]
    processor: str


def timed_chain(extent: Extent) -> TimedChain:
    """A chain that is made and timed in this process."""
    chains = made_chains(extent, nothing)
    rows, _ = costs_of_growth(chains, nothing)
    return TimedChain(rows, chains.left_out, chains.absent, timing.vectors())


def add_growth_elsewhere(result: Result, setup: Setup) -> None:
    """The table of costs against joints, see growth.add_growth; each number of joints has a worker for itself, see Setup.door.

    Notes say on which machine where it is not this one, or why nothing can be timed; what is not timed to its end is a failed
    check.
    """
    if why := setup.door.no_timing():
        result.notes.append(f"Growth is left out: {why}.")
        return
    extent = extent_of(setup)
    asked = [extent._replace(numbers=(n,)) for n in extent.numbers]

    def progress(done: int) -> None:
        setup.progress(f"speed: {done} of {len(asked)} chains are timed")

    rows, left_out, absent, places = [], {}, {}, {}
    for n, outcome in zip(extent.numbers, setup.door.outcomes(timed_chain, asked, timed=True, progress=progress)):
        if outcome.broke:
            result.check(f"chain of {n}", ENDS, None, 0.0, "", outcome.broke, rule="equal", about=About.PROGRAM)
            continue
        found = outcome.returned
        rows += found.rows
        absent |= found.absent
        for key, numbers in found.left_out.items():
            left_out.setdefault(key, []).extend(numbers)
        if outcome.machine != platform.node():
            places.setdefault(f"{outcome.machine} ({found.processor})", []).append(n)
    if rows:
        add_costs(result, rows, reasons_in_words(left_out, absent))
    for machine, numbers in places.items():
        result.notes.append(
            f"Growth: {number_in_words(numbers)} timed on {machine}, by a worker that did nothing else."
        )
