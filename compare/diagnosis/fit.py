"""Fits: which change of one place, or of two, explains given values; least squares over the states, many places at once."""

import time
from collections.abc import Sequence
from functools import cached_property
from itertools import combinations
from typing import NamedTuple

import numpy as np

from .model import TINY, Equations, Path
from .places import OF_ZERO, Place

ROUNDS = 25  # of a search from one start
LEADING, PARTNERS = 4, 8  # single places, and others that are tried with each
FIRST_ROUNDS, FINALISTS = 6, 24  # after these rounds only the best go on
CONVERGED = 1e-14  # a step of a place, of its size
SEEN = 1e-100  # of the square of a derivative, in tolerances
LEAST = 1e-12  # damping of a step, of the diagonal: two places may do the same
POLISHED = 16  # places with a quadratic influence that are fitted
CANDIDATES = 64  # pairs that are fitted, the most promising of all
ROWS = 256  # of changes in one evaluation
TURNED = np.pi * np.array([-0.75, -0.5, -0.25, 0.25, 0.5, 0.75, 1.0])  # further starts for the zero of a hinge


class Fitted(NamedTuple):
    """The best change of one or two places."""

    places: tuple[Place, ...]
    changes: tuple[float, ...]
    ratio: float  # of what is left to its tolerance, the largest; explained if at most 1
    left: float  # of the difference, a share: root of the sum of the squares


class OutOfTime(Exception):
    """A search has used its time."""


