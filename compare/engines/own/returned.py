"""What a user's function returns as an array of float, what it raises in a line, and states as they can be typed."""

import traceback
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple

import numpy as np

from tmt.model.values import real_numbers, shown

from .functions import STATE, OwnError

SAME = 1e-12  # of the largest value: a batch gives what single states give, except for rounding
MOST_SHOWN = 8  # numbers of a state in a message


class Problem(NamedTuple):
    """Something wrong with equations that can be used all the same."""

    quantity: str
    state: str  # the first at which it was found, as the function was given it
    text: str  # one line


SHAPES: dict[str, Callable] = {  # of one state; None: the number of bodies, which is what it gives at first
    "mass_matrix": lambda nv: (nv, nv),
    "bias": lambda nv: (nv,),
    "gravity": lambda nv: (nv,),
    "acceleration": lambda nv: (nv,),
    "energy": lambda nv: (),
    "com_positions": lambda nv: (None, 3),
    "jacobians": lambda nv: (2, None, 3, nv),
}


def converted(name: str, value: object, expected: tuple, count: int | None) -> np.ndarray:
    """What a function returned as an array of float; OwnError if it is none of the expected shape."""
    expected = expected if count is None else (count, *expected)
    said = f"({', '.join('bodies' if n is None else str(n) for n in expected)}{',' * (len(expected) == 1)})"
    try:
        array = None if value is None else np.asarray(value)
        if array is not None and array.dtype.kind == "O":  # of SymPy's numbers and the like
            array = array.astype(float)
    except Exception:  # whatever the conversion of a user's own object raises
        array = None
    if array is not None and array.dtype.kind == "c":
        raise OwnError(f"{name} is complex: {shown(value)}; real numbers of shape {said} are expected")
    array = None if array is None else real_numbers(array)
    if array is None:
        raise OwnError(f"{name} is {shown(value)}; real numbers of shape {said} are expected")
    if len(array.shape) != len(expected) or any(n not in (None, m) for n, m in zip(expected, array.shape)):
        raise OwnError(f"{name} has shape {array.shape}; {said} is expected")
    return array


def same(together: np.ndarray, singles: np.ndarray) -> bool:
    """Whether a batch gives what single states give."""
    size = np.abs(singles[np.isfinite(singles)]).max(initial=0.0)
    return together.shape == singles.shape and np.allclose(
        together, singles, rtol=0.0, atol=SAME * size, equal_nan=True
    )


def state_in_words(state: list[np.ndarray]) -> str:
    """q, qd and tau, as many as there are, as they can be typed."""
    return ", ".join(f"{symbol} = {typed(part)}" for symbol, part in zip(STATE, state))


def and_more(count: int) -> str:
    """So many states beside the one that is named."""
    return f", and at {count} more state{'s' * (count > 1)}" if count else ""


def typed(values: np.ndarray) -> str:
    """Numbers as they can be typed."""
    more = ", ..." if len(values) > MOST_SHOWN else ""
    return f"[{', '.join(f'{value:.6g}' for value in values[:MOST_SHOWN])}{more}]"


def as_raised(error: BaseException) -> str:
    """An error of a user's own function, and the line where it was raised, as far as that is the user's."""
    text = f"{type(error).__name__}: {error}".rstrip(": ")
    frames = traceback.extract_tb(error.__traceback__)[1:]
    own = [frame for frame in frames if frame.filename == frames[0].filename]
    return f"{text} ({Path(own[-1].filename).name}, line {own[-1].lineno})" if own else text
