"""Where equations differ: entries of Mbar, gravity, and coefficients of products of speeds in h, yours beside the right ones."""

from collections.abc import Callable
from typing import NamedTuple

import numpy as np

from ..robots.coordinates import Coordinates
from .model import Equations
from .places import bias_at_rest, entry_name, products_of_rates, rates_name

SPEEDS_ASKED = 6  # of which your h is asked at every pair of speeds
ROUNDING = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
POSITIONS_SHOWN = 6  # coefficients in a sentence
SMALL_SHARE = 0.05  # of the largest value, that rounded constants may change


class Coefficient(NamedTuple):
    """One entry of Mbar or gravity, or the coefficient of a product of speeds in h, at some positions."""

    part: str  # "M", "gravity" or "velocity"
    name: str
    yours: np.ndarray  # (states,)
    right: np.ndarray  # (states,)
    tolerance: np.ndarray  # (states,)
    place: tuple  # of the right one, see `right_values`

    @property
    def differs(self) -> bool:
        return bool((np.abs(self.yours - self.right) > self.tolerance).any())

    @property
    def is_small(self) -> bool:
        """Whether the difference is small beside the largest value: rounded constants leave no more."""
        return bool(
            np.abs(self.yours - self.right).max() <= SMALL_SHARE * np.abs(self.right).max() + self.tolerance.max()
        )

    def at_worst(self, equations: Equations) -> str:
        """Both numbers at the position where they are furthest apart."""
        k = int(np.argmax(np.abs(self.yours - self.right)))
        names = Coordinates(equations.tree.hinge_names, equations.tree.kind).positions
        at = ", ".join(f"{name} = {value:.6g}" for name, value in list(zip(names, equations.q[k]))[:POSITIONS_SHOWN])
        return f"{self.name}: yours is {self.yours[k]:.6g}, the right one {self.right[k]:.6g} at {at}"


def coefficients_of(
    equations: Equations, given: np.ndarray, tolerance: np.ndarray, bias: Callable | None
) -> list[Coefficient]:
    """All that are known of given values, (states, entries) as those of `Equations`.

    bias: your h at these positions and other speeds, (states, nv) -> (states, nv); None: only values are known.
    """
    names, nv = equations.names, equations.nv
    right = right_values(equations)
    allowed = np.maximum(tolerance, tolerance[tolerance > 0.0].min(initial=1.0))
    yours = {entry: given[:, k] for k, entry in enumerate(equations.entries) if entry[0] == "M"}
    of_h = ROUNDING * allowed[:, -nv:].max(axis=1)
    if not equations.qd.any():
        yours |= {("gravity", i): given[:, k - nv] for i, k in enumerate(range(nv))}
    elif bias is not None and nv <= SPEEDS_ASKED:
        yours |= of_speeds(bias, nv, len(given))
    return [
        Coefficient(
            place[0], coefficient_name(place, names), values, right[place],
            allowed[:, equations.entries.index(place)] if place[0] == "M" else of_h, place,
        )
        for place, values in yours.items() if np.isfinite(values).all()
    ]  # fmt: skip


def coefficient_name(place: tuple, names: tuple[str, ...]) -> str:
    """The name of a coefficient."""
    kind, *indices = place
    if kind == "M":
        return entry_name(place, names)
    row = entry_name(("h", indices[0]), names)
    return f"{row}, gravity" if kind == "gravity" else f"{row}, coefficient of {rates_name(*indices[1:], names)}"


def right_values(equations: Equations) -> dict[tuple, np.ndarray]:
    """The right coefficients: ("M", i, j), ("gravity", i), ("velocity", i, j, k), (states,) each."""
    values = equations.values()[0]
    found = {entry: values[:, k] for k, entry in enumerate(equations.entries) if entry[0] == "M"}
    if equations.nv <= SPEEDS_ASKED:
        of_rates, weight = products_of_rates(equations)
        found |= {("velocity", i, *pair): c[:, i] for pair, c in of_rates.items() for i in range(equations.nv)}
    else:
        weight = bias_at_rest(equations)
    return found | {("gravity", i): weight[:, i] for i in range(equations.nv)}


def of_speeds(bias: Callable, nv: int, states: int) -> dict[tuple, np.ndarray]:
    """Yours in h: at rest, and what two speeds together add, which is even in them."""
    unit = np.eye(nv)

    def h(speeds: np.ndarray) -> np.ndarray:
        return np.asarray(bias(np.tile(speeds, (states, 1))))

    weight = h(np.zeros(nv))
    even = {
        (j, k): (h(unit[j] + (j != k) * unit[k]) + h(-unit[j] - (j != k) * unit[k])) / 2.0 - weight
        for j in range(nv)
        for k in range(j, nv)
    }
    found = {("gravity", i): weight[:, i] for i in range(nv)}
    for (j, k), values in even.items():
        added = values if j == k else values - even[j, j] - even[k, k]
        found |= {("velocity", i, j, k): added[:, i] for i in range(nv)}
    return found
