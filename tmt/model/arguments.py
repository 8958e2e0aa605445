"""What a user gives, checked: the value in the type that is worked with, or a ValueError of one line.

The line says what was given and what is accepted.
"""

import functools
import math
import numbers
import os
from collections.abc import Callable

import numpy as np

from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.tree import Tree
from tmt.model.values import real_numbers, shown

SMALL = 1e8  # B, that any machine has


def quantity(function: Callable) -> Callable:
    """The function without NumPy's warnings, which no caller can place; what does not fit into memory is a ValueError."""

    @functools.wraps(function)
    def evaluated(*arguments, **named):
        try:
            with np.errstate(all="ignore"):
                return function(*arguments, **named)
        except MemoryError as error:
            raise ValueError(
                f"{function.__name__} of these states does not fit into memory: {error}"
            ) from None

    return evaluated


def states(model, **arrays) -> list:
    """Each array as nq scalars (q) or nv of one batch shape, after a check of type, shape and values."""
    checked_model(model)
    coordinates, checked = model.coordinates, []
    for name, values in arrays.items():
        n = coordinates.nq if name == "q" else coordinates.nv
        array = real_numbers(values)
        if array is None:
            raise ValueError(f"{name} is {shown(values)}; real numbers of shape (..., {n}) are expected")
        if array.ndim == 0 or array.shape[-1] != n:
            kinds = dict.fromkeys(model.kind)
            each = " or ".join(kind for kind in kinds if kind != "ball")
            one = [f"one number per {each}"] * bool(each)
            one += [f"{'four' if name == 'q' else 'three'} per ball"] * ("ball" in kinds)
            names = ", ".join(model.joint_names)
            raise ValueError(
                f"{name} has shape {array.shape}; (..., {n}) is expected, {', '.join(one)} ({names})"
            )
        if not np.isfinite(array).all():
            raise ValueError(f"{name} has values that are not finite; finite numbers are expected")
        if name == "q":
            for joint in coordinates.balls:
                off = np.abs(np.linalg.norm(array[..., joint.q], axis=-1) - 1.0)
                if off.size and off.max() > CLOSE_TO_ONE:
                    ball = model.joint_names[coordinates.joints.index(joint)]
                    found = array[..., joint.q].reshape(-1, 4)[np.argmax(off)]
                    wanted = "a quaternion w, x, y, z of length 1 is expected"
                    raise ValueError(f"q of {ball!r} is {found.tolist()}; {wanted}")
        checked.append(array)
    batches = [array.shape[:-1] for array in checked]
    try:
        batch = np.broadcast_shapes(*batches)
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in zip(arrays, checked))
        raise ValueError(f"the batch shapes do not fit together: {shapes}") from None
    checked = [np.broadcast_to(array, (*batch, array.shape[-1])) for array in checked]
    return [[array[..., i] for i in range(array.shape[-1])] for array in checked]


def checked_model(model) -> None:
    """Raise ValueError unless it is a Tree."""
    if not isinstance(model, Tree):
        raise ValueError(f"model is {shown(model)}; a tmt.Tree is expected")


def positive(name, value, kind) -> float:
    """The value as a finite float above 0."""
    if type(value) is float and 0.0 < value < math.inf:
        return value
    try:
        number = float(value) if isinstance(value, numbers.Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        number = math.inf
    if not 0.0 < number < math.inf:
        raise ValueError(f"{name} is {shown(value)}; {kind} above 0 is expected")
    return number


def whole(name, value) -> int:
    """The value as an int of at least 1 that compiled code can count to."""
    if type(value) is int and 1 <= value < 2**63:
        return value
    if not isinstance(value, numbers.Integral) or isinstance(value, bool) or value < 1:
        raise ValueError(f"{name} is {shown(value)}; a whole number of at least 1 is expected")
    if value >= 2**63:
        raise ValueError(f"{name} is {shown(value)}; a whole number below 2^63 is expected")
    return int(value)


def paths(runs, steps, every, nq, nv) -> tuple[np.ndarray, np.ndarray]:
    """Arrays for the q and qd of all runs, (runs, steps / every + 1, nq or nv); ValueError if there is no memory for them."""
    records = steps // every + 1
    size = runs * records * (nq + nv) * 8
    try:
        if size > SMALL and size > memory():
            raise MemoryError
        return np.empty((runs, records, nq)), np.empty((runs, records, nv))
    except MemoryError:
        size = f"{size / 1e9:.3g} GB" if size < 10**100 else "more than 1e+100 B"
        raise ValueError(
            f"steps is {shown(steps)}: with {nq} positions and {nv} speeds the states of {runs} runs would take {size} of "
            "memory, more than there is; with every=k each k-th of them is kept"
        ) from None


def memory() -> float:
    """The memory of this machine, B; infinite where it is not known."""
    try:
        return float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):
        return math.inf
