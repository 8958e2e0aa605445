"""Causes in words."""

from typing import NamedTuple

import numpy as np

from ..joint_map import Joint
from .fit import Fitted
from .places import OF_ZERO, Place
from .variants import Variant

FACTORS = {0.0: "missing", 0.5: "halved", 2.0: "doubled", -1.0: "of the other sign"}
EXPLAINS = " would explain it"
FITTED = 1e-11  # of the size of a place: what a fit may leave of a number that is 0
NEVER_NEGATIVE = ("mass of", "armature of", "inertia xx", "inertia yy", "inertia zz")
CLOSE = 1e-9  # a fitted factor, to one of these


class Cause(NamedTuple):
    """One explanation of everything."""

    rank: int
    kind: str
    place: str
    stated: float | str
    explains: float | str  # the value that would explain the difference
    unit: str
    left_over: float  # of the difference, a share
    tied: int  # other explanations that cannot be told from it
    text: str


def of_variant(variant: Variant, left: float) -> Cause:
    """An option, a convention or a slip."""
    text = f"{variant.name}: {variant.explains}" if variant.kind != "slip" or variant.explains != "so" else variant.name
    if variant.joints is not None:
        text += f" (state it as joints={[str(joint) for joint in variant.joints.joints]})"
    return Cause(variant.rank, variant.kind, variant.name, variant.stated, variant.explains, "", left, 0, text)


def of_fitted(fitted: Fitted, rank: int, beside: Variant | None = None) -> Cause:
    """A number, a term or a coefficient, or two of them."""
    places, found = fitted.places, [value_of(place, change) for place, change in zip(fitted.places, fitted.changes)]
    kinds, names = [place.kind for place in places], [place.name for place in places]
    stated, explains, units = (
        [f"{place.stated:.12g}" for place in places],
        [f"{x:.12g}" for x in found],
        [p.unit for p in places],
    )
    texts = [place_text(place, value) for place, value in zip(places, found)]
    if beside:
        kinds, names = [beside.kind, *kinds], [beside.name, *names]
        stated, explains, units = [beside.stated, *stated], [beside.explains, *explains], ["", *units]
        texts = [of_variant(beside, 0.0).text, *texts]
    text = texts[0] if len(texts) == 1 else together(texts)
    if len(texts) == 1:
        place = places[0]
        return Cause(rank, place.kind, place.name, place.stated, found[0], place.unit, fitted.left, 0, text)
    joined = [
        " and ".join(dict.fromkeys(parts)) if parts is units else " and ".join(parts)
        for parts in (kinds, names, stated, explains, units)
    ]
    return Cause(rank, *joined, fitted.left, 0, text)


def value_of(place: Place, change: float) -> float:
    """What a changed place is; 0 where only the digits of a fit are left."""
    value = place.stated + change
    return 0.0 if abs(value) < FITTED * place.size else value


def is_possible(fitted: Fitted) -> bool:
    """Whether no mass, armature or moment of inertia is below zero."""
    values = [(place, value_of(place, change)) for place, change in zip(fitted.places, fitted.changes)]
    return not any(value < 0.0 and place.name.startswith(NEVER_NEGATIVE) for place, value in values)


def together(texts: list[str]) -> str:
    """Several that explain only with each other."""
    return " and ".join(text.removesuffix(EXPLAINS) for text in texts) + ": together they" + EXPLAINS


def place_text(place: Place, value: float) -> str:
    """One place with the value that would explain the difference."""
    shown = nice(value)
    if shown == nice(place.stated):
        shown = f"{nice(place.stated)} {'+' if value > place.stated else '-'} {abs(value - place.stated):.2g}"
    if place.unit == "times":
        near = [word for factor, word in FACTORS.items() if abs(value - factor) <= CLOSE]
        if place.kind == "coefficient" and not place.stated:
            return f"{place.name}: {shown} times it is added in yours"
        if place.kind == "coefficient":
            return f"{place.name}: yours is {shown} times the right one"
        return f"{place.name}: {near[0] if near else f'{shown} times'}"
    unit = f" {place.unit}" if place.unit else ""
    if place.kind == OF_ZERO:
        joint = place.name.removeprefix("zero of ")
        how = Joint(joint, zero=zeroed(place, value), slides=place.unit == "m")
        return f"{place.name}: {shown}{unit} in place of {nice(place.stated)} (state it as {str(how)!r})"
    return f"{place.name}: {shown}{unit} in place of {nice(place.stated)}{EXPLAINS}"


def zeroed(place: Place, value: float) -> float:
    """What is added to the model's position of a joint, within a turn and of the fewest digits that say the same."""
    off = value - place.stated
    if place.unit == "m":
        return float(f"{off:.9g}")
    off = (off + np.pi) % (2.0 * np.pi) - np.pi
    degrees = round(np.degrees(off), 6)
    return float(np.radians(degrees)) if abs(np.radians(degrees) - off) <= CLOSE else float(off)


def nice(value: float) -> str:
    """A number without the digits that a fit leaves behind."""
    short = float(f"{value:.9g}")
    close = abs(value - short) <= CLOSE * max(abs(value), 1e-6)
    return f"{short:g}" if close and f"{short:g}" == f"{short:.9g}" else f"{short if close else value:.9g}"
