"""Where equations differ: entries of Mbar, gravity, and coefficients of products of speeds in h, with both numbers."""

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from .cause import Detail
from .given import Given
from .model import MOST_SPEEDS, Entry, coefficients_of

ROUNDING = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
SHOWN = 6  # positions, and coefficients, in a sentence


class Coefficient(NamedTuple):
    """One entry of Mbar or gravity, or the coefficient of a product of speeds in h, (states,) each."""

    entry: Entry
    yours: ndarray
    right: ndarray
    tolerance: ndarray

    @property
    def off(self) -> ndarray:
        return self.yours - self.right


@dataclass
class Compared:
    """The coefficients of given values that differ from the right ones."""

    given: Given

    @cached_property
    def differing(self) -> list[Coefficient]:
        given, equations = self.given, self.given.equations
        right, of_M = equations.coefficients, equations.entries[equations.in_M]
        tolerances = dict.fromkeys(right, ROUNDING * given.tolerance[:, equations.in_h].max(axis=1))
        tolerances |= dict(zip(of_M, given.tolerance.T))
        yours = dict(zip(of_M, given.packed.T)) | self.of_h
        finite = [entry for entry, values in yours.items() if np.isfinite(values).all()]
        compared = [Coefficient(entry, yours[entry], right[entry], tolerances[entry]) for entry in finite]
        return [entry for entry in compared if (np.abs(entry.off) > entry.tolerance).any()]

    @property
    def of_h(self) -> dict[Entry, ndarray]:
        """Your coefficients of h, as far as they are known."""
        bias, nv, values = self.given.bias, self.given.equations.nv, self.given.values
        if not values.qd.any():
            return {Entry("gravity", (i,)): column for i, column in enumerate(values.bias.T)}
        if bias is None or nv > MOST_SPEEDS:
            return {}
        return coefficients_of(lambda speeds: np.stack([bias(qd + 0.0 * values.qd) for qd in speeds]), nv)

    def details(self) -> tuple[Detail, ...]:
        """The coefficients that differ, in a sentence."""
        details, equations = [], self.given.equations
        for coefficient in self.differing[:SHOWN]:
            k, names = int(np.argmax(np.abs(coefficient.off))), equations.coordinates.positions
            at = tuple(f"{name} = {value:.6g}" for name, value in zip(names[:SHOWN], equations.q[k]))
            numbers = coefficient.yours[k], coefficient.right[k]
            yours, right = (x if abs(x) > coefficient.tolerance[k] else 0.0 for x in numbers)
            details.append(Detail(coefficient.entry.named(equations.speeds), yours, right, at))
        return tuple(details)
