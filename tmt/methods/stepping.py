"""What a method of integration is: `Method`, whose `slope` asks a Form of the dynamics for accelerations."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from tmt.derivation.coordinates import Coordinates, coordinates_of
from tmt.derivation.form import LITERAL, Form
from tmt.derivation.mechanism import Mechanism
from tmt.derivation.vectors import Scalar, Values, plus, weighted
from tmt.model.values import listed, real_numbers, require, shown

Slope = Callable[[Values, Values], Values]
State = tuple[Values, Values]
Numbers = tuple[float, ...]
DIVERGED, NEWTON, SMALL, MANY = 1, 2, 3, 4  # why a run ends; 0: it does not
MOST_EVALUATIONS = 100_000_000  # of the dynamics, in a run of an adaptive method


class Method(ABC):
    """A method of integration. Another one is a hashable subclass with a `step`, such as a frozen dataclass.

    `step(slope, q, qd, dt, joints)` returns the state (q, qd) one dt later, each a list of scalars of any
    type; it asks `slope(q, qd)` for accelerations, a list of nv. Which accelerations these are is said by the
    method's own `slope`. Positions move by `joints.move(q, u)`, see coordinates.py: with balls q is longer
    than qd.
    """

    order: int = 1  # the error of a run falls with dt to this power
    adaptive = False  # chooses its own steps, takes a tolerance and has an `attempt`, see AdaptiveRungeKutta
    solves_stages = False  # its stages solve an equation: it has `stage_states` and `finish`, see implicit.py

    @cached_property
    def stages(self) -> int:
        """Evaluations of the dynamics in one step; of a method that solves its stages, in one iteration."""
        positions = []

        def slope(q: Values, qd: Values) -> Values:
            positions.append(q)
            return [0.0]

        self.step(slope, [0.0], [0.0], 1.0, coordinates_of(("hinge",)))
        return len(positions)

    def slope(
        self, tree: Mechanism, q: Values, qd: Values, tau: Values, dt: Scalar, form: Form = LITERAL
    ) -> Values:
        return form.acceleration(tree, q, qd, tau)

    @abstractmethod
    def step(self, slope: Slope, q: Values, qd: Values, dt: Scalar, joints: Coordinates) -> State:
        """The state (q, qd) one dt later, from `slope(q, qd)`."""


def increments(dt: Scalar, weights: Sequence[float], slopes: Sequence[Values], n: int) -> Values:
    return [dt * weighted(weights, (slope[k] for slope in slopes)) for k in range(n)]


def advance(start: Values, dt: Scalar, weights: Sequence[float], slopes: Sequence[Values]) -> Values:
    return plus(start, increments(dt, weights, slopes, len(start)))


@dataclass(frozen=True)
class Tableau(Method):
    """A method given by its Butcher tableau; ValueError unless rows of A sum to c, and b to 1."""

    order: int = field()  # it must be given, though Method has a default
    A: tuple[Numbers, ...]  # row i: the weights in stage i, of the stages before it or of all
    b: Numbers  # the weights of the stages in the step
    c: Numbers  # the time of each stage in units of dt

    def __post_init__(self) -> None:
        is_order = type(self.order) is int and 1 <= self.order <= 100
        require(is_order, "order of the method", self.order, "a whole number from 1 to 100 is")
        self.set_rows("A")
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

    @abstractmethod
    def check_row(self, i: int, row: Numbers) -> None:
        """Raise ValueError if row i of A has not as many entries as the kind of method wants."""

    def set_rows(self, name: str) -> None:
        self.set_plain(name, tuple(numbers(name, row) for row in listed(getattr(self, name)) or (None,)))

    def set_plain(self, name: str, value: Any) -> None:
        """Of floats in tuples, a method is a value, and a key of what is compiled for it."""
        object.__setattr__(self, name, value)


def numbers(name: str, values: Any) -> Numbers:
    array = real_numbers(values)
    if array is None or array.ndim != 1 or not np.isfinite(array).all():
        raise ValueError(f"{name} of the method has {shown(values)}, where a row of numbers is expected")
    return tuple(array.tolist())
