"""Butcher tableaus: what explicit and implicit Runge-Kutta methods are given by."""

from dataclasses import dataclass, field
from typing import TypeGuard

import numpy as np

from tmt.methods.stepping import Method
from tmt.model.values import real_numbers, shown

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
        self.make_plain("A", "b", "c")
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

    def make_plain(self, *names: str) -> None:
        """Make these rows of numbers tuples of float: a method is a value, and a key of what is compiled for it."""
        for name in names:
            value, is_nested = getattr(self, name), name not in ("b", "c")
            try:
                parts = [real_numbers(part) for part in value] if is_nested else [real_numbers(value)]
            except TypeError:  # one number where rows are expected
                parts = [None]
            rows = tuple(tuple(part.tolist()) for part in parts if is_vector(part))
            if len(rows) < len(parts):
                wanted = "rows of numbers" if is_nested else "numbers"
                raise ValueError(f"{name} of the method is {shown(value)}; {wanted} are expected")
            object.__setattr__(self, name, rows if is_nested else rows[0])  # it is frozen


def is_vector(values: np.ndarray | None) -> TypeGuard[np.ndarray]:
    return values is not None and values.ndim == 1 and bool(np.isfinite(values).all())
