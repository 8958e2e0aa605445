"""Validation of what users give for a scene."""

from typing import Any

import numpy as np


class WrongField(ValueError):
    """A field of a scene has a wrong value. accepted: what is expected instead."""

    def __init__(self, scene: object, field: str, value: object, accepted: str):
        named, shown = (shorten(" ".join(repr(part).split())) for part in (scene, value))
        super().__init__(f"scene {named}: {field} is {shown}; expected {accepted}")
        self.field, self.accepted = field, accepted


def is_number(value: object) -> bool:
    """Whether a value is a finite real number; texts and booleans are not."""
    try:
        number = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return number.ndim == 0 and number.dtype.kind in "iuf" and bool(np.isfinite(number))


def are_numbers(values: Any) -> bool:
    """Whether a value is a sequence of finite real numbers."""
    row = np.ndim(values) == 1 if isinstance(values, np.ndarray) else isinstance(values, tuple | list | range)
    return row and all(is_number(value) for value in values)


def shorten(text: str, length: int = 60) -> str:
    return text if len(text) <= length else text[: length - 4] + " ..."
