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

ARGUMENTS = {  # of a state
    "q": "(..., nq), rad; of slides m, of balls a quaternion w, x, y, z",
    "qd": "(..., nv), rad/s; of slides m/s, of balls the angular velocity in the body's frame",
    "qdd": "(..., nv), rad/s2; of slides m/s2",
    "tau": "(..., nv), N m; of slides N",
}
MOST = 256  # evaluators that are held, besides those that are prepared
DOUBLE = np.dtype(float)
Function = TypeVar("Function", bound=Callable[..., Any])
prepared: dict[tuple[Tree, str], Evaluator] = {}
evaluator_of = lru_cache(maxsize=MOST)(Evaluator)


def documented(function: Function) -> Function:
    """Add what all functions of a state share, errors and arguments, before the examples of a docstring."""
    text = inspect.getdoc(function)
    if text is None:  # python -OO
        return function
    _, *states = inspect.signature(function).parameters
    solved = " a singular Mbar," if quantity_of(function.__name__).solves else ""
    arguments = "\n".join(f"{name} : {ARGUMENTS[name]}" for name in states)
    before, mark, examples = text.partition("\n\n>>> ")
    shared = f"""
Raises ValueError for wrong shapes, values that are not finite,{solved} results beyond the largest double.

Parameters
----------
model : Tree
{arguments}"""
    function.__doc__ = before + shared + mark + examples
    return function


def answered(quantity: str, model: Tree, *arguments: ArrayLike) -> Any:
    """The quantity of states of any batch shape, given as the function of its name takes them."""
    if isinstance(model, Tree):
        result = by_machine_code(quantity, model, arguments)
        if result is not None:
            return result
    return literal.literal(quantity)(model, *arguments)


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

    >>> forearm = tmt.ARM.lock({"alpha": 0.0, "beta": 0.0})
    >>> tmt.prepare(forearm)
    >>> print(tmt.gravity_balance(forearm, [0.0]).round(9))  # -1.5 9.81 0.15
    [-2.20725]
    """
    checked_model(model)
    chosen = quantities or [name for name in PLAIN if not QUANTITIES[name].is_long]
    for evaluator in [Evaluator(model, quantity) for quantity in chosen]:
        evaluator.loop(wide=False)  # it is compiled, or loaded
        prepared[model, evaluator.quantity] = evaluator


def by_machine_code(quantity: str, tree: Tree, arguments: tuple[Any, ...]) -> Any:
    """The quantity of states; None where NumPy is to answer: few states, or something is wrong."""
    evaluator = prepared.get((tree, quantity))
    if evaluator and not evaluator.may_be_singular:
        for array, shape in zip(arguments, evaluator.shapes):  # no generator, which takes as long as the rest
            if type(array) is not ndarray or array.shape != shape or array.dtype is not DOUBLE:
                break
        else:  # one state in arrays of doubles: nothing else has to be looked at
            return evaluator.of_one(*arguments)
    # without warnings of numbers beyond the largest double, which the literal form refuses
    with np.errstate(all="ignore"):
        numbers = [x if type(x) is ndarray and x.dtype is DOUBLE else real_numbers(x) for x in arguments]
    arrays = [x for x in numbers if x is not None]
    sizes = [(tree.nq,), (tree.nv,), (tree.nv,), (1,)]
    if [array.shape[-1:] for array in arrays] != sizes[: len(arguments)]:
        return None
    try:
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in arrays))
    except ValueError:
        return None
    count = math.prod(batch)
    if count == 0 or ((count <= SMALL or quantity_of(quantity).is_long) and not evaluator):
        return None
    evaluator = evaluator or evaluator_of(tree, quantity)
    if evaluator.may_be_singular and is_singular(tree, arrays[0]):
        return None
    try:
        return evaluator.of_any(*arrays) if batch else evaluator.of_one(*arrays)
    except MemoryError:
        return None


def is_singular(tree: Tree, q: ndarray) -> bool:
    """Whether Mbar may be singular at a position among these, or cannot be told here."""
    q = np.ascontiguousarray(q.reshape(-1, q.shape[-1]))
    M = (prepared.get((tree, "mass_matrix")) or evaluator_of(tree, "mass_matrix")).of_rows(q)
    return M is None or bool(singular.first(tree, q, M.reshape(-1, tree.nv, tree.nv)))
