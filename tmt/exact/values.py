"""Every quantity of a state with 50 digits: what values in doubles are compared with."""

from collections import namedtuple

import mpmath
import numpy as np

from tmt.derivation.quantities import QUANTITIES, State
from tmt.exact.tree import exact_tree

DIGITS = 50


# the fields of a Truth: the quantities, of those with several arrays each by its own name
FIELDS = {name: (name,) for name in QUANTITIES} | {
    name: of.parts for name, of in QUANTITIES.items() if of.parts
}
Truth = namedtuple("Truth", [field for fields in FIELDS.values() for field in fields])
Truth.__doc__ = (
    "Every quantity of one state as object arrays of mpmath numbers; names, shapes and units as in `tmt`."
)


def exact(tree, q, qd, tau) -> Truth:
    """Every TMT quantity at one state, from the same source as the floats, with 50 digits.

    q (nq,), qd, tau (nv,): rad, rad/s, N m. The numbers of the tree and of the state are taken as what their
    doubles are exactly; 0.1 means 0.1000000000000000055511151231257827...
    """
    with mpmath.workdps(DIGITS):
        q, qd, tau = ([mpmath.mpf(float(v)) for v in values] for values in (q, qd, tau))
        state, found = State(exact_tree(tree, mpmath.mpf), q, qd, tau), {}
        for name, fields in FIELDS.items():
            value = QUANTITIES[name].of(state)
            found |= zip(fields, value) if len(fields) > 1 else [(name, value)]
        return Truth(**{name: _array(value) for name, value in found.items()})


def _array(nested):
    """Nested iterables of numbers as an object array."""

    def lists(item):
        return [lists(i) for i in item] if hasattr(item, "__iter__") else item

    return np.array(lists(nested), dtype=object)


def distance(values, truth) -> np.ndarray:
    """|values - truth| as floats: the difference is taken exactly and rounded once."""
    return np.asarray(np.abs(np.asarray(values, dtype=float).astype(object) - truth), dtype=float)
