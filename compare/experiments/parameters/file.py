"""The numbers that a file states compared with those that MuJoCo compiled, and what of the file is switched off."""

from collections.abc import Sequence

import numpy as np

from ...core.check import Result
from ...engines.mujoco.parameters import stated_numbers
from ..setup import Setup
from .numbers import check_forces, compare_number, rows_of, unit_of


def rows_of_file(setup: Setup) -> Result:
    """A row for each number, a check for each that the file states and no option changes, and the inventory."""
    result = Result(
        "parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit", "asked_by"]
    )
    causes, reading = [], setup.reading
    kinds = dict(zip(setup.robot.joints, setup.robot.tree.kind))
    for number in stated_numbers(reading.source, reading.model):
        slides = kinds.get(number.place, "slide") == "slide"  # the first of a free joint is a slide
        unit = unit_of(number.quantity, slides)
        compiled, is_stated = np.ravel(number.compiled).astype(float), number.stated is not None
        stated = np.ravel(number.stated).astype(float) if is_stated else [None] * len(compiled)
        result.rows += rows_of(number.place, number.quantity, stated, compiled, unit, asked_by=number.why)
        if is_stated and not number.why:
            causes += compare_number(
                result, number.place, number.quantity, stated, compiled, unit, number.tolerance
            )
    check_forces(result, setup)
    for name, value, unit in (("integrator", reading.integrator, ""), ("timestep", reading.dt, "s")):
        result.rows.append({"of": "file", "quantity": name, "component": "", "compiled": value, "unit": unit})
    add_inventory(result, setup.robot.features)
    result.causes = sorted(causes, key=lambda cause: -cause["size"])
    return result


def add_inventory(result: Result, features: Sequence) -> None:
    """The table of the features of the file: modelled, switched off or opened."""
    result.tables["inventory"] = [
        feature._asdict() | {"names": ";".join(feature.names)} for feature in features
    ]
