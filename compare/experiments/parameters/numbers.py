"""Numbers, stated and compiled: their rows, checks and causes; that no other forces act; what touches."""

from collections.abc import Mapping
from dataclasses import asdict, dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np

from tmt import literal

from ...core.cause import Cause
from ...core.check import Result
from ...core.rows import Row, column
from ...diagnosis.places import unit_of as unit_of_joint
from ...engines.mujoco.dynamics import MujocoDynamics
from ...engines.mujoco.parameters import ABSENT as FIELDS
from ...engines.mujoco.parameters import STATED_FLAGS, Stated
from ...judge.scale import EPS, FACTOR
from ...robots import Feature
from ...robots.states import Sample
from ..setup import Setup

# without a counterpart in the equations
ABSENT = ("contact pairs", *(name for name in FIELDS if name != "tendon armature"))
# these explain a force
OF_FORCES = (*ABSENT, "stiffness", "density", "viscosity", "gravcomp", "limited", "frictionloss")
# causes of rank 1
OPTIONS = (*STATED_FLAGS, "order", "parent", "ref", "density", "viscosity", "contact pairs")
WHOLE_NUMBERS = (*STATED_FLAGS, "order", "parent", "limited", "contact pairs")
OF_BODIES = ("mass", "com", "inertia", "gravcomp")
UNITS = dict.fromkeys((*STATED_FLAGS, "order", "parent", "axis", "limited", "gravcomp", *ABSENT), "") | {
    "ref": "rad", "anchor": "m", "pos": "m", "damping": "N m s/rad", "armature": "kg m2", "rest": "rad",
    "frictionloss": "N m", "stiffness": "N m/rad", "mass": "kg", "com": "m", "inertia": "kg m2",
    "gravity": "m/s2", "density": "kg/m3", "viscosity": "Pa s", "other mass": "kg",
    "tendon armature": "kg m2", "actuator armature": "kg m2",
}  # fmt: skip
FINER = 8  # steps in one of the scene, in which contacts are looked for
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
    """A number, vector or tensor of a body or joint, and its causes, one for each component that differs."""

    place: str
    quantity: str
    unit: str
    tolerance: float
    stated: np.ndarray  # (components,)
    compiled: np.ndarray
    causes: list[Cause]


def unit_of(quantity: str, slides: bool) -> str:
    """The unit of a number of a body, or of a joint that turns or slides."""
    return unit_of_joint(UNITS[quantity], "slide" if slides and quantity not in OF_BODIES else "hinge")


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


def compare_number(result: Result, number: Stated, unit: str, words: Mapping[int, str]) -> Compared:
    """Add the check of a number of a body or joint.

    words: for whole numbers. Rank 1: an option or a convention of a joint (order, sign, zero); 2: one number.
    """
    quantity, tolerance = number.quantity, number.tolerance
    stated, compiled = (np.array(values, float).ravel() for values in (number.stated, number.compiled))
    difference = np.abs(stated - compiled)
    is_whole = quantity in WHOLE_NUMBERS
    value, bound = (compiled[0], stated[0]) if is_whole else (difference.max(), tolerance)
    rule = "equal" if is_whole else "at most"
    result.check(number.place, quantity, value, bound, unit, rounding=not is_whole, rule=rule)
    is_flipped = quantity == "axis" and np.abs(stated + compiled).max() <= tolerance
    rank = 1 if is_flipped or quantity in OPTIONS else 2
    owner = "" if number.place == "world" else f"of {number.place}"
    causes = []
    for k, (name, a, b) in enumerate(zip(COMPONENTS[len(stated)], stated, compiled)):
        if not difference[k] <= tolerance:
            place = " ".join(filter(None, (quantity, name, owner)))
            texts = [words.get(value, f"{value:.7g} {unit}".rstrip()) for value in (a, b)]
            if texts[0] == texts[1]:
                texts = [f"{float(value)!r} {unit}".rstrip() for value in (a, b)]
            text = f"{place}: stated {texts[0]}, compiled {texts[1]}"
            text += " (the opposite sign)" if is_flipped else ""
            size = difference[k] / tolerance if tolerance else np.inf
            causes.append(cause(place, a, b, text, rank=rank, size=float(size), quantity=quantity))
    return Compared(number.place, quantity, unit, tolerance, stated, compiled, causes)


def cause(place: str, stated: float, compiled: float, text: str, **more: Any) -> Cause:
    number = float(compiled) if np.isfinite(compiled) else None
    return Cause(place=place, stated=float(stated), explains=number, text=text, **more)


def check_forces(result: Result, sample: Sample, dynamics: MujocoDynamics) -> list[Cause]:
    """Check that no other forces act; these are causes unless those of the result explain them.

    MuJoCo adds forces of fluid and tendons to springs and damping, of whose sum the rounding is allowed.
    """
    unexplained, tree = [], sample.tree
    largest = np.abs(sample.qd * tree.damping).max() + np.abs(literal.spring_torque(tree, sample.q)).max()
    for source, force in dynamics.other_forces(sample.q, sample.qd).items():
        allowed = FACTOR * EPS * float(largest) if source == "fluid and tendons" else 0.0
        most, is_rounded = float(np.abs(force).max()), allowed > 0.0
        check = result.check(sample.name, f"no forces of {source}", most, allowed, "N m", rounding=is_rounded)
        if check.failed and not any(cause.quantity in OF_FORCES for cause in result.causes):
            place = f"forces of {source}"
            if source == "actuators":
                place += f" ({', '.join(dynamics.acting_actuators(sample.q, sample.qd))})"
            text = f"{place}: stated none, up to {most:.3g} N m at random states"
            unexplained.append(cause(place, 0.0, most, text, rank=2, quantity=place))
    return unexplained


class Touch(NamedTuple):
    """Two geoms that touch."""

    geoms: tuple[str, str]
    scene: str  # "": at a random state alone
    time: float  # s, the first in that scene
    q: list[float]  # rad


def touches(setup: Setup, dynamics: MujocoDynamics) -> list[Touch]:
    """The pairs of geoms that touch, each where it first does: in a scene by MuJoCo, at a random state."""
    if not dynamics.may_touch:
        return []
    found: dict[tuple[str, str], Touch] = {}
    for case in setup.robot.cases_of_torque:
        acting = cast(MujocoDynamics, setup.engines["mujoco"].of(case))
        motion = acting.run(case.q, case.v, case.tau, case.scene.dt / FINER, case.steps * FINER, "RK4")
        q = motion.q[np.isfinite(motion.q).all(axis=1)]
        for time, state, pairs in zip(motion.t.tolist(), q, acting.touching(q)):
            for pair in pairs - found.keys():
                found[pair] = Touch(pair, case.name, time, case.positions_of_all(state).tolist())
    for state, pairs in zip(setup.random.q, dynamics.touching(setup.random.q)):
        for pair in pairs - found.keys():
            found[pair] = Touch(pair, "", 0.0, state.tolist())
    return list(found.values())
