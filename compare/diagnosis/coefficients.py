"""Where equations differ: entries of Mbar, gravity, and coefficients of products of speeds in h, and which of their terms."""

from collections.abc import Callable, Iterator
from functools import cached_property
from itertools import islice
from typing import NamedTuple

import numpy as np

from ..judge.finding import Finding
from ..judge.words import listed
from ..report.text import say
from ..robots.coordinates import Coordinates
from .cause import TEMPLATE, Cause, Change, cause_of
from .model import Equations
from .places import bias_at_rest, entry_name, products_of_rates, rates_name
from .terms import JOINTS_OF_TERMS, STATES_PER_TERM, few_terms, right_terms, tried_terms

MOST_SPEEDS = 6  # for which your h is evaluated at every pair of speeds
ROUNDING = 8.0  # times the tolerance of an entry: of a sum of its values at several speeds
SHOWN = 6  # positions, and coefficients, in a sentence
SMALL_SHARE = 0.05  # of the largest value, that rounded constants may change
SAME_FACTOR = 1e-7  # of the largest of several: two numbers that are one
EXCHANGED = "sin and cos exchanged"
SWAPPED = (("sin(", "cos("), ("cos(", "sin("))


class Coefficient(NamedTuple):
    """One entry of Mbar or gravity, or the coefficient of a product of speeds in h, at some positions."""

    place: tuple  # ("M", i, j), ("gravity", i) or ("velocity", i, j, k)
    name: str
    yours: np.ndarray  # (states,)
    right: np.ndarray  # (states,)
    tolerance: np.ndarray  # (states,)

    @property
    def off(self) -> np.ndarray:
        return np.abs(self.yours - self.right)

    @property
    def is_small(self) -> bool:
        """Whether the difference is small compared with the largest value: rounded constants leave no more."""
        return bool(self.off.max() <= SMALL_SHARE * np.abs(self.right).max() + self.tolerance.max())

    def at_worst(self, equations: Equations) -> dict:
        """Both numbers at the position where they are furthest apart, for the template."""
        k = int(np.argmax(self.off))
        names = Coordinates(equations.tree.hinge_names, equations.tree.kind).positions
        at = [f"{name} = {value:.6g}" for name, value in list(zip(names, equations.q[k]))[:SHOWN]]
        return {"name": self.name, "yours": self.yours[k], "right": self.right[k], "at": at}


class Slip(NamedTuple):
    """What differs in one coefficient, in a few terms."""

    kinds: tuple[str, ...]  # slips of several coefficients with the same kind are one slip
    values: dict  # for the template


