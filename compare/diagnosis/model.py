"""The equations of motion as functions of a tree's numbers, for many changes of the numbers at once.

Mbar and h are TMT's sum over the bodies, by the functions of tmt. The numbers may be arrays (changes, 1) that broadcast with
positions (states,), real or complex; the derivative by a number is the imaginary part after an imaginary change of 1e-100, exact
to rounding.
"""

from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cached_property
from types import SimpleNamespace
from typing import Any, NamedTuple

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
VELOCITY_TERMS = BODY_TERMS[3:]
MOST_SPEEDS = 8  # with more, coefficients of products of speeds are not compared: there are nv^2 (nv + 1) / 2
TINY = 1e-100  # an imaginary change, whose square vanishes


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
        first, *others = names = [speeds[i] for i in self.at]
        if self.kind == "gravity":
            return f"h[{first}], gravity"
        if self.kind == "velocity":
            rates = f"{others[0]}'^2" if others[0] == others[1] else f"{others[0]}' {others[1]}'"
            return f"h[{first}], coefficient of {rates}"
        return self.kind + "".join(f"[{name}]" for name in names)


Changes = Mapping[Path, np.ndarray]  # what is added to a number, (changes,)


class Equations:
    """Mbar and h of a tree at states q (states, nq), qd (states, nv).

    One array of numbers for each state: the lower triangle of Mbar by rows, then h; see `entries`.
    """

    def __init__(self, tree: tmt.Tree, q: np.ndarray, qd: np.ndarray):
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
    def terms(self) -> dict[str, np.ndarray]:
        """What each term of all bodies adds, (bodies, states, entries)."""
        return {term: np.stack([self.of_body(body, [term]) for body in self.bodies]) for term in BODY_TERMS}

    @cached_property
    def right(self) -> np.ndarray:
        """The values without changes, (states, entries)."""
        return self.values({})[0]

    @cached_property
    def coefficients(self) -> dict[Entry, np.ndarray]:
        """The entries of Mbar, and the coefficients of h, (states,) each."""

        def bias(speeds: np.ndarray) -> np.ndarray:
            at_speeds = Equations(self.tree, self.q, np.broadcast_to(speeds, self.qd.shape))
            return at_speeds.right[:, self.in_h]

        of_M = dict(zip(self.entries[self.in_M], self.right.T))
        return of_M | coefficients_of(bias, self.nv)

    def values(self, changes: Changes) -> np.ndarray:
        """Mbar and h with entries of the tree changed, (changes, states, entries). Changed axes are normalized."""
        numbers = {name: value.tolist() for name, value in self.stated.items()}
        for path, added in changes.items():
            row, (*places, last) = numbers[path.field], path.at
            for place in places:
                row = row[place]
            row[last] = row[last] + np.asarray(added)[:, None]
        for k in {path.at[0] for path in changes if path.field == "axis"}:
            numbers["axis"][k] = unit_direction(*numbers["axis"][k])
        structure = {
            name: getattr(self.tree, name) for name in ("parent", "coordinates", "body_joint", "moves")
        }
        changed = SimpleNamespace(**numbers, **structure)
        bodies = method.bodies(changed, list(self.q.T), list(self.qd.T))
        return self.summed(bodies, changed.gravity, changed.armature, BODY_TERMS)

    def with_bias(self, h: np.ndarray) -> np.ndarray:
        """The right values with another h (states, nv)."""
        return np.concatenate([self.right[:, self.in_M], h], axis=1)

    def of_body(self, body: method.Body, terms: Collection[str] = BODY_TERMS) -> np.ndarray:
        """The terms of a body in Mbar and h, (states, entries)."""
        return self.summed([body], self.tree.gravity, [0.0] * self.nv, terms)[0]

    def summed(
        self,
        bodies: Sequence[method.Body],
        gravity: Sequence[Any],
        armature: Sequence[Any],
        terms: Collection[str],
    ) -> np.ndarray:
        """Mbar and h of some bodies, (changes, states, entries)."""
        translation, rotation, weight, convective, Euler, gyroscopic = (
            float(term in terms) for term in BODY_TERMS
        )
        g = Vector(*gravity)
        M = [[0.0] * i + [rotor] for i, rotor in enumerate(armature)]
        h = [0.0] * self.nv
        for b in bodies:
            force = (b.v_conv * convective - g * weight) * b.mass
            moment = (b.inertia @ b.w_conv) * Euler + b.omega.cross(b.inertia @ b.omega) * gyroscopic
            turned = [b.inertia @ column for column in b.B]
            moving = [i for i in range(self.nv) if b.T[i] is not ZERO]
            for i in moving:
                h[i] = h[i] + b.T[i].dot(force) + b.B[i].dot(moment)
                for j in moving[: moving.index(i) + 1]:
                    of_mass = b.mass * translation * b.T[i].dot(b.T[j])
                    M[i][j] = M[i][j] + of_mass + rotation * b.B[i].dot(turned[j])
        flat = [*(M[i][j] for i, j in zip(*self.triangle)), *h]
        count = max([np.shape(value)[0] for value in flat if np.ndim(value) == 2], default=1)
        return np.stack([np.broadcast_to(value, (count, len(self.q))) for value in flat], axis=-1)

    def full_mass_matrix(self, values: np.ndarray) -> np.ndarray:
        """Mbar (..., nv, nv) of values (..., entries)."""
        i, j = self.triangle
        M = np.zeros((*values.shape[:-1], self.nv, self.nv), values.dtype)
        M[..., i, j] = M[..., j, i] = values[..., self.in_M]
        return M


def packed(mass_matrix: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """Mbar (..., nv, nv) and h (..., nv) as `Equations` has them, (..., entries)."""
    i, j = np.tril_indices(np.shape(bias)[-1])
    return np.concatenate([np.asarray(mass_matrix)[..., i, j], bias], axis=-1)


def coefficients_of(bias: Callable[[np.ndarray], np.ndarray], nv: int) -> dict[Entry, np.ndarray]:
    """Coefficients of h, (states,) each: "gravity" (i,), and "velocity" (i, j, k) of qd_j qd_k, j <= k, in h_i.

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


def unit_direction(x: np.ndarray, y: np.ndarray, z: np.ndarray) -> list[np.ndarray]:
    """A direction at length 1."""
    length = np.sqrt(x * x + y * y + z * z)
    length = np.where(length == 0.0, 1.0, length)  # of a change that leaves no direction
    return [x / length, y / length, z / length]
