"""What a user gives, checked: the value in the type that is worked with, or a ValueError of one line.

The line says what was given and what is accepted.
"""

import math
import numbers
import os
import reprlib
import textwrap
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tmt.derivation.mechanism import Mechanism

ALWAYS_FREE = 1e8  # B, that any machine has
CLOSE_TO_ONE = 1e-6  # how far the length of a quaternion may be from 1
Array = NDArray[np.float64]


def require(is_right: object, name: str, value: Any, expected: str) -> None:
    """Raise ValueError unless it is right: what was given, and what is expected."""
    if not is_right:
        raise ValueError(f"{name} is {shown(value)}; {expected} expected")


def shown(value: Any) -> str:
    try:
        return textwrap.shorten(reprlib.repr(value), 90, placeholder=" ...")
    except Exception:  # a repr that fails, an int of too many digits
        return f"a {type(value).__name__}"


def real_numbers(values: Any) -> Array | None:
    """The values as an array of float; None for what are no real numbers: truth values, masked ones, text."""
    try:
        if _masked(values):
            return None
        array = np.asarray(values)
        return array.astype(float) if array.dtype.kind in "fiu" else None
    except MemoryError:
        raise
    except Exception:  # whatever the conversion of a user's own object raises
        return None


def _masked(values: Any) -> bool:
    """Whether an entry is masked: NumPy would ignore the mask."""
    if isinstance(values, (list, tuple)):
        return any(_masked(value) for value in values if not isinstance(value, float))
    return isinstance(values, np.ma.MaskedArray) and bool(np.ma.getmaskarray(values).any())


def listed(values: Any) -> tuple[Any, ...] | None:
    is_row = isinstance(values, np.ndarray) and values.ndim == 1
    return tuple(values) if is_row or isinstance(values, (list, tuple)) else None


def names(field: str, values: Any) -> tuple[str, ...]:
    found = listed(values) or ()
    are_names = all(isinstance(name, str) and name.isprintable() for name in found)
    are_different = listed(values) is not None and are_names and len(set(found)) == len(found)
    require(are_different, f"Tree.{field}", values, "different names are")
    return tuple(map(str, found))


def numbers_of(name: str, values: Any, shape: tuple[int, ...]) -> Any:
    array = real_numbers(values)
    if array is None:
        raise ValueError(f"Tree.{name} is {shown(values)}; numbers of shape {shape} are expected")
    if array.shape != shape:
        raise ValueError(f"Tree.{name} has shape {array.shape}; {shape} is expected")
    require(np.isfinite(array).all(), f"Tree.{name}", values, "finite numbers are")
    return nested(array.tolist())


def nested(item: Any) -> Any:
    return tuple(map(nested, item)) if isinstance(item, list) else item


def states(model: Mechanism, **arrays: ArrayLike) -> list[Array]:
    """Arrays (..., nq), q, or (..., nv) of one batch shape, after a check of type, shape and values."""
    checked = {name: _state(model, name, values) for name, values in arrays.items()}
    for ball in model.coordinates.balls if checked.get("q", np.empty(0)).size else ():
        quaternions = checked["q"][..., ball.q].reshape(-1, 4)
        off = np.abs(np.linalg.norm(quaternions, axis=-1) - 1.0)
        name = model.joint_names[model.coordinates.joints.index(ball)]
        worst, is_close = quaternions[np.argmax(off)].tolist(), off.max() <= CLOSE_TO_ONE
        require(is_close, f"q of {name!r}", worst, "a quaternion w, x, y, z of length 1 is")
    try:
        batch = np.broadcast_shapes(*(array.shape[:-1] for array in checked.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in checked.items())
        raise ValueError(f"the batch shapes do not fit together: {shapes}") from None
    return [np.broadcast_to(array, (*batch, array.shape[-1])) for array in checked.values()]


def _state(model: Mechanism, name: str, values: ArrayLike) -> Array:
    n = {"q": model.coordinates.nq, "dt": 1}.get(name, model.coordinates.nv)
    array = real_numbers(values)
    if array is None:
        raise ValueError(f"{name} is {shown(values)}; real numbers of shape (..., {n}) are expected")
    if array.ndim == 0 or array.shape[-1] != n:
        kinds = dict.fromkeys(model.kind)
        flat = " or ".join(kind for kind in kinds if kind != "ball")
        parts = [f"one number per {flat}"] if flat else []
        if "ball" in kinds:
            parts.append("four per ball" if name == "q" else "three per ball")
        expected = f"(..., {n}) is expected, {', '.join(parts)} ({', '.join(model.joint_names)})"
        raise ValueError(f"{name} has shape {array.shape}; {expected}")
    if not np.isfinite(array).all():
        raise ValueError(f"{name} has values that are not finite; finite numbers are expected")
    return array


def positive(name: str, value: Any, kind: str) -> float:
    try:
        number = float(value) if isinstance(value, numbers.Real) and not isinstance(value, bool) else math.nan
    except OverflowError:
        number = math.inf
    require(0.0 < number < math.inf, name, value, f"{kind} above 0 is")
    return number


def whole(name: str, value: Any) -> int:
    """The value as an int of at least 1 that compiled code can count to."""
    number = int(value) if isinstance(value, numbers.Integral) and not isinstance(value, bool) else 0
    require(1 <= number < 2**63, name, value, "a whole number from 1 to 2^63 is")
    return number


def paths(runs: int, steps: int, every: int, nq: int, nv: int) -> tuple[Array, Array]:
    """Arrays for q and qd of all runs, (runs, steps / every + 1, nq or nv); ValueError without memory."""
    records = steps // every + 1
    size = runs * records * (nq + nv) * 8
    try:
        memory = float(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    except (AttributeError, OSError, ValueError):  # it is not known
        memory = math.inf
    try:
        if size > max(ALWAYS_FREE, memory):
            raise MemoryError
        return np.empty((runs, records, nq)), np.empty((runs, records, nv))
    except MemoryError:
        needed = f"{size / 1e9:.3g} GB" if size < 10**100 else "more than 1e+100 B"
        raise ValueError(
            f"steps is {shown(steps)}: with {nq} positions and {nv} speeds the states of {runs} runs would "
            f"take {needed} of memory, more than there is; with every=k each k-th of them is kept"
        ) from None
