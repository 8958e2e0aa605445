"""What a user has to know of how a file is compared: a base that is fixed, what the compiler changed, what is switched off."""

import re

from ...core.finding import Finding
from .inventory import LEFT_OUT, OFF, OPEN
from .names import element_name, moving
from .parameters import stated_numbers
from .reading import Reading
from .source import Source


def remarks(reading: Reading, has_scenes: bool) -> list[Finding]:
    """Findings, a line each. has_scenes: servos act in some of them."""
    findings = of_source(reading.source)
    if off := [feature for feature in reading.features if feature.treatment in (OFF, OPEN, LEFT_OUT)]:
        driven = has_scenes and bool(reading.drive.actuators)
        findings.append(Finding("remarks", "switched_off", {"features": off, "driven": driven}))
    return findings


def of_source(source: Source) -> list[Finding]:
    """What is fixed of a URDF; for each option by which the compiler changed stated numbers, where it did, by quantity."""
    model, findings = source.model, []
    root = re.search(r"<(robot|mujoco)\b", source.text)
    fixed = [body for body in range(1, model.nbody) if model.body_mass[body] and not moving(model)[body]]
    if root and root[1] == "robot" and '"world"' not in source.text and fixed:
        values = {"link": element_name(model, "body", fixed[0]), "mass": float(model.body_mass[fixed].sum())}
        findings.append(Finding("remarks", "fixed_base", values))
    changed: dict[str, dict[str, list[str]]] = {}
    for number in stated_numbers(source):
        if number.why and number.stated is not None:
            changed.setdefault(number.why, {}).setdefault(number.quantity, []).append(number.place)
    for why, places in changed.items():
        findings.append(Finding("remarks", "changed", {"why": why, "places": places}))
    return findings
