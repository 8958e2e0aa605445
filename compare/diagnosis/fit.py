"""Which change of one place, or of two, explains given values, by least squares over the states."""

import time
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from dataclasses import replace
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from .cause import together
from .model import TINY, Changes, Path
from .places import FIT_ROUNDING, OF_ZERO, Place

ROUNDS = 25  # of a search from one start
FIRST_ROUNDS, FINALISTS = 6, 24  # after these rounds only the best go on
CONVERGED = 1e-14  # a step of a place, of its size
SEEN = 1e-100  # of the square of a derivative, in tolerances
LEAST = 1e-12  # damping of a step, of the diagonal: two places may do the same
PROMISING = 1e-4  # of the difference: places that leave more, to second order, are not fitted
NEARLY = 5e-13  # of the difference: what an explanation may leave as rounding
NEAR_ZERO = 1e-6  # of the size of a number
NEAR_PAIRS, THIRDS = 8, 4  # pairs beside which a third number is sought, and how many of these
PAIRS = 20_000  # that are looked at together
CANDIDATES = 64  # pairs that are fitted, the most promising of all
NUMBERS = 1_000_000  # in one evaluation, about, of changes: each has nv^2 at each state
TURNED = np.pi * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])  # more starts for the zero of a hinge


class Fitted(NamedTuple):
    """The best change of one or two places."""

    places: tuple[Place, ...]
    changes: tuple[float, ...]
    ratio: float  # of what is left to its tolerance, the largest; explained if at most 1
    left_over: float  # of the difference, a share: root of the sum of the squares

    @property
    def is_possible(self) -> bool:
        return all(place.is_possible(change) for place, change in zip(self.places, self.changes))

    @property
    def explains(self) -> bool:
        """Whether it leaves nothing, and each of several places has a part in that."""
        pairs = zip(self.places, self.changes)
        acts = len(self.places) == 1 or all(
            abs(change) > FIT_ROUNDING * place.size for place, change in pairs
        )
        return self.ratio <= 1.0 and self.is_possible and acts

    @property
    def cause(self) -> Cause:
        changes = [place.cause(change) for place, change in zip(self.places, self.changes)]
        return together(changes, self.left_over)


class OutOfTime(Exception):
    """A search has used its time."""


