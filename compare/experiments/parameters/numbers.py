"""A number of the model, stated and compiled: its rows, check and causes; and the check that no other forces act."""

from collections.abc import Mapping, Sequence

import numpy as np

from tmt import literal

from ...core.check import Result
from ...engines.mujoco.parameters import STATED_FLAGS
from ...judge.scale import EPS, FACTOR
from ..setup import Setup

# without a counterpart in the equations
ABSENT = (
    "contact pairs",
    "damping beyond linear",
    "stiffness beyond linear",
    "actuator damping",
    "actuator armature",
)
OF_FORCES = (
    *ABSENT,
    "stiffness",
    "density",
    "viscosity",
    "gravcomp",
    "limited",
    "frictionloss",
)  # explain a force
OPTIONS = (
    *STATED_FLAGS,
    "order",
    "parent",
    "ref",
    "density",
    "viscosity",
    "contact pairs",
)  # causes of rank 1
OF_BODIES = ("mass", "com", "inertia", "gravcomp")
UNITS = dict.fromkeys((*STATED_FLAGS, "order", "parent", "axis", "limited", "gravcomp", *ABSENT), "") | {
    "ref": "rad", "anchor": "m", "pos": "m", "damping": "N m s/rad", "armature": "kg m2", "frictionloss": "N m",
    "stiffness": "N m/rad",
    "mass": "kg", "com": "m", "inertia": "kg m2", "rest": "rad", "gravity": "m/s2", "density": "kg/m3", "viscosity": "Pa s",
    "other mass": "kg", "tendon armature": "kg m2", "actuator armature": "kg m2",
}  # fmt: skip
OF_SLIDES = {"rad": "m", "N m s/rad": "N s/m", "kg m2": "kg", "N m/rad": "N/m", "N m": "N"}  # units


def unit_of(quantity: str, slides: bool) -> str:
    """The unit of a number of a body, or of a joint that turns or slides."""
    return (
        OF_SLIDES.get(UNITS[quantity], UNITS[quantity])
        if slides and quantity not in OF_BODIES
        else UNITS[quantity]
    )


def component(k: int, count: int) -> str:
    """The k-th of 1, 3 or 9 components by name."""
    return {1: ("",), 3: "xyz", 9: [a + b for a in "xyz" for b in "xyz"]}[count][k]


def rows_of(owner: str, quantity: str, stated: Sequence, compiled: Sequence, unit: str, **more) -> list[dict]:
    """Rows of the table, one for each component. stated: None for a component that is not stated."""
    return [
        {
            "of": owner,
            "quantity": quantity,
            "component": component(k, len(compiled)),
            "stated": a,
            "compiled": b,
        }
        | {"difference": None if a is None else b - a, "unit": unit}
        | more
        for k, (a, b) in enumerate(zip(stated, compiled))
    ]


def compare_number(
    result: Result,
    owner: str,
    quantity: str,
    stated: np.ndarray,
    compiled: np.ndarray,
    unit: str,
    tolerance: float,
    is_whole: bool = False,
    words: Mapping[float, str] = {},
) -> list[dict]:
    """Adds the check of a quantity of a body or joint; returns a cause for each component that differs.

    is_whole: a count, an index or a flag. words: for such numbers. Rank 1: an option, or a convention of a joint (its
    order, its sign, its zero); 2: one number.
    """
    difference = np.abs(stated - compiled)
    value, bound, rule = (
        (compiled[0], stated[0], "equal") if is_whole else (difference.max(), tolerance, "at most")
    )
    result.check(owner, quantity, value, bound, unit, rounding=not is_whole, rule=rule)
    is_flipped = quantity == "axis" and bool(np.abs(stated + compiled).max() <= tolerance)
    causes = []
    for k, (a, b) in enumerate(zip(stated, compiled)):
        if not difference[k] <= tolerance:
            of = "" if owner == "world" else f"of {owner}"
            place = " ".join(filter(None, (quantity, component(k, len(stated)), of)))
            values = [words.get(number, f"{number:.7g} {unit}".rstrip()) for number in (a, b)]
            if values[0] == values[1]:
                values = [f"{float(number)!r} {unit}".rstrip() for number in (a, b)]
            text = f"{place}: stated {values[0]}, compiled {values[1]}" + " (the opposite sign)" * is_flipped
            rank = 1 if is_flipped or quantity in OPTIONS else 2
            causes.append(
                cause(rank, place, a, b, text, difference[k] / tolerance if tolerance else np.inf, quantity)
            )
    return causes


def cause(
    rank: int, place: str, stated: float, compiled: float, text: str, size: float, quantity: str
) -> dict:
    """A cause; size: its difference over its tolerance."""
    compiled = float(compiled) if np.isfinite(compiled) else None
    about = {"rank": rank, "place": place, "stated": float(stated), "found": compiled, "text": text}
    return about | {"size": float(size), "quantity": quantity}


def check_forces(result: Result, setup: Setup, causes: Sequence[dict] = ()) -> list[dict]:
    """Checks that no forces act that the equations do not have; these are causes unless `causes` explain them.

    Fluid and tendons: MuJoCo adds their forces to those of springs and damping, of whose sum the rounding is allowed.
    """
    tree, sample, unexplained, dynamics = setup.robot.tree, setup.random, [], setup.compared()["mujoco"]
    largest = np.abs(sample.qd * tree.damping).max() + np.abs(literal.spring_torque(sample.q, tree)).max()
    for source, force in dynamics.other_forces(sample.q, sample.qd).items():
        allowed = FACTOR * EPS * float(largest) if source == "fluid and tendons" else 0.0
        most = float(np.abs(force).max())
        check = result.check(
            sample.name, f"no forces of {source}", most, allowed, "N m", rounding=bool(allowed)
        )
        if check.failed and not any(cause["quantity"] in OF_FORCES for cause in causes):
            place = f"forces of {source}"
            if source == "actuators":
                place += f" ({', '.join(dynamics.acting_actuators(sample.q, sample.qd))})"
            text = f"{place}: stated none, up to {most:.3g} N m at random states"
            unexplained.append(cause(2, place, 0.0, most, text, np.inf, place))
    return unexplained
