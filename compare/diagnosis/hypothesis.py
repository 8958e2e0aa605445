"""One way in which equations can be wrong: a cause, and what it changes in the values of Mbar and h.

All kinds have this form. A hypothesis is open, as "mass of forearm", until a number is fitted, or it is
complete, as "masses exchanged", and its change is 1. Its cost is stated where it is made: of several
explanations that with the fewer and rounder numbers, and the commoner slip, is named first.
"""

from dataclasses import replace
from itertools import product
from math import log10
from typing import Any, NamedTuple

import numpy as np
from numpy import ndarray

from ..core.cause import Cause
from ..robots.joint_map import JointMap, within_a_turn
from .model import Equations, Path

OF_ZERO = "zero position"  # a kind: the zero of a joint is a convention
COMMON_FACTORS = (-1.0, 0.0, 0.5, 1.0, 2.0)
# angles that are written in one unit and read in the other, rad
COMMON_ANGLES = np.radians(np.outer((90, 180, 45, 30, 60, 15, 120, 135, 150, 270), (1.0, -1.0)).ravel())
WRITTEN = 1e-6  # of a turn: what the digits of an angle leave
FIT_ROUNDING = 1e-11  # of the size of a number: what a fit leaves of a number that is 0
SMALL = 1e-9  # of the other numbers: a number that a regression leaves at 0
EVERY = 0.03  # what a cause in several bodies or joints costs more
RARE, MASSLESS = 0.15, 0.2  # what an anchor or a new armature, and no mass cost more
NATURAL = 1.0  # a cause that costs less is said; the others only if there is no such
ADDED, PAIR = 0.1, 0.3  # a number that was 0, a second cause
UNUSUAL = 1.0  # of a factor or a number that nobody writes
ALL = slice(None)  # entries of a state
Entries = slice | list[int]


class Hypothesis(NamedTuple):
    """A cause, whose `explains` is None where its number is open, and what a change of 1 does."""

    cause: Cause
    column: ndarray | None = None  # what it adds to the values, (states, entries)
    moves: tuple[tuple[Path, float], ...] = ()  # or numbers of the tree, and how far they go
    size: float = 1.0  # of a change that matters, for starts of a search
    least: float = -np.inf  # possible value
    convention: Any = None  # a Convention, which other causes may stand beside

    @property
    def is_open(self) -> bool:
        return self.cause.explains is None

    @property
    def key(self) -> tuple[str, str]:
        """What tells it from the others of its kind."""
        return self.cause.place, str(self.cause.explains)

    @property
    def joints(self) -> JointMap | None:
        """How the joints are stated in its convention."""
        return self.convention.joints if self.convention else None

    @property
    def is_quadratic(self) -> bool:
        """Whether Mbar and h are a polynomial of second degree in it."""
        return not any(path.field in ("axis", "reference") for path, _ in self.moves)

    def value(self, change: float) -> float:
        """The number after a change (of a zero, half a turn at most); 0 if only digits of a fit remain."""
        stated, is_slide = float(self.cause.stated), self.cause.unit == "m"
        value = stated + (within_a_turn(change, is_slide) if self.cause.kind == OF_ZERO else change)
        return 0.0 if abs(value) < FIT_ROUNDING * self.size else float(value)

    def is_possible(self, change: float) -> bool:
        """Whether no mass, inertia, damping or stiffness is below zero, except the right one with the other sign."""
        if not self.is_open:
            return True
        value, stated = self.value(change), float(self.cause.stated)
        return value >= self.least or bool(stated and np.isclose(value, -stated, rtol=SMALL))

    def explained(self, change: float) -> Cause:
        """The cause with its number; of a zero whose angle is read in another unit, both angles."""
        cause = self.cause
        if not self.is_open:
            return cause
        if cause.kind == OF_ZERO and cause.unit == "rad":
            for meant, read in product(COMMON_ANGLES, (np.degrees, np.radians)):
                turns = (change - read(meant) + meant) / (2.0 * np.pi)
                if abs(turns - round(turns)) < WRITTEN:
                    right, yours = abs(float(meant)), abs(float(read(meant)))
                    return replace(cause, rank=2, kind="number", stated=right, explains=yours, cost=0.0)
        stated, explains, more = float(cause.stated), self.value(change), 0.0
        field = self.moves[0][0].field if self.moves else ""
        if field == "mass" and explains == 0.0:
            more = MASSLESS
        if field == "armature" and not (stated and is_common(explains / stated)):
            more = RARE
        return replace(cause, explains=explains, cost=cause.cost + more)


