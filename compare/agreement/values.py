"""What assert_agrees compares: the quantities, a state, and the values of one quantity at all states."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..engines.own import QUANTITIES
from ..engines.own.functions import Quantity, state_in_words
from ..judge.agree import over, share_of

PRODUCT, SYMMETRIC = "C qd", "C + C'"
OF_CORIOLIS = {PRODUCT: Quantity(2, ("nv",)), SYMMETRIC: Quantity(2, ("nv", "nv"))}
COMPARED = QUANTITIES | OF_CORIOLIS
SYMBOLS = {  # of entries
    "mass_matrix": "M", "bias": "h", "gravity": "g", "acceleration": "qdd", "coriolis_matrix": "C",
    PRODUCT: f"({PRODUCT})", SYMMETRIC: f"({SYMMETRIC})",
}  # fmt: skip


class State(NamedTuple):
    """A state in the user's joints."""

    number: int
    q: tuple[float, ...]
    qd: tuple[float, ...]
    tau: tuple[float, ...]

    def said(self, quantity: str) -> str:
        """What of the state a quantity depends on, as it can be typed."""
        return state_in_words((self.q, self.qd, self.tau)[: COMPARED[quantity].arguments])


class Compared(NamedTuple):
    """One quantity at all states, (states, ...), in the user's joints."""

    yours: ndarray
    right: ndarray  # MuJoCo's
    rounding: ndarray  # 64 eps x scale
    tolerance: ndarray  # the same and rtol x the largest value that the entry has at these states

    @property
    def ratio(self) -> ndarray:
        """Of the difference to the tolerance; 0 if both are 0, inf if the user's value is not finite."""
        return share_of(np.abs(self.yours - self.right), self.tolerance)

    @property
    def fails(self) -> bool:
        return bool((self.ratio > 1.0).any())

    @property
    def least_rtol(self) -> float:
        """The rtol with which all entries agree; NaN or inf where none does."""
        beyond = np.maximum(np.abs(self.yours - self.right) - self.rounding, 0.0)
        return float(over(beyond, np.broadcast_to(np.abs(self.right).max(axis=0), beyond.shape)).max())
