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
