"""Where equations differ: entries of Mbar, gravity, and coefficients of products of speeds in h; and which term of
them is wrong.

These are polynomials in the sines and cosines of hinges and in the positions of slides, of second degree in
each. A common error is one term with another factor, or replaced by another.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from ..core.finding import Finding
from ..core.text import apart, say
from ..core.words import listed
from .cause import TEMPLATE, Detail
from .given import Given
from .model import MOST_SPEEDS, Entry, Equations, coefficients_of

MOST_JOINTS = 3  # whose terms are tried
ROUNDING = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
SHOWN = 6  # positions, and coefficients, in a sentence
STATES_PER_TERM = 2  # at which the right expressions are known
FIT_ROUNDING = 1e-9  # of the largest coefficient
AS_NEAR = 1.0 - 1e-6  # of the largest part of a target along one term

Terms = dict[str, ndarray]  # values of terms at states, (states,), by their names


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

    @property
    def is_complete(self) -> bool:
        """Whether these make up all that differs in h: nothing is linear or cubic in the speeds."""
        values, h = self.given.values, self.given.equations.h.copy()
        for coefficient in self.differing:
            i, *pair = coefficient.entry.at
            if coefficient.entry.kind != "M":
                h[:, i] += coefficient.off * np.prod(values.qd[:, pair], axis=1)
        size = values.tolerances[1] * (1.0 + np.abs(values.qd).max(axis=1, keepdims=True) ** 2)
        off = np.abs(values.bias - h)
        return bool(((off <= ROUNDING * size) | ~np.isfinite(off)).all())

    @cached_property
    def terms(self) -> list[tuple[str, str]]:
        """Yours and the right one, of each coefficient that differs; empty if they are not found."""
        equations, tree = self.given.equations, self.given.tree
        names, kinds, differing = equations.speeds, tree.kind, self.differing
        if "ball" in kinds or len(kinds) > MOST_JOINTS or len(differing) > SHOWN:
            return [("", "")] * len(differing)
        x = np.random.default_rng(0).uniform(-3.0, 3.0, (STATES_PER_TERM * 5 ** len(kinds), len(kinds)))
        reference = np.array(tree.reference)
        right, basis = (
            Equations(tree, x + reference, np.zeros_like(x)).coefficients,
            products(names, kinds, x),
        )
        angles = equations.q - reference
        tried = products(names, kinds, angles) | dict(zip(names, angles.T))
        return [wrong_term(tried, expression(basis, right[one.entry]), one) for one in differing]

    def details(self) -> tuple[Detail, ...]:
        """The coefficients that differ, in a sentence."""
        details, equations = [], self.given.equations
        for coefficient, terms in zip(self.differing[:SHOWN], self.terms):
            k, names = int(np.argmax(np.abs(coefficient.off))), equations.coordinates.positions
            at = tuple(f"{name} = {value:.6g}" for name, value in zip(names[:SHOWN], equations.q[k]))
            numbers = coefficient.yours[k], coefficient.right[k]
            yours, right = (x if abs(x) > coefficient.tolerance[k] else 0.0 for x in numbers)
            details.append(Detail(coefficient.entry.named(equations.speeds), terms, yours, right, at))
        return tuple(details)

    def causes(self) -> list[Cause]:
        """The cause, if all that differs is the same wrong term, else none."""
        if not self.differing or not self.is_complete or len(set(self.terms)) > 1 or not any(self.terms[0]):
            return []
        explains = say(Finding(TEMPLATE, "details", {"detail": Detail("", self.terms[0])}))
        names = listed(
            [coefficient.entry.named(self.given.equations.speeds) for coefficient in self.differing]
        )
        return [Cause(rank=2, kind="term", place=names, stated="right", explains=explains)]


def products(names: Sequence[str], kinds: Sequence[str], x: ndarray) -> Terms:
    """Products of one function of each joint, the simplest first, (states,) each."""
    functions, ones = [], np.ones(len(x))  # of each joint: degree, name, values
    for name, kind, p in zip(names, kinds, x.T):
        of_joint = [(0, "", ones)]
        if kind == "slide":
            of_joint += [(1, name, p), (2, f"{name}^2", p**2)]
        else:
            c, s = np.cos(p), np.sin(p)
            of_joint += [(1, f"cos({name})", c), (1, f"sin({name})", s)]
            of_joint += [(2, f"cos({name})^2", c * c), (1, f"sin({name}) cos({name})", s * c)]
        functions.append(of_joint)
    terms = {}
    for factors in sorted(product(*functions), key=lambda factors: sum(degree for degree, *_ in factors)):
        name = " ".join(name for _, name, _ in factors if name)
        terms[name or "1"] = np.prod([ones, *(values for *_, values in factors)], axis=0)
    return terms


def expression(basis: Terms, right: ndarray) -> dict[str, float]:
    """An expression (states,) as a sum of terms, with their factors."""
    x = np.linalg.lstsq(np.array(list(basis.values())).T, right, rcond=None)[0]
    least = FIT_ROUNDING * np.abs(x).max()
    return {name: float(value) for name, value in zip(basis, x) if abs(value) > least}


def wrong_term(tried: Terms, right: Mapping[str, float], coefficient: Coefficient) -> tuple[str, str]:
    """What yours has, and what the right expression has in its place, "" for nothing; both empty: more is wrong."""
    names, columns = list(tried), np.array(list(tried.values())) / coefficient.tolerance
    target = coefficient.off / coefficient.tolerance
    for replaced in ([], *([names.index(name)] for name in right)):
        for k in nearest_columns(columns, target, replaced):
            x = np.linalg.lstsq(columns[[*replaced, k]].T, target, rcond=None)[0]
            left = np.abs(target - x @ columns[[*replaced, k]]).max()
            if left > 1.0 or np.ptp(np.abs(x)) > FIT_ROUNDING * np.abs(x).max():
                continue
            factor, expected = float(x[-1]), right.get(names[k], 0.0)
            if replaced:
                return with_factor(factor, names[k]), with_factor(-float(x[0]), names[replaced[0]])
            yours = expected + factor
            is_there = abs(yours) > FIT_ROUNDING * abs(factor)
            of_yours = with_factor(yours, names[k], expected) if is_there else ""
            return of_yours, with_factor(expected, names[k], yours) if expected else ""
    return "", ""


def nearest_columns(columns: ndarray, target: ndarray, chosen: list[int]) -> list[int]:
    """The columns that come closest to a target together with the chosen ones."""
    basis = np.linalg.qr(columns[chosen].T)[0] if chosen else np.zeros((len(target), 0))
    rest = columns - columns @ basis @ basis.T
    least = 1e-6 * np.linalg.norm(columns, axis=1)
    sizes = np.linalg.norm(rest, axis=1)
    along = np.where(sizes > least, np.abs(rest @ target) / np.maximum(sizes, least), 0.0)
    return np.flatnonzero(along >= AS_NEAR * along.max()).tolist()


def with_factor(value: float, term: str, other: float = 0.0) -> str:
    """A coefficient with its term; other: a coefficient that it is told from."""
    number = apart(value, other, 10)
    if term == "1":
        return f"a constant {number}"
    return term if number == "1" else f"{number} {term}"
