"""What is given, as plain values: numbers, names, and how they are said in a message."""

import reprlib
from typing import Any

import numpy as np
from numpy.typing import NDArray


def shown(value: Any) -> str:
    """What was given, in one short line."""
    try:
        return " ".join(reprlib.repr(value).split())
    except Exception:  # a repr that fails, an int of too many digits
        return f"a {type(value).__name__}"


def real_numbers(values: Any) -> NDArray[np.float64] | None:
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
    """The values of a list, a tuple or an array of one dimension; None of anything else."""
    is_row = isinstance(values, np.ndarray) and values.ndim == 1
    return tuple(values) if is_row or isinstance(values, (list, tuple)) else None


def names(field: str, values: Any) -> tuple[str, ...]:
    found = listed(values) or ()
    are_names = all(isinstance(name, str) and name.isprintable() for name in found)
    if listed(values) is None or not are_names or len(set(found)) < len(found):
        raise ValueError(f"Tree.{field} is {shown(values)}; different names are expected")
    return tuple(map(str, found))


def numbers_of(name: str, values: Any, shape: tuple[int, ...]) -> Any:
    """The values as nested tuples of float, after a check of their shape."""
    array = real_numbers(values)
    if array is None:
        raise ValueError(f"Tree.{name} is {shown(values)}; numbers of shape {shape} are expected")
    if array.shape != shape:
        raise ValueError(f"Tree.{name} has shape {array.shape}; {shape} is expected")
    if not np.isfinite(array).all():
        raise ValueError(f"Tree.{name} is {shown(values)}; finite numbers are expected")
    return nested(array.tolist())


def nested(item: Any) -> Any:
    return tuple(map(nested, item)) if isinstance(item, list) else item
