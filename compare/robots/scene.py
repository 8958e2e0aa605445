"""A scene: a motion of any robot, and the validation of what users give for it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.values import real_numbers, shown

from ..core.words import some_of
from .coordinates import KINDS, Coordinates

SEED = 10  # of every random number in a report
MAX_STEPS = 20_000  # of a run; the finest of an experiment takes 128 times as many
TIMES = 1e-9, 1e6  # s, the shortest and the longest that is accepted
TORQUES = ("free", "hold", "servos")
UNITS = {  # of what has a number for each speed
    "torque": "{0.force}", "speed": "{0.speed_given}", "damping": "{0.force} s/{0.unit}",
    "targets": "{0.movement_given}",
}  # fmt: skip
NUMBERS = "posture", "torque", "speed", "damping", "targets", "duration", "dt", "judged"  # or names, or None


class WrongField(ValueError):
    """A field of a scene has a wrong value. accepted: what is expected instead."""

    def __init__(self, scene: object, field: str, value: object, accepted: str):
        super().__init__(f"scene {shown(scene)}: {field} is {shown(value)}; expected {accepted}")
        self.field, self.value, self.accepted = field, value, accepted


def is_number(value: object) -> bool:
    """Whether a value is a finite real number; texts and booleans are not."""
    number = real_numbers(value)
    return number is not None and number.ndim == 0 and bool(np.isfinite(number))


def are_numbers(values: Any) -> bool:
    """Whether a value is a sequence of finite real numbers."""
    row = np.ndim(values) == 1 if isinstance(values, np.ndarray) else isinstance(values, tuple | list | range)
    return row and all(is_number(value) for value in values)


def is_each(value: Any) -> bool:
    """Whether a value is a number, or a sequence of numbers that is not empty."""
    return is_number(value) or (are_numbers(value) and np.size(value) > 0)


@dataclass(frozen=True)
class Scene:
    """A motion of any robot under constant torque, or under constant controls of its actuators.

    It states changes of the model ("no gravity", "additional damping", "these joints locked"), never absolute
    values that would hide those of the file. Raises WrongField for values that no robot can have.
    """

    name: str
    posture: str | tuple[float, ...] = ()  # name, or one number per joint, deg (m, quaternion); (): all zero
    # "hold": balance of gravity and springs at the start; "servos": own actuators; or N m
    torque: str | tuple[float, ...] = "free"
    speed: tuple[float, ...] = ()  # deg/s (m/s) at the start; (): at rest
    damping: float | tuple[float, ...] = 0.0  # N m s/rad (N s/m), added: of all joints, or of each speed
    targets: float | tuple[float, ...] = 0.0  # deg (m), shift of the targets of the servos, all or each speed
    gravity: bool = True  # that of the model, or none
    locked: tuple[str, ...] = ()  # names of joints that keep their position
    duration: float = 5.0  # s
    dt: float = 5.0 / 64  # s, the largest step; all others divide it
    judged: float | None = None  # s during which the band of rounding must be narrow; None: always
    tags: tuple[str, ...] = ()  # see case.Robot

    def __post_init__(self) -> None:
        is_name = isinstance(self.name, str) and bool(self.name.strip()) and self.name.isprintable()
        self.require("name", is_name, "a text in one line, not empty")
        is_posture = isinstance(self.posture, str) or are_numbers(self.posture)
        self.require("posture", is_posture, "the name of a posture, or numbers")
        is_torque = self.torque in TORQUES if isinstance(self.torque, str) else are_numbers(self.torque)
        self.require("torque", is_torque, "free, hold, servos, or a torque in N m for each joint")
        self.require("speed", are_numbers(self.speed), "a speed in deg/s for each joint")
        for name in ("duration", "dt"):
            is_time = is_number(getattr(self, name)) and TIMES[0] <= getattr(self, name) <= TIMES[1]
            self.require(name, is_time, f"a time from {TIMES[0]:g} to {TIMES[1]:g} s")
        accepted = "a number of at least 0 N m s/rad, or one for each joint"
        self.require("damping", is_each(self.damping) and np.min(self.damping) >= 0.0, accepted)
        self.require("targets", is_each(self.targets), "a movement in deg (m), of all joints or each")
        self.require("targets", not np.any(self.targets) or self.torque == "servos", 'torque = "servos"')
        self.require("gravity", isinstance(self.gravity, bool | np.bool_), "true or false")
        object.__setattr__(self, "gravity", bool(self.gravity))
        divides = abs(self.steps * self.dt - self.duration) <= 1e-9 * self.duration and self.steps >= 1
        accepted = f"a step that divides {self.duration:g} s into at most {MAX_STEPS:,} steps"
        self.require("dt", divides and self.duration / self.dt <= MAX_STEPS, accepted)
        if self.judged is not None:
            is_time = is_number(self.judged) and 0.0 <= self.judged <= self.duration
            self.require("judged", is_time, f"a time in s of at most {self.duration:g}")
        for name in NUMBERS:
            value = getattr(self, name)
            if not isinstance(value, str | None):
                number = tuple(map(float, value)) if np.ndim(value) else float(value)
                object.__setattr__(self, name, number)
        for name in ("locked", "tags"):
            value = getattr(self, name)
            is_names = isinstance(value, tuple | list) and all(isinstance(part, str) for part in value)
            self.require(name, is_names, "a list of names")
            object.__setattr__(self, name, tuple(dict.fromkeys(value)))

    def require(self, name: str, is_right: bool, accepted: str) -> None:
        """Raise WrongField for a field unless it is right."""
        if not is_right:
            raise WrongField(self.name, name, getattr(self, name), accepted)

    def require_coordinates(self, coordinates: Coordinates, postures: Mapping[str, Sequence[float]]) -> None:
        """Raise WrongField unless the numbers are as many as those of a robot, and the names are its own.

        postures: of the robot, by name, (nq,) each.
        """
        names, count = coordinates.names, counted(coordinates, "positions", "{0.position_given}")
        if isinstance(self.posture, str):
            named = [name for name, q in postures.items() if len(q) == coordinates.nq]
            accepted = " or ".join(filter(None, [", ".join(named), count]))
            self.require("posture", self.posture in named, accepted)
        elif self.posture:
            self.require("posture", len(self.posture) == coordinates.nq, count)
            lengths = [np.linalg.norm(self.posture[joint.q]) for joint in coordinates.places.balls]
            is_unit = all(abs(length - 1.0) <= CLOSE_TO_ONE for length in lengths)
            self.require("posture", is_unit, "a quaternion w, x, y, z of length 1 for each ball")
        for name, unit in UNITS.items():
            value, accepted = getattr(self, name), counted(coordinates, "speeds", unit)
            is_each = isinstance(value, tuple) and (value or name != "speed")
            self.require(name, not is_each or len(value) == coordinates.nv, accepted)
        has_units = len({*coordinates.all_kinds} - {"ball"}) > 1  # of several kinds
        is_mixed = has_units and isinstance(self.targets, float) and self.targets != 0.0
        self.require("targets", not is_mixed, counted(coordinates, "speeds", UNITS["targets"]))
        is_alone = self.torque != "servos" or not self.locked
        self.require("locked", is_alone, "no locked joint together with servos")
        is_right = set(self.locked) <= set(names) and len(self.locked) < len(names)
        self.require("locked", is_right, f"at most {len(names) - 1} of {some_of(names)}")
        moving = any(any(self.speed[coordinates.by_name[name].qd]) for name in self.locked)
        self.require("speed", not moving, f"speed 0 for locked joints ({', '.join(self.locked)})")

    @property
    def steps(self) -> int:
        """The number of steps of length dt."""
        return round(self.duration / self.dt)


def counted(coordinates: Coordinates, what: str, unit: str) -> str:
    """How many numbers are accepted for the positions or speeds of all joints, and their units."""
    names: tuple[str, ...] = getattr(coordinates, what)
    units = dict.fromkeys(unit.format(KINDS[kind]) for kind in coordinates.all_kinds)
    return f"{len(names)} numbers, one per joint ({some_of(names)}), in {', '.join(units)}"