class Search:
    """Changes of places of the right equations that come closest to given values.

    given: (states, entries) as `Equations.values`; NaN where nothing is given. tolerance: of each entry, (states, entries).
    end: the time.monotonic() at which OutOfTime is raised.
    """

    def __init__(
        self,
        equations: Equations,
        places: Sequence[Place],
        given: np.ndarray,
        tolerance: np.ndarray,
        end: float = np.inf,
    ):
        self.equations, self.places, self.end = equations, list(places), end
        least = tolerance[tolerance > 0.0].min(initial=1.0)
        self.given, self.tolerance = given, np.where(tolerance > 0.0, tolerance, least)  # what is always 0 has no scale
        self.known = np.isfinite(given)
        self.weight = np.where(self.known, 1.0 / self.tolerance, 0.0)
        self.right = equations.values()[0]
        self.off = self.weighted(self.right)
        self.size = float(np.linalg.norm(self.off))
        self.single_fits: list[Fitted] = []  # of `singles` and `pairs`, once they are sought
        self.pair_fits: list[Fitted] = []

    def weighted(self, values: np.ndarray) -> np.ndarray:
        """Given values minus others, in tolerances, (..., states, entries); 0 where nothing is given."""
        return np.where(self.known, np.where(self.known, self.given, 0.0) - values, 0.0) * self.weight

    @property
    def differs(self) -> bool:
        return bool(np.abs(self.off).max() > 1.0)

    def values(self, which: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Values for each row of changes, (rows, states, entries): x (rows, k), of the places which (rows, k)."""
        if len(which) > ROWS:
            return np.concatenate(
                [self.values(which[k : k + ROWS], x[k : k + ROWS]) for k in range(0, len(which), ROWS)]
            )
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

    def derivatives(self, which: np.ndarray, x: np.ndarray) -> np.ndarray:
        """Derivatives by each of the k changes, in tolerances, (rows, k, states, entries)."""
        steps = np.eye(x.shape[1]) * (1j * TINY)
        return np.stack([self.values(which, x + step).imag / TINY for step in steps], axis=1) * self.weight

    def fitted(self, which: np.ndarray, x: np.ndarray, rounds: int = ROUNDS) -> tuple[np.ndarray, np.ndarray]:
        """The best changes from the starts x (rows, k), and what they leave, (rows, states, entries)."""
        size = np.array([[self.places[place].size for place in row] for row in which])
        left = self.weighted(self.values(which, x))
        best, damping, moving = (left**2).sum(axis=(1, 2)), np.full(len(x), 1e-3), np.arange(len(x))
        for _ in range(rounds):
            J = self.derivatives(which[moving], x[moving]).reshape(len(moving), x.shape[1], -1)
            J = J * size[moving][:, :, None]
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
            damping[moving] = np.clip(np.where(better, damping[moving] * 0.05, damping[moving] * 10.0), LEAST, 1e8)
            going = (np.abs(step).max(axis=1) > CONVERGED) & (damping[moving] < 1e6)
            moving = moving[going]
            if not len(moving):
                break
        return x, left

    def outcome(self, which: np.ndarray, x: np.ndarray, left: np.ndarray) -> list[Fitted]:
        """The best row of each set of places, the smallest remainder first."""
        found = {}
        for places, changes, rest in zip(which, x, left):
            ratio = float(np.nan_to_num(np.abs(rest).max(), nan=np.inf))
            share = float(np.linalg.norm(rest)) / self.size if self.size else 0.0
            one = Fitted(tuple(self.places[k] for k in places), tuple(map(float, changes)), ratio, share)
            key = tuple(sorted(places.tolist()))
            if key not in found or one.ratio < found[key].ratio:
                found[key] = one
        return sorted(found.values(), key=lambda one: one.ratio)

    @cached_property
    def nearest(self) -> list[tuple[float, float]]:
        """What the best change of each place leaves, in tolerances, and that change, for values quadratic in it."""
        found = nearest_changes(*self.expansion, self.off)
        return [(left, best * place.size) for (left, best), place in zip(found, self.places)]

    def singles(self) -> list[Fitted]:
        """Each place alone, the smallest remainder first.

        Where the values are quadratic in its change, the best one is the root of a cubic. The few best of these are fitted; all
        directions and zeros are fitted from several starts.
        """
        which, starts, promising = [], [], []
        for k, (place, (left, best)) in enumerate(zip(self.places, self.nearest)):
            if place.is_quadratic:
                promising.append((left, k, best))
            else:
                turned = TURNED if place.kind == OF_ZERO else (-1.0, 1.0)
                near = [0.0, best, *turned]
                which += [[k]] * len(near)
                starts += [[x] for x in near]
        for _, k, x in sorted(promising)[:POLISHED]:
            which.append([k])
            starts.append([x])
        which, (x, left) = np.array(which), self.fitted(np.array(which), np.array(starts), FIRST_ROUNDS)
        near = np.argsort(np.nan_to_num((left**2).sum(axis=(1, 2)), nan=np.inf))[:FINALISTS]
        x[near], left[near] = self.fitted(which[near], x[near])
        self.single_fits = self.outcome(which, x, left)
        return self.single_fits

    @cached_property
    def expansion(self) -> tuple[np.ndarray, np.ndarray]:
        """First and second coefficients of the values in each place's change over its size, in tolerances.

        (places, states, entries) each; exact where the values are quadratic: for all except directions and zeros.
        """
        which = np.arange(len(self.places))[:, None]
        size = np.array([[place.size] for place in self.places])
        up, down = (self.values(which, sign * size) for sign in (1.0, -1.0))
        return (up - down) / 2.0 * self.weight, ((up + down) / 2.0 - self.right) * self.weight

    @property
    def seen(self) -> list[Path]:
        """The numbers of the tree on which the values depend."""
        first, second = self.expansion
        moved = (np.abs(first).max(axis=(1, 2)) > 1.0) | (np.abs(second).max(axis=(1, 2)) > 1.0)
        return [place.moves[0][0] for place, moves in zip(self.places, moved) if moves and place.moves]

    def partners(self, leading: Fitted) -> tuple[np.ndarray, np.ndarray]:
        """Places that explain most of what a fitted one leaves, together with it, and starts: (PARTNERS, 2) each.

        They follow from derivatives at the fitted place, which may be far from the stated one.
        """
        first = next(k for k, place in enumerate(self.places) if place is leading.places[0])
        which = np.array([[first, k] for k in range(len(self.places)) if k != first])
        x = np.tile([leading.changes[0], 0.0], (len(which), 1))
        left = self.weighted(self.values(which[:1], x[:1])).ravel()
        J = np.nan_to_num(self.derivatives(which, x)).reshape(len(which), 2, -1)
        lengths = np.linalg.norm(J, axis=2)
        J = np.divide(J, lengths[:, :, None], out=np.zeros_like(J), where=lengths[:, :, None] > 0.0)
        normal = np.einsum("rim,rjm->rij", J, J) + 1e-9 * np.eye(2)
        down = J @ left
        step = np.linalg.solve(normal, down[:, :, None])[:, :, 0]
        best = np.argsort(-np.einsum("ri,ri->r", step, down))[:PARTNERS]
        steps = np.divide(step, lengths, out=np.zeros_like(step), where=lengths > 0.0)
        return which[best], (x + steps)[best]

    def pairs(self) -> list[Fitted]:
        """Two places together: the most promising of all pairs, where each change is taken to act alone, are fitted."""
        first, second = (part.reshape(len(self.places), -1) for part in self.expansion)
        columns = np.concatenate([first, second])
        lengths = np.linalg.norm(columns, axis=1)
        columns = np.divide(columns, lengths[:, None], out=np.zeros_like(columns), where=lengths[:, None] > 0.0)
        inner, down, count = columns @ columns.T, columns @ self.off.ravel(), len(self.places)
        active = [k for k in range(count) if lengths[k] > 0.0]
        pairs = np.array(list(combinations(active, 2)))
        if not len(pairs):
            return []
        spans = np.concatenate([pairs, pairs + count], axis=1)  # of the first and second coefficients of both
        matrices = inner[spans[:, :, None], spans[:, None, :]] + 1e-9 * np.eye(4)
        coefficients = np.linalg.solve(matrices, down[spans][:, :, None])[:, :, 0]
        gained = np.einsum("pi,pi->p", coefficients, down[spans])
        best = np.argsort(-gained)[:CANDIDATES]
        size = np.array([place.size for place in self.places])
        starts = coefficients[best][:, :2] / lengths[pairs[best]] * size[pairs[best]]
        which, starts = [pairs[best]] * 2, [starts, np.zeros_like(starts)]
        for one in sorted(self.single_fits, key=lambda one: one.left)[:LEADING]:
            more = self.partners(one)
            which.append(more[0])
            starts.append(more[1])
        which, starts = np.concatenate(which), np.concatenate(starts)
        near, left = self.fitted(which, starts, FIRST_ROUNDS)
        found = np.argsort(np.nan_to_num((left**2).sum(axis=(1, 2)), nan=np.inf))[:FINALISTS]
        self.pair_fits = self.outcome(which[found], *self.fitted(which[found], near[found]))
        return self.pair_fits


def nearest_changes(first: np.ndarray, second: np.ndarray, off: np.ndarray) -> list[tuple[float, float]]:
    """What the best change x of each place leaves, |off - x first - x^2 second|, and x, a root of a cubic.

    first, second: (places, states, entries), off: (states, entries), in tolerances.
    """
    (first, second), r, nearest = (part.reshape(len(part), -1) for part in (first, second)), off.ravel(), []
    rr, ra, rb = r @ r, first @ r, second @ r
    aa, ab, bb = (np.einsum("kn,kn->k", *pair) for pair in ((first, first), (first, second), (second, second)))
    for k in range(len(first)):
        cubic = [2.0 * bb[k], 3.0 * ab[k], aa[k] - 2.0 * rb[k], -ra[k]]
        roots = np.roots(cubic) if np.isfinite(cubic).all() else np.zeros(0)
        roots = roots[np.abs(roots.imag) <= 1e-9 * (1.0 + np.abs(roots))].real
        left = {
            x: rr - 2.0 * x * ra[k] - 2.0 * x * x * rb[k] + x * x * aa[k] + 2.0 * x**3 * ab[k] + x**4 * bb[k]
            for x in roots
        }
        best = min(left, key=left.get, default=0.0)
        nearest.append((float(np.sqrt(max(0.0, left.get(best, rr)))), float(best)))
    return nearest
