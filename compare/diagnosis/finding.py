"""What a diagnosis finds, and its sentence."""

from typing import NamedTuple

import numpy as np

from ..judge.words import listed
from .words import Cause

LEAST_STATES = 4  # different positions: of fewer, wrong numbers explain by luck
ENTRIES_SHOWN = 6  # entries in a sentence
CAUSES_SHOWN = 8
OTHERWISE = " State joints only if yours are defined so: with a number or term that is wrong they would agree too."


class Diagnosis(NamedTuple):
    """What explains a difference."""

    differs: bool
    causes: tuple[Cause, ...] = ()  # of one rank, each explains everything; (): nothing does
    left: float = 0.0  # of the difference that the nearest single number, term or pair leaves, a share
    digits: float = np.inf  # to which the values agree
    is_small: bool = False  # whether every difference is small beside its own entry or coefficient
    details: str = ""  # which of M, gravity and the velocity terms differ, and which coefficients, with both numbers
    entries: tuple[str, ...] = ()  # of Mbar and h that differ, "M[hip][knee]"
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
            shown = self.causes[:CAUSES_SHOWN]
            more = " Others beside these are listed in the report." * (len(self.causes) > CAUSES_SHOWN)
            of_joints = {cause.joints is not None for cause in self.causes}
            more += OTHERWISE * (len(of_joints) == 2)
            return f"{'; or '.join(cause.text for cause in shown)}{ties}.{more}"
        if self.too_few:
            few = f"{self.too_few} state{'s' * (self.too_few > 1)}"
            return f"No cause can be told from {few}: {LEAST_STATES} different positions are needed. {self.where}"
        if self.searched:
            return f"Nothing of what there was time for explains this ({self.searched}). {self.where}"
        rounded = ""
        if 2.0 <= self.digits < np.inf and self.is_small:
            rounded = (
                f" The values agree to {int(self.digits)} digits: rounded constants, or noise, would look like this."
            )
        share = f"{self.left:.2g}" if self.left < 0.01 else f"{100 * self.left:.2g} %"
        said = f"No single change that is tried explains all of this, nor do two: {share} is left. {self.where}"
        return f"{said} {self.details}".rstrip() + rounded

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
