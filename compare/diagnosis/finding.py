"""What a diagnosis finds, and its sentence."""

from typing import NamedTuple

import numpy as np

from ..judge.words import listed
from .words import Cause

LEAST_STATES = 4  # different positions: of fewer, wrong numbers explain by luck
ENTRIES_SHOWN = 6  # entries in a sentence


class Diagnosis(NamedTuple):
    """What explains a difference."""

    differs: bool
    causes: tuple[Cause, ...] = ()  # of one rank, each explains everything; (): nothing does
    left: float = 0.0  # of the difference that the nearest single number, term or pair leaves, a share
    digits: float = np.inf  # to which the values agree
    entries: tuple[str, ...] = ()  # of Mbar and h that differ, "M[0][1]"
    states: tuple[int, int] = (0, 0)  # at how many they differ, and of how many
    compared: int = 0  # entries in all
    nearest: tuple[tuple[str, float], ...] = ()  # single explanations that leave least, and what they leave, a share
    too_few: int = 0  # states, of which nothing can be told; 0: enough
    searched: str = ""  # what there was time for; "": everything

    @property
    def sentence(self) -> str:
        """The finding."""
        if not self.differs:
            return "There is nothing to explain: the equations agree."
        if self.causes:
            ties = "" if len(self.causes) == 1 else f" ({len(self.causes)} explanations that cannot be told apart)"
            return f"{'; or '.join(cause.text for cause in self.causes[:4])}{ties}."
        if self.too_few:
            few = f"{self.too_few} state{'s' * (self.too_few > 1)}"
            return f"No cause can be told from {few}: {LEAST_STATES} different positions are needed. {self.where}"
        if self.searched:
            return f"Nothing of what there was time for explains this ({self.searched}). {self.where}"
        rounded = ""
        if 2.0 <= self.digits < np.inf:
            rounded = (
                f" The values agree to {int(self.digits)} digits: rounded constants, or noise, would look like this."
            )
        share = f"{self.left:.2g}" if self.left < 0.01 else f"{100 * self.left:.2g} %"
        return f"None of the changes that are tried, nor two of them, explains this: {share} is left. {self.where}{rounded}"

    @property
    def where(self) -> str:
        """Which entries differ, and at how many states if these are few."""
        off, states = self.states
        return self.which + (
            f" They differ at {off} of {states} states only: look at those." if 3 * off < states else ""
        )

    @property
    def which(self) -> str:
        """Which entries differ."""
        if len(self.entries) == self.compared:
            return "Every entry differs."
        if len(self.entries) > ENTRIES_SHOWN:
            shown = ", ".join(self.entries[:ENTRIES_SHOWN])
            return f"{len(self.entries)} of {self.compared} entries differ, the others agree: {shown}, ..."
        return f"{listed(self.entries)} {'differs' if len(self.entries) == 1 else 'differ'}, the others agree."
