"""Which of several explanations is named first: the fewer and rounder numbers, the commoner slip."""

from math import log10

import numpy as np

from ..core.cause import Cause
from .groups import numbers_in
from .model import Equations
from .places import OF_ZERO, is_common

NATURAL = 1.0  # a cause that costs less is said; the others only if there is no such
OF_KINDS = {  # what a cause of a kind costs, besides its numbers
    "option": 0.0, "sign": 0.0, "angles": 0.0, "displacement": 0.1, "number": 0.0, OF_ZERO: 0.05, "unit": 0.1, "body": 0.12,
    "axes": 0.15, "term": 0.15, "part": 0.3, "force": 0.2, "cross": 0.3, "numbers": 0.2, "order": 0.25, "slip": 0.3,
    "coefficient": 0.3, "whole": 0.3, "added": 0.3, "derivative": 0.36, "angle": 0.45, "load": 0.6, "several": 0.5,
}  # fmt: skip
ADDED, PAIR = 0.1, 0.3  # a number that was 0, a second cause
IN_PART, CONVENTION_IN_PART = 0.12, 0.32  # of a slip, of a convention in some parts alone
CONVENTIONS = "sign", "axes", "angles", "displacement", "unit", "order"  # kinds
UNUSUAL = 1.0  # of a factor or a number that nobody writes


def cost(cause: Cause, equations: Equations) -> float:
    """A number that is smaller the likelier a cause is."""
    if len(cause.parts) > 1:
        return PAIR + sum(cost(part, equations) for part in cause.parts)
    return of_one(cause, equations) + cause.cost


def in_part(cause: Cause) -> float:
    """What a cause costs more that is in some parts of the equations alone."""
    return CONVENTION_IN_PART if cause.kind in CONVENTIONS else IN_PART


def of_one(cause: Cause, equations: Equations) -> float:
    base, value = OF_KINDS.get(cause.kind, 0.5), cause.explains
    if cause.kind == "several":
        pairs = zip(numbers_in(str(value)), numbers_in(str(cause.stated)))
        return base + float(np.mean([of_number(x, right, equations) for x, right in pairs]))
    if not isinstance(value, float):
        return base
    stated = cause.stated if isinstance(cause.stated, float) else 0.0
    if cause.unit == "times":
        return base + of_factor(value, equations) + 0.05 * (value != 0.0)
    if cause.kind == OF_ZERO and cause.unit == "rad":
        quarters = (value - stated) / (np.pi / 2.0)
        is_quarter = abs(quarters - round(quarters)) < 1e-9
        return base + (0.05 if is_quarter else of_number(np.degrees(value), stated, equations))
    added = ADDED * (stated == 0.0 and cause.kind != OF_ZERO)
    return base + of_number(value, stated, equations) + added


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
