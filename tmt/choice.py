"""Who answers: the form of the dynamics that has given all answers soonest, decided by numbers of operations and evaluations.

The literal form is there at once and slow; compiled code is fast, but must be got: compiled, or read from the cache folder.
That is to rent or to buy: as long as nobody knows how many evaluations will follow, code is got when what it would have saved
on those so far, with those that are asked for now, is what getting it takes. Then nobody waits more than twice as long as
with knowledge of the future. All times are estimates from counts and never read from a clock: the same call in the same
situation is answered by the same form, with the same bits.
"""

from collections.abc import Iterable
from functools import lru_cache
from typing import NamedTuple


class Form(NamedTuple):
    """One way to evaluate the dynamics."""

    name: str  # "literal", "loop", "loop_lanes", "straight_line" or "straight_line_lanes"
    getting: float  # s until it is there: 0 in a process that has it, less where its machine code is on disk
    each: float  # s for one evaluation


def chosen(forms: Iterable[Form], wanted: float, before: float = 0.0) -> Form:
    """The form with the least total of getting it and of so many evaluations; the first of equals.

    wanted: evaluations that are asked for now; before: those that were asked for earlier in this process and which all of
    these forms could have answered.
    """
    return min(forms, key=lambda form: form.getting + form.each * (wanted + before))


class Asked:
    """How many evaluations of one kind were asked for so far in this process."""

    def __init__(self):
        self.count = 0.0


@lru_cache(maxsize=256)
def asked(*kind) -> Asked:
    """The count of a kind, such as a Tree and the name of what is asked; `asked(...).count += wanted` after each question."""
    return Asked()


# estimates in s, measured once on one machine: of them only ratios matter
TRACED = 1e-4  # to trace a line of straight-line code
COMPILED, COMPILED_IN_LANES = (0.6, 0.55e-3), (1.3, 2e-3)  # to compile what stands around it, and each line
READ = 0.05  # to read a module from the cache folder
USUAL_LINES = 100  # for one speed: where so few would not pay nothing is traced
LOOPS_READ = 0.3
LOOPS_COMPILED = {  # for the first time on a machine
    "run_tableau": 3.5, "run_tableau_lanes": 5.5, "run_adaptive": 5.0, "run_semi_implicit": 8.0, "run_implicit": 16.0,
}  # fmt: skip


def straight_line_each(lines: float, lanes: bool = False) -> float:
    """What one evaluation takes in so many lines, s."""
    return 6e-9 + 0.035e-9 * lines if lanes else 15e-9 + 0.22e-9 * lines


def loop_each(speeds: int, lanes: bool = False) -> float:
    """What one evaluation takes in a loop over any tree, s."""
    return (17e-9 if lanes else 75e-9) * (1 + speeds)


def straight_line_getting(lines: float, kept: bool, lanes: bool = False, traced: bool = True) -> float:
    """What it takes until straight-line code is there, s; kept: its machine code is on disk."""
    around, line = COMPILED_IN_LANES if lanes else COMPILED
    return (0.0 if traced else TRACED * lines) + (READ if kept else around + line * lines)


def loop_getting(name: str, kept: bool) -> float:
    """What it takes until a loop of that name is there, s."""
    return LOOPS_READ if kept else LOOPS_COMPILED.get(name, max(LOOPS_COMPILED.values()))
