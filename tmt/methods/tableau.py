"""Butcher tableaus: what explicit and implicit Runge-Kutta methods are given by."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tmt.methods.stepping import Method
from tmt.model.values import listed, real_numbers, shown

Numbers = tuple[float, ...]


@dataclass(frozen=True)
class Tableau(Method):
    """A method given by its Butcher tableau; ValueError unless rows of A sum to c, and b to 1."""

    order: int = field()  # it must be given, though Method has a default
    A: tuple[Numbers, ...]  # row i: the weights in stage i, of the stages before it or of all
    b: Numbers  # the weights of the stages in the step
    c: Numbers  # the time of each stage in units of dt

    def __post_init__(self) -> None:
        if type(self.order) is not int or not 1 <= self.order <= 100:
            expected = "a whole number from 1 to 100 is expected"
            raise ValueError(f"order of the method is {shown(self.order)}; {expected}")
        self.set_plain("A", tuple(numbers("A", row) for row in listed(self.A) or (None,)))
        for name in ("b", "c"):
            self.set_plain(name, numbers(name, getattr(self, name)))
        if not len(self.A) == len(self.b) == len(self.c):
            raise ValueError("A, b and c must have one entry for each stage")
        for i, (row, time) in enumerate(zip(self.A, self.c)):
            self.check_row(i, row)
            if abs(sum(row) - time) > 1e-14:
                raise ValueError(f"row {i} of A sums to {sum(row)}, not to c = {time}")
        if abs(sum(self.b) - 1.0) > 1e-14:
            raise ValueError(f"b sums to {sum(self.b)}, not to 1")

    def check_row(self, i: int, row: Numbers) -> None:
        """Raise ValueError if row i of A has not as many entries as the kind of method wants."""
        raise NotImplementedError

    def set_plain(self, name: str, value: Any) -> None:
        """Of floats in tuples, a method is a value, and a key of what is compiled for it."""
        object.__setattr__(self, name, value)


def numbers(name: str, values: Any) -> Numbers:
    array = real_numbers(values)
    if array is None or array.ndim != 1 or not np.isfinite(array).all():
        raise ValueError(f"{name} of the method has {shown(values)}, where a row of numbers is expected")
    return tuple(array.tolist())
