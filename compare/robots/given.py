"""What is given for a scene: whether it is made of numbers, and what is said of what cannot be."""

from collections.abc import Sequence

import numpy as np


class WrongField(ValueError):
    """A field that cannot be one of a scene: which, and what is accepted."""

    def __init__(self, scene: object, field: str, value: object, accepted: str):
        named, found = (shorten(" ".join(repr(part).split())) for part in (scene, value))
        super().__init__(f"scene {named}: {field} is {found}; {accepted} is expected")
        self.field, self.accepted = field, accepted


def is_number(value: object) -> bool:
    """Whether a value is one finite real number; neither text nor true and false."""
    try:
        number = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return number.ndim == 0 and number.dtype.kind in "iuf" and bool(np.isfinite(number))


def are_numbers(values: object) -> bool:
    """Whether the values are such numbers in a row."""
    row = np.ndim(values) == 1 if isinstance(values, np.ndarray) else isinstance(values, tuple | list | range)
    return row and all(is_number(value) for value in values)


def some(names: Sequence[str], most: int = 6) -> str:
    """Names in a sentence: the first ones, and how many more there are."""
    more = len(names) - most
    return ", ".join(names[:most]) + (f" and {more} more" if more > 0 else "")


def shorten(text: str, length: int = 60) -> str:
    """A text that may stand in one line."""
    return text if len(text) <= length else text[: length - 4] + " ..."
