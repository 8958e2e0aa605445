"""How equations of one's own name, order, turn, zero and measure the joints of a model.

A joint of one's own is stated as "knee", "-knee" (the other sense), "knee+90deg", "knee-0.1rad", "slider+0.2m" (its own zero:
own position = position of the model + 90 deg), "knee in deg" (positions in deg and speeds in deg/s), "knee in deg, rad/s"
(positions alone), or several of these: "-knee+90deg in deg". They stand in the order in which one's own equations take them.
Mbar and h of one's own are per rad and in N m in each of them, whatever the unit of the arguments.
"""

import re
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from ..judge.words import listed
from .coordinates import Coordinates

PER_UNIT = {"": (1.0, 1.0), "deg": (180.0 / np.pi, 180.0 / np.pi), "deg (rad/s)": (180.0 / np.pi, 1.0)}
STATED = re.compile(r"(?P<name>.+?)(?P<offset>[+-](?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)(?P<measure>deg|rad|m)")
FORMS = '"knee", "-knee", "knee+90deg" or "knee in deg"'


class JointsError(ValueError):
    """A statement of joints that does not fit the model; the message is one line."""


class Joint(NamedTuple):
    """A joint as one's own equations have it: own position = sign x position of the model + zero, in its unit."""

    name: str  # of the model
    sign: float = 1.0
    zero: float = 0.0  # rad or m
    unit: str = ""  # of PER_UNIT
    slides: bool = False

    def __str__(self):
        exact = f"{'+' * (self.zero > 0.0)}{float(self.zero)!r}"
        zero = f"{exact}m" if self.zero else ""
        if self.zero and not self.slides:
            degrees = np.degrees(self.zero)
            whole = abs(degrees - round(degrees, 6)) <= 1e-9
            zero = f"{round(degrees, 6):+.10g}deg" if whole else f"{exact}rad"
        return f"{'-' * (self.sign < 0.0)}{self.name}{zero}{' in ' * bool(self.unit)}{self.unit}"


class JointMap:
    """Between positions q (..., nq), speeds (..., nv), Mbar and forces of a model and those of one's own equations."""

    def __init__(self, coordinates: Coordinates, joints: Sequence[Joint]):
        places = dict(zip(coordinates.names, coordinates.places.joints))
        self.joints = tuple(joints)
        chosen = [places[joint.name] for joint in joints]
        self.q = np.array([i for kind, at, by in chosen for i in range(at.start, at.stop)], int)
        self.v = np.array([i for kind, at, by in chosen for i in range(by.start, by.stop)], int)
        self.sign, self.zero, self.sense = np.ones(len(self.q)), np.zeros(len(self.q)), np.ones(len(self.v))
        self.of_q, self.of_v = np.ones(len(self.q)), np.ones(len(self.v))
        at = by = 0
        for joint, (kind, q, v) in zip(joints, chosen):
            if kind != "ball":
                self.sign[at] = self.sense[by] = joint.sign
                self.zero[at] = joint.zero
                self.of_q[at], self.of_v[by] = PER_UNIT[joint.unit]
            at, by = at + q.stop - q.start, by + v.stop - v.start

    @property
    def is_same(self) -> bool:
        """Whether one's own joints are the model's."""
        same = self.sign.min() == self.of_q.min() == self.of_q.max() == 1.0 and not self.zero.any()
        return bool(same and (self.of_v == 1.0).all() and (self.q == np.arange(len(self.q))).all())

    def after(self, found: "JointMap", coordinates: Coordinates) -> "JointMap | None":
        """The map from a model to one's own joints, where what this map takes for the model's joints are those of `found`.

        None where it cannot be stated, as of degrees of degrees.
        """
        places, joints = {name: i for i, name in enumerate(coordinates.names)}, []
        for stated in self.joints:
            inner = found.joints[places[stated.name]]
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
        """Forces at the model's joints, at those of one's own; also accelerations, which are per s2 in rad."""
        return np.asarray(tau)[..., self.v] * self.sense

    def own_mass_matrix(self, M: np.ndarray) -> np.ndarray:
        return np.asarray(M)[..., self.v[:, None], self.v] * self.sense[:, None] * self.sense

    def positions(self, own: np.ndarray) -> np.ndarray:
        """Of the model."""
        return put((np.asarray(own) / self.of_q - self.zero) * self.sign, self.q)

    def speeds(self, own: np.ndarray) -> np.ndarray:
        return put(np.asarray(own) / self.of_v * self.sense, self.v)

    def forces(self, own: np.ndarray) -> np.ndarray:
        return put(np.asarray(own) * self.sense, self.v)

    def mass_matrix(self, own: np.ndarray) -> np.ndarray:
        back = np.argsort(self.v)
        return (np.asarray(own) * self.sense[:, None] * self.sense)[..., back[:, None], back]


