"""Fits: which change of one place, or of two, explains given values; least squares over the states, many places at once."""

import time
from collections.abc import Callable, Sequence
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .model import TINY, Equations
from .places import OF_ZERO, Place

ROUNDS = 25  # of a search from one start
FIRST_ROUNDS, FINALISTS = 6, 24  # after these rounds only the best go on
CONVERGED = 1e-14  # a step of a place, of its size
SEEN = 1e-100  # of the square of a derivative, in tolerances
LEAST = 1e-12  # damping of a step, of the diagonal: two places may do the same
POLISHED = 24  # places with a quadratic influence that are fitted
CANDIDATES = 64  # pairs that are fitted, the most promising of all
ROWS = 256  # of changes in one evaluation
TURNED = np.pi * np.array(
    [-0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0]
)  # further starts for the zero of a hinge


class Fitted(NamedTuple):
    """The best change of one or two places."""

    places: tuple[Place, ...]
    changes: tuple[float, ...]
    ratio: float  # of what is left to its tolerance, the largest; explained if at most 1
    left: float  # of the difference, a share: root of the sum of the squares

    @property
    def is_possible(self) -> bool:
        return all(of.is_possible(change) for of, change in zip(self.places, self.changes))

    @property
    def explains(self) -> bool:
        return self.ratio <= 1.0 and self.is_possible


class OutOfTime(Exception):
    """A search has used its time."""


