"""Which changes of one hypothesis, or of several together, explain given values: least squares over the states."""

import time
from collections.abc import Callable, Iterable, Sequence
from copy import copy
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from .cause import together
from .hypothesis import FIT_ROUNDING, OF_ZERO, Hypothesis
from .model import TINY, Changes, Path

ROUNDS = 25  # of a fit from one start
FIRST_ROUNDS, FINALISTS = 6, 24  # after these rounds only the best go on
CONVERGED = 1e-14  # a step of a number, of its size
SEEN = 1e-100  # of the square of a derivative, in tolerances
LEAST = 1e-12  # damping of a step, of the diagonal: two numbers may do the same
PROMISING = 1e-4  # of the difference: numbers that leave more, to second order, are not fitted
NEARLY = 5e-13  # of the difference: what an explanation may leave as rounding
NEAR_ZERO = 1e-6  # of the size of a number
NUMBERS = 1_000_000  # in one evaluation, about, of changes: each has nv^2 at each state
TURNED = np.pi * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])  # more starts for the zero of a hinge
Set = tuple[Hypothesis, ...]


class Fitted(NamedTuple):
    """The best change of one hypothesis, or of several."""

    hypotheses: Set
    changes: tuple[float, ...]
    ratio: float  # of what is left to its tolerance, the largest; explained if at most 1
    left_over: float  # of the difference, a share: root of the sum of the squares

    @property
    def is_possible(self) -> bool:
        return all(one.is_possible(change) for one, change in zip(self.hypotheses, self.changes))

    @property
    def explains(self) -> bool:
        """Whether it leaves nothing, is possible, and each of several has a part in that."""
        pairs = zip(self.hypotheses, self.changes)
        acts = all(abs(change) > FIT_ROUNDING * one.size for one, change in pairs)
        return self.ratio <= 1.0 and self.is_possible and (acts or len(self.changes) == 1)

    @property
    def cause(self) -> Cause:
        causes = [one.explained(change) for one, change in zip(self.hypotheses, self.changes)]
        return together(causes, self.left_over)


class Family(NamedTuple):
    """Hypotheses, all open or all complete, with the coefficients of the values in each one's change over its size.

    (n, states, entries); exact for all except directions and zeros. Of complete ones the first is what they
    add.
    """

    hypotheses: list[Hypothesis]
    first: ndarray
    second: ndarray


class OutOfTime(Exception):
    """A search has used its time."""