def within_a_turn(zero: float, slides: bool) -> float:
    """The zero of a hinge between -180 and 180 deg, 0 if only rounding is left of it; that of a slide as it is."""
    turned = zero if slides else (zero + np.pi) % (2.0 * np.pi) - np.pi
    return 0.0 if abs(turned) < 1e-9 else float(turned)


def put(values: np.ndarray, at: np.ndarray) -> np.ndarray:
    """Values in one's own order, in the model's."""
    return np.asarray(values)[..., np.argsort(at)]


def joint_map(coordinates: Coordinates, stated: Sequence[str] | None) -> JointMap:
    """Of joints as they are stated; None: those of the model. JointsError says what does not fit."""
    if stated is None:
        return JointMap(coordinates, [Joint(name) for name in coordinates.names])
    if isinstance(stated, str) or not all(isinstance(text, str) for text in stated):
        raise JointsError(f"joints is {stated!r}; a list of names such as {FORMS} is expected")
    joints = [read_joint(text.strip(), coordinates) for text in stated]
    names = [joint.name for joint in joints]
    twice = [name for name in names if names.count(name) > 1]
    missing = [name for name in coordinates.names if name not in names]
    if twice:
        raise JointsError(f"joints name {twice[0]!r} twice")
    if missing:
        raise JointsError(
            f"joints do not name {listed(missing)}; all {len(coordinates.names)} of the model are expected"
        )
    return JointMap(coordinates, joints)


def read_joint(text: str, coordinates: Coordinates) -> Joint:
    """One joint as it is stated; a joint of that very name comes first."""
    kinds = dict(zip(coordinates.names, (joint.kind for joint in coordinates.places.joints)))
    if text in kinds:
        return Joint(text)
    rest, unit = text, ""
    for known in PER_UNIT:
        if known and rest.endswith(f" in {known}"):
            rest, unit = rest.removesuffix(f" in {known}").rstrip(), known
            break
    sign, zero = 1.0, 0.0
    if rest not in kinds and rest.startswith("-"):
        rest, sign = rest[1:], -1.0
    if rest not in kinds and (match := STATED.fullmatch(rest)):
        rest, value = match["name"], float(match["offset"])
        zero = np.radians(value) if match["measure"] == "deg" else value
        if rest in kinds and (match["measure"] == "m") != (kinds[rest] == "slide"):
            raise JointsError(f"joint {text!r}: {rest} is a {kinds[rest]}, whose zero is not in {match['measure']}")
    name, measured, measure = rest.rpartition(" in ")
    if rest not in kinds and measured and name.removeprefix("-") in kinds:
        raise JointsError(f"joint {text!r}: the unit {measure!r} is not known; {', '.join(filter(None, PER_UNIT))} are")
    if rest not in kinds:
        raise JointsError(f"there is no joint {text!r}; {listed(coordinates.names)} are known, stated as {FORMS}")
    if kinds[rest] == "ball" and (sign, zero, unit) != (1.0, 0.0, ""):
        raise JointsError(f"joint {text!r}: {rest} is a ball, of which only the name can be stated")
    if kinds[rest] == "slide" and unit:
        raise JointsError(f"joint {text!r}: {rest} is a slide, whose unit is m")
    return Joint(rest, sign, float(zero), unit, kinds[rest] == "slide")