class Search:
    """Changes of places of the right equations that come closest to given values.

    given: (states, entries) as `Equations.values`; NaN where nothing is given. tolerance: of each entry, (states, entries).
    end: the time.monotonic() at which OutOfTime is raised.
    """

    def __init__(self, equations: Equations, places: Sequence[Place], given, tolerance, end: float = np.inf):
        self.equations, self.places, self.end = equations, list(places), end
        least = tolerance[tolerance > 0.0].min(initial=1.0)  # what is always 0 has no scale
        self.known = np.isfinite(given)
        self.given = np.where(self.known, given, 0.0)
        self.weight = np.where(self.known, 1.0 / np.where(tolerance > 0.0, tolerance, least), 0.0)
        self.right = equations.values()[0]
        self.off = self.weighted(self.right)
        self.size = float(np.linalg.norm(self.off))
        self.sizes = np.array([place.size for place in self.places])
        self.is_finished = True

    def in_time(self, fits: Callable[[], list[Fitted]]) -> list[Fitted]:
        """The fits, [] where the time is over."""
        try:
            return fits()
        except OutOfTime:
            self.is_finished = False
            return []

    def weighted(self, values: np.ndarray) -> np.ndarray:
        """Given values minus others, in tolerances, (..., states, entries); 0 where nothing is given."""
        return np.where(self.known, self.given - values, 0.0) * self.weight

    def values(self, which: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Values for each row of changes, (rows, states, entries): x (rows, k), of the places which (rows, k)."""
        if len(which) > ROWS:
            starts = range(0, len(which), ROWS)
            return np.concatenate([self.values(which[k : k + ROWS], x[k : k + ROWS]) for k in starts])
        if time.monotonic() > self.end:
            raise OutOfTime
        changes, columns = {}, []
        for row in range(len(which)):
            for place, change in zip(which[row], x[row]):
                for path, coefficient in self.places[place].moves:
                    changes.setdefault(path, np.zeros(len(which), x.dtype))[row] += coefficient * change
                if self.places[place].column is not None:
                    columns.append((row, self.places[place], change))
        values = self.equations.values(changes)
        values = np.array(np.broadcast_to(values, (len(which), *values.shape[1:])), dtype=x.dtype)
        for row, place, change in columns:
            values[row, :, place.entry] += change * place.column
        return values

    def fitted(self, which: np.ndarray, x: np.ndarray, rounds: int = ROUNDS) -> tuple[np.ndarray, np.ndarray]:
        """The best changes from the starts x (rows, k), and what they leave, (rows, states, entries)."""
        size, steps = self.sizes[which], np.eye(x.shape[1]) * (1j * TINY)
        left = self.weighted(self.values(which, x))
        best, damping, moving = (left**2).sum(axis=(1, 2)), np.full(len(x), 1e-3), np.arange(len(x))
        for _ in range(rounds):
            slopes = [
                self.values(which[moving], x[moving] + step).imag / TINY * self.weight for step in steps
            ]
            J = np.stack(slopes, axis=1).reshape(len(moving), x.shape[1], -1) * size[moving][:, :, None]
            normal = np.einsum("rim,rjm->rij", J, J)
            diagonal = np.einsum("rii->ri", normal)
            diagonal = np.where(diagonal > SEEN, diagonal, 1.0)  # a place without influence stays
            scaled = normal / np.sqrt(diagonal[:, :, None] * diagonal[:, None, :])
            scaled += np.eye(x.shape[1]) * damping[moving][:, None, None]
            down = np.einsum("rim,rm->ri", J, left[moving].reshape(len(moving), -1)) / np.sqrt(diagonal)
            step = np.linalg.solve(scaled, down[:, :, None])[:, :, 0] / np.sqrt(diagonal)
            tried = x[moving] + step * size[moving]
            after = self.weighted(self.values(which[moving], tried))
            sums = np.nan_to_num((after**2).sum(axis=(1, 2)), nan=np.inf)
            better = sums < best[moving]
            now = moving[better]
            x[now], left[now], best[now] = tried[better], after[better], sums[better]
            damping[moving] = np.clip(
                np.where(better, damping[moving] * 0.05, damping[moving] * 10.0), LEAST, 1e8
            )
            moving = moving[(np.abs(step).max(axis=1) > CONVERGED) & (damping[moving] < 1e6)]
            if not len(moving):
                break
        return x, left

    def outcome(self, which: np.ndarray, starts: np.ndarray) -> list[Fitted]:
        """The fit of each set of places, from the best of its starts, the smallest remainder first."""
        x, left = self.fitted(which, starts, FIRST_ROUNDS)
        near = np.argsort(np.nan_to_num((left**2).sum(axis=(1, 2)), nan=np.inf))[:FINALISTS]
        x[near], left[near] = self.fitted(which[near], x[near])
        found = {}
        for places, changes, rest in zip(which, x, left):
            ratio = float(np.nan_to_num(np.abs(rest).max(), nan=np.inf))
            share = float(np.linalg.norm(rest)) / self.size
            one = Fitted(tuple(self.places[k] for k in places), tuple(map(float, changes)), ratio, share)
            key = tuple(places.tolist())
            if key not in found or one.ratio < found[key].ratio:
                found[key] = one
        return sorted(found.values(), key=lambda one: one.ratio)

    def singles(self) -> list[Fitted]:
        """Each place alone, the smallest remainder first.

        Where the values are quadratic in its change, the best one is the root of a cubic. The few best of these are fitted; all
        directions and zeros are fitted from several starts.
        """
        which, starts, promising = [], [], []
        for k, (place, (left, best)) in enumerate(
            zip(self.places, nearest_changes(*self.expansion, self.off))
        ):
            best *= place.size
            if place.is_quadratic:
                promising.append((left, k, best))
            else:
                near = [0.0, best, *(TURNED if place.kind == OF_ZERO else (-1.0, 1.0))]
                which += [[k]] * len(near)
                starts += [[x] for x in near]
        for _, k, x in sorted(promising)[:POLISHED]:
            which.append([k])
            starts.append([x])
        return self.outcome(np.array(which), np.array(starts))

    @cached_property
    def expansion(self) -> tuple[np.ndarray, np.ndarray]:
        """First and second coefficients of the values in each place's change over its size, in tolerances.

        (places, states, entries) each; exact where the values are quadratic: for all except directions and zeros.
        """
        which, size = np.arange(len(self.places))[:, None], self.sizes[:, None]
        up, down = (self.values(which, sign * size) for sign in (1.0, -1.0))
        return (up - down) / 2.0 * self.weight, ((up + down) / 2.0 - self.right) * self.weight

    def pairs(self, kinds: Sequence[str]) -> list[Fitted]:
        """Two places of some kinds together: the most promising, where each change is taken to act alone, are fitted."""
        columns = np.concatenate([part.reshape(len(self.places), -1) for part in self.expansion])
        lengths = np.linalg.norm(columns, axis=1)
        columns = np.divide(
            columns, lengths[:, None], out=np.zeros_like(columns), where=lengths[:, None] > 0.0
        )
        inner, down, count = columns @ columns.T, columns @ self.off.ravel(), len(self.places)
        active = [k for k, place in enumerate(self.places) if lengths[k] > 0.0 and place.kind in kinds]
        pairs = np.array(list(combinations(active, 2)))
        if not len(pairs):
            return []
        spans = np.concatenate([pairs, pairs + count], axis=1)  # of the first and second coefficients of both
        matrices = inner[spans[:, :, None], spans[:, None, :]] + 1e-9 * np.eye(4)
        coefficients = np.linalg.solve(matrices, down[spans][:, :, None])[:, :, 0]
        best = np.argsort(-np.einsum("pi,pi->p", coefficients, down[spans]))[:CANDIDATES]
        near = coefficients[best][:, :2] / lengths[pairs[best]] * self.sizes[pairs[best]]
        return self.outcome(np.tile(pairs[best], (2, 1)), np.concatenate([near, np.zeros_like(near)]))


def nearest_changes(first: np.ndarray, second: np.ndarray, off: np.ndarray) -> list[tuple[float, float]]:
    """What the best change x of each place leaves, |off - x first - x^2 second|, and x, a root of a cubic.

    first, second: (places, states, entries), off: (states, entries), in tolerances.
    """
    nearest = []
    for a, b in zip(first, second):
        cubic = [
            2.0 * (b * b).sum(),
            3.0 * (a * b).sum(),
            (a * a).sum() - 2.0 * (off * b).sum(),
            -(off * a).sum(),
        ]
        roots = np.roots(cubic) if np.isfinite(cubic).all() else np.zeros(0)
        real = [float(x.real) for x in roots if abs(x.imag) <= 1e-9 * (1.0 + abs(x))]
        left = [(float(np.linalg.norm(off - x * a - x * x * b)), x) for x in [*real, 0.0]]
        nearest.append(
            min(left, key=lambda one: (np.round(one[0]), abs(one[1])))
        )  # of two that do the same the nearer
    return nearest
