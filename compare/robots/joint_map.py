"""The joints of a user's equations: their order, sense, zero and units.

A user states joints in the order of the arguments: "knee"; "-knee", opposite sense; "knee+90deg",
"knee-0.1rad", "slider+0.2m", another zero (own position = position of the model + 90 deg); "knee in deg",
positions in deg and speeds in deg/s; "knee in deg (rad/s)", positions only; and combinations: "-knee+90deg in
deg". Mbar and h are always per rad and in N m.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..core.words import listed
from .coordinates import Coordinates

PER_UNIT = {"": (1.0, 1.0), "deg": (180.0 / np.pi, 180.0 / np.pi), "deg (rad/s)": (180.0 / np.pi, 1.0)}
NUMBER = r"[+-](?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
ZERO, UNIT = rf"(?:(?P<zero>{NUMBER})(?P<measure>deg|rad|m))", "(?: +in (?P<unit>.+))"
FORMS = '"knee", "-knee", "knee+90deg" or "knee in deg"'


class JointsError(ValueError):
    """The stated joints do not match the model; the message is one line."""


class Joint(NamedTuple):
    """A joint of a user's equations: own position = sign x position of the model + zero, in its unit."""

    name: str  # of the model
    sign: float = 1.0
    zero: float = 0.0  # rad or m
    unit: str = ""  # of PER_UNIT
    slides: bool = False

    def __str__(self) -> str:
        zero = f"{float(self.zero):+}m" if self.zero else ""
        if self.zero and not self.slides:
            degrees = np.degrees(self.zero)
            is_short = abs(degrees - round(degrees, 6)) <= 1e-9
            zero = f"{round(degrees, 6):+.10g}deg" if is_short else f"{float(self.zero):+}rad"
        sign, unit = "-" if self.sign < 0.0 else "", f" in {self.unit}" if self.unit else ""
        return f"{sign}{self.name}{zero}{unit}"


class JointMap:
    """Converts positions (..., nq), speeds (..., nv), Mbar and forces between a model and `own` equations.

    q, v: the index in the model of each own position and speed. The others are factors of own positions
    (sign, of_q), zeros, and factors of own speeds (sense, of_v).
    """

    def __init__(self, coordinates: Coordinates, joints: Sequence[Joint]) -> None:
        self.joints = tuple(joints)
        places = [coordinates.by_name[joint.name] for joint in joints]
        self.q = np.r_[tuple(place.q for place in places)]
        self.v = np.r_[tuple(place.qd for place in places)]
        # a ball has no sign, zero or unit
        pairs = list(zip(joints, places))
        stated = [Joint(joint.name) if place.kind == "ball" else joint for joint, place in pairs]
        numbers = np.array([(joint.sign, joint.zero, *PER_UNIT[joint.unit]) for joint in stated])
        positions = [place.q.stop - place.q.start for place in places]
        speeds = [place.qd.stop - place.qd.start for place in places]
        self.sign, self.zero, self.of_q, _ = np.repeat(numbers, positions, axis=0).T
        self.sense, _, _, self.of_v = np.repeat(numbers, speeds, axis=0).T

    @property
    def is_same(self) -> bool:
        """Whether the joints are those of the model."""
        factors = np.concatenate([self.sign, self.of_q, self.of_v])
        in_order = (self.q == np.arange(len(self.q))).all()
        return bool(in_order and (factors == 1.0).all() and not self.zero.any())

    def after(self, first: "JointMap", coordinates: Coordinates) -> "JointMap | None":
        """The composition: first, then this map. None if it cannot be stated, such as degrees of degrees."""
        inner_joints, joints = dict(zip(coordinates.names, first.joints)), []
        for stated in self.joints:
            inner = inner_joints[stated.name]
            if stated.unit and inner.unit:
                return None
            zero = stated.sign * inner.zero + stated.zero / PER_UNIT[inner.unit][0]
            sign, unit = stated.sign * inner.sign, stated.unit or inner.unit
            joints.append(Joint(inner.name, sign, within_a_turn(zero, inner.slides), unit, inner.slides))
        return JointMap(coordinates, joints)

    def own_positions(self, q: np.ndarray) -> np.ndarray:
        return (np.asarray(q)[..., self.q] * self.sign + self.zero) * self.of_q

    def own_speeds(self, v: np.ndarray) -> np.ndarray:
        return np.asarray(v)[..., self.v] * self.sense * self.of_v

    def own_forces(self, tau: np.ndarray) -> np.ndarray:
        """Forces at the own joints; also accelerations, in rad/s2 whatever the unit."""
        return np.asarray(tau)[..., self.v] * self.sense

    def own_mass_matrix(self, M: np.ndarray) -> np.ndarray:
        return np.asarray(M)[..., self.v[:, None], self.v] * self.sense[:, None] * self.sense

    def positions(self, own: np.ndarray) -> np.ndarray:
        return put((np.asarray(own) / self.of_q - self.zero) * self.sign, self.q)

    def speeds(self, own: np.ndarray) -> np.ndarray:
        return put(np.asarray(own) / self.of_v * self.sense, self.v)

    def forces(self, own: np.ndarray) -> np.ndarray:
        return put(np.asarray(own) * self.sense, self.v)

    def mass_matrix(self, own: np.ndarray) -> np.ndarray:
        columns = put(np.asarray(own) * self.sense[:, None] * self.sense, self.v)
        return np.swapaxes(put(np.swapaxes(columns, -1, -2), self.v), -1, -2)


