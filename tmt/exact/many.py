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


class Pairs(NamedTuple):
    """Exact values: the sum of two doubles, (states, ...) each."""

    high: np.ndarray
    low: np.ndarray

    def part(self, k: int | None) -> "Pairs":
        """One of several arrays of a quantity; None: all."""
        return self if k is None else Pairs(self.high[:, k], self.low[:, k])

    def distance(self, values) -> np.ndarray:
        """|values - exact|, (states, ...)."""
        with np.errstate(invalid="ignore"):  # a user's own equations may give NaN
            return np.abs((values - self.high) - self.low)


def exact_of_many(tree, name: str, q, qd, tau) -> Pairs:
    """A quantity at q (states, nq), qd, tau (states, nv): doubles, taken as exact. Shapes and units as in `tmt`."""
    states, shape = np.concatenate([q, qd, tau], axis=1), shape_of(name, tree)
    if not len(states):
        return Pairs(*np.empty((2, 0, *shape)))
    found, at = traced(tree, name)
    count, (high, low) = states.shape[1], np.zeros((2, found.rows, 2))
    high[count : count + found.numbers.shape[1], 0], low[count : count + found.numbers.shape[1], 0] = (
        found.numbers
    )
    values = np.empty((2, len(states), len(at)))
    for k, numbers in enumerate(states):
        high[:count, 0] = numbers
        series.expand(found.code, high, low)  # the first coefficients are the values
        values[:, k] = high[at, 0], low[at, 0]
    return Pairs(*values.reshape(2, len(states), *shape))


@lru_cache(maxsize=64)
def traced(tree, name: str) -> tuple[Equations, list[int]]:
    """The operations of a quantity, and the rows of its numbers."""
    tape, n = Tape(mpmath.mpf), len(tree.axis)
    with mpmath.workdps(DIGITS):
        sizes = tree.coordinates.nq, n, n
        inputs = [
            tape.inputs(*(f"{of}{i}" for i in range(size))) for of, size in zip(("q", "qd", "tau"), sizes)
        ]
        state = State(exact_tree(tree, mpmath.mpf), *inputs)
        state.mass_matrix, state.bias = FORMS["composite"](state.tree, state.q, state.qd)
        results = [tape.lift(x) for x in flat(QUANTITIES[name].of(state))]
        found, row = program(tape, [x for part in inputs for x in part], results)
    return found, [row[x.i] for x in results]
