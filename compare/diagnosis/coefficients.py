"""Where equations differ: entries of Mbar, gravity, and coefficients of products of speeds in h, and which of
their terms.

These are polynomials in the sines and cosines of hinges and in the positions of slides, of second degree in
each. A common error is one term with another factor, or replaced by another. Terms have two forms: products
such as sin(hip) cos(knee) and sums such as sin(hip + knee).
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations, product
from typing import NamedTuple

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from ..core.finding import Finding
from ..core.text import apart, say
from ..core.words import listed
from .cause import TEMPLATE, Detail
from .model import MOST_SPEEDS, Entry, Equations, coefficients_of

MOST_JOINTS = 3  # whose terms are tried
ROUNDING = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
SHOWN = 6  # positions, and coefficients, in a sentence
STATES_PER_TERM = 2  # at which the right expressions are known
FIT_ROUNDING = 1e-9  # of the largest coefficient
SAME_FACTOR = 1e-7  # of the largest of several: two numbers that are one
SHOWN_TIMES = {-2: "-2 ", -1: "-", 1: "", 2: "2 "}
AS_NEAR = 1.0 - 1e-6  # of the largest part of a target along one term
# numbers of terms of the right expression and of other terms, and whether these replace those
COMBINATIONS = ((1, 0, False), (1, 1, True), (0, 1, False), (1, 1, False), (2, 0, False), (2, 1, False))

Bias = Callable[[ndarray], ndarray]  # speeds (states, nv) -> h (states, nv) at the positions of the states
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

    equations: Equations
    given: ndarray  # (states, entries), as its tolerance
    tolerance: ndarray
    bias: Bias | None  # your h at these positions and other speeds; None: only values are given

    @cached_property
    def differing(self) -> list[Coefficient]:
        equations, right = self.equations, self.equations.coefficients
        tolerances = dict.fromkeys(right, ROUNDING * self.tolerance[:, equations.in_h].max(axis=1))
        tolerances |= dict(zip(equations.entries, self.tolerance[:, equations.in_M].T))
        yours = dict(zip(equations.entries, self.given[:, equations.in_M].T)) | self.of_h
        finite = [entry for entry, values in yours.items() if np.isfinite(values).all()]
        compared = [Coefficient(entry, yours[entry], right[entry], tolerances[entry]) for entry in finite]
        return [entry for entry in compared if (np.abs(entry.off) > entry.tolerance).any()]

    @property
    def of_h(self) -> dict[Entry, ndarray]:
        """Your coefficients of h, as far as they are known."""
        nv, bias, states = self.equations.nv, self.bias, len(self.given)
        if not self.equations.qd.any():
            at_rest = self.given[:, self.equations.in_h].T
            return {Entry("gravity", (i,)): column for i, column in enumerate(at_rest)}
        if bias is None or nv > MOST_SPEEDS:
            return {}
        return coefficients_of(
            lambda speeds: np.stack([bias(np.tile(row, (states, 1))) for row in speeds]), nv
        )

    @property
    def is_complete(self) -> bool:
        """Whether these make up all that differs in h: nothing is linear or cubic in the speeds."""
        qd, in_h = self.equations.qd, self.equations.in_h
        h = self.equations.right[:, in_h].copy()
        for coefficient in self.differing:
            i, *pair = coefficient.entry.at
            if coefficient.entry.kind != "M":
                h[:, i] += coefficient.off * np.prod(qd[:, pair], axis=1)
        size = self.tolerance[:, in_h] * (1.0 + np.abs(qd).max(axis=1, keepdims=True) ** 2)
        off = np.abs(self.given[:, in_h] - h)
        return bool(((off <= ROUNDING * size) | ~np.isfinite(off)).all())

    @cached_property
    def terms(self) -> list[list[tuple[str, str]]]:
        """See Detail, of each coefficient that differs; [] if the terms are not found."""
        tree, names, kinds = self.equations.tree, self.equations.speeds, self.equations.tree.kind
        if "ball" in kinds or len(kinds) > MOST_JOINTS or len(self.differing) > SHOWN:
            return [[] for _ in self.differing]
        x = np.random.default_rng(0).uniform(-3.0, 3.0, (STATES_PER_TERM * 5 ** len(kinds), len(kinds)))
        reference = np.array(tree.reference)
        right = Equations(tree, x + reference, np.zeros_like(x)).coefficients
        forms = [form(names, kinds, x) for form in (sums, products)]
        angles = self.equations.q - reference
        tried = sums(names, kinds, angles) | products(names, kinds, angles) | dict(zip(names, angles.T))
        found = []
        for coefficient in self.differing:
            expression = right_terms(forms, right[coefficient.entry], np.abs(coefficient.yours).max())
            found.append(list(pairs_of_terms(expression, few_terms(tried, expression, coefficient))))
        return found

    def details(self) -> tuple[Detail, ...]:
        """The coefficients that differ, in a sentence."""
        details, names = [], self.equations.coordinates.positions
        for coefficient, terms in zip(self.differing[:SHOWN], self.terms):
            k = int(np.argmax(np.abs(coefficient.off)))
            at = tuple(f"{name} = {value:.6g}" for name, value in zip(names[:SHOWN], self.equations.q[k]))
            numbers = coefficient.yours[k], coefficient.right[k]
            yours, right = (x if abs(x) > coefficient.tolerance[k] else 0.0 for x in numbers)
            details.append(Detail(coefficient.entry.named(self.equations.speeds), terms, yours, right, at))
        return tuple(details)

    def causes(self, most: int) -> list[Cause]:
        """The cause, if all that differs is at most this number of wrong terms, else none."""
        if not self.differing or not self.is_complete or not all(self.terms):
            return []
        kinds = {pair for terms in self.terms for pair in terms}
        if len(kinds) > most:
            return []
        findings = [Finding(TEMPLATE, "details", {"detail": Detail("", terms)}) for terms in self.terms]
        names = listed([coefficient.entry.named(self.equations.speeds) for coefficient in self.differing])
        explains = "; ".join(dict.fromkeys(map(say, findings)))
        return [Cause(rank=1 + len(kinds), kind="term", place=names, stated="right", explains=explains)]


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


def sums(names: Sequence[str], kinds: Sequence[str], x: ndarray) -> Terms:
    """Sines and cosines of sums of the angles, each up to twice, times powers of the slides."""
    slides = [k for k, kind in enumerate(kinds) if kind == "slide"]
    hinges = [k for k, kind in enumerate(kinds) if kind != "slide"]
    powers = products([names[k] for k in slides], ["slide"] * len(slides), x[:, slides])
    terms = dict(powers)
    for times in sorted(product(range(-2, 3), repeat=len(hinges)), key=lambda times: sum(map(abs, times))):
        if next((k for k in times if k), 0) > 0:  # the others are the same
            parts = [f"{SHOWN_TIMES[k]}{names[hinge]}" for k, hinge in zip(times, hinges) if k]
            called = " + ".join(parts).replace("+ -", "- ")
            angle = x[:, hinges] @ np.array(times)
            for power, column in powers.items():
                before = "" if power == "1" else f"{power} "
                terms[f"{before}cos({called})"] = column * np.cos(angle)
                terms[f"{before}sin({called})"] = column * np.sin(angle)
    return terms


def right_terms(forms: Sequence[Terms], right: ndarray, size: float) -> dict[str, float]:
    """An expression (states,) as a sum of terms, in the form with fewer; what rounding yours leaves is 0."""
    fits = []
    for form in forms:
        x = np.linalg.lstsq(np.array(list(form.values())).T, right, rcond=None)[0]
        least = FIT_ROUNDING * max(np.abs(x).max(), size)
        fits.append({name: float(value) for name, value in zip(form, x) if abs(value) > least})
    return min(fits, key=len)


def few_terms(tried: Terms, right: Mapping[str, float], coefficient: Coefficient) -> dict[str, float]:
    """The terms that make up a coefficient's difference, with their factors; {}: a few do not suffice."""
    names, columns = list(tried), np.array(list(tried.values())) / coefficient.tolerance
    target = coefficient.off / coefficient.tolerance
    of_right = [names.index(name) for name in right]
    for count, others, is_replaced in COMBINATIONS:
        for chosen in combinations(of_right, count):
            for terms in completed(columns, target, list(chosen)) if others else [list(chosen)]:
                x = np.linalg.lstsq(columns[terms].T, target, rcond=None)[0]
                sizes, left = np.abs(x), np.abs(target - x @ columns[terms])
                negligible = FIT_ROUNDING * sizes.max()
                is_fit = sizes.min() > negligible and left.max() <= 1.0
                if is_fit and (not is_replaced or np.ptp(sizes) <= negligible):
                    return {names[k]: float(value) for k, value in zip(terms, x)}
    return {}


