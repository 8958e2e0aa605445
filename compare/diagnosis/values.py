"""Values of Mbar and h at states, which are to be explained."""

from typing import NamedTuple

import numpy as np

import tmt

from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from .model import packed


class Values(NamedTuple):
    """Mbar and h with their tolerances, at states in the model's joints; NaN where a quantity is not given."""

    q: np.ndarray  # (states, nq)
    qd: np.ndarray  # (states, nv)
    mass_matrix: np.ndarray  # (states, nv, nv)
    bias: np.ndarray  # (states, nv)
    tolerances: tuple[np.ndarray, np.ndarray]  # of both

    @classmethod
    def of(
        cls, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray, mass_matrix: np.ndarray, bias: np.ndarray,
        rounding: float = FACTOR * EPS,
    ) -> "Values":  # fmt: skip
        """With the tolerances of judge.entries. rounding: of the scale of an entry."""
        scale = Entries(tree, q, qd)
        of_mass_matrix = np.broadcast_to(scale.mass_matrix, mass_matrix.shape)
        return cls(q, qd, mass_matrix, bias, (rounding * of_mass_matrix, rounding * scale.bias))

    @property
    def packed(self) -> np.ndarray:
        """As `Equations` has them, (states, entries)."""
        return packed(self.mass_matrix, self.bias)

    @property
    def packed_tolerance(self) -> np.ndarray:
        return packed(*self.tolerances)

    @property
    def are_finite(self) -> bool:
        return bool(np.isfinite(self.packed).all())
