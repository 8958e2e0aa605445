"""The numbers that a file states compared with those that MuJoCo compiled, and what of the file is switched off."""

from collections.abc import Sequence

import numpy as np

from ...engines.mujoco.inventory import MODELLED, OPEN
from ...engines.mujoco.parameters import Stated, stated_numbers
from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ..setup import Setup
from .numbers import check_forces, compare_number, rows_of

UNITS = {"mass": "kg", "pos": "m", "com": "m", "inertia": "kg m2", "anchor": "m", "axis": ""}
UNITS_OF_JOINTS = {  # that turn, and that slide
    "armature": ("kg m2", "kg"),
    "damping": ("N m s/rad", "N s/m"),
    "stiffness": ("N m/rad", "N/m"),
}
OF_BODIES = ("mass", "pos", "com", "inertia")


def rows_of_file(setup: Setup) -> Result:
    """A row for each number, a check for each that the file states, the inventory; findings on what the compiler changed."""
    result = Result("parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit", "asked_by"])
    causes, changed, reading = [], [], setup.reading
    for number in stated_numbers(reading):
        unit = unit_of(setup.robot, number)
        compiled = np.ravel(number.compiled).astype(float)
        is_stated = number.stated is not None
        stated = np.ravel(number.stated).astype(float) if is_stated else [None] * len(compiled)
        result.rows += rows_of(number.place, number.quantity, stated, compiled, unit, asked_by=number.why)
        if is_stated and not number.why:
            allowed = tolerance_of(number)
            causes += compare_number(result, number.place, number.quantity, stated, compiled, unit, allowed)
        elif not is_stated or np.abs(stated - compiled).max() > tolerance_of(number):
            changed.append((number, unit))
    check_forces(result, setup)
    for name, value, unit in (("integrator", reading.integrator, ""), ("timestep", reading.dt, "s")):
        result.rows.append({"of": "file", "quantity": name, "component": "", "compiled": value, "unit": unit})
    for why in dict.fromkeys(number.why for number, _ in changed):
        result.find("changed", why=why, changes=changes([each for each in changed if each[0].why == why]))
    add_inventory(result, setup.robot.features)
    result.curves["causes"] = sorted(causes, key=lambda cause: -cause["size"])
    return result


def unit_of(robot: Robot, number: Stated) -> str:
    if number.quantity in UNITS:
        return UNITS[number.quantity]
    kinds = dict(zip(robot.joints, robot.tree.kind))
    return UNITS_OF_JOINTS[number.quantity][kinds.get(number.place, "slide") == "slide"]  # a free joint's first is one


def tolerance_of(number: Stated) -> float:
    """The largest difference between a stated and a compiled number that is rounding."""
    size = np.trace(number.stated) if number.quantity == "inertia" else np.abs(number.stated).max()
    return max(FACTOR * EPS, number.precision) * float(size)


def changes(numbers: Sequence[tuple[Stated, str]]) -> list[dict]:
    """For each quantity how many numbers the compiler changed, and the one with the largest change, of those that are stated."""
    quantities = []
    for quantity in dict.fromkeys(number.quantity for number, _ in numbers):
        of_quantity = [(number, unit) for number, unit in numbers if number.quantity == quantity]
        stated = [
            (np.abs(np.subtract(number.stated, number.compiled)).max(), k)
            for k, (number, _) in enumerate(of_quantity)
            if number.stated is not None
        ]
        about = {"quantity": quantity, "count": len(of_quantity), "of_bodies": quantity in OF_BODIES, "largest": None}
        if stated:
            by, k = max(stated, key=lambda each: each[0])
            number, unit = of_quantity[k]
            about["largest"] = {
                "place": number.place,
                "unit": unit,
                "by": by,
                "is_scalar": np.size(number.compiled) == 1,
            }
            about["largest"] |= {"stated": number.stated, "compiled": number.compiled}
        quantities.append(about)
    return quantities


def add_inventory(result: Result, features: Sequence) -> None:
    """The table of the features of the file: modelled, switched off or opened."""
    fields = ("feature", "count", "names", "treatment", "reason")
    result.tables["inventory"] = [
        {name: ";".join(feature.names) if name == "names" else getattr(feature, name) for name in fields}
        for feature in features
    ]
    modelled, opened = ([f for f in features if f.treatment == treatment] for treatment in (MODELLED, OPEN))
    off = [f for f in features if f.treatment not in (MODELLED, OPEN)]
    for kind, those in (("modelled", modelled), ("switched_off", off), ("open_tree", opened)):
        if those:
            result.find(kind, features=those)
