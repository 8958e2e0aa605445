"""Two causes together, one of them a number: which pairs may leave nothing, by inner products of what they add."""

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations
from typing import Any

import numpy as np
from numpy import ndarray

from .fit import PROMISING, Family, Fitted, Search, explaining
from .hypothesis import Hypothesis

BLOCK = 20_000  # pairs that are looked at together
CANDIDATES = 64  # pairs of two numbers that are fitted, the most promising of all
MOST_NEAR = 200  # slips that are fitted beside a number
SAME = 1e-9  # of a cosine from 1: two columns that do the same


def of_numbers(search: Search, families: Sequence[Family]) -> list[Fitted]:
    """The fits of two of the first family, or of one and one of the others, that leave nothing.

    The most promising pairs are fitted.
    """
    every = [one for family in families for one in family.hypotheses]
    count, columns = len(every), np.concatenate([*(f.first for f in families), *(f.second for f in families)])
    columns = columns * search.weight
    columns = columns.reshape(2 * count, -1)
    lengths = np.linalg.norm(columns, axis=1)
    columns = columns / np.where(lengths > 0.0, lengths, 1.0)[:, None]
    inner, down = columns @ columns.T, columns @ search.off.ravel()
    acting = np.flatnonzero(lengths[:count] > 0.0).tolist()
    pairs = np.array([pair for pair in combinations(acting, 2) if pair[0] < len(families[0].hypotheses)])
    near: list[tuple[float, list[int], ndarray]] = []
    for start in range(0, len(pairs), BLOCK):
        search.in_time()
        block = pairs[start : start + BLOCK]
        spans = np.concatenate([block, block + count], axis=1)  # of first and second coefficients of both
        matrices = inner[spans[:, :, None], spans[:, None, :]] + SAME * np.eye(4)
        coefficients = np.linalg.solve(matrices, down[spans][:, :, None])[:, :, 0]
        explained = np.einsum("pi,pi->p", coefficients, down[spans])
        best = np.argsort(-explained)[:CANDIDATES]
        changes = coefficients[best][:, :2] / lengths[block[best]]
        near += zip(explained[best].tolist(), block[best].tolist(), changes)
    near = sorted(near, key=lambda pair: -pair[0])[:CANDIDATES]
    if not near:
        return []
    sets = [(every[i], every[j]) for _, (i, j), _ in near]
    sizes = np.array([[one.size for one in pair] for pair in sets])
    starts = np.array([x for *_, x in near]) * sizes
    return explaining(search.fitted(sets * 2, np.concatenate([starts, 0.0 * starts])))


def of_slips(
    search: Search, numbers: Family, families: Mapping[Any, Family]
) -> Iterator[tuple[Any, Hypothesis, Hypothesis]]:
    """Complete hypotheses, each with its kind, and the numbers that leave nothing beside them; their changes are added."""
    polynomial = [k for k, one in enumerate(numbers.hypotheses) if one.is_quadratic]
    a, b = ((part[polynomial] * search.weight).reshape(-1, search.off.size) for part in numbers[1:])
    aa, ab, bb = (np.einsum("km,km->k", *pair) for pair in ((a, a), (a, b), (b, b)))
    determinant = aa * bb - ab * ab
    is_plane = determinant > SAME * aa * bb  # else both columns do the same
    near: list[tuple[float, Any, Hypothesis, int]] = []
    for kind, family in families.items():
        search.in_time()
        complete = [v for v, one in enumerate(family.hypotheses) if not one.is_open]
        added = (family.first[complete] * search.weight).reshape(len(complete), search.off.size)
        left = search.off.ravel() - added
        squares, la, lb = np.einsum("vm,vm->v", left, left), left @ a.T, left @ b.T
        of_line = la * la / np.where(aa > 0.0, aa, 1.0)
        of_plane = (bb * la * la - 2.0 * ab * la * lb + aa * lb * lb) / np.where(is_plane, determinant, 1.0)
        after = squares[:, None] - np.where(is_plane, of_plane, of_line)
        may = (np.abs(added).max(axis=1, initial=0.0) > 1.0)[:, None] & (aa > 0.0)
        may &= after < (PROMISING * search.size) ** 2 + SAME * squares[:, None]
        near += [(after[v, k], kind, family.hypotheses[complete[v]], k) for v, k in np.argwhere(may)]
    for _, kind, one, k in sorted(near, key=lambda pair: pair[0])[:MOST_NEAR]:
        chosen = [polynomial[k]]
        beside = search.beside(one)
        family = Family([numbers.hypotheses[chosen[0]]], numbers.first[chosen], numbers.second[chosen])
        if explaining(beside.alone(family)):
            yield kind, one, family.hypotheses[0]
