"""A quantity of many states in pairs of doubles, some 31 digits: what values in doubles are compared with."""

from functools import lru_cache
from typing import NamedTuple

import mpmath
import numpy as np

from tmt.compiled.forms import flat
from tmt.compiled.trace import Tape
from tmt.derivation.quantities import QUANTITIES, State, shape_of
from tmt.exact import series
from tmt.exact.motion import DIGITS, FORMS, Equations, program
from tmt.exact.tree import exact_tree
from tmt.model.tree import Tree


class Pairs(NamedTuple):
    """Exact values: the sum of two doubles, (states, ...) each."""

    high: np.ndarray
    low: np.ndarray

    def part(self, k: int | None) -> "Pairs":
        """One of several arrays of a quantity; None: all."""
        return self if k is None else Pairs(self.high[:, k], self.low[:, k])

    def distance(self, values: np.ndarray) -> np.ndarray:
        """|values - exact|, (states, ...)."""
        with np.errstate(invalid="ignore"):  # a user's own equations may give NaN
            return np.abs((values - self.high) - self.low)


def exact_of_many(tree: Tree, name: str, q: np.ndarray, qd: np.ndarray, tau: np.ndarray) -> Pairs:
    """A quantity at q (states, nq), qd, tau (states, nv): doubles, taken as exact. Shapes and units as in `tmt`."""
    states, shape = np.concatenate([q, qd, tau], axis=1), shape_of(name, tree)
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
    """The operations of a quantity, and the rows of its numbers."""
    tape, n = Tape(mpmath.mpf), len(tree.axis)
    with mpmath.workdps(DIGITS):
        sizes = {"q": tree.coordinates.nq, "qd": n, "tau": n}
        q, qd, tau = (tape.inputs(*(f"{array}{i}" for i in range(size))) for array, size in sizes.items())
        state = State(exact_tree(tree, mpmath.mpf), q, qd, tau)
        state.mass_matrix, state.bias = FORMS["composite"](state.tree, q, qd)
        results = [tape.lift(x) for x in flat(QUANTITIES[name].of(state))]
        equations, row = program(tape, [*q, *qd, *tau], results)
    return equations, [row[x.i] for x in results]
