"""Where equations differ: entries of Mbar, gravity, and coefficients of products of speeds in h, and which of their terms.

These are polynomials in the sines and cosines of hinges and in the positions of slides, of second degree in each. A common error
is one term with another factor, or replaced by another. Terms have two forms: products such as sin(hip) cos(knee) and sums such
as sin(hip + knee).
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property
from itertools import combinations, product
from typing import NamedTuple

import numpy as np

from ..core.finding import Finding
from ..core.text import apart, say
from ..core.words import listed
from ..robots.coordinates import Coordinates
from .cause import TEMPLATE, Cause, Change, cause_of
from .model import MOST_SPEEDS, Equations, coefficients_of
from .places import entry_name

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


class Coefficient(NamedTuple):
    """One entry of Mbar or gravity, or the coefficient of a product of speeds in h, at some positions, (states,) each."""

    place: tuple  # ("M", i, j), ("gravity", i) or ("velocity", i, j, k)
    name: str
    yours: np.ndarray
    right: np.ndarray
    tolerance: np.ndarray

    @property
    def off(self) -> np.ndarray:
        return self.yours - self.right


class Compared:
    """The coefficients of given values that differ from the right ones.

    given, tolerance: (states, entries) as those of `Equations`. bias: your h at these positions and other speeds,
    (states, nv) -> (states, nv); None: only values are given.
    """

    def __init__(self, equations: Equations, given: np.ndarray, tolerance: np.ndarray, bias: Callable | None):
        self.equations, self.given, self.bias = equations, given, bias
        self.tolerance = np.maximum(tolerance, tolerance[tolerance > 0.0].min(initial=1.0))

    @cached_property
    def differing(self) -> list[Coefficient]:
        equations, nv, given = self.equations, self.equations.nv, self.given
        right, names, entries = right_values(equations), equations.names, equations.entries
        yours = {entry: given[:, k] for k, entry in enumerate(entries) if entry[0] == "M"}
        if not equations.qd.any():
            yours |= {("gravity", i): given[:, i - nv] for i in range(nv)}
        elif self.bias is not None and nv <= MOST_SPEEDS:
            yours |= coefficients_of(lambda v: np.asarray(self.bias(np.tile(v, (len(given), 1)))), nv)
        of_h = ROUNDING * self.tolerance[:, -nv:].max(axis=1)
        known = [
            Coefficient(place, entry_name(place, names), values, right[place],
                        self.tolerance[:, entries.index(place)] if place[0] == "M" else of_h)
            for place, values in yours.items() if np.isfinite(values).all()
        ]  # fmt: skip
        return [
            coefficient for coefficient in known if (np.abs(coefficient.off) > coefficient.tolerance).any()
        ]

    @property
    def is_complete(self) -> bool:
        """Whether the coefficients that differ make up all that differs in h: nothing is linear or cubic in the speeds."""
        nv, qd = self.equations.nv, self.equations.qd
        h = self.equations.values()[0][:, -nv:].copy()
        for coefficient in self.differing:
            kind, i, *pair = coefficient.place
            if kind != "M":
                h[:, i] += coefficient.off * np.prod(qd[:, pair], axis=1)
        size = self.tolerance[:, -nv:] * (1.0 + np.abs(qd).max(axis=1, keepdims=True) ** 2)
        off = np.abs(self.given[:, -nv:] - h)
        return bool(((off <= ROUNDING * size) | ~np.isfinite(off)).all())

    @cached_property
    def terms(self) -> list[list[tuple[str, str]]]:
        """Of each coefficient that differs, your terms and the right ones in their places, "" for none; [] if not found."""
        tree, names, reference = (
            self.equations.tree,
            self.equations.names,
            np.array(self.equations.tree.reference),
        )
        if "ball" in tree.kind or len(tree.kind) > MOST_JOINTS or len(self.differing) > SHOWN:
            return [[] for _ in self.differing]
        n = len(tree.kind)
        x = np.random.default_rng(0).uniform(-3.0, 3.0, (STATES_PER_TERM * 5**n, n))
        right = right_values(Equations(tree, x + reference, np.zeros_like(x)))
        angles = self.equations.q - reference
        at_x = [form(names, tree.kind, x) for form in (sums, products)]
        tried = (
            sums(names, tree.kind, angles) | products(names, tree.kind, angles) | dict(zip(names, angles.T))
        )
        found = []
        for one in self.differing:
            expression = right_terms(at_x, right[one.place], np.abs(one.yours).max())
            off = few_terms(tried, expression, one.off, one.tolerance)
            found.append(list(pairs_of_terms(expression, off)))
        return found

    def details(self) -> tuple[dict, ...]:
        """The coefficients that differ, for the template: in terms, or both numbers where they are furthest apart."""
        q, tree, details = self.equations.q, self.equations.tree, []
        names = Coordinates(tree.joint_names, tree.kind).positions
        for one, terms in list(zip(self.differing, self.terms))[:SHOWN]:
            k = int(np.argmax(np.abs(one.off)))
            at = [f"{name} = {value:.6g}" for name, value in list(zip(names, q[k]))[:SHOWN]]
            yours, right = (
                part[k] if abs(part[k]) > one.tolerance[k] else 0.0 for part in (one.yours, one.right)
            )
            details.append({"name": one.name, "terms": terms, "yours": yours, "right": right, "at": at})
        return tuple(details)

    def cause(self, most: int) -> Cause | None:
        """The cause if all that differs is at most this number of wrong terms; the same in several coefficients is one."""
        if not self.differing or not self.is_complete or not all(self.terms):
            return None
        found = [Finding(TEMPLATE, "details", {"coefficient": {"terms": terms}}) for terms in self.terms]
        texts = dict.fromkeys(map(say, found))
        kinds = {pair for terms in self.terms for pair in terms}
        if len(kinds) > most:
            return None
        names = listed([one.name for one in self.differing])
        return cause_of(1 + len(kinds), [Change("term", names, "right", "; ".join(texts))], 0.0)


def right_values(equations: Equations) -> dict[tuple, np.ndarray]:
    """The right coefficients, (states,) each."""
    values = equations.values()[0]
    of_M = {entry: k for k, entry in enumerate(equations.entries) if entry[0] == "M"}
    return {entry: values[:, k] for entry, k in of_M.items()} | equations.coefficients()


def products(names: Sequence[str], kinds: Sequence[str], x: np.ndarray) -> dict[str, np.ndarray]:
    """Products of one function of each joint, the simplest first, (states,) each."""
    of_each = []
    for name, kind, p in zip(names, kinds, x.T):
        c, s = np.cos(p), np.sin(p)
        powers = [("", np.ones(len(x))), (name, p), (f"{name}^2", p**2)]
        turns = [
            (f"cos({name})", c),
            (f"sin({name})", s),
            (f"cos({name})^2", c * c),
            (f"sin({name}) cos({name})", s * c),
        ]
        of_each.append(powers if kind == "slide" else [*powers[:1], *turns])
    chosen = sorted(
        product(*of_each), key=lambda factors: sum(bool(name) + ("^2" in name) for name, _ in factors)
    )
    return {
        " ".join(filter(None, (name for name, _ in factors))) or "1": np.prod(
            [part for _, part in factors], axis=0
        )
        for factors in chosen
    }


def sums(names: Sequence[str], kinds: Sequence[str], x: np.ndarray) -> dict[str, np.ndarray]:
    """Sines and cosines of sums of the angles, each up to twice, times powers of the slides, (states,) each."""
    slides = [k for k, kind in enumerate(kinds) if kind == "slide"]
    hinges = [k for k in range(len(kinds)) if k not in slides]
    powers = (
        products([names[k] for k in slides], ["slide"] * len(slides), x[:, slides]) if slides else {"1": 1.0}
    )
    terms = {power: column * np.ones(len(x)) for power, column in powers.items()}
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


def right_terms(forms: list[dict[str, np.ndarray]], right: np.ndarray, size: float) -> dict[str, float]:
    """An expression (states,) as a sum of terms, in the form that has fewer. size: of yours; less than its rounding is 0."""
    fits = []
    for form in forms:
        x = np.linalg.lstsq(np.array(list(form.values())).T, right, rcond=None)[0]
        least = FIT_ROUNDING * max(np.abs(x).max(), size)
        fits.append({name: float(value) for name, value in zip(form, x) if abs(value) > least})
    return min(fits, key=len)


def few_terms(
    tried: dict, right: dict[str, float], off: np.ndarray, tolerance: np.ndarray
) -> dict[str, float]:
    """The terms that make up a difference, off (states,), with their coefficients; {}: a few do not suffice."""
    names, columns, target = list(tried), np.array(list(tried.values())) / tolerance, off / tolerance
    own = [names.index(name) for name in right]
    for of_right, others, is_replaced in COMBINATIONS:
        for chosen in combinations(own, of_right):
            for best in completed(columns, target, list(chosen)) if others else [list(chosen)]:
                x = np.linalg.lstsq(columns[best].T, target, rcond=None)[0]
                sizes = np.abs(x)
                if (
                    sizes.min() <= FIT_ROUNDING * sizes.max()
                    or np.abs(target - x @ columns[best]).max() > 1.0
                ):
                    continue
                if not is_replaced or np.ptp(sizes) <= FIT_ROUNDING * sizes.max():
                    return {names[k]: float(value) for k, value in zip(best, x)}
    return {}


def completed(columns: np.ndarray, target: np.ndarray, chosen: list[int]) -> list[list[int]]:
    """The chosen terms with the one that comes closest to a target with them, or all that come as close."""
    basis = np.linalg.qr(columns[chosen].T)[0] if chosen else np.zeros((len(target), 0))
    rest = columns - columns @ basis @ basis.T
    lengths = np.linalg.norm(columns, axis=1)
    sizes = np.linalg.norm(rest, axis=1)
    along = np.where(sizes > 1e-6 * lengths, np.abs(rest @ target) / np.maximum(sizes, 1e-6 * lengths), 0.0)
    return [[*chosen, int(k)] for k in np.flatnonzero(along >= AS_NEAR * along.max())]


def pairs_of_terms(right: dict[str, float], off: dict[str, float]) -> Iterator[tuple[str, str]]:
    """What yours has and the right expression in its place, "" for nothing: replaced, with another factor, missing, added."""
    size = max(map(abs, (*off.values(), *right.values())), default=1.0)
    new = [term for term in off if term not in right]
    for term in (term for term in off if term in right):
        same = [other for other in new if abs(abs(off[other]) - abs(off[term])) <= SAME_FACTOR * size]
        if same:
            new.remove(same[0])
            yield with_factor(off[same[0]], same[0]), with_factor(-off[term], term)
        else:
            mine, expected = right[term] + off[term], right[term]
            is_there = abs(mine) > SAME_FACTOR * size
            yield with_factor(mine, term, expected) if is_there else "", with_factor(expected, term, mine)
    for term in new:
        yield with_factor(off[term], term), ""


def with_factor(value: float, term: str, other: float = 0.0) -> str:
    """A coefficient with its term; other: a coefficient that it is told from."""
    number = apart(value, other, 10)
    if term == "1":
        return f"a constant {number}"
    return term if number == "1" else f"{number} {term}"