class Search:
    """Changes of places that bring computed values closest to given ones.

    computed: the values with changes of numbers of the model, (changes, states, entries). given: (states,
    entries); NaN where nothing is given. tolerance: of each entry, (states, entries). end: the
    time.monotonic() at which OutOfTime is raised.
    """

    def __init__(
        self, computed: Callable[[Changes], ndarray], places: Iterable[Place], given: ndarray,
        tolerance: ndarray, end: float = np.inf,
    ):  # fmt: skip
        self.computed, self.places, self.given, self.end = computed, list(places), given, end
        least = tolerance[tolerance > 0.0].min(initial=1.0)  # what is always 0 has no scale
        self.tolerance = np.where(tolerance > 0.0, tolerance, least)
        self.known = np.isfinite(given)
        self.weight = np.where(self.known, 1.0 / self.tolerance, 0.0)
        self.right = computed({})[0]
        self.off = self.weighted(self.right)
        self.size = float(np.linalg.norm(self.off))
        self.sizes = np.array([place.size for place in self.places])

    def in_time(self) -> None:
        """OutOfTime, if it is."""
        if time.monotonic() > self.end:
            raise OutOfTime

    def within(self, entries: ndarray) -> "Search":
        """The search of what explains some entries (entries,), whatever the others are."""
        part = copy(self)
        part.known, part.weight = self.known & entries, self.weight * entries
        part.off = part.weighted(part.right)
        part.size = float(np.linalg.norm(part.off))
        return part

    def at(self, states: ndarray) -> "Search":
        """The search at some of the states, of places that are a column and of given changes."""
        part = copy(self)
        part.given, part.known, part.weight = self.given[states], self.known[states], self.weight[states]
        part.tolerance, part.right, part.off = self.tolerance[states], self.right[states], self.off[states]
        part.size = float(np.linalg.norm(part.off)) or 1.0
        if "coefficients" in self.__dict__:
            first, second = self.coefficients
            part.__dict__["coefficients"] = first[:, states], second[:, states]
        return part

    def weighted(self, values: ndarray) -> ndarray:
        """Given values minus others, at the first or all states, in tolerances; 0 where none is given."""
        first = slice(values.shape[-2])
        return np.where(self.known[first], self.given[first] - values, 0.0) * self.weight[first]

    def explained(self, variants: Iterable[tuple[Cause, ndarray]]) -> list[Cause]:
        """The causes whose values, at the first or all states, leave nothing."""
        left = ((cause, self.left_over(self.weighted(values))) for cause, values in variants)
        return [replace(cause, left_over=share) for cause, (ratio, share) in left if ratio <= 1.0]

    def left_over(self, left: ndarray) -> tuple[float, float]:
        """What is left, in tolerances: the largest, and the share of the difference.

        The largest is at most 1 where the share is rounding: a length in mm rounds what is small.
        """
        share = float(np.linalg.norm(left)) / self.size
        ratio = float(np.nan_to_num(np.abs(left).max(), nan=np.inf))
        return (min(ratio, 1.0) if share <= NEARLY else ratio), share

    def values(self, numbers: ndarray, x: ndarray) -> ndarray:
        """Values for each row of changes x of the places `numbers`, (rows, k): (rows, states, entries)."""
        rows = max(4, NUMBERS // self.right.size)
        if len(numbers) > rows:
            starts = range(0, len(numbers), rows)
            return np.concatenate([self.values(numbers[k : k + rows], x[k : k + rows]) for k in starts])
        self.in_time()
        changes: dict[Path, ndarray] = {}
        columns = []
        for row in range(len(numbers)):
            for place, change in zip([self.places[k] for k in numbers[row]], x[row]):
                for path, coefficient in place.moves:
                    changes.setdefault(path, np.zeros(len(numbers), x.dtype))[row] += coefficient * change
                if place.column is not None:
                    columns.append((row, change * place.column))
        values = self.computed(changes)
        values = np.array(np.broadcast_to(values, (len(numbers), *values.shape[1:])), dtype=x.dtype)
        for row, added in columns:
            values[row] += added
        return values

    def fitted(self, numbers: ndarray, x: ndarray, rounds: int = ROUNDS) -> tuple[ndarray, ndarray]:
        """The best changes from the starts x (rows, k), and what they leave, (rows, states, entries)."""
        size, steps = self.sizes[numbers], np.eye(x.shape[1]) * (1j * TINY)
        left = self.weighted(self.values(numbers, x))
        best, damping, moving = (left**2).sum(axis=(1, 2)), np.full(len(x), 1e-3), np.arange(len(x))
        for _ in range(rounds):
            slopes = [self.values(numbers[moving], x[moving] + step).imag / TINY for step in steps]
            J = (np.stack(slopes, axis=1) * self.weight).reshape(len(moving), x.shape[1], -1)
            J = J * size[moving][:, :, None]
            normal = np.einsum("rim,rjm->rij", J, J)
            diagonal = np.einsum("rii->ri", normal)
            diagonal = np.where(diagonal > SEEN, diagonal, 1.0)  # a place without influence stays
            scaled = normal / np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
            scaled += np.eye(x.shape[1]) * damping[moving][:, None, None]
            down = np.einsum("rim,rm->ri", J, left[moving].reshape(len(moving), -1)) / np.sqrt(diagonal)
            step = np.linalg.solve(scaled, down[:, :, None])[:, :, 0] / np.sqrt(diagonal)
            tried = x[moving] + step * size[moving]
            after = self.weighted(self.values(numbers[moving], tried))
            sums = np.nan_to_num((after**2).sum(axis=(1, 2)), nan=np.inf)
            better = sums < best[moving]
            now = moving[better]
            x[now], left[now], best[now] = tried[better], after[better], sums[better]
            damping[moving] = (damping[moving] * np.where(better, 0.05, 10.0)).clip(LEAST, 1e8)
            moving = moving[(np.abs(step).max(axis=1) > CONVERGED) & (damping[moving] < 1e6)]
            if not len(moving):
                break
        return x, left

    def outcome(self, numbers: ndarray, starts: ndarray) -> list[Fitted]:
        """The fit of each set of places, from the best of its starts, the smallest remainder first."""
        x, left = self.fitted(numbers, starts, FIRST_ROUNDS)
        near = np.argsort(np.nan_to_num((left**2).sum(axis=(1, 2)), nan=np.inf))[:FINALISTS]
        x[near], left[near] = self.fitted(numbers[near], x[near])
        fits: dict[tuple[int, ...], Fitted] = {}
        for key, changes, rest in zip(map(tuple, numbers.tolist()), x.tolist(), left):
            ratio, share = self.left_over(rest)
            if key not in fits or ratio < fits[key].ratio:
                fits[key] = Fitted(tuple(self.places[k] for k in key), tuple(changes), ratio, share)
        return sorted(fits.values(), key=lambda fit: fit.ratio)

    def singles(self, is_thorough: bool = True) -> list[Fitted]:
        """Each place alone; directions and zeros from several starts, if it is thorough."""
        first, second = self.expansion
        fits, starts = [], []
        for k, place in enumerate(self.places):
            left, best = nearest_change(first[k], second[k], self.off)
            if not place.is_quadratic:
                turned = TURNED if place.kind == OF_ZERO else (-1.0, 1.0)
                starts += [(k, start) for start in (0.0, best * place.size, *turned)] * is_thorough
            elif left <= PROMISING * self.size:
                starts.append((k, best * place.size))
            else:
                fits.append(Fitted((place,), (best * place.size,), np.inf, left / self.size))
        if starts:
            numbers, x = zip(*starts)
            fits += map(self.at_zero, self.outcome(np.array(numbers)[:, None], np.array(x)[:, None]))
        return fits

    def at_zero(self, fit: Fitted) -> Fitted:
        """A fit of one place, at zero where that explains as much: a double root is found to half the digits."""
        (place,), (change,) = fit.places, fit.changes
        if (
            fit.ratio > 1.0
            or place.kind == OF_ZERO
            or not 0.0 < abs(place.stated + change) < NEAR_ZERO * place.size
        ):
            return fit
        k = next(k for k, other in enumerate(self.places) if other is place)
        left = self.weighted(self.values(np.array([[k]]), np.array([[-place.stated]]))[0])
        ratio, share = self.left_over(left)
        return fit._replace(changes=(-place.stated,), ratio=ratio, left_over=share) if ratio <= 1.0 else fit

    def thirds(self, fits: Sequence[Fitted]) -> list[Fitted]:
        """A third number beside the pairs that leave least."""
        first, _ = self.expansion
        columns = first.reshape(len(self.places), -1)
        lengths = np.linalg.norm(columns, axis=1)
        columns = columns / np.where(lengths > 0.0, lengths, 1.0)[:, None]
        index = {id(place): k for k, place in enumerate(self.places)}
        numbers, starts = [], []
        for fit in sorted(fits, key=lambda fit: fit.left_over)[:NEAR_PAIRS]:
            pair = [index[id(place)] for place in fit.places]
            left = self.weighted(self.values(np.array([pair]), np.array([fit.changes]))[0]).ravel()
            along = columns @ left
            likely = (k for k in np.argsort(-np.abs(along)).tolist() if self.places[k].kind == "number")
            for k in [k for k in likely if k not in pair][:THIRDS]:
                numbers.append([*pair, k])
                starts.append([*fit.changes, along[k] / lengths[k] * self.sizes[k]])
        return self.outcome(np.array(numbers), np.array(starts)) if numbers else []

    @property
    def expansion(self) -> tuple[ndarray, ndarray]:
        """First and second coefficients of the values in each place's change over its size, in tolerances.

        (places, states, entries) each; exact for all places except directions and zeros.
        """
        first, second = self.coefficients
        return first * self.weight, second * self.weight

    @cached_property
    def coefficients(self) -> tuple[ndarray, ndarray]:
        """As `expansion`, in the units of the values."""
        numbers, size = np.arange(len(self.places))[:, None], self.sizes[:, None]
        up, down = (self.values(numbers, sign * size) for sign in (1.0, -1.0))
        return (up - down) / 2.0, (up + down) / 2.0 - self.right

    def change(self, fit: Fitted) -> ndarray:
        """What one place changes in the values to first order, (states, entries)."""
        k = next(k for k, place in enumerate(self.places) if place is fit.places[0])
        return self.coefficients[0][k] * fit.changes[0] / self.sizes[k]

    def best_change(self, k: int, off: ndarray) -> tuple[float, float]:
        """What the best change of a place leaves of other differences, over its tolerance, and the change."""
        first, second = (part[k] * self.weight for part in self.coefficients)
        _, x = nearest_change(first, second, off)
        for _ in range(2):  # Newton's steps: the roots of a cubic have half the digits
            slope, left = first + 2.0 * x * second, off - x * first - x * x * second
            x += float((slope * left).sum() / max((slope * slope).sum(), 1e-300))
        return float(np.abs(off - x * first - x * x * second).max()), x * self.places[k].size

    def pairs(self, kinds: Sequence[str], others: Sequence[str]) -> list[Fitted]:
        """Two places together, one of some kinds and one of others; the most promising pairs are fitted."""
        columns = np.concatenate([part.reshape(len(self.places), -1) for part in self.expansion])
        lengths = np.linalg.norm(columns, axis=1)
        columns = columns / np.where(lengths > 0.0, lengths, 1.0)[:, None]
        inner, down, count = columns @ columns.T, columns @ self.off.ravel(), len(self.places)
        active = [k for k, place in enumerate(self.places) if lengths[k] > 0.0 and place.kind in others]
        first = {k for k in active if self.places[k].kind in kinds}
        pairs = np.array([pair for pair in combinations(active, 2) if not first.isdisjoint(pair)])
        if not len(pairs):
            return []
        near: list[tuple[float, tuple[int, int], ndarray]] = []
        for start in range(0, len(pairs), PAIRS):
            self.in_time()
            block = pairs[start : start + PAIRS]
            spans = np.concatenate([block, block + count], axis=1)  # of first and second coefficients of both
            matrices = inner[spans[:, :, None], spans[:, None, :]] + 1e-9 * np.eye(4)
            coefficients = np.linalg.solve(matrices, down[spans][:, :, None])[:, :, 0]
            explained = np.einsum("pi,pi->p", coefficients, down[spans])
            best = np.argsort(-explained)[:CANDIDATES]
            changes = coefficients[best][:, :2] / lengths[block[best]] * self.sizes[block[best]]
            near += zip(explained[best].tolist(), map(tuple, block[best].tolist()), changes)
        near = sorted(near, key=lambda pair: -pair[0])[:CANDIDATES]
        numbers, starts = np.array([pair for _, pair, _ in near]), np.array([x for *_, x in near])
        return self.outcome(np.tile(numbers, (2, 1)), np.concatenate([starts, np.zeros_like(starts)]))


def nearest_change(a: ndarray, b: ndarray, off: ndarray) -> tuple[float, float]:
    """What the best change x leaves, |off - x a - x^2 b|, and x, a root of a cubic; of (states, entries)."""
    aa, ab, bb = (a * a).sum(), (a * b).sum(), (b * b).sum()
    cubic = [2.0 * bb, 3.0 * ab, aa - 2.0 * (off * b).sum(), -(off * a).sum()]
    roots = np.roots(cubic) if np.isfinite(cubic).all() else np.zeros(0)
    real = [float(x.real) for x in roots if abs(x.imag) <= 1e-6 * (1.0 + abs(x))]
    left = [(float(np.linalg.norm(off - x * a - x * x * b)), x) for x in [*real, 0.0]]
    # of two that do the same the nearer
    return min(left, key=lambda left_by: (np.round(left_by[0]), abs(left_by[1])))