def within_a_turn(zero: float, slides: bool) -> float:
    """A zero; of a hinge between -180 and 180 deg, rounding errors removed."""
    turned = zero if slides else (zero + np.pi) % (2.0 * np.pi) - np.pi
    return 0.0 if abs(turned) < 1e-9 else float(turned)


def put(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Own values, (..., n), at their indices in the model."""
    return np.asarray(values)[..., np.argsort(at)]


def joint_map(coordinates: Coordinates, stated: Sequence[str] | None) -> JointMap:
    """The JointMap of stated joints; None: those of the model."""
    if stated is None:
        return JointMap(coordinates, [Joint(name) for name in coordinates.names])
    if isinstance(stated, str) or not all(isinstance(text, str) for text in stated):
        raise JointsError(f"joints is {stated!r}; expected a list of names such as {FORMS}")
    joints = [read_joint(text.strip(), coordinates) for text in stated]
    names = [joint.name for joint in joints]
    if twice := [name for name in names if names.count(name) > 1]:
        raise JointsError(f"joint {twice[0]!r} is stated twice")
    if missing := [name for name in coordinates.names if name not in names]:
        count = len(coordinates.names)
        raise JointsError(f"joints without {listed(missing)}; expected all {count} of the model")
    return JointMap(coordinates, joints)


def read_joint(text: str, coordinates: Coordinates) -> Joint:
    """A stated joint; a joint with exactly this name has priority."""
    kinds = dict(zip(coordinates.names, coordinates.all_kinds))
    if text in kinds:
        return Joint(text)
    names = "|".join(map(re.escape, sorted(kinds, key=len, reverse=True)))
    match = re.fullmatch(f"(?P<sign>-?)(?P<name>{names}){ZERO}?{UNIT}?", text)
    if match is None:
        raise JointsError(f"unknown joint {text!r}; known: {listed(coordinates.names)}, stated as {FORMS}")
    name, measure, unit = match["name"], match["measure"], match["unit"] or ""
    kind, zero = kinds[name], float(match["zero"] or 0.0)
    if unit not in PER_UNIT:
        known = ", ".join(filter(None, PER_UNIT))
        raise JointsError(f"joint {text!r}: unknown unit {unit!r}; known: {known}")
    if measure and (measure == "m") != (kind == "slide"):
        raise JointsError(f"joint {text!r}: {name} is a {kind}, its zero cannot be in {measure}")
    if kind == "ball":
        raise JointsError(f"joint {text!r}: {name} is a ball, only its name can be stated")
    if kind == "slide" and unit:
        raise JointsError(f"joint {text!r}: {name} is a slide, its unit is m")
    zero = float(np.radians(zero)) if measure == "deg" else zero
    return Joint(name, -1.0 if match["sign"] else 1.0, zero, unit, kind == "slide")
