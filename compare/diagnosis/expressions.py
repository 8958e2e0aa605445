"""What is wrong with a coefficient in terms: another factor, a term in place of another, one missing or too much."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from .coefficients import Coefficient, right_values
from .model import Equations
from .terms import STATES_PER_TERM, few_terms, right_terms, tried_terms

SAME_FACTOR = 1e-7  # of the largest of several: two numbers that are one
EXCHANGED = "sin and cos exchanged"
SWAPPED = (("sin(", "cos("), ("cos(", "sin("))


class Slip(NamedTuple):
    """What differs in one coefficient, in a few terms."""

    coefficient: Coefficient
    kinds: tuple[str, ...]  # by which slips in several coefficients are the same one
    text: str


class Expressions:
    """The right ones of some coefficients as sums of terms, and what is wrong with yours in terms."""

    def __init__(self, equations: Equations, differing: list[Coefficient]):
        tree, names = equations.tree, equations.names
        reference, rng = np.array(tree.reference), np.random.default_rng(0)
        x = rng.uniform(-3.0, 3.0, (STATES_PER_TERM * 5 ** len(tree.kind), len(tree.kind)))
        known = right_values(Equations(tree, x + reference, np.zeros_like(x)))
        right = right_terms(names, tree.kind, x, np.array([known[one.place] for one in differing]))
        self.right = {one.name: expression for one, expression in zip(differing, right)}
        self.every, self.found = tried_terms(names, tree.kind, equations.q - reference), {}

    def slip(self, one: Coefficient) -> Slip | None:
        """What is wrong with a coefficient; None if it is not a few terms."""
        if one.name not in self.found:
            right = self.right[one.name]
            self.found[one.name] = slip_of(
                one, right, few_terms(self.every, right, one.yours - one.right, one.tolerance)
            )
        return self.found[one.name]


def slip_of(one: Coefficient, right: dict[str, float], off: dict[str, float] | None) -> Slip | None:
    """A difference in words: terms in place of others, with another factor, missing, or added."""
    if off is None:
        return None
    size = max(map(abs, (*off.values(), *right.values())))
    replaced = [name for name, change in off.items() if name in right]
    new = [name for name in off if name not in right]
    kinds, said = [], []
    for name in replaced:
        change = off[name]
        partner = next((other for other in new if abs(abs(off[other]) - abs(change)) <= SAME_FACTOR * size), None)
        if partner and partner in new:
            new.remove(partner)
            kinds.append(EXCHANGED if partner in sine_for_cosine(name) else f"{name} to {partner}")
            said.append(f"yours has {with_factor(off[partner], partner)} in place of {with_factor(-change, name)}")
        elif abs(right[name] + change) <= SAME_FACTOR * size:
            kinds.append(f"{one.name} {name}")
            said.append(f"{with_factor(right[name], name)} is missing in yours")
        else:
            kinds.append(f"{one.name} {name}")
            of = "the constant" if name == "1" else f"the factor of {name}"
            yours, theirs = without_digits(right[name] + change), without_digits(right[name])
            said.append(f"{of} is {yours} in yours, the right one is {theirs}")
    for name in new:
        kinds.append(f"{one.name} {name}")
        said.append(f"yours has {with_factor(off[name], name)} too much")
    return Slip(one, tuple(kinds), f"{one.name}: {', '.join(said)}")


def sine_for_cosine(name: str) -> Iterator[str]:
    """A term with a sine for one of its cosines, or the other way round."""
    for old, new in SWAPPED:
        start = name.find(old)
        while start >= 0:
            yield name[:start] + new + name[start + len(old) :]
            start = name.find(old, start + 1)


def without_digits(value: float) -> str:
    """A coefficient without the digits of a fit."""
    return f"{float(f'{value:.8g}'):.6g}"


def with_factor(value: float, name: str) -> str:
    """A coefficient with its term."""
    if name == "1":
        return f"a constant {without_digits(value)}"
    return name if abs(value - 1.0) <= SAME_FACTOR else f"{without_digits(value)} {name}"
