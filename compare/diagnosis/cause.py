"""Causes: explanations of a difference, the results of all searches. Their text is in causes.md.jinja."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..judge.finding import Finding
from ..report.text import say
from ..robots.coordinates import Coordinates
from ..robots.joint_map import Joint, JointMap

TEMPLATE = "causes"
LEAST_STATES = 4  # different positions: with fewer, wrong numbers explain by luck
FACTORS = (0.0, 0.5, 2.0, -1.0)  # which have a word
FIT_ROUNDING = 1e-11  # of the size of a number: what a fit leaves of a number that is 0
CLOSE = 1e-9  # a fitted factor, to one of FACTORS


class Change(NamedTuple):
    """One change of the equations."""

    kind: str  # "number", "term", "coefficient", "option", "order", ...
    place: str
    stated: float | str
    explains: float | str  # the value that explains the difference
    unit: str = ""
    form: str = "option"  # of its sentence
    values: dict | None = None  # what the sentence needs further


class Cause(NamedTuple):
    """One explanation of the whole difference."""

    rank: int
    kind: str
    place: str
    stated: float | str
    explains: float | str
    unit: str
    left_over: float  # of the difference, a share
    changes: tuple[Change, ...]
    joints: JointMap | None = None  # with which the equations would agree, for a convention of the joints
    of_no_body: bool = False  # whether no rigid body has this number
    tied: int = 0  # other explanations that explain as much

    def text(self, stated_by: str = "argument") -> str:
        """The cause in words. stated_by: how joints are stated, "argument" (joints=), "option" (--joints); "": they are not."""
        return say(Finding(TEMPLATE, "cause", {"cause": self, "stated_by": stated_by}))

    @property
    def stated_joints(self) -> list[str]:
        """The joints as `joints=` takes them."""
        return joints_stated(self.joints) if self.joints else []


class Diagnosis(NamedTuple):
    """What explains a difference."""

    differs: bool
    causes: tuple[Cause, ...] = ()  # of one rank, each explains everything; (): nothing does
    left: float = 0.0  # of the difference that the nearest single number, term or pair leaves, a share
    digits: float = np.inf  # to which the values agree
    is_small: bool = False  # whether every difference is small compared with its own entry or coefficient
    parts: tuple[list[str], list[str]] = ((), ())  # of "M", "gravity" and "velocity" those that differ, and that agree
    details: tuple[dict, ...] = ()  # coefficients that differ, with both numbers or in terms
    more: int = 0  # coefficients that differ and are not in `details`
    entries: tuple[str, ...] = ()  # of Mbar and h that differ, "M[hip][knee]"
    states: tuple[int, int] = (0, 0)  # at how many they differ, and of how many
    compared: int = 0  # entries in all
    nearest: tuple[tuple[str, float], ...] = ()  # single explanations that leave least, and what they leave, a share
    too_few: int = 0  # states, if they are too few for a search
    seconds: float | None = None  # of a search that was not finished
    numbers_searched: bool = True  # whether at least numbers were searched

    def sentence(self, stated_by: str = "argument") -> str:
        """The result in words. stated_by: see `Cause.text`."""
        values = {"found": self, "least_states": LEAST_STATES, "stated_by": stated_by}
        return say(Finding(TEMPLATE, "diagnosis", values))


def cause_of(
    rank: int,
    changes: Sequence[Change],
    left: float,
    joints: JointMap | None = None,
    of_no_body: bool = False,
) -> Cause:
    """The cause that several changes are together."""
    if len(changes) == 1:
        return Cause(rank, *changes[0][:5], left, tuple(changes), joints, of_no_body)
    kinds, places, *values, units = zip(*(change[:5] for change in changes))
    stated, explains = (" and ".join(x if isinstance(x, str) else f"{x:.12g}" for x in numbers) for numbers in values)
    unit = " and ".join(dict.fromkeys(filter(None, units)))
    return Cause(rank, " and ".join(kinds), " and ".join(places), stated, explains, unit, left, tuple(changes), joints)


def tied(causes: Sequence[Cause]) -> tuple[Cause, ...]:
    """The causes of one rank, each with the number of the others."""
    return tuple(cause._replace(tied=len(causes) - 1) for cause in causes)


def joints_stated(joints: JointMap) -> list[str]:
    """The joints as `joints=` takes them."""
    return list(map(str, joints.joints))


def number_changed(name: str, stated: float, value: float, unit: str, kind: str = "number") -> Change:
    """A number of the model with another value."""
    return Change(
        kind, name, stated, float(value), unit, "number", {"shown": shown(value, stated), "stated": nice(stated)}
    )


def place_changed(place, change: float) -> Change:
    """A place of the equations, see places.py, with a fitted change."""
    value = value_of(place, change)
    form, values = "number", {"shown": shown(value, place.stated)}
    if place.is_zero:
        form, values = "zero", {"shown": shown(place.stated + zero_of(place, value), place.stated)}
    elif place.unit == "times":
        near = next((factor for factor in FACTORS if abs(value - factor) <= CLOSE), None)
        form, values = "factor", {"shown": nice(value), "near": near}
        if place.kind == "coefficient":
            constant = place.column is not None and np.ptp(place.column) <= CLOSE * np.abs(place.column).max()
            form = "constant" if constant else "coefficient"
            if not place.stated:
                form = "added"
            elif constant:
                right = float(np.ravel(place.column)[0])
                values = {"shown": nice(value * right), "right": nice(right)}
    return Change(
        place.kind, place.name, place.stated, value, place.unit, form, values | {"stated": nice(place.stated)}
    )


def value_of(place, change: float) -> float:
    """The value of a changed place; 0 where only the digits of a fit remain."""
    value = place.stated + change
    return 0.0 if abs(value) < FIT_ROUNDING * place.size else value


def zero_of(place, value: float) -> float:
    """What is added to the model's position of a joint, within a turn and in the fewest digits."""
    off = value - place.stated
    if place.unit == "m":
        return float(f"{off:.9g}")
    off = (off + np.pi) % (2.0 * np.pi) - np.pi
    degrees = round(np.degrees(off), 6)
    return float(np.radians(degrees)) if abs(np.radians(degrees) - off) <= CLOSE else float(off)


def with_zeros(places, changes, coordinates: Coordinates, stated: JointMap | None) -> JointMap:
    """The joints with fitted zeros. stated: another convention, which comes after these."""
    zeros = {place.name: zero_of(place, value_of(place, change)) for place, change in zip(places, changes)}
    joints = [
        Joint(name, zero=zeros.get(f"zero of {name}", 0.0), slides=kind == "slide")
        for name, kind in zip(coordinates.names, coordinates.all_kinds)
    ]
    fitted = JointMap(coordinates, joints)
    return stated.after(fitted, coordinates) if stated else fitted


def nice(value: float) -> str:
    """A number without the digits that a fit leaves behind."""
    short = float(f"{value:.9g}")
    close = abs(value - short) <= CLOSE * max(abs(value), 1e-6)
    return f"{short:g}" if close and f"{short:g}" == f"{short:.9g}" else f"{short if close else value:.9g}"


def shown(value: float, stated: float) -> str:
    """A number, as a sum where it would look the same as the stated one."""
    text = nice(value)
    return text if text != nice(stated) else f"{text} {'+' if value > stated else '-'} {abs(value - stated):.2g}"
