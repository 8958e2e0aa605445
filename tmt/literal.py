"""The public functions in the literal form: method.py with NumPy, nothing compiled.

It answers small requests, says what is wrong with what is given, and is what other forms are compared with.
Arguments, results and errors are those of the functions of the same names in `tmt`.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tmt.derivation.quantities import PLAIN, State, argument_of, quantity_of
from tmt.derivation.vectors import Rows, Scalar, Values, added
from tmt.methods import METHODS, SemiImplicitEuler, method_named, transition
from tmt.model import singular
from tmt.model.tree import Tree, checked_model
from tmt.model.values import states

BEYOND = "the result is beyond the largest double; smaller numbers in the state or model are expected"


def __getattr__(name: str) -> Callable[..., Any]:
    if name not in PLAIN:
        raise AttributeError(name)
    return literal(name)


def literal(name: str) -> Callable[..., Any]:
    """The quantity of that full name as a function of a model and what it takes."""
    takes = quantity_of(name).takes

    def function(model: Tree, *arrays: Any) -> Any:
        if len(arrays) != len(takes):
            raise TypeError(f"{name} takes a model and {', '.join(takes)}")
        try:
            with np.errstate(all="ignore"):  # of warnings, which no caller can place
                return answer(name, model, dict(zip(takes, arrays)))
        except MemoryError as error:
            raise ValueError(f"{name} of these states does not fit into memory: {error}") from None

    function.__name__ = function.__qualname__ = name
    return function


def answer(name: str, tree: Tree, arrays: dict[str, ArrayLike]) -> Any:
    checked_model(tree)
    quantity, checked = quantity_of(name), states(tree, **arrays)
    batch = checked[0].shape[:-1]
    scalars = {key: list(np.moveaxis(array, -1, 0)) for key, array in zip(arrays, checked)}
    state = State(tree, scalars, name=argument_of(name))
    if quantity.solves and not tree.never_singular:
        matrix = state.mass_matrix
        if isinstance(stepping := METHODS.get(argument_of(name)), SemiImplicitEuler):
            implicit = stepping.implicit(tree, list(state.qd), scalars["dt"][0])
            matrix = added(matrix, implicit.matrix)
        check_regular(tree, list(state.q), matrix, batch)
    if quantity.argument == "method":
        q, qd, tau, dt = checked
        try:
            steps = transition(method_named(argument_of(name)), tree, q, qd, tau, dt[..., 0])
        except (ArithmeticError, np.linalg.LinAlgError) as error:
            why = f"{argument_of(name)} has no step of this size from a state: {error}"
            raise ValueError(why) from None
        if not np.isfinite(steps).all():
            raise ValueError(BEYOND)
        return steps
    values = quantity.of(state)
    if quantity.parts:
        return tuple(gather(part, batch) for part in values)
    return gather(values, batch, overflow=np.inf if name == "energy" else None)


def check_regular(tree: Tree, q: Values, matrix: Rows, batch: tuple[int, ...]) -> None:
    """Raise ValueError where the matrix that a system is solved with is singular, at the first such state."""
    n = len(matrix)
    positions = gather(q, batch).reshape(-1, len(q))
    if place := singular.first(tree, positions, gather(matrix, batch).reshape(-1, n, n)):
        at = ", ".join(f"{value:.6g}" for value in positions[place[0]])
        unit = " rad" if set(tree.kind) == {"hinge"} else ""
        raise ValueError(f"Mbar is singular at q = ({at}){unit}: {place[1]}")


def gather(nested: Scalar, batch: tuple[int, ...], overflow: float | None = None) -> np.ndarray:
    """Nested scalars as an array, the batch first; overflow: for what is not finite, None: an error."""

    def lists(item: Scalar) -> Scalar:
        if isinstance(item, (float, np.ndarray)):
            return item if np.shape(item) == batch else np.broadcast_to(item, batch)
        return [lists(part) for part in item]

    array = np.array(lists(nested), dtype=float)
    finite = np.isfinite(array)
    if overflow is not None:
        array = np.where(finite, array, overflow)
    elif not finite.all():
        raise ValueError(BEYOND)
    components = array.ndim - len(batch)
    return np.moveaxis(array, range(components), range(-components, 0)).copy()
