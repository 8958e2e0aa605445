"""Every quantity of a state with 50 digits: what values in doubles are compared with."""

from collections.abc import Sequence
from types import SimpleNamespace

import mpmath
import numpy as np

from tmt.derivation.quantities import QUANTITIES, State
from tmt.derivation.scalar import Scalar
from tmt.exact.tree import exact_tree
from tmt.model.tree import Tree

DIGITS = 50
# the arrays of each quantity: one of its own name, or several with names of their own
FIELDS = {name: quantity.parts or (name,) for name, quantity in QUANTITIES.items()}


def exact(tree: Tree, q: Sequence[float], qd: Sequence[float], tau: Sequence[float]) -> SimpleNamespace:
    """Every TMT quantity at one state, from the same source as the floats, with 50 digits, by its name.

    q (nq,), qd, tau (nv,): rad, rad/s, N m. Numbers are taken as what their doubles are exactly. Each is an
    object array of mpmath numbers, with shape and unit as in `tmt`; of several arrays each has its own name.
    """
    with mpmath.workdps(DIGITS):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd, tau))
        state = State(exact_tree(tree, mpmath.mpf), q, qd, tau)
        values: dict[str, Scalar] = {}
        for name, fields in FIELDS.items():
            value = QUANTITIES[name].of(state)
            values |= zip(fields, value if QUANTITIES[name].parts else [value])
        return SimpleNamespace(**{field: np.array(value, dtype=object) for field, value in values.items()})


def distance(values: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """|values - truth| as floats: the difference is taken exactly and rounded once."""
    return np.asarray(np.abs(np.asarray(values, dtype=float).astype(object) - truth), dtype=float)
