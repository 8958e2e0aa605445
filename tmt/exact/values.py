"""Every quantity of a state with 50 digits: what values in doubles are compared with."""

from collections.abc import Sequence
from functools import partial
from types import SimpleNamespace

import mpmath
import numpy as np

from tmt.derivation.quantities import QUANTITIES, State
from tmt.exact.tree import exact_tree
from tmt.methods import method_named, one_step
from tmt.model.tree import Tree

Numbers = Sequence[float]
DIGITS = 50
# the arrays of each quantity: one of its own name, or several with names of their own
FIELDS = {name: quantity.parts or (name,) for name, quantity in QUANTITIES.items()}


class Exact(SimpleNamespace):
    """Every TMT quantity at one state, by its name, each computed when it is asked for."""

    def __getattr__(self, name: str) -> np.ndarray:
        quantity = next((key for key, fields in FIELDS.items() if name in fields), None)
        if quantity is None:
            raise AttributeError(name)
        with mpmath.workdps(DIGITS):
            value = QUANTITIES[quantity].of(self.state)
        for field, part in zip(FIELDS[quantity], value if QUANTITIES[quantity].parts else [value]):
            setattr(self, field, np.array(part, dtype=object))
        return vars(self)[name]


def exact(
    tree: Tree, q: Numbers, qd: Numbers, tau: Numbers, qdd: Numbers | None = None, name: str = "",
    step: tuple[str, float] = ("", 0.0),
) -> Exact:  # fmt: skip
    """Every TMT quantity at one state, from the same source as the floats, with 50 digits, by its name.

    q (nq,), qd, tau (nv,): rad, rad/s, N m. Numbers are taken as what their doubles are exactly. Each is an
    object array of mpmath numbers, with shape and unit as in `tmt`; of several arrays each has its own name.
    qdd: of inverse dynamics, by default those under tau. name: of the frame; step: a method and dt, s.
    """
    with mpmath.workdps(DIGITS):
        given = {"q": q, "qd": qd, "tau": tau, "dt": [step[1]]} | ({} if qdd is None else {"qdd": qdd})
        numbers = {key: [mpmath.mpf(float(x)) for x in values] for key, values in given.items()}
        many = exact_tree(tree, mpmath.mpf)
        stepping = partial(one_step, method_named(step[0]), many) if step[0] else None
        return Exact(state=State(many, numbers, name=name, step=stepping))


def distance(values: np.ndarray, truth: np.ndarray) -> np.ndarray:
    """|values - truth| as floats: the difference is taken exactly and rounded once."""
    return np.asarray(np.abs(np.asarray(values, dtype=float).astype(object) - truth), dtype=float)