def completed(columns: ndarray, target: ndarray, chosen: list[int]) -> list[list[int]]:
    """The chosen terms with the one that comes closest to a target with them, or all that come as close."""
    basis = np.linalg.qr(columns[chosen].T)[0] if chosen else np.zeros((len(target), 0))
    rest = columns - columns @ basis @ basis.T
    lengths = np.linalg.norm(columns, axis=1)
    sizes = np.linalg.norm(rest, axis=1)
    along = np.where(sizes > 1e-6 * lengths, np.abs(rest @ target) / np.maximum(sizes, 1e-6 * lengths), 0.0)
    return [[*chosen, int(k)] for k in np.flatnonzero(along >= AS_NEAR * along.max())]


def pairs_of_terms(right: Mapping[str, float], off: Mapping[str, float]) -> Iterator[tuple[str, str]]:
    """What yours has, and what the right expression has in its place; "" for nothing."""
    least = SAME_FACTOR * max(map(abs, (*off.values(), *right.values())), default=1.0)
    added = [term for term in off if term not in right]
    for term in (term for term in off if term in right):
        same = [other for other in added if abs(abs(off[other]) - abs(off[term])) <= least]
        if same:
            added.remove(same[0])
            yield with_factor(off[same[0]], same[0]), with_factor(-off[term], term)
        else:
            yours, expected = right[term] + off[term], right[term]
            is_there = abs(yours) > least
            yield with_factor(yours, term, expected) if is_there else "", with_factor(expected, term, yours)
    for term in added:
        yield with_factor(off[term], term), ""


def with_factor(value: float, term: str, other: float = 0.0) -> str:
    """A coefficient with its term; other: a coefficient that it is told from."""
    number = apart(value, other, 10)
    if term == "1":
        return f"a constant {number}"
    return term if number == "1" else f"{number} {term}"
