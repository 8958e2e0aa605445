"""What is given, as plain values: numbers, names, and how they are said in a message."""

import reprlib

import numpy as np


def shown(value) -> str:
    """What was given, in one short line."""
    try:
        return " ".join(reprlib.repr(value).split())
    except Exception:  # a repr that fails, an int of too many digits
        return f"a {type(value).__name__}"


def real_numbers(values) -> np.ndarray | None:
    """The values as an array of float, None if they are anything else but real numbers: truth values, masked ones, text."""
    try:
        if _masked(values):
            return None
        array = np.asarray(values)
        return array.astype(float) if array.dtype.kind in "fiu" else None
    except MemoryError:
        raise
    except Exception:  # whatever the conversion of a user's own object raises
        return None


def _masked(values) -> bool:
    """Whether an entry is masked: NumPy would ignore the mask."""
    if isinstance(values, (list, tuple)):
        return any(_masked(value) for value in values if not isinstance(value, float))
    return isinstance(values, np.ma.MaskedArray) and bool(np.ma.getmaskarray(values).any())


def names(field, values):
    """The values as a tuple of different strings that can stand in a line."""
    listed = isinstance(values, (list, tuple)) or (isinstance(values, np.ndarray) and values.ndim == 1)
    names = tuple(values) if listed else (None,)
    if not all(isinstance(name, str) and name.isprintable() for name in names) or len(set(names)) < len(
        names
    ):
        raise ValueError(f"Tree.{field} is {shown(values)}; different names are expected")
    return tuple(map(str, names))


def numbers_of(name, values, shape):
    """The values as nested tuples of float, after a check of their shape."""
    array = real_numbers(values)
    if array is None:
        raise ValueError(f"Tree.{name} is {shown(values)}; numbers of shape {shape} are expected")
    if array.shape != shape:
        raise ValueError(f"Tree.{name} has shape {array.shape}; {shape} is expected")
    if not np.isfinite(array).all():
        raise ValueError(f"Tree.{name} is {shown(values)}; finite numbers are expected")

    def nested(item):
        return tuple(map(nested, item)) if isinstance(item, list) else item

    return nested(array.tolist())
