"""The equations of motion as functions of a tree's numbers, for many changes of the numbers at once.

Mbar and h are TMT's sum over the bodies, by the functions of tmt. The numbers may be arrays (changes, 1) that broadcast with
positions (states,), real or complex; the derivative by a number is the imaginary part after an imaginary change of 1e-100, exact
to rounding. Each term of each body has a factor, 1 in the right equations.
"""

from collections.abc import Callable, Sequence
from types import SimpleNamespace
from typing import NamedTuple

import numpy as np

import tmt
from tmt.derivation import method
from tmt.derivation.vectors import ZERO, Vector

from ..robots.coordinates import Coordinates

FIELDS = ("offset", "axis", "com", "inertia", "mass", "gravity", "reference", "armature")
OF_TERM = {  # of each body; the first two of Mbar
    "translation": "T' m T of {}", "rotation": "B' I B of {}", "gravity": "gravity term T' m g of {}",
    "convective": "convective term T' m v_conv of {}", "Euler": "Euler term B' I w_conv of {}",
    "gyroscopic": "gyroscopic term B' (omega x I omega) of {}",
}  # fmt: skip
BODY_TERMS = tuple(OF_TERM)
MOST_SPEEDS = 8  # with more, coefficients of products of speeds are not compared: there are nv^2 (nv + 1) / 2
TINY = 1e-100  # an imaginary change, whose square vanishes


class Path(NamedTuple):
    """One entry of a field of a Tree, or the factor of a term ("factor", (body, term))."""

    field: str
    index: tuple[int, ...]


class Equations:
    """Mbar and h of a tree at states q (states, nq), qd (states, nv).

    One array of numbers for each state: the lower triangle of Mbar by rows, then h; see `entries`.
    """

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
        self.tree, self.q, self.qd = tree, q, qd
        self.nv = len(tree.axis)
        self.stated = {name: np.array(getattr(tree, name), float) for name in FIELDS}
        self.stated["factor"] = np.ones((len(tree.mass), len(BODY_TERMS)))
        self.triangle = np.tril_indices(self.nv)

    @property
    def names(self) -> tuple[str, ...]:
        return Coordinates(self.tree.joint_names, self.tree.kind).speeds

    @property
    def entries(self) -> list[tuple]:
        """The entries of a state: ("M", i, j) or ("h", i)."""
        return [*(("M", int(i), int(j)) for i, j in zip(*self.triangle)), *(("h", i) for i in range(self.nv))]

    def values(self, changes: dict | None = None) -> np.ndarray:
        """Mbar and h, (changes, states, entries), with entries of the tree changed; (1, states, entries) without changes.

        changes: {Path: what is added, (changes,)}. Changed axes are normalized.
        """
        numbers = {name: value.tolist() for name, value in self.stated.items()}
        for path, added in (changes or {}).items():
            row, (*places, last) = numbers[path.field], path.index
            for place in places:
                row = row[place]
            row[last] = row[last] + np.asarray(added)[:, None]
        for k in {path.index[0] for path in changes or {} if path.field == "axis"}:
            numbers["axis"][k] = unit_direction(*numbers["axis"][k])
        kept = {name: getattr(self.tree, name) for name in ("parent", "coordinates", "body_joint", "moves")}
        changed = SimpleNamespace(**numbers, **kept)
        return self.summed(changed, method.bodies(changed, list(self.q.T), list(self.qd.T)))

    def coefficients(self) -> dict[tuple, np.ndarray]:
        """See `coefficients_of`."""

        def h(speeds: np.ndarray) -> np.ndarray:
            return Equations(self.tree, self.q, np.broadcast_to(speeds, self.qd.shape)).values()[0][
                :, -self.nv :
            ]

        return coefficients_of(h, self.nv)

    def summed(self, tree: tmt.Tree | SimpleNamespace, bodies: Sequence) -> np.ndarray:
        """Mbar and h of some bodies, (changes, states, entries). tree: with the factor of each term of these bodies."""
        g = Vector(*tree.gravity)
        M = [[0.0] * i + [rotor] for i, rotor in enumerate(tree.armature)]
        h = [0.0] * self.nv
        for b, factor in zip(bodies, tree.factor):
            translation, rotation, weight, convective, Euler, gyroscopic = factor
            force = (b.v_conv * convective - g * weight) * b.mass
            moment = (b.inertia @ b.w_conv) * Euler + b.omega.cross(b.inertia @ b.omega) * gyroscopic
            turned = [b.inertia @ column for column in b.B]
            moving = [i for i in range(self.nv) if b.T[i] is not ZERO]
            for i in moving:
                h[i] = h[i] + b.T[i].dot(force) + b.B[i].dot(moment)
                for j in moving[: moving.index(i) + 1]:
                    M[i][j] = (
                        M[i][j] + b.mass * translation * b.T[i].dot(b.T[j]) + rotation * b.B[i].dot(turned[j])
                    )
        flat = [*(M[i][j] for i, j in zip(*self.triangle)), *h]
        count = max([np.shape(value)[0] for value in flat if np.ndim(value) == 2], default=1)
        return np.stack([np.broadcast_to(value, (count, len(self.q))) for value in flat], axis=-1)

    def full_mass_matrix(self, values: np.ndarray) -> np.ndarray:
        """Mbar (..., nv, nv) of values (..., entries)."""
        i, j = self.triangle
        M = np.zeros((*values.shape[:-1], self.nv, self.nv), values.dtype)
        M[..., i, j] = M[..., j, i] = values[..., : len(i)]
        return M


def packed(mass_matrix: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Mbar (..., nv, nv) and h (..., nv) as `Equations` has them, (..., entries)."""
    i, j = np.tril_indices(np.shape(bias)[-1])
    return np.concatenate([np.asarray(mass_matrix)[..., i, j], bias], axis=-1)


def coefficients_of(bias: Callable, nv: int) -> dict[tuple, np.ndarray]:
    """Coefficients of h, (states,) each: ("gravity", i), and ("velocity", i, j, k) of qd_j qd_k, j <= k, in h_i.

    bias: speeds (nv,) -> h (states, nv), of which the part that is even in the speeds is taken.
    """
    unit, even, rest = np.eye(nv), {}, bias(np.zeros(nv))
    pairs = zip(*map(np.ndarray.tolist, np.triu_indices(nv)))
    for j, k in pairs if nv <= MOST_SPEEDS else ():
        speeds = unit[j] + (j != k) * unit[k]
        even[j, k] = (bias(speeds) + bias(-speeds)) / 2.0 - rest
    mixed = {(j, k): values - even[j, j] - even[k, k] for (j, k), values in even.items() if j != k}
    rows = {("gravity", i): rest[:, i] for i in range(nv)}
    return rows | {("velocity", i, *pair): c[:, i] for pair, c in (even | mixed).items() for i in range(nv)}


def unit_direction(x, y, z) -> list:
    """A direction at length 1."""
    length = np.sqrt(x * x + y * y + z * z)
    length = np.where(length == 0.0, 1.0, length)  # of a change that leaves no direction
    return [x / length, y / length, z / length]
