"""Which of several explanations is named first: the fewer and rounder numbers, the commoner slip."""

from math import log10

import numpy as np

from ..core.cause import Cause
from .model import Equations
from .places import OF_ZERO, is_common

NATURAL = 1.0  # a cause that costs less is said; the others only if there is no such
OF_KINDS = {  # what a cause of a kind costs, besides its numbers
    "option": 0.0, "sign": 0.0, "angles": 0.0, "number": 0.0, OF_ZERO: 0.05, "unit": 0.1, "body": 0.12, "axes": 0.15,
    "term": 0.15, "part": 0.16, "force": 0.2, "numbers": 0.2, "order": 0.25, "slip": 0.3, "coefficient": 0.3,
    "derivative": 0.36, "angle": 0.45, "load": 0.6, "several": 0.65,
}  # fmt: skip
OF_NAME, ADDED, PAIR = (
    0.1,
    0.1,
    0.3,
)  # for each joint that is named; for a number that was 0; for a second cause
IN_PART = 0.12  # of a slip in some parts alone
UNUSUAL = 1.0  # of a factor or a number that nobody writes


def cost(cause: Cause, equations: Equations) -> float:
    """A number that is smaller the likelier a cause is."""
    if len(cause.parts) > 1:
        return PAIR + sum(cost(part, equations) for part in cause.parts)
    is_in_part = cause.place.endswith((" alone", "but not in gravity", "but not in the velocity terms of h"))
    return of_one(cause, equations) + IN_PART * is_in_part + ADDED * ("damping added" in cause.place)


def of_one(cause: Cause, equations: Equations) -> float:
    is_massless = cause.place.startswith("mass of") and cause.unit == "kg" and cause.explains == 0.0
    base, names = OF_KINDS.get(cause.kind, 0.5), cause.place.count(",") + cause.place.count(" and ")
    if cause.kind == "term" and cause.stated == "right":  # terms of an expression
        return 0.5
    if cause.kind in ("sign", "angles"):
        slides = [
            name
            for name, kind in zip(equations.coordinates.names, equations.coordinates.all_kinds)
            if kind == "slide"
        ]
        words = cause.place.replace(",", " ").split()
        return base + OF_NAME * (1 + names) + 0.15 * sum(name in words for name in slides)
    if not isinstance(cause.explains, float):
        return base + 0.03 * ("every" in cause.place) - 0.05 * cause.place.startswith("R' I R")
    value, stated = cause.explains, float(cause.stated) if isinstance(cause.stated, float) else 0.0
    if cause.unit == "times":
        return base + of_factor(value, equations) + 0.05 * (value != 0.0) + 0.03 * ("every" in cause.place)
    if cause.kind == OF_ZERO:
        quarters = (value - stated) / (np.pi / 2.0)
        turns = abs(quarters - round(quarters)) < 1e-9 and cause.unit == "rad"
        return base + (
            0.05
            if turns
            else of_number(np.degrees(value) if cause.unit == "rad" else value, stated, equations)
        )
    base += 0.2 * is_massless
    return (
        base
        + of_number(value, stated, equations)
        + ADDED * (stated == 0.0)
        + 0.15 * cause.place.startswith(("anchor", "armature"))
    )


def of_factor(factor: float, equations: Equations) -> float:
    """A common factor costs little, a length or one over a length more."""
    if is_common(factor):
        return 0.0
    lengths = np.abs(np.concatenate([equations.stated["offset"].ravel(), equations.stated["com"].ravel()]))
    lengths = lengths[lengths > 0.0]
    is_power = np.isclose(np.concatenate([lengths, 1.0 / lengths]), abs(factor), rtol=1e-9, atol=0.0).any()
    return 0.3 if is_power else UNUSUAL


def of_number(value: float, stated: float, equations: Equations) -> float:
    """0, the other sign or another power of ten cost least, then numbers with few digits or of the model."""
    if value == 0.0:
        return 0.1
    ratio = abs(value / stated) if stated else 0.0
    if ratio and abs(log10(ratio) - round(log10(ratio))) < 1e-10:
        return 0.1
    digits = len(f"{abs(value):.10e}".split("e")[0].replace(".", "").rstrip("0"))
    others = np.concatenate([np.abs(field).ravel() for field in equations.stated.values()])
    if np.isclose(others, abs(value), rtol=1e-9, atol=0.0).any() or (ratio and is_common(ratio)):
        return 0.15
    return 0.2 + 0.02 * digits if digits <= 4 else (0.6 if digits <= 6 else UNUSUAL)
