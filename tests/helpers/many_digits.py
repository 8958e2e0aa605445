"""Every quantity of a state with 50 digits, by the literal form: what exact values and values in doubles are compared with."""

from functools import partial

import mpmath
import numpy as np

from tmt.derivation.quantities import QUANTITIES, State
from tmt.exact.tree import DIGITS, exact_tree
from tmt.methods import method_named, one_step

# the arrays of each quantity: one of its own name, or several with names of their own
FIELDS = {name: quantity.parts or (name,) for name, quantity in QUANTITIES.items()}


class Exact:
    """Every TMT quantity at one state, by its name, an object array of mpmath numbers, computed when it is asked for."""

    def __init__(self, state: State):
        self.state = state

    def __getattr__(self, name: str) -> np.ndarray:
        quantity = QUANTITIES[next(key for key, fields in FIELDS.items() if name in fields)]
        with mpmath.workdps(DIGITS):
            value = quantity.of(self.state)
        return np.array(value[quantity.parts.index(name)] if quantity.parts else value, dtype=object)


def exact(tree, q, qd, tau, qdd=None, step=None) -> Exact:
    """q (nq,), qd, tau (nv,): rad, rad/s, N m; qdd: by default that under tau; step: a method and dt, s."""
    with mpmath.workdps(DIGITS):
        arrays = {"q": q, "qd": qd, "tau": tau, "qdd": qdd, "dt": step and step[1:]}
        stated = {name: values for name, values in arrays.items() if values is not None}
        given = {name: [mpmath.mpf(float(x)) for x in values] for name, values in stated.items()}
        many = exact_tree(tree, mpmath.mpf)
        return Exact(State(many, given, step=step and partial(one_step, method_named(step[0]), many)))


def distance(values, truth) -> np.ndarray:
    """|values - truth| as floats: the difference is taken exactly and rounded once."""
    return np.asarray(np.abs(np.asarray(values, dtype=float).astype(object) - truth), dtype=float)
