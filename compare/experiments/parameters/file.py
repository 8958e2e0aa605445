"""What a file states beside what MuJoCo's compiler made of it, what of it is switched off, and that this exerts no force."""

from collections.abc import Sequence

import numpy as np

from tmt import literal

from ...engines.mujoco.inventory import MODELLED, OPEN
from ...engines.mujoco.stated import Stated, stated_numbers
from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ...judge.words import listed
from ...robots import Robot
from ..setup import Setup

CLAIM = (
    "The model as MuJoCo compiled it has every number that the file states: mass, centre of mass, inertia tensor and place (pos) "
    "of each body; anchor, axis, armature, damping and stiffness of each joint. Another number is there only where an option of "
    "the file asks for it (column asked by). Nothing that is switched off in MuJoCo for the comparison exerts a force at random "
    "states."
)
TOLERANCE = (
    "64 eps x the largest entry of the quantity; of an inertia tensor x the sum of its principal moments, for it is turned to "
    "its principal axes and back (before MuJoCo 4.0 a fullinertia only to about 5e-7: there 1e-6 x that sum). Forces of what is "
    "switched off: exactly 0; where springs and damping are taken from a sum, 64 eps x the largest of these."
)
UNITS_OF_ALL = {"mass": "kg", "pos": "m", "com": "m", "inertia": "kg m2", "anchor": "m", "axis": ""}
OF_MOVEMENTS = {  # of joints that turn, and of slides
    "armature": ("kg m2", "kg"),
    "damping": ("N m s/rad", "N s/m"),
    "stiffness": ("N m/rad", "N/m"),
}
OF_BODY = ("mass", "pos", "com", "inertia")  # quantities; the others are of joints
PASSIVE = "fluid and tendons"  # their forces are in MuJoCo's sum with those of springs and damping


def rows_of_file(setup: Setup) -> Result:
    """A row for each number, a check for each that the file states, the inventory, and sentences on what is not as stated."""
    result = Result("parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit", "asked_by"])
    causes, changed = [], []
    for number in stated_numbers(setup.reading):
        unit = unit_of(setup.robot, number)
        compiled = np.ravel(number.compiled).astype(float)
        known = number.stated is not None
        expected = np.ravel(number.stated).astype(float) if known else [None] * len(compiled)
        for k, (a, b) in enumerate(zip(expected, compiled)):
            about = {"of": number.place, "quantity": number.quantity, "component": component_of(number, k)}
            difference = b - a if known else None
            about |= {"stated": a, "compiled": b, "difference": difference, "unit": unit, "asked_by": number.why}
            result.rows.append(about)
        if known and not number.why:
            causes += compare_number(result, number, unit)
        elif not known or np.abs(expected - compiled).max() > tolerance_of(number):
            changed.append((number, unit))
    check_forces(result, setup)
    reading = setup.reading
    options = {"integrator": (reading.integrator, ""), "timestep": (reading.dt, "s")}
    result.rows += [
        {"of": "file", "quantity": name, "component": "", "compiled": value, "unit": unit}
        for name, (value, unit) in options.items()
    ]
    result.tables["inventory"] = inventory(setup.robot.features)
    result.notes = [*changes_in_words(changed), *treatments_in_words(setup.robot.features)]
    result.curves["causes"] = sorted(causes, key=lambda cause: -cause["size"])
    return result


def unit_of(robot: Robot, number: Stated) -> str:
    """The unit of a number of a body or joint."""
    if number.quantity in UNITS_OF_ALL:
        return UNITS_OF_ALL[number.quantity]
    kinds = dict(zip(robot.joints, robot.tree.kind))
    return OF_MOVEMENTS[number.quantity][kinds.get(number.place, "slide") == "slide"]  # a free joint's first is one