class Compared:
    """The coefficients of given values and the right ones.

    given, tolerance: (states, entries) as those of `Equations`. bias: your h at these positions and other speeds,
    (states, nv) -> (states, nv); None: only values are given.
    """

    def __init__(self, equations: Equations, given: np.ndarray, tolerance: np.ndarray, bias: Callable | None):
        self.equations, self.coefficients = equations, coefficients_of(equations, given, tolerance, bias)
        self.differing = [
            coefficient for coefficient in self.coefficients if (coefficient.off > coefficient.tolerance).any()
        ]
        self.is_complete = self.explains_bias(given, tolerance)
        right = equations.values()[0]
        off, largest = np.abs(given - right), np.abs(right).max(axis=0)
        of_entries = np.nan_to_num(off).max(axis=0) <= SMALL_SHARE * largest + tolerance.max(axis=0)
        every = (off > tolerance).any(axis=0) | np.isnan(off).all(axis=0) | (largest == 0.0)
        self.is_small = bool(of_entries.all()) and (
            bool(every.all()) or (bool(self.differing) and all(coefficient.is_small for coefficient in self.differing))
        )

    def explains_bias(self, given: np.ndarray, tolerance: np.ndarray) -> bool:
        """Whether the coefficients that differ make up all that differs in h: nothing is linear or cubic in the speeds."""
        nv, qd = self.equations.nv, self.equations.qd
        h = self.equations.values()[0][:, -nv:].copy()
        for coefficient in self.differing:
            kind, i, *pair = coefficient.place
            if kind != "M":
                h[:, i] += (coefficient.yours - coefficient.right) * np.prod(qd[:, pair], axis=1)
        size = tolerance[:, -nv:] * (1.0 + np.abs(qd).max(axis=1, keepdims=True) ** 2)
        off = np.abs(given[:, -nv:] - h)
        return bool(((off <= ROUNDING * size) | ~np.isfinite(off)).all())

    @cached_property
    def right_terms(self) -> list[dict[str, float]]:
        """The right coefficients that differ as sums of terms."""
        tree, names = self.equations.tree, self.equations.names
        reference, rng = np.array(tree.reference), np.random.default_rng(0)
        x = rng.uniform(-3.0, 3.0, (STATES_PER_TERM * 5 ** len(tree.kind), len(tree.kind)))
        known = right_values(Equations(tree, x + reference, np.zeros_like(x)))
        return right_terms(names, tree.kind, x, np.array([known[coefficient.place] for coefficient in self.differing]))

    @cached_property
    def tried_terms(self):
        tree = self.equations.tree
        return tried_terms(self.equations.names, tree.kind, self.equations.q - np.array(tree.reference))

    def slips(self) -> Iterator[Slip | None]:
        """What differs in each coefficient, in a few terms; None where that is not found, or with many joints or balls."""
        tree = self.equations.tree
        is_known = "ball" not in tree.kind and len(tree.kind) <= JOINTS_OF_TERMS
        for k, coefficient in enumerate(self.differing):
            if not is_known:
                yield None
                continue
            right = self.right_terms[k]
            off = few_terms(self.tried_terms, right, coefficient.yours - coefficient.right, coefficient.tolerance)
            yield off and slip_of(coefficient.name, right, off)

    def details(self) -> dict:
        """Which parts of the equations differ, and which coefficients: `parts`, `details` and `more` of a Diagnosis."""
        differ, every = (
            list(dict.fromkeys(coefficient.place[0] for coefficient in some))
            for some in (self.differing, self.coefficients)
        )
        agree = [part for part in every if part not in differ]
        slips = list(islice(self.slips(), SHOWN))
        if self.is_small and not all(slips):
            return {"parts": (differ, agree)}
        details = [
            slip.values if slip else coefficient.at_worst(self.equations)
            for coefficient, slip in zip(self.differing, slips)
        ]
        return {"parts": (differ, agree), "details": tuple(details), "more": len(self.differing) - len(details)}

    def cause(self, most: int) -> Cause | None:
        """The cause if all that differs is at most this number of slips."""
        found, kinds = [], set()
        for slip in self.slips() if self.is_complete else ():
            if slip is None or len(kinds := kinds.union(slip.kinds)) > most:
                return None
            found.append(slip.values)
        if not found:
            return None
        text = say(Finding(TEMPLATE, "several_terms", {"list": found}))
        values = {"exchanged": kinds == {EXCHANGED}, "list": found}
        change = Change("term", listed([of["name"] for of in found]), "right", text, "", "term", values)
        return cause_of(1 + len(kinds), [change], 0.0)


def coefficients_of(equations: Equations, given: np.ndarray, tolerance: np.ndarray, bias: Callable | None) -> list:
    """All coefficients that are known of given values."""
    nv, right = equations.nv, right_values(equations)
    allowed = np.maximum(tolerance, tolerance[tolerance > 0.0].min(initial=1.0))
    of_h = ROUNDING * allowed[:, -nv:].max(axis=1)
    entries = {entry: k for k, entry in enumerate(equations.entries)}
    yours = {entry: given[:, k] for entry, k in entries.items() if entry[0] == "M"}
    if not equations.qd.any():
        yours |= {("gravity", i): given[:, i - nv] for i in range(nv)}
    elif bias is not None and nv <= MOST_SPEEDS:
        yours |= rows_of(*even_products(bias, nv, len(given)))
    return [
        Coefficient(place, name_of(place, equations.names), values, right[place],
                    allowed[:, entries[place]] if place[0] == "M" else of_h)
        for place, values in yours.items() if np.isfinite(values).all()
    ]  # fmt: skip


