"""Who answers the public functions: NumPy calls of up to SMALL states, machine code larger ones and those of a prepared model.

Nothing depends on earlier calls: the same call gives the same bits. Compiled code answers where nothing is wrong with what is
given; whatever is, the literal form says.
"""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from tmt import literal
from tmt.arm import ARM
from tmt.compiled.evaluator import SMALL, Evaluator
from tmt.derivation.quantities import QUANTITIES
from tmt.model import singular
from tmt.model.arguments import checked_model
from tmt.model.tree import Tree
from tmt.model.values import real_numbers, shown

MOST = 64  # models that are held, besides those that are prepared
DOUBLE = np.dtype(float)
known: dict[int, "Answers"] = {}


def answered(quantity: str, model: Tree, *given: ArrayLike) -> Any:
    """The quantity of states of any batch shape: what the function of that name in literal.py returns.

    given: q, or q and qd, or q, qd and tau, as that function takes them.
    """
    if answers := known.get(id(model)) or (answers_of(model) if isinstance(model, Tree) else None):
        found = answers.of_one(quantity, given)
        if found is None:
            found = answers.of_any(quantity, given)
        if found is not None:
            return found
    return getattr(literal, quantity)(*given, model)


def answers_of(model: Tree) -> "Answers":
    """What is compiled of a model; of the prepared ones and the last others."""
    others = [key for key, answers in list(known.items()) if not answers.ready]
    for key in others if len(others) >= MOST else ():
        known.pop(key, None)
    return known.setdefault(id(model), Answers(model))


def prepare(model: Tree = ARM, *quantities: str) -> None:
    """Have machine code answer all calls of a model from now on: for many calls of one state, in a loop or a controller.

    Without it NumPy answers those of up to 500 states, ten times as slowly; the last bits differ. The first time on a machine all
    take about a second for an arm and several for a humanoid.

    Parameters
    ----------
    model : Tree, default ARM
    *quantities : str
        Names of functions of `tmt`; all without any.

    Raises
    ------
    ValueError
        If the model is no Tree or there is no such quantity.

    Examples
    --------
    >>> forearm = tmt.ARM.lock({"alpha": 0.0, "beta": 0.0})
    >>> tmt.prepare(forearm)
    >>> print(tmt.gravity_balance([0.0], forearm).round(9))  # -1.5 9.81 0.15
    [-2.20725]
    """
    checked_model(model)
    if unknown := [name for name in quantities if not isinstance(name, str) or name not in QUANTITIES]:
        raise ValueError(f"{shown(unknown[0])} is no quantity; known are {', '.join(QUANTITIES)}")
    for quantity in quantities or QUANTITIES:
        (known.get(id(model)) or answers_of(model)).get(quantity)


class Answers:
    """The compiled quantities of a model, and those that are prepared."""

    def __init__(self, tree: Tree):
        self.tree = tree  # held, so that no other has its id
        self.compiled = {name: Evaluator(tree, name) for name in QUANTITIES}
        self.ready: dict[str, Callable[..., Any]] = {}  # of one state, those that are prepared
        self.shapes = [(tree.coordinates.nq,), (tree.coordinates.nv,), (tree.coordinates.nv,)]
        self.may_be_singular = not tree.never_singular

    def get(self, quantity: str) -> None:
        """Have machine code answer all calls."""
        if quantity not in self.ready:
            self.ready[quantity] = self.compiled[quantity].single()

    def of_one(self, quantity: str, given: tuple[Any, ...]) -> Any:
        """The quantity of one state that is given in plain arrays; None where nothing is compiled, or something is wrong."""
        evaluate = self.ready.get(quantity)
        if evaluate is None or (self.may_be_singular and quantity == "acceleration"):
            return None
        for array, shape in zip(given, self.shapes):
            if type(array) is not ndarray or array.shape != shape or array.dtype is not DOUBLE:
                return None
        return evaluate(*given)

    def of_any(self, quantity: str, given: tuple[Any, ...]) -> Any:
        """The quantity of states of any batch shape; None where the literal form is to answer."""
        with np.errstate(
            all="ignore"
        ):  # of numbers beyond the largest double, which the literal form refuses
            found = [x if type(x) is ndarray and x.dtype is DOUBLE else real_numbers(x) for x in given]
        arrays = [
            x for x, shape in zip(found, self.shapes) if x is not None and x.ndim and x.shape[-1:] == shape
        ]
        if len(arrays) < len(given):
            return None
        try:
            batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            return None
        count, own = math.prod(batch), self.compiled[quantity]
        if not count or (count <= SMALL and quantity not in self.ready):
            return None
        if quantity == "acceleration" and self.may_be_singular and self.is_singular(arrays[0]):
            return None
        if not batch:
            return own.of_one(*arrays)
        try:
            return own.of_any(*arrays)
        except MemoryError:
            return None

    def is_singular(self, q: ndarray) -> bool:
        """Whether Mbar may be singular at a position among these, or cannot be told here."""
        q = q.reshape(-1, q.shape[-1])
        M = self.compiled["mass_matrix"].of_rows(np.ascontiguousarray(q))
        n = len(self.tree.axis)
        return M is None or bool(singular.first(self.tree, q, M.reshape(-1, n, n)))