def component_of(number: Stated, k: int) -> str:
    """The k-th of 1, 3 or 9 numbers by name."""
    count = np.size(number.compiled)
    return "" if count == 1 else "xyz"[k] if count == 3 else "xyz"[k // 3] + "xyz"[k % 3]


def tolerance_of(number: Stated) -> float:
    """How far a compiled number may be from the stated one."""
    size = np.trace(number.stated) if number.quantity == "inertia" else np.abs(number.stated).max()
    return max(FACTOR * EPS, number.precision) * float(size)


def compare_number(result: Result, number: Stated, unit: str) -> list[dict]:
    """The check of a number that no option of the file asks to change; of one that differs the causes, a component each."""
    expected, compiled = np.ravel(number.stated).astype(float), np.ravel(number.compiled).astype(float)
    off, allowed = np.abs(expected - compiled), tolerance_of(number)
    result.check(number.place, number.quantity, off.max(), allowed, unit, rounding=True)
    causes = []
    for k, (a, b, difference) in enumerate(zip(expected, compiled, off)):
        if not difference <= allowed:
            place = " ".join(filter(None, (number.quantity, component_of(number, k), "of", number.place)))
            text = f"{place}: the file states {a:.7g} {unit}".rstrip() + f", compiled {b:.7g} {unit}".rstrip()
            about = {"rank": 2, "place": place, "stated": float(a), "found": float(b) if np.isfinite(b) else None}
            size = float(difference / allowed) if allowed else np.inf
            causes.append(about | {"text": text, "size": size, "quantity": number.quantity})
    return causes


def check_forces(result: Result, setup: Setup) -> None:
    """Checks that nothing acts but what the equations have: of a sum with springs and damping except for its rounding."""
    tree, sample = setup.robot.tree, setup.random
    largest = np.abs(sample.qd * tree.damping).max() + np.abs(literal.spring_torque(sample.q, tree)).max()
    for source, force in setup.compared()["mujoco"].other_forces(sample.q, sample.qd).items():
        allowed = FACTOR * EPS * float(largest) if source == PASSIVE else 0.0
        most = float(np.abs(force).max())
        result.check(sample.name, f"no forces of {source}", most, allowed, "N m", rounding=bool(allowed))


def inventory(features: Sequence) -> list[dict]:
    """The rows of the inventory: what the file has, and how it is treated."""
    return [
        {
            "feature": f.feature,
            "count": f.count,
            "names": ";".join(f.names),
            "treatment": f.treatment,
            "reason": f.reason,
        }
        for f in features
    ]


def changes_in_words(changed: Sequence[tuple[Stated, str]]) -> list[str]:
    """What is not as the file states, or not stated: a sentence for each option that asks for it."""
    sentences = []
    for why in dict.fromkeys(number.why for number, _ in changed):
        parts = []
        of_why = [(number, unit) for number, unit in changed if number.why == why]
        for quantity in dict.fromkeys(number.quantity for number, _ in of_why):
            of_quantity = [(number, unit) for number, unit in of_why if number.quantity == quantity]
            one, many = ("body", "bodies") if quantity in OF_BODY else ("joint", "joints")
            count = f"{len(of_quantity)} {one if len(of_quantity) == 1 else many}"
            parts.append(f"{quantity} of {count} ({most_in_words(of_quantity)})")
        sentences.append(f"By {why} the compiler sets {listed(parts)}.")
    return sentences


def most_in_words(changed: Sequence[tuple[Stated, str]]) -> str:
    """Of numbers of one quantity the one that is changed most; those that the file does not state have no such."""
    known = [(np.abs(np.subtract(n.stated, n.compiled)).max(), n, unit) for n, unit in changed if n.stated is not None]
    if not known:
        return "not stated"
    _, number, unit = max(known, key=lambda each: each[0])
    if np.size(number.compiled) == 1:
        return f"most: {number.place}, {float(number.stated):.4g} to {float(number.compiled):.4g} {unit}".rstrip()
    apart = np.subtract(number.stated, number.compiled)
    return f"most: {number.place}, by {np.abs(apart).max():.3g} {unit}".rstrip()


def treatments_in_words(features: Sequence) -> list[str]:
    """What is modelled, what is switched off in MuJoCo and why, and which equalities are off."""
    of = {treatment: [f for f in features if f.treatment == treatment] for treatment in (MODELLED, OPEN)}
    off = [f for f in features if f.treatment not in of]
    sentences = [f"Modelled: {listed([f'{f.feature} ({f.count})' for f in of[MODELLED]])}."]
    if off:
        why = "; ".join(f"{f.feature} ({f.count}), {f.reason}" for f in off)
        sentences.append(f"Switched off in MuJoCo for the comparison: {why}.")
    for names in (feature.names for feature in of[OPEN]):
        which = "the equality {} is" if len(names) == 1 else "the equalities {} are"
        sentences.append(f"The open tree is compared: {which.format(listed(names))} off.")
    return sentences
