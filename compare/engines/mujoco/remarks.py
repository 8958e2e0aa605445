"""What a user has to know of how a file is compared: a base that is fixed, what the compiler changed, what is switched off."""

from pathlib import Path

import mujoco
import numpy as np

from ...judge.finding import Finding
from .inventory import OFF, OPEN
from .parameters import stated_numbers
from .reading import Reading
from .urdf_file import fixed_base


def remarks(reading: Reading, has_scenes: bool) -> list[Finding]:
    """Findings, a line each. has_scenes: servos act in some of them."""
    found = changes(reading.source, reading.model) if reading.source is not None else []
    if reading.source is not None and (base := fixed_base(reading.source, reading.model)):
        found.insert(0, Finding("remarks", "fixed_base", {"link": base[0], "mass": base[1]}))
    if off := [feature for feature in reading.features if feature.treatment in (OFF, OPEN)]:
        driven = has_scenes and bool(reading.drive.actuators)
        found.append(Finding("remarks", "switched_off", {"features": off, "driven": driven}))
    return found


def changes(source: Path | str, model: mujoco.MjModel) -> list[Finding]:
    """A finding for each option by which the compiler changed numbers that the file states: where, by quantity."""
    changed: dict[str, dict[str, list[str]]] = {}
    for number in stated_numbers(source, model):
        is_stated = number.stated is not None
        if is_stated and np.abs(np.subtract(number.stated, number.compiled)).max() > number.tolerance and number.why:
            changed.setdefault(number.why, {}).setdefault(number.quantity, []).append(number.place)
    return [Finding("remarks", "changed", {"why": why, "places": places}) for why, places in changed.items()]
