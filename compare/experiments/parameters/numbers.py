"""Numbers, stated and compiled: their rows and checks; and that no other forces act."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import NamedTuple

import numpy as np

from tmt import literal

from ...core.check import Result
from ...core.rows import Row, column
from ...core.text import apart
from ...engines.mujoco.dynamics import MujocoDynamics
from ...engines.mujoco.parameters import ABSENT as FIELDS
from ...engines.mujoco.parameters import STATED_FLAGS, Stated
from ...judge.scale import EPS, FACTOR
from ...robots import Feature
from ...robots.states import Sample

# without a counterpart in the equations
ABSENT = ("contact pairs", *(name for name in FIELDS if name != "tendon armature"))
# these explain a force
OF_FORCES = (*ABSENT, "stiffness", "density", "viscosity", "gravcomp", "limited", "frictionloss")
# causes of rank 1
OPTIONS = (*STATED_FLAGS, "order", "parent", "ref", "density", "viscosity", "contact pairs")
WHOLE_NUMBERS = (*STATED_FLAGS, "order", "parent", "limited", "contact pairs")
OF_BODIES = ("mass", "com", "inertia", "gravcomp")
UNITS = dict.fromkeys((*STATED_FLAGS, "order", "parent", "axis", "limited", "gravcomp", *ABSENT), "") | {
    "ref": "rad", "anchor": "m", "offset": "m", "pos": "m", "damping": "N m s/rad", "armature": "kg m2", "rest": "rad",
    "frictionloss": "N m", "stiffness": "N m/rad", "mass": "kg", "com": "m", "inertia": "kg m2",
    "gravity": "m/s2", "density": "kg/m3", "viscosity": "Pa s", "other mass": "kg",
    "tendon armature": "kg m2", "actuator armature": "kg m2",
}  # fmt: skip
OF_SLIDES = {"rad": "m", "N m s/rad": "N s/m", "N m/rad": "N/m", "N m": "N", "kg m2": "kg"}
COMPONENTS = {1: [""], 3: [*"xyz"], 9: [row + of_row for row in "xyz" for of_row in "xyz"]}  # by their number


@dataclass(kw_only=True)
class NumberRow(Row):
    """A number of the model: parameters.csv."""

    of: str
    quantity: str
    component: str = ""
    stated: float | None = column(digits=7, default=None)  # None: the file leaves it to the compiler
    compiled: float | str = column(digits=7)
    difference: float | None = None
    unit: str
    asked_by: str | None = column(optional=True)  # the option of the file that changes it


@dataclass(kw_only=True)
class FeatureRow(Row):
    """A feature of a file: inventory.csv."""

    feature: str
    count: int
    names: str = column(names=True)
    treatment: str
    reason: str

    @classmethod
    def of(cls, feature: Feature) -> "FeatureRow":
        return cls(**asdict(feature) | {"count": feature.count, "names": ";".join(feature.names)})


class Compared(NamedTuple):
    """A number, vector or tensor of a body or joint, here (as compiled) and there (as stated)."""

    place: str
    quantity: str
    unit: str
    here: np.ndarray  # (components,)
    there: np.ndarray
    differs: np.ndarray  # which of them
    size: float  # the largest difference over its tolerance
    rank: int  # 1: an option or a convention of a joint (order, sign, zero); 2: one number
    words: Mapping[int, str] = {}  # for whole numbers

    @property
    def shown(self) -> list[int]:
        """The components that are said: the only one that differs; of a tensor those of its upper triangle that do."""
        names, found = COMPONENTS[len(self.here)], np.flatnonzero(self.differs).tolist()
        if len(names) == 9:
            found = [k for k in found if names[k] == "".join(sorted(names[k]))] or found
        return found if len(found) == 1 or len(names) == 9 else [*range(len(names))]

    @property
    def name(self) -> str:
        """Of the quantity, with its components if not all are said."""
        names = COMPONENTS[len(self.here)]
        said = ", ".join(names[k] for k in self.shown) if len(self.shown) < len(names) else ""
        return f"{self.quantity} {said}".rstrip()

    @property
    def full_name(self) -> str:
        return self.name if self.place == "world" else f"{self.name} of {self.place}"

    @property
    def is_opposite(self) -> bool:
        """Whether an axis points the other way."""
        off = np.abs(self.here + self.there).max()
        return self.quantity == "axis" and bool(off <= FACTOR * EPS * np.abs(self.there).max())

    @property
    def values(self) -> tuple[str, str]:
        """Here and there, with the unit, in as many digits as tell them apart."""
        if self.words:
            return self.words[int(self.here[0])], self.words[int(self.there[0])]
        pairs = [(self.here[k], self.there[k]) for k in self.shown]
        sides = [apart(a, b, 7) for a, b in pairs], [apart(b, a, 7) for a, b in pairs]
        said = (", ".join(side) if len(side) == 1 else f"({', '.join(side)})" for side in sides)
        here, there = (f"{side} {self.unit}".rstrip() for side in said)
        return here, there


def unit_of(quantity: str, slides: bool) -> str:
    """The unit of a number of a body, or of a joint that turns or slides."""
    unit = UNITS[quantity]
    return OF_SLIDES.get(unit, unit) if slides and quantity not in OF_BODIES else unit


def rows_of(number: Stated, unit: str, asked_by: str | None = None) -> list[NumberRow]:
    """Rows of the table, one for each component."""
    compiled = np.ravel(number.compiled).astype(float).tolist()
    stated: list[float | None] = [None] * len(compiled)
    if number.stated is not None:
        stated = np.ravel(number.stated).astype(float).tolist()
    rows = []
    for name, a, b in zip(COMPONENTS[len(compiled)], stated, compiled):
        row = NumberRow(of=number.place, quantity=number.quantity, component=name, compiled=b, unit=unit)
        rows.append(replace(row, stated=a, difference=None if a is None else b - a, asked_by=asked_by))
    return rows


def compare_number(result: Result, number: Stated, unit: str, words: Mapping[int, str] = {}) -> Compared:
    """Add the check of a number of a body or joint."""
    quantity, tolerance = number.quantity, number.tolerance
    there, here = (np.array(values, float).ravel() for values in (number.stated, number.compiled))
    difference, is_whole = np.abs(there - here), quantity in WHOLE_NUMBERS
    value, bound = (here[0], there[0]) if is_whole else (difference.max(), tolerance)
    rule = "equal" if is_whole else "at most"
    result.check(number.place, quantity, value, bound, unit, rounding=not is_whole, rule=rule)
    differs = ~(difference <= tolerance)
    size = float(difference.max() / tolerance) if tolerance else np.inf
    compared = Compared(number.place, quantity, unit, here, there, differs, size, 2, words)
    return compared._replace(rank=1 if quantity in OPTIONS or compared.is_opposite else 2)


def check_forces(result: Result, sample: Sample, dynamics: MujocoDynamics, explained: bool) -> list[Compared]:
    """Check that no other forces act; those that do and are not explained.

    MuJoCo adds forces of fluid and tendons to springs and damping, of whose sum the rounding is allowed.
    """
    unexplained, tree = [], sample.tree
    springs = literal.spring_torque(tree, sample.q)
    largest = np.abs(sample.qd * tree.damping).max() + np.abs(springs).max()
    for source, force in dynamics.other_forces(sample.q, sample.qd).items():
        allowed = FACTOR * EPS * float(largest) if source == "fluid and tendons" else 0.0
        most, is_rounded = float(np.abs(force).max()), allowed > 0.0
        check = result.check(sample.name, f"no forces of {source}", most, allowed, "N m", rounding=is_rounded)
        if check.failed and not explained:
            place = f"forces of {source}"
            if source == "actuators":
                place += f" ({', '.join(dynamics.acting_actuators(sample.q, sample.qd))})"
            sides = np.array([most]), np.zeros(1)
            unexplained.append(Compared("world", place, "N m", *sides, np.array([True]), np.inf, 2))
    return unexplained