def slip(
    right: ndarray, place: str, explains: str, values: ndarray, cost: float = 0.3, kind: str = "slip",
    rank: int = 2, stated: str = "", owner: str = "", owners: int = 1,
) -> Hypothesis:  # fmt: skip
    """A complete hypothesis of the values that it gives and the right ones; place: with {} for its owner, a body or joint."""
    name, form = (place.replace("{}", owner), place) if owner else (place, "")
    about: dict[str, Any] = {"form": form, "owners": owners, "cost": cost + EVERY * (owners > 1)}
    cause = Cause(rank=rank, kind=kind, place=name, stated=stated, explains=explains, **about)
    return Hypothesis(cause, values - right)


def number(
    place: str, stated: float, unit: str, cost: float = 0.0, kind: str = "number", form: str = "",
    owners: int = 1, **more: Any,
) -> Hypothesis:  # fmt: skip
    """An open hypothesis; more: the fields of a Hypothesis."""
    about: dict[str, Any] = {"form": form, "owners": owners, "cost": cost + EVERY * (owners > 1)}
    rank, stated = 1 if kind == OF_ZERO else 2, float(stated)
    cause = Cause(rank=rank, kind=kind, place=place, stated=stated, explains=None, unit=unit, **about)
    return Hypothesis(cause, **more)


def factor(
    kind: str, place: str, column: ndarray, entries: Entries = ALL, cost: float = 0.15, stated: float = 1.0,
    **more: Any,
) -> Hypothesis:  # fmt: skip
    """The factor of what some entries of a column (states, entries) are; 1 is right."""
    chosen = np.zeros_like(column)
    chosen[:, entries] = column[:, entries]
    return number(place, stated, "times", cost, kind, column=chosen, **more)


def is_common(factor: float) -> bool:
    """Whether a wrong term often has this factor."""
    return bool(np.isclose(factor, COMMON_FACTORS, rtol=0.0, atol=1e-6).any())


def option(right: ndarray, place: str, stated: str, explains: str, values: ndarray) -> Hypothesis:
    """What an option or a convention of the whole file or program changes."""
    return slip(right, place, explains, values, 0.0, "option", rank=1, stated=stated)


# which is named first


def cost(cause: Cause, equations: Equations) -> float:
    """A number that is smaller the likelier a cause is."""
    if len(cause.parts) > 1:
        return PAIR + sum(cost(part, equations) for part in cause.parts)
    value, stated = cause.explains, cause.stated
    if not (isinstance(value, float) and isinstance(stated, float)):
        return cause.cost
    if cause.unit == "times":
        return cause.cost + of_factor(value, equations) + 0.05 * (value != 0.0)
    if cause.kind == OF_ZERO and cause.unit == "rad":
        quarters = (value - stated) / (np.pi / 2.0)
        is_quarter = abs(quarters - round(quarters)) < 1e-9
        return cause.cost + (0.05 if is_quarter else of_number(np.degrees(value), stated, equations))
    added = ADDED * (stated == 0.0 and cause.kind != OF_ZERO)
    return cause.cost + of_number(value, stated, equations) + added


def of_factor(factor: float, equations: Equations) -> float:
    """A common factor costs little, degrees for rad a little, a length or a mass, or one over it, more."""
    if is_common(factor):
        return 0.0
    if np.isclose(abs(log10(abs(factor))), log10(180.0 / np.pi), rtol=1e-9):
        return 0.1
    lengths = np.abs(np.concatenate([equations.stated[name].ravel() for name in ("offset", "com", "mass")]))
    lengths = lengths[lengths > 0.0]
    is_power = np.isclose(np.concatenate([lengths, 1.0 / lengths]), abs(factor), rtol=1e-9, atol=0.0).any()
    return 0.3 if is_power else UNUSUAL


def of_number(value: float, stated: float, equations: Equations) -> float:
    """0, the other sign or another power of ten cost least, then numbers with few digits or of the model."""
    ratio = abs(value / stated) if stated else 0.0
    if value == 0.0 or (ratio and abs(log10(ratio) - round(log10(ratio))) < 1e-10):
        return 0.1
    digits = len(f"{abs(value):.10e}".split("e")[0].replace(".", "").rstrip("0"))
    others = np.concatenate([np.abs(field).ravel() for field in equations.stated.values()])
    if np.isclose(others, abs(value), rtol=1e-9, atol=0.0).any() or (ratio and is_common(ratio)):
        return 0.15
    return 0.2 + 0.02 * digits if digits <= 4 else (0.6 if digits <= 6 else UNUSUAL)


def is_round(x: float) -> bool:
    """Whether a number has few digits, as people write them, the fewer the less exact it is."""
    exact = {5: 1e-9, 3: 1e-5}  # a share, by the count of digits
    return any(abs(x - float(f"{x:.{n}g}")) <= share * abs(x) or abs(x) < share for n, share in exact.items())


def is_written(x: float, right: float) -> bool:
    """Whether a number, or its ratio to the right one, has few digits."""
    ratios = [x / right, right / x] if x and right else []
    return any(map(is_round, [x, *ratios]))
