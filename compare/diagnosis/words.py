"""Causes in words."""

from typing import NamedTuple

import numpy as np

from ..robots.coordinates import Coordinates
from ..robots.joint_map import Joint, JointMap
from .fit import Fitted
from .places import OF_ZERO, Place
from .variants import Variant

FACTORS = {0.0: "missing", 0.5: "halved", 2.0: "doubled", -1.0: "of the other sign"}
EXPLAINS = " would explain it"
FITTED = 1e-11  # of the size of a place: what a fit may leave of a number that is 0
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
    what: str  # in words
    joints: JointMap | None = None  # by which equations would agree, of a convention of the joints

    @property
    def text(self) -> str:
        """It in words, with the joints as they are to be stated."""
        return self.what + (f" (state it as joints={joints_stated(self.joints)})" if self.joints else "")


def joints_stated(joints: JointMap) -> list[str]:
    """The joints as `joints=` takes them."""
    return list(map(str, joints.joints))


def of_variant(variant: Variant, left: float) -> Cause:
    """An option, a convention or a slip."""
    text = f"{variant.name}: {variant.explains}" if variant.kind != "slip" or variant.explains != "so" else variant.name
    return Cause(
        variant.rank, variant.kind, variant.name, variant.stated, variant.explains, "", left, 0, text, variant.joints
    )


def of_fitted(fitted: Fitted, rank: int, coordinates: Coordinates, beside: Variant | None = None) -> Cause:
    """A number, a term or a coefficient, or two of them; or one beside a variant."""
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
        texts = [of_variant(beside, 0.0).what, *texts]
    text, joints = texts[0] if len(texts) == 1 else together(texts), joints_of(fitted, coordinates, beside)
    if len(texts) == 1:
        place = places[0]
        return Cause(rank, place.kind, place.name, place.stated, found[0], place.unit, fitted.left, 0, text, joints)
    joined = [
        " and ".join(dict.fromkeys(parts)) if parts is units else " and ".join(parts)
        for parts in (kinds, names, stated, explains, units)
    ]
    return Cause(rank, *joined, fitted.left, 0, text, joints)


def joints_of(fitted: Fitted, coordinates: Coordinates, beside: Variant | None) -> JointMap | None:
    """The joints with the zeros that were found, and of the variant beside them; None unless both are of joints alone."""
    if any(place.kind != OF_ZERO for place in fitted.places) or (beside and not beside.joints):
        return None
    zeros = {place.name: zeroed(place, value_of(place, change)) for place, change in zip(fitted.places, fitted.changes)}
    kinds = zip(coordinates.names, coordinates.all_kinds)
    joints = [Joint(name, zero=zeros.get(f"zero of {name}", 0.0), slides=kind == "slide") for name, kind in kinds]
    found = JointMap(coordinates, joints)
    return beside.joints.after(found, coordinates) if beside else found


def value_of(place: Place, change: float) -> float:
    """What a changed place is; 0 where only the digits of a fit are left."""
    value = place.stated + change
    return 0.0 if abs(value) < FITTED * place.size else value


def together(texts: list[str]) -> str:
    """Several that explain only with each other."""
    return " and ".join(text.removesuffix(EXPLAINS) for text in texts) + ": together they" + EXPLAINS


def place_text(place: Place, value: float) -> str:
    """One place with the value that would explain the difference."""
    shown = nice(value)
    if place.kind == OF_ZERO:
        shown = nice(place.stated + zeroed(place, value))
    if shown == nice(place.stated):
        shown = f"{nice(place.stated)} {'+' if value > place.stated else '-'} {abs(value - place.stated):.2g}"
    if place.unit == "times":
        near = [word for factor, word in FACTORS.items() if abs(value - factor) <= CLOSE]
        if place.kind == "coefficient" and not place.stated:
            return f"{place.name}: {shown} times it is added in yours"
        if place.kind == "coefficient":
            if place.column is not None and np.ptp(place.column) <= CLOSE * np.abs(place.column).max():  # a constant
                right = float(np.ravel(place.column)[0])
                return f"{place.name}: yours is {nice(value * right)}, the right one {nice(right)}"
            return f"{place.name}: yours is {shown} times the right one"
        return f"{place.name}: {near[0] if near else f'{shown} times'}"
    unit = f" {place.unit}" if place.unit else ""
    if place.kind == OF_ZERO:
        return f"{place.name}: {shown}{unit} in place of {nice(place.stated)}"
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
