"""Which coefficients differ, in words; and the cause, if that is a term or two."""

from collections.abc import Callable, Iterator
from functools import cached_property
from itertools import islice

import numpy as np

from ..judge.words import listed
from .coefficients import ROUNDING, SMALL_SHARE, coefficients_of
from .expressions import EXCHANGED, Expressions, Slip
from .model import Equations
from .terms import JOINTS_OF_TERMS
from .words import Cause

SHOWN_COEFFICIENTS = 6  # in a sentence
NAMES_OF_PARTS = {"M": "M", "gravity": "gravity", "velocity": "the velocity terms of h"}


class Compared:
    """The coefficients of given values beside the right ones, see `coefficients_of`."""

    def __init__(self, equations: Equations, given: np.ndarray, tolerance: np.ndarray, bias: Callable | None):
        self.equations, self.known = equations, coefficients_of(equations, given, tolerance, bias)
        self.differing = [one for one in self.known if one.differs]
        self.is_all = self.is_whole(given, tolerance)
        off, right = np.abs(given - equations.values()[0]), np.abs(equations.values()[0])
        of_entries = np.nan_to_num(off).max(axis=0) <= SMALL_SHARE * right.max(axis=0) + tolerance.max(axis=0)
        every = (off > tolerance).any(axis=0) | np.isnan(off).all(axis=0) | (right.max(axis=0) == 0.0)
        self.is_small = bool(of_entries.all()) and (
            bool(every.all()) or (bool(self.differing) and all(one.is_small for one in self.differing))
        )

    @cached_property
    def expressions(self) -> "Expressions | None":
        """The right coefficients that differ as sums of terms; None of many joints and of balls."""
        tree = self.equations.tree
        is_known = "ball" not in tree.kind and len(tree.kind) <= JOINTS_OF_TERMS
        return Expressions(self.equations, self.differing) if is_known else None

    def slips(self) -> Iterator[Slip | None]:
        """What differs in each coefficient, in a few terms; None where that is not found."""
        for one in self.differing:
            yield self.expressions and self.expressions.slip(one)

    def is_whole(self, given: np.ndarray, tolerance: np.ndarray) -> bool:
        """Whether the coefficients that differ make up all that differs in h: nothing is linear or cubic in the speeds."""
        nv, qd = self.equations.nv, self.equations.qd
        h = self.equations.values()[0][:, -nv:].copy()
        for one in self.differing:
            if one.part != "M":
                i, *pair = one.place[1:]
                h[:, i] += (one.yours - one.right) * np.prod(qd[:, pair], axis=1)
        size = tolerance[:, -nv:] * (1.0 + np.abs(qd).max(axis=1, keepdims=True) ** 2)
        off = np.abs(given[:, -nv:] - h) <= ROUNDING * size
        return bool((off | ~np.isfinite(given[:, -nv:])).all())

    @property
    def in_words(self) -> str:
        """Which of M, gravity and the velocity terms differ, and which coefficients, with both numbers."""
        differ, every = (list(dict.fromkeys(one.part for one in some)) for some in (self.differing, self.known))
        agree = [part for part in every if part not in differ]
        said = f"Only {with_verb(differ, 'differ')}; {with_verb(agree, 'agree')}. " if differ and agree else ""
        slips = list(islice(self.slips(), SHOWN_COEFFICIENTS))
        if self.is_small and not all(slips):
            return said
        shown = [slip.text if slip else one.at_worst(self.equations) for one, slip in zip(self.differing, slips)]
        left = len(self.differing) - len(shown)
        return said + "; ".join(shown) + (f"; and {left} more" if left else "") + "." * bool(shown)

    def cause(self, most: int) -> Cause | None:
        """The cause if all that differs is so few slips; None if it is not."""
        found, kinds = [], set()
        for slip in self.slips() if self.is_all else ():
            if slip is None or len(kinds := kinds.union(slip.kinds)) > most:
                return None
            found.append(slip)
        if not found:
            return None
        place, text = listed([slip.coefficient.name for slip in found]), "; ".join(slip.text for slip in found)
        told = f"{EXCHANGED}: " if kinds == {EXCHANGED} else ""
        return Cause(1 + len(kinds), "term", place, "right", text, "", 0.0, 0, told + text)


def with_verb(parts: list[str], verb: str) -> str:
    """Parts of the equations with a verb."""
    return (
        f"{listed([NAMES_OF_PARTS[part] for part in parts])} {verb}{'s' * (len(parts) == 1 and parts != ['velocity'])}"
    )
