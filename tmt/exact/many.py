"""A quantity of many states in pairs of doubles, some 31 digits: what values are compared with where 50 digits take too long."""

import mpmath
import numpy as np

from tmt.compiled.trace import Tape
from tmt.derivation.quantities import QUANTITIES, State, shape_of
from tmt.exact import series
from tmt.exact.motion import DIGITS, FORMS, program
from tmt.exact.tree import exact_tree


def exact_of_many(tree, name: str, q, qd, tau) -> tuple[np.ndarray, np.ndarray]:
    """A quantity as the sum of two doubles, high and low, (states, ...) each; shapes, units and errors as in `tmt`.

    q (states, nq), qd, tau (states, nv): taken as what their doubles are exactly.
    """
    tape, n = Tape(mpmath.mpf), len(tree.axis)
    with mpmath.workdps(DIGITS):
        sizes = tree.coordinates.nq, n, n
        inputs = [tape.inputs(*(f"{of}{i}" for i in range(size))) for of, size in zip(("q", "qd", "tau"), sizes)]
        state = State(exact_tree(tree, mpmath.mpf), *inputs)
        state.mass_matrix, moving = FORMS["composite"](state.tree, state.q, state.qd)
        if name != "gravity_balance":
            state.bias = moving
        results = [tape.lift(x) for x in flat(QUANTITIES[name].of(state))]
        found, row = program(tape, [x for part in inputs for x in part], results)
    states = np.concatenate([q, qd, tau], axis=1)
    count, (high, low) = states.shape[1], np.zeros((2, found.rows, 2))
    high[count : count + found.numbers.shape[1], 0], low[count : count + found.numbers.shape[1], 0] = found.numbers
    at, values = [row[x.i] for x in results], np.empty((2, len(states), len(results)))
    for k, numbers in enumerate(states):
        high[:count, 0] = numbers
        series.expand(found.code, high, low)  # the first coefficients are the values
        values[:, k] = high[at, 0], low[at, 0]
    return tuple(values.reshape(2, len(states), *shape_of(name, tree)))


def flat(nested) -> list:
    return [x for part in nested for x in flat(part)] if isinstance(nested, (list, tuple)) else [nested]