def rows_of(coefficients: dict, weight: np.ndarray) -> dict[tuple, np.ndarray]:
    """Coefficients of h by their places, row by row."""
    rows = {("gravity", i): values for i, values in enumerate(weight.T)}
    return rows | {("velocity", i, *pair): values for pair, c in coefficients.items() for i, values in enumerate(c.T)}


def right_values(equations: Equations) -> dict[tuple, np.ndarray]:
    """The right coefficients, (states,) each."""
    values = equations.values()[0]
    found = {entry: values[:, k] for k, entry in enumerate(equations.entries) if entry[0] == "M"}
    if equations.nv > MOST_SPEEDS:
        return found | rows_of({}, bias_at_rest(equations))
    return found | rows_of(*products_of_rates(equations))


def even_products(bias: Callable, nv: int, states: int) -> tuple[dict, np.ndarray]:
    """The coefficients of products of two speeds in your h, of its part that is even in them, and h at rest."""
    unit, even = np.eye(nv), {}

    def h(speeds: np.ndarray) -> np.ndarray:
        return np.asarray(bias(np.tile(speeds, (states, 1))))

    weight = h(np.zeros(nv))
    for j, k in zip(*np.triu_indices(nv)):
        speeds = unit[j] + (j != k) * unit[k]
        even[j, k] = (h(speeds) + h(-speeds)) / 2.0 - weight
    mixed = {(j, k): values - even[j, j] - even[k, k] for (j, k), values in even.items() if j != k}
    return even | mixed, weight


def name_of(place: tuple, names: tuple[str, ...]) -> str:
    kind, *indices = place
    if kind == "M":
        return entry_name(place, names)
    row = entry_name(("h", indices[0]), names)
    return f"{row}, gravity" if kind == "gravity" else f"{row}, coefficient of {rates_name(*indices[1:], names)}"


def slip_of(name: str, right: dict[str, float], off: dict[str, float]) -> Slip:
    """A difference in terms: replaced by others, with another factor, missing, or added."""
    size = max(map(abs, (*off.values(), *right.values())))
    new, kinds, terms = [term for term in off if term not in right], [], []
    for term in (term for term in off if term in right):
        change, kind = off[term], f"{name} {term}"
        partner = next((other for other in new if abs(abs(off[other]) - abs(change)) <= SAME_FACTOR * size), None)
        if partner:
            new.remove(partner)
            kind = EXCHANGED if partner in sine_for_cosine(term) else f"{term} to {partner}"
            both = {"yours": with_factor(off[partner], partner), "right": with_factor(-change, term)}
            terms.append({"form": "replaced"} | both)
        elif abs(right[term] + change) <= SAME_FACTOR * size:
            terms.append({"form": "missing", "right": with_factor(right[term], term)})
        else:
            both = {"yours": without_digits(right[term] + change), "right": without_digits(right[term])}
            terms.append({"form": "factor", "name": term} | both)
        kinds.append(kind)
    terms += [{"form": "added", "yours": with_factor(off[term], term)} for term in new]
    kinds += [f"{name} {term}" for term in new]
    return Slip(tuple(kinds), {"name": name, "terms": terms})


def sine_for_cosine(term: str) -> Iterator[str]:
    """A term with a sine for one of its cosines, or the other way round."""
    for old, new in SWAPPED:
        start = term.find(old)
        while start >= 0:
            yield term[:start] + new + term[start + len(old) :]
            start = term.find(old, start + 1)


def without_digits(value: float) -> str:
    """A coefficient without the digits of a fit."""
    return f"{float(f'{value:.8g}'):.6g}"


def with_factor(value: float, term: str) -> str:
    """A coefficient with its term."""
    if term == "1":
        return f"a constant {without_digits(value)}"
    return term if abs(value - 1.0) <= SAME_FACTOR else f"{without_digits(value)} {term}"
