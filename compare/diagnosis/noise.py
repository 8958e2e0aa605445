"""One number that is wrong in values with noise, as of a log: by least squares, with its uncertainty."""

from typing import NamedTuple

import numpy as np
from numpy import ndarray

from tmt import Tree

from .fit import Search, nearest_change
from .given import Given
from .model import Values
from .places import Place
from .terms import all_places

MOST_NOISE = 0.02  # of the values: what is larger is no noise
MOST_OFF = 0.8  # of the states, at which each entry has noise
LEAST_NUMBERS = 50
WHITE = 6.0  # standard deviations: what of a place the noise may have
LARGE = 20.0  # standard deviations: a change that is told


class Noisy(NamedTuple):
    """What least squares find: noise, and a place if one number is wrong."""

    noise: float  # of the values, a share
    place: Place | None = None
    value: float = 0.0
    deviation: float = 0.0  # its standard deviation

    @property
    def digits(self) -> int:
        """Of the value, as many as its deviation leaves."""
        return (
            int(np.clip(np.ceil(np.log10(abs(self.value / self.deviation))) + 1, 2, 12)) if self.value else 1
        )


def through_noise(tree: Tree, values: Values, qdd: ndarray | None = None) -> Noisy | None:
    """The number that is wrong beside noise, or noise alone; None where something else is left over."""
    given = Given(tree, values, None, qdd=qdd)
    equations = given.equations
    search = Search(equations.values, all_places(equations), given.packed, given.tolerance)
    first, second = search.expansion
    count, off = int(search.known.sum()), search.off
    of_values = given.packed if qdd is None else np.einsum("sij,sj->si", equations.parts[0], qdd)
    entries = search.known.any(axis=0) & search.right.any(axis=0)
    if count < LEAST_NUMBERS or not np.isfinite(off).all():
        return None

    def noise_of(left: ndarray) -> float | None:
        """The share of noise in the values, if all that is left is that: no place explains a part of it."""
        sigma = np.linalg.norm(left) / np.sqrt(count)
        lengths = np.linalg.norm(first.reshape(len(first), -1), axis=1)
        part = np.abs(np.einsum("kse,se->k", first, left)) / np.where(lengths > 0.0, lengths, 1.0)
        share = np.linalg.norm(left * search.tolerance) / np.linalg.norm(of_values[search.known])
        is_everywhere = bool((np.abs(left)[:, entries] > 1.0).mean(axis=0).min(initial=1.0) > MOST_OFF)
        is_white = bool((part <= WHITE * sigma).all())
        return float(share) if is_everywhere and is_white and share <= MOST_NOISE else None

    alone = noise_of(off)
    if alone is not None:
        return Noisy(alone)
    numbers = [k for k, place in enumerate(search.places) if place.kind == "number" and place.is_quadratic]
    fits = sorted((*nearest_change(first[k], second[k], off), k) for k in numbers)
    for left_over, x, k in fits[:1]:
        slope, place = first[k] + 2.0 * x * second[k], search.places[k]
        noise = noise_of(off - x * first[k] - x * x * second[k])
        deviation = left_over / np.sqrt(count - 1) / np.linalg.norm(slope)
        if noise is not None and abs(x) > LARGE * deviation and place.is_possible(x * place.size):
            return Noisy(noise, place, place.value(x * place.size), float(deviation * place.size))
    return None
