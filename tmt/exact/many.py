"""A quantity of many states in pairs of doubles, some 31 digits: what values in doubles are compared with."""

from functools import lru_cache, partial
from typing import NamedTuple

import mpmath
import numpy as np

from tmt.compiled.forms import values_in
from tmt.compiled.trace import Tape
from tmt.derivation import composite, linearized
from tmt.derivation.form import Form
from tmt.derivation.quantities import quantity_of, shape_of
from tmt.exact import series
from tmt.exact.motion import DIGITS, FORMS, Equations, program
from tmt.exact.tree import exact_tree
from tmt.model.tree import Tree

EXACT = Form(
    FORMS["composite"],
    partial(composite.generalized_force, number=mpmath.mpf),
    partial(linearized.rates, number=mpmath.mpf),
)


class Pairs(NamedTuple):
    high: np.ndarray
    low: np.ndarray

    def part(self, k: int | None) -> "Pairs":
        return self if k is None else Pairs(self.high[:, k], self.low[:, k])

    def distance(self, values: np.ndarray) -> np.ndarray:
        with np.errstate(invalid="ignore"):  # a user's own equations may give NaN
            return np.abs((values - self.high) - self.low)


def exact_of_many(tree: Tree, name: str, q: np.ndarray, *rates: np.ndarray) -> Pairs:
    """A quantity, by its full name, at q (states, nq), qd, tau or qdd (states, nv), dt (states, 1), as exact.

    Shapes and units as in `tmt`.
    """
    states, shape = np.concatenate([q, *rates], axis=1), shape_of(name, tree)
    equations, rows = traced(tree, name)
    high, low = equations.tables(states.shape[1], 2)
    values = np.empty((2, len(states), len(rows)))
    for k, numbers in enumerate(states):
        high[: len(numbers), 0] = numbers
        series.expand(equations.code, high, low)  # the first coefficients are the values
        values[:, k] = high[rows, 0], low[rows, 0]
    return Pairs(*values.reshape(2, len(states), *shape))


@lru_cache(maxsize=64)
def traced(tree: Tree, name: str) -> tuple[Equations, list[int]]:
    tape, n, takes = Tape(mpmath.mpf), len(tree.axis), quantity_of(name).takes
    with mpmath.workdps(DIGITS):
        exact = exact_tree(tree, mpmath.mpf)
        sizes = {"q": tree.coordinates.nq, "qd": n, "tau": n, "qdd": n, "dt": 1}
        takes = takes if len(takes) > 2 else ("q", "qd", "tau")
        given = {array: tape.inputs(*(f"{array}{i}" for i in range(sizes[array]))) for array in takes}
        results = [tape.lift(x) for x in values_in(EXACT, exact, name, given)]
        equations, places = program(tape, [x for part in given.values() for x in part], results)
    return equations, [places[x.i] for x in results]
