"""The equations of motion as functions of a tree's numbers, for many changes of the numbers at once.

Mbar and h are TMT's sum over the bodies, by the functions of tmt. The numbers may be arrays (changes, 1) that
broadcast with positions (states,), real or complex; the derivative by a number is the imaginary part after an
imaginary change of 1e-100, exact to rounding.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import fields
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

import tmt
from tmt.derivation import method
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import ZERO, Matrix

from ..judge.entries import Entries
from ..judge.scale import EPS, FACTOR
from ..robots.coordinates import Coordinates

FIELDS = ("offset", "axis", "com", "inertia", "mass", "gravity", "reference", "armature")
OF_TERM = {  # of each body; the first two of Mbar
    "translation": "T' m T of {}", "rotation": "B' I B of {}", "gravity": "gravity term T' m g of {}",
    "convective": "convective term T' m v_conv of {}", "Euler": "Euler term B' I w_conv of {}",
    "gyroscopic": "gyroscopic term B' (omega x I omega) of {}",
}  # fmt: skip
BODY_TERMS = tuple(OF_TERM)
VELOCITY_TERMS = BODY_TERMS[3:]
NOTHING: dict[str, Any] = dict.fromkeys(("v_conv", "w_conv", "omega"), ZERO)
NOTHING |= {"mass": 0.0, "inertia": Matrix([ZERO] * 3)}
FIELDS_OF_TERMS = {  # of a body, on which a term depends
    "translation": ("mass",), "rotation": ("inertia",), "gravity": ("mass",), "convective": ("mass", "v_conv"),
    "Euler": ("inertia", "w_conv"), "gyroscopic": ("inertia", "omega"),
}  # fmt: skip
MOST_SPEEDS = 8  # with more, coefficients of products of speeds are not compared: there are nv^2 (nv + 1) / 2
TINY = 1e-100  # an imaginary change, whose square vanishes
ROUNDED = FACTOR * EPS  # of the scale of an entry
Bodies = Sequence[method.Body]


class Path(NamedTuple):
    """One entry of a field of a Tree."""

    field: str
    at: tuple[int, ...]


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


Changes = Mapping[Path, ndarray]  # what is added to a number, (changes,)


class Equations:
    """Mbar and h of a tree at states q (states, nq), qd (states, nv).

    One array of numbers for each state: the lower triangle of Mbar by rows, then h; see `entries`.
    """

    def __init__(self, tree: tmt.Tree, q: ndarray, qd: ndarray):
        self.tree, self.q, self.qd = tree, q, qd
        self.nv = len(tree.axis)
        self.coordinates = Coordinates(tree.joint_names, tree.kind)
        self.speeds = self.coordinates.speeds
        self.stated = {name: np.array(getattr(tree, name), float) for name in FIELDS}
        self.triangle = np.tril_indices(self.nv)
        self.in_M, self.in_h = slice(len(self.triangle[0])), slice(len(self.triangle[0]), None)

    @cached_property
    def entries(self) -> list[Entry]:
        """The entries of a state, those of Mbar first."""
        of_M = [Entry("M", (j, i)) for i in range(self.nv) for j in range(i + 1)]
        return of_M + [Entry("h", (i,)) for i in range(self.nv)]

    @cached_property
    def bodies(self) -> list[method.Body]:
        return method.bodies(self.tree, list(self.q.T), list(self.qd.T))

    @cached_property
    def terms(self) -> dict[str, ndarray]:
        """What each term of all bodies adds, (bodies, states, entries)."""
        terms = {}
        for term, needed in FIELDS_OF_TERMS.items():
            absent = {name: nothing for name, nothing in NOTHING.items() if name not in needed}
            gravity = self.tree.gravity if term == "gravity" else ZERO
            terms[term] = np.stack([self.summed([b._replace(**absent)], gravity)[0] for b in self.bodies])
            terms[term][..., self.in_h if term in BODY_TERMS[:2] else self.in_M] = 0.0
        return terms

    @cached_property
    def right(self) -> ndarray:
        """The values without changes, (states, entries)."""
        return self.summed(self.bodies, self.tree.gravity, self.tree.armature)[0]

    @cached_property
    def coefficients(self) -> dict[Entry, ndarray]:
        """The entries of Mbar, and the coefficients of h, (states,) each."""

        def bias(speeds: ndarray) -> ndarray:
            at_speeds = Equations(self.tree, self.q, np.broadcast_to(speeds, self.qd.shape))
            return at_speeds.right[:, self.in_h]

        of_M = dict(zip(self.entries[self.in_M], self.right.T))
        return of_M | coefficients_of(bias, self.nv)

    def values(self, changes: Changes) -> ndarray:
        """Mbar and h with numbers of the tree changed, (changes, states, entries); axes are normalized."""
        numbers: dict[str, Any] = {field.name: getattr(self.tree, field.name) for field in fields(Mechanism)}
        numbers |= {name: value.tolist() for name, value in self.stated.items()}
        for path, added in changes.items():
            row, (*places, last) = numbers[path.field], path.at
            for place in places:
                row = row[place]
            row[last] = row[last] + np.asarray(added)[:, None]
        for k in {path.at[0] for path in changes if path.field == "axis"}:
            x, y, z = numbers["axis"][k]
            length = np.sqrt(x * x + y * y + z * z)
            length = np.where(length == 0.0, 1.0, length)  # of a change that leaves no direction
            numbers["axis"][k] = [x / length, y / length, z / length]
        bodies = method.bodies(Mechanism(**numbers), list(self.q.T), list(self.qd.T))
        return self.summed(bodies, numbers["gravity"], numbers["armature"])

    def with_bias(self, h: ndarray) -> ndarray:
        """The right values with another h (states, nv)."""
        return np.concatenate([self.right[:, self.in_M], h], axis=1)

    def summed(self, bodies: Bodies, gravity: Iterable[Any], armature: Sequence[Any] = ()) -> ndarray:
        """Mbar and h of some bodies, (changes, states, entries)."""
        M, h = method.mass_matrix(bodies), method.bias(bodies, gravity)
        for i, rotor in enumerate(armature):
            M[i][i] = M[i][i] + rotor
        flat = [*(M[i][j] for i, j in zip(*self.triangle)), *h]
        count = max([np.shape(value)[0] for value in flat if np.ndim(value) == 2], default=1)
        return np.stack([np.broadcast_to(value, (count, len(self.q))) for value in flat], axis=-1)

    def full_mass_matrix(self, values: ndarray) -> ndarray:
        """Mbar (..., nv, nv) of values (..., entries)."""
        i, j = self.triangle
        M = np.zeros((*values.shape[:-1], self.nv, self.nv), values.dtype)
        M[..., i, j] = M[..., j, i] = values[..., self.in_M]
        return M


def packed(mass_matrix: ndarray, bias: ndarray) -> ndarray:
    """Mbar (..., nv, nv) and h (..., nv) as `Equations` has them, (..., entries)."""
    i, j = np.tril_indices(np.shape(bias)[-1])
    return np.concatenate([np.asarray(mass_matrix)[..., i, j], bias], axis=-1)


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

    bias: speeds (nv,) -> h (states, nv), of which the part that is even in the speeds is taken.
    """
    unit, even, rest = np.eye(nv), {}, bias(np.zeros(nv))
    pairs = [(j, k) for j in range(nv) for k in range(j, nv)] if nv <= MOST_SPEEDS else []
    for j, k in pairs:
        speeds = unit[j] + (j != k) * unit[k]
        even[j, k] = (bias(speeds) + bias(-speeds)) / 2.0 - rest
    mixed = {(j, k): values - even[j, j] - even[k, k] for (j, k), values in even.items() if j != k}
    found = {Entry("gravity", (i,)): rest[:, i] for i in range(nv)}
    for pair, values in (even | mixed).items():
        found |= {Entry("velocity", (i, *pair)): values[:, i] for i in range(nv)}
    return found
