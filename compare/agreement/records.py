"""A state that is compared, and a quantity at all of them."""

from typing import NamedTuple

import numpy as np

from ..engines.own import QUANTITIES
from ..engines.own.functions import state_in_words
from ..judge.agree import over, share_of
from .coriolis import OF_CORIOLIS

COMPARED = QUANTITIES | OF_CORIOLIS
# of entries of quantities
SYMBOLS = {"mass_matrix": "M", "bias": "h", "gravity": "g", "acceleration": "qdd"}
SYMBOLS |= {"coriolis_matrix": "C", "C qd": "(C qd)", "C + C'": "(C + C')"}


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

    yours: np.ndarray
    right: np.ndarray  # MuJoCo's
    rounding: np.ndarray  # 64 eps x scale
    tolerance: np.ndarray  # with rtol

    @property
    def ratio(self) -> np.ndarray:
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
