"""What stands in a row of values: the entries of Mbar and h, their names, tolerances, and coefficients of speeds."""

from collections.abc import Callable, Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np
from numpy import ndarray

import tmt

from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR

MOST_SPEEDS = 8  # with more, coefficients of products of speeds are not compared: there are nv^2 (nv + 1) / 2
ROUNDED = FACTOR * EPS  # of the scale of an entry
IN_PARTS = {  # how the parts in which alone a slip was made are said
    ("M",): " in M alone", ("h",): " in h alone", ("velocity terms", "gravity"): " in h alone",
    ("velocity terms",): " in the velocity terms of h alone", ("gravity",): " in {rest} alone",
    ("M", "velocity terms"): ", but not in {rest}", ("M", "gravity"): ", but not in the velocity terms of h",
}  # fmt: skip


class Entry(NamedTuple):
    """An entry of Mbar or h, or a coefficient of h, see `coefficients_of`."""

    kind: str  # "M", "h", "gravity" or "velocity"
    at: tuple[int, ...]  # the numbers of the speeds

    def named(self, speeds: Sequence[str]) -> str:
        """Its name: "M[hip][knee]", "h[hip]", "h[hip], gravity", "h[hip], coefficient of hip' knee'"."""
        names = [speeds[i] for i in self.at]
        if self.kind == "gravity":
            return f"h[{names[0]}], gravity"
        if self.kind == "velocity":
            first, second = names[1:]
            rates = f"{first}'^2" if first == second else f"{first}' {second}'"
            return f"h[{names[0]}], coefficient of {rates}"
        return self.kind + "".join(f"[{name}]" for name in names)


class Layout(NamedTuple):
    """What stands in a row of values: Mbar by rows, then h, or its velocity terms and h at rest.

    With accelerations qdd (states, nv) these are the forces Mbar qdd + h alone. with_forces: whether h is
    what accelerations leave beside the damping and springs of the model.
    """

    nv: int
    is_split: bool = False
    is_symmetric: bool = True  # the lower triangle of Mbar by rows, else all of it
    qdd: ndarray | None = None
    with_forces: bool = False

    @property
    def places(self) -> tuple[ndarray, ndarray]:
        """The rows and columns of the entries of Mbar."""
        of_M = np.ones((self.nv, self.nv)) * (self.qdd is None)
        i, j = np.nonzero(np.tril(of_M) if self.is_symmetric else of_M)
        return i, j

    @property
    def parts(self) -> dict[str, slice]:
        """The entries of each part of the equations."""
        n, nv = len(self.places[0]), self.nv
        of_h = {"velocity terms": slice(n, n + nv), "gravity": slice(n + nv, n + 2 * nv)}
        return {"M": slice(0, n)} | (of_h if self.is_split else {"h": slice(n, n + nv)})

    @property
    def in_M(self) -> slice:
        return self.parts["M"]

    @property
    def in_h(self) -> slice:
        """All entries of h."""
        return slice(self.in_M.stop, None)

    def packed(self, mass_matrix: ndarray, velocity_terms: ndarray, rest: ndarray) -> ndarray:
        """Values (..., entries) of Mbar (..., nv, nv) and the two parts of h (..., nv)."""
        if self.qdd is not None:  # of as many states as there are, or of all several times
            qdd = np.resize(self.qdd, np.shape(velocity_terms)[-2:])
            return np.einsum("...ij,...j->...i", mass_matrix, qdd) + velocity_terms + rest
        of_h = [velocity_terms, rest] if self.is_split else [velocity_terms + rest]
        return np.concatenate([np.asarray(mass_matrix)[..., *self.places], *of_h], axis=-1)

    def of_rows(self, rows: Sequence[int]) -> list[int]:
        """The entries of rows of h."""
        return [part.start + i for i in rows for part in list(self.parts.values())[1:]]


def packed(mass_matrix: ndarray, bias: ndarray) -> ndarray:
    """Mbar (..., nv, nv) and h (..., nv), (..., entries), by the layout without parts."""
    return Layout(np.shape(bias)[-1]).packed(mass_matrix, bias, np.zeros_like(bias))


class Values(NamedTuple):
    """Mbar and h with their tolerances, in the model's joints; NaN where a quantity is not given."""

    q: ndarray  # (states, nq)
    qd: ndarray  # (states, nv)
    mass_matrix: ndarray  # (states, nv, nv)
    bias: ndarray  # (states, nv)
    tolerances: tuple[ndarray, ndarray]  # of both

    @classmethod
    def of(
        cls, tree: tmt.Tree, q: ndarray, qd: ndarray, mass_matrix: ndarray | None, bias: ndarray | None,
        rounding: float = ROUNDED,
    ) -> "Values":  # fmt: skip
        """With the tolerances of judge.entries. None: not given; rounding: of the scale of an entry."""
        scale, shape = Entries(tree, q, qd), (*qd.shape, qd.shape[1])
        M = np.full(shape, np.nan) if mass_matrix is None else mass_matrix
        h = np.full(qd.shape, np.nan) if bias is None else bias
        return cls(q, qd, M, h, (rounding * np.broadcast_to(scale.mass_matrix, shape), rounding * scale.bias))

    @property
    def packed(self) -> ndarray:
        """As `Equations` has them, (states, entries)."""
        return packed(self.mass_matrix, self.bias)

    @property
    def packed_tolerance(self) -> ndarray:
        return packed(*self.tolerances)

    @property
    def are_finite(self) -> bool:
        return bool(np.isfinite(self.packed).all())


def coefficients_of(bias: Callable[[ndarray], ndarray], nv: int) -> dict[Entry, ndarray]:
    """Coefficients of h_i, (states,) each: "gravity" (i,), and "velocity" (i, j, k) of qd_j qd_k, j <= k.

    bias: speeds (n, nv) -> h (n, states, nv), of which the part that is even in the speeds is taken.
    """
    pairs = list(combinations_with_replacement(range(nv), 2)) if nv <= MOST_SPEEDS else []
    speeds = np.array([(np.eye(nv)[j] + np.eye(nv)[k]) / (1.0 + (j == k)) for j, k in pairs]).reshape(-1, nv)
    rest, *values = bias(np.concatenate([np.zeros((1, nv)), speeds, -speeds]))
    moved = zip(pairs, values, values[len(pairs) :])
    even = {pair: (forward + back) / 2.0 - rest for pair, forward, back in moved}
    found = {Entry("gravity", (i,)): rest[:, i] for i in range(nv)}
    for (j, k), both in even.items():
        own = both if j == k else both - even[j, j] - even[k, k]
        found |= {Entry("velocity", (i, j, k)): own[:, i] for i in range(nv)}
    return found
