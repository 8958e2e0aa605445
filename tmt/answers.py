"""Who answers the public functions: NumPy up to SMALL states, machine code more, and prepared models.

Nothing depends on earlier calls: the same call gives the same bits. Compiled code answers where nothing is
wrong with what is given; whatever is, the literal form says.
"""

import inspect
import math
from collections.abc import Callable
from functools import lru_cache
from typing import Any, TypeVar

import numpy as np
from numpy import ndarray
from numpy.typing import ArrayLike

from tmt import literal
from tmt.compiled.evaluator import SMALL, Evaluator
from tmt.derivation.quantities import PLAIN, QUANTITIES, quantity_of
from tmt.model import singular
from tmt.model.tree import Tree, checked_model
from tmt.model.values import real_numbers

PARAMETERS = {
    "model": "Tree",
    "q": "(..., nq), rad, of slides m, of balls quaternions w, x, y, z",
    "qd": "(..., nv), rad/s, of slides m/s",
    "tau": "(..., nv), N m, of slides N",
    "qdd": "(..., nv), rad/s2, of slides m/s2",
}
MOST = 64  # models that are held, besides those that are prepared
DOUBLE = np.dtype(float)
Function = TypeVar("Function", bound=Callable[..., Any])
prepared: dict[Tree, "Answers"] = {}


def documented(function: Function) -> Function:
    """Add the sections on parameters and errors, which all functions of a state share, to a docstring."""
    text = inspect.getdoc(function)
    if text is None:  # python -OO
        return function
    lines = [f"{name} : {PARAMETERS[name]}" for name in inspect.signature(function).parameters]
    solved = " a singular Mbar," if literal.is_solved(function.__name__) else ""
    wrong = f"For wrong shapes, values that are not finite,{solved} results beyond the largest double."
    before, returns, after = text.partition("Returns\n-------\n")
    values, _, examples = after.partition("\n\n")
    parts = [
        "Parameters\n----------\n" + "\n".join(lines), returns + values, f"Raises\n------\nValueError\n    {wrong}",
        examples,
    ]  # fmt: skip
    function.__doc__ = before + "\n\n".join(parts)
    return function


def answered(quantity: str, model: Tree, *arguments: ArrayLike) -> Any:
    """The quantity of states of any batch shape, given as the function of its name takes them."""
    if isinstance(model, Tree):
        answers = prepared.get(model) or recent(model)
        result = answers.by_machine_code(quantity, arguments)
        if result is not None:
            return result
    return literal.literal(quantity)(model, *arguments)


@lru_cache(maxsize=MOST)
def recent(model: Tree) -> "Answers":
    return Answers(model)


def prepare(model: Tree, *quantities: str) -> None:
    """Have machine code answer all calls of a model from now on: for many calls, in a loop or a controller.

    Without it NumPy answers those of up to 500 states, ten times as slowly; the last bits differ. The first
    time on a machine all take about a second for an arm and several for a humanoid; derivatives take longer
    and have to be named. ValueError if the model is no Tree or there is no such quantity.

    Parameters
    ----------
    model : Tree
    *quantities : names of functions of `tmt`; without any all but derivatives and what has an argument
        That stands after a colon: "step_derivatives:rk4", and for `frame` of a body or site NAME
        "frame_pose:NAME", "frame_jacobian:NAME" and "frame_convective:NAME".

    Examples
    --------
    >>> forearm = tmt.ARM.lock({"alpha": 0.0, "beta": 0.0})
    >>> tmt.prepare(forearm)
    >>> print(tmt.gravity_balance(forearm, [0.0]).round(9))  # -1.5 9.81 0.15
    [-2.20725]
    """
    checked_model(model)
    chosen = quantities or [name for name in PLAIN if not QUANTITIES[name].is_long]
    answers = prepared.setdefault(model, recent(model))
    for evaluator in [Evaluator(model, quantity) for quantity in chosen]:
        evaluator.loop(wide=False)  # it is compiled, or loaded
        answers.evaluators[evaluator.quantity] = evaluator
        answers.prepared[evaluator.quantity] = evaluator.of_one


class Answers:
    def __init__(self, tree: Tree):
        self.tree = tree
        self.evaluators: dict[str, Evaluator] = {}
        self.prepared: dict[str, Callable[..., Any]] = {}  # of one state
        self.shapes = [(tree.coordinates.nq,), (tree.coordinates.nv,), (tree.coordinates.nv,), (1,)]
        self.may_be_singular = not tree.never_singular

    def evaluator(self, quantity: str) -> Evaluator:
        if quantity not in self.evaluators:
            self.evaluators[quantity] = Evaluator(self.tree, quantity)
        return self.evaluators[quantity]

    def by_machine_code(self, quantity: str, arguments: tuple[Any, ...]) -> Any:
        """The quantity of states; None where NumPy is to answer: few states, or something is wrong."""
        prepared = self.prepared.get(quantity)
        may_be_singular = self.may_be_singular and literal.is_solved(quantity)
        if prepared and not may_be_singular:
            for array, shape in zip(arguments, self.shapes):  # no generator, which takes as long as the rest
                if type(array) is not ndarray or array.shape != shape or array.dtype is not DOUBLE:
                    break
            else:  # one state in arrays of doubles: nothing else has to be looked at
                return prepared(*arguments)
        # without warnings of numbers beyond the largest double, which the literal form refuses
        with np.errstate(all="ignore"):
            numbers = [x if type(x) is ndarray and x.dtype is DOUBLE else real_numbers(x) for x in arguments]
        arrays = [x for x in numbers if x is not None]
        if [array.shape[-1:] for array in arrays] != self.shapes[: len(arguments)]:
            return None
        try:
            batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
        except ValueError:
            return None
        count = math.prod(batch)
        if count == 0 or ((count <= SMALL or quantity_of(quantity).is_long) and not prepared):
            return None
        if may_be_singular and self.is_singular(arrays[0]):
            return None
        evaluator = self.evaluator(quantity)
        try:
            return evaluator.of_any(*arrays) if batch else evaluator.of_one(*arrays)
        except MemoryError:
            return None

    def is_singular(self, q: ndarray) -> bool:
        """Whether Mbar may be singular at a position among these, or cannot be told here."""
        q = q.reshape(-1, q.shape[-1])
        M = self.evaluator("mass_matrix").of_rows(np.ascontiguousarray(q))
        n = len(self.tree.axis)
        return M is None or bool(singular.first(self.tree, q, M.reshape(-1, n, n)))