class Search:
    """Given values beside computed ones; what is left is in tolerances.

    computed: the values with changes of numbers of the model, (changes, states, entries). given: (states,
    entries); NaN where nothing is given. tolerance: of each entry, (states, entries). end: the
    time.monotonic() at which OutOfTime is raised.
    """

    def __init__(
        self, computed: Callable[[Changes], ndarray], given: ndarray, tolerance: ndarray, end: float = np.inf
    ):
        self.computed, self.given, self.end = computed, given, end
        least = tolerance[tolerance > 0.0].min(initial=1.0)  # what is always 0 has no scale
        self.tolerance = np.where(tolerance > 0.0, tolerance, least)
        self.known = np.isfinite(given)
        self.weight = np.where(self.known, 1.0 / self.tolerance, 0.0)
        self.right = computed({})[0]
        self.off = self.weighted(self.right)
        self.size = float(np.linalg.norm(self.off)) or 1.0

    def in_time(self) -> None:
        """OutOfTime, if it is."""
        if time.monotonic() > self.end:
            raise OutOfTime

    def within(self, entries: ndarray) -> "Search":
        """The search of what explains some entries (entries,), whatever the others are."""
        part = copy(self)
        part.known, part.weight = self.known & entries, self.weight * entries
        part.off = part.weighted(part.right)
        part.size = float(np.linalg.norm(part.off)) or 1.0
        return part

    def beside(self, one: Hypothesis) -> "Search":
        """The search of what explains the rest beside a complete hypothesis."""
        part = copy(self)
        part.given = self.given - self.expanded([one]).first[0]
        part.off = part.weighted(part.right)
        return part

    def weighted(self, values: ndarray) -> ndarray:
        """Given values minus others, in tolerances; 0 where none is given."""
        return np.where(self.known, self.given - values, 0.0) * self.weight

    def left_over(self, left: ndarray) -> tuple[float, float]:
        """What is left, in tolerances: the largest, and the share of the difference.

        The largest is at most 1 where the share is rounding: a length in mm rounds what is small.
        """
        share = float(np.linalg.norm(left)) / self.size
        ratio = float(np.nan_to_num(np.abs(left).max(), nan=np.inf))
        return (min(ratio, 1.0) if share <= NEARLY else ratio), share

    def values(self, sets: Sequence[Set], x: ndarray) -> ndarray:
        """Values for each row of changes x (rows, k) of k hypotheses: (rows, states, entries)."""
        rows = max(4, NUMBERS // self.right.size)
        if len(sets) > rows:
            starts = range(0, len(sets), rows)
            return np.concatenate([self.values(sets[k : k + rows], x[k : k + rows]) for k in starts])
        self.in_time()
        changes: dict[Path, ndarray] = {}
        columns = []
        for row, (hypotheses, amounts) in enumerate(zip(sets, x)):
            for one, change in zip(hypotheses, amounts):
                for path, coefficient in one.moves:
                    changes.setdefault(path, np.zeros(len(sets), x.dtype))[row] += coefficient * change
                if one.column is not None:
                    columns.append((row, change * one.column))
        values = self.computed(changes)
        values = np.array(np.broadcast_to(values, (len(sets), *values.shape[1:])), dtype=x.dtype)
        for row, added in columns:
            values[row] += added
        return values

    def expanded(self, hypotheses: list[Hypothesis]) -> Family:
        """The coefficients of hypotheses."""
        first = np.zeros((len(hypotheses), *self.right.shape))
        second = np.zeros_like(first) if any(one.moves for one in hypotheses) else 0.0 * first[:1]
        for k, one in enumerate(hypotheses):
            if one.column is not None:
                first[k] = one.size * one.column
        moved = [k for k, one in enumerate(hypotheses) if one.moves]
        if moved:
            sets, size = [(hypotheses[k],) for k in moved], np.array([[hypotheses[k].size] for k in moved])
            up = self.values(sets, size) - self.right
            down = self.values(sets, -size) - self.right if hypotheses[moved[0]].is_open else -up
            first[moved], second[moved] = (up - down) / 2.0, (up + down) / 2.0
        return Family(hypotheses, first, np.broadcast_to(second, first.shape))

    def alone(self, family: Family, is_thorough: bool = True) -> list[Fitted]:
        """The best change of each; directions and zeros from several starts, if it is thorough."""
        fits, sets, starts = [], list[Set](), list[float]()
        for one, first, second in zip(*family):
            if not one.is_open:
                fits.append(Fitted((one,), (1.0,), *self.left_over(self.off - first * self.weight)))
                continue
            left, best = nearest_change(first * self.weight, second * self.weight, self.off)
            if not one.is_quadratic:
                turned = TURNED if one.cause.kind == OF_ZERO else (-1.0, 1.0)
                more = [0.0, best * one.size, *turned] if is_thorough else []
                sets, starts = [*sets, *[(one,)] * len(more)], [*starts, *more]
            elif left <= PROMISING * self.size:
                sets, starts = [*sets, (one,)], [*starts, best * one.size]
            else:
                fits.append(Fitted((one,), (best * one.size,), np.inf, left / self.size))
        return fits + (self.fitted(sets, np.array(starts)[:, None]) if sets else [])

    def at_zero(self, fit: Fitted) -> Fitted:
        """A fit with zeros where these explain as much: a double root is found to half the digits."""
        changes = list(fit.changes)
        for k, (one, change) in enumerate(zip(fit.hypotheses, changes)):
            stated = float(one.cause.stated)
            if one.cause.kind != OF_ZERO and 0.0 < abs(stated + change) < NEAR_ZERO * one.size:
                changes[k] = -stated
        if fit.ratio > 1.0 or tuple(changes) == fit.changes:
            return fit
        ratio, share = self.left_over(self.weighted(self.values([fit.hypotheses], np.array([changes]))[0]))
        return Fitted(fit.hypotheses, tuple(changes), ratio, share) if ratio <= 1.0 else fit

    def fitted(self, sets: Sequence[Set], starts: ndarray) -> list[Fitted]:
        """The fit of each set of hypotheses, from the best of its starts (rows, k), the smallest remainder first."""
        x, left = self.descended(sets, starts, FIRST_ROUNDS)
        near = np.argsort(np.nan_to_num((left**2).sum(axis=(1, 2)), nan=np.inf))[:FINALISTS]
        x[near], left[near] = self.descended([sets[k] for k in near.tolist()], x[near])
        fits: dict[tuple[int, ...], Fitted] = {}
        for those, changes, rest in zip(sets, x.tolist(), left):
            ratio, share = self.left_over(rest)
            key = tuple(map(id, those))
            if key not in fits or ratio < fits[key].ratio:
                fits[key] = Fitted(those, tuple(changes), ratio, share)
        return sorted(map(self.at_zero, fits.values()), key=lambda fit: fit.ratio)

    def descended(self, sets: Sequence[Set], x: ndarray, rounds: int = ROUNDS) -> tuple[ndarray, ndarray]:
        """Changes by Levenberg and Marquardt from x (rows, k), and what they leave, (rows, states, entries)."""
        size = np.array([[one.size for one in those] for those in sets])
        steps, moving = np.eye(x.shape[1]) * (1j * TINY), np.arange(len(x))
        left = self.weighted(self.values(sets, x))
        best, damping = (left**2).sum(axis=(1, 2)), np.full(len(x), 1e-3)
        for _ in range(rounds):
            now = [sets[k] for k in moving.tolist()]
            slopes = [self.values(now, x[moving] + step).imag / TINY for step in steps]
            J = (np.stack(slopes, axis=1) * self.weight).reshape(len(moving), x.shape[1], -1)
            J = J * size[moving][:, :, None]
            normal = np.einsum("rim,rjm->rij", J, J)
            diagonal = np.einsum("rii->ri", normal)
            diagonal = np.where(diagonal > SEEN, diagonal, 1.0)  # a number without influence stays
            scaled = normal / np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
            scaled += np.eye(x.shape[1]) * damping[moving][:, None, None]
            down = np.einsum("rim,rm->ri", J, left[moving].reshape(len(moving), -1)) / np.sqrt(diagonal)
            step = np.linalg.solve(scaled, down[:, :, None])[:, :, 0] / np.sqrt(diagonal)
            tried = x[moving] + step * size[moving]
            after = self.weighted(self.values(now, tried))
            sums = np.nan_to_num((after**2).sum(axis=(1, 2)), nan=np.inf)
            better = sums < best[moving]
            down_there = moving[better]
            x[down_there], left[down_there], best[down_there] = tried[better], after[better], sums[better]
            damping[moving] = (damping[moving] * np.where(better, 0.05, 10.0)).clip(LEAST, 1e8)
            moving = moving[(np.abs(step).max(axis=1) > CONVERGED) & (damping[moving] < 1e6)]
            if not len(moving):
                break
        return x, left


def nearest_change(a: ndarray, b: ndarray, off: ndarray) -> tuple[float, float]:
    """What the best change x leaves, |off - x a - x^2 b|, and x, a root of a cubic; of (states, entries)."""
    aa, ab, bb = (a * a).sum(), (a * b).sum(), (b * b).sum()
    cubic = [2.0 * bb, 3.0 * ab, aa - 2.0 * (off * b).sum(), -(off * a).sum()]
    roots = np.roots(cubic) if np.isfinite(cubic).all() else np.zeros(0)
    real = [float(x.real) for x in roots if abs(x.imag) <= 1e-6 * (1.0 + abs(x))]
    left = [(float(np.linalg.norm(off - x * a - x * x * b)), x) for x in [*real, 0.0]]
    # of two that do the same the nearer
    return min(left, key=lambda left_by: (np.round(left_by[0]), abs(left_by[1])))


def explaining(fits: Iterable[Fitted]) -> list[Fitted]:
    return [fit for fit in fits if fit.explains]
