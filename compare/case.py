"""A scene, as a small record, and a case: a robot with what a scene changes.

A scene says what is held or let go, from where, for how long, of any robot. It carries changes and never values that would
hide what a file says: "no gravity", "so much damping more", "these joints locked".
"""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

import tmt

SEED = 10  # of every random number in a report
MOST_STEPS = 10_000_000  # of a run
TORQUES = ("free", "hold")


class Coordinates(NamedTuple):
    """The coordinates of a model's joints: hinges, whose positions are angles and whose speeds are their rates."""

    names: tuple[str, ...]

    @property
    def nq(self) -> int:
        return len(self.names)

    @property
    def nv(self) -> int:
        return len(self.names)

    @property
    def units(self) -> tuple[str, ...]:
        """Of the positions; those of the speeds are the same per s."""
        return ("rad",) * self.nq

    def difference(self, q1: np.ndarray, q0: np.ndarray) -> np.ndarray:
        """From q0 to q1 as a movement, (..., nq) -> (..., nv)."""
        return np.subtract(q1, q0)

    def move(self, q: np.ndarray, dv: np.ndarray) -> np.ndarray:
        """The position after a movement, (..., nq)."""
        return np.add(q, dv)

    def random(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Random positions, (count, nq): a whole turn of each hinge."""
        return rng.uniform(-np.pi, np.pi, (count, self.nq))


@dataclass(frozen=True)
class Scene:
    """A motion under constant torque. Raises ValueError, in one line, for what cannot be a scene of any robot."""

    name: str
    posture: str | tuple = ()  # a posture's name, or an angle in deg for each joint; (): all joints at zero
    torque: str | tuple = "free"  # "free": none; "hold": TMT's gravity balance at the start, for all engines; or N m
    speed: tuple = ()  # deg/s at the start; (): at rest
    damping: float = 0.0  # N m s/rad, added to that of every joint
    gravity: bool = True  # the robot's own, or none
    locked: tuple = ()  # names of the joints that stay at the start
    duration: float = 5.0  # s
    dt: float = 5.0 / 64  # s, the coarsest step; runs with finer ones divide it
    judged: float | None = None  # s, for how long a run must be judged, its band of rounding narrow; None: all along
    tags: tuple = ()  # what it serves for, see robots

    def __post_init__(self):
        named = isinstance(self.name, str) and self.name.strip() and self.name.isprintable()
        self.refuse("name", not named, "a text that is not empty, in one line")
        choices = {
            "posture": "the name of a posture, or an angle in deg for each joint",
            "torque": "free, hold, or a torque in N m for each joint",
            "speed": "a speed in deg/s for each joint",
        }
        for name, accepted in choices.items():
            value = getattr(self, name)
            text = isinstance(value, str)
            known = {"posture": True, "torque": value in TORQUES, "speed": False}[name] if text else are_numbers(value)
            self.refuse(name, not known, accepted)
            if not text:
                object.__setattr__(self, name, tuple(float(v) for v in value))
        for name in ("duration", "dt"):
            value = getattr(self, name)
            self.refuse(name, not is_number(value) or value <= 0.0, "a time in s above 0")
            object.__setattr__(self, name, float(value))
        self.refuse("damping", not is_number(self.damping) or self.damping < 0.0, "at least 0 N m s/rad")
        object.__setattr__(self, "damping", float(self.damping))
        self.refuse("gravity", not isinstance(self.gravity, bool | np.bool_), "True, the model's own, or False, none")
        object.__setattr__(self, "gravity", bool(self.gravity))
        steps = f"a step that divides {self.duration:g} s"
        self.refuse("dt", self.duration / self.dt > MOST_STEPS, f"{steps} into at most {MOST_STEPS:,}")
        left = abs(self.steps * self.dt - self.duration)
        self.refuse("dt", self.steps < 1 or left > 1e-9 * self.duration, steps)
        judged = self.judged is None or (is_number(self.judged) and 0.0 <= self.judged <= self.duration)
        self.refuse("judged", not judged, f"None, or a time in s of at least 0 and at most {self.duration:g}")
        object.__setattr__(self, "judged", None if self.judged is None else float(self.judged))
        for name in ("locked", "tags"):
            value = getattr(self, name)
            texts = isinstance(value, tuple | list) and all(isinstance(part, str) for part in value)
            self.refuse(name, not texts, "a tuple of names")
            object.__setattr__(self, name, tuple(dict.fromkeys(value)))

    def refuse(self, name, wrong, accepted) -> None:
        """Raise ValueError if a field is wrong: what it is, and what is expected."""
        if wrong:
            named, found = (shorten(" ".join(repr(getattr(self, field)).split())) for field in ("name", name))
            raise ValueError(f"scene {named}: {name} is {found}; {accepted} is expected")

    @property
    def steps(self) -> int:
        """The number of the coarsest steps."""
        return round(self.duration / self.dt)


@dataclass(frozen=True)
class Case:
    """A robot with what a scene changes. Raises ValueError, in one line, for what cannot be a scene of this robot."""

    robot: object  # a robots.Robot
    scene: Scene

    def __post_init__(self):
        names, scene = self.robot.joints, self.scene
        count = f"{len(names)} numbers, one per joint ({', '.join(names)})"
        if isinstance(scene.posture, str):
            postures = [name for name, angles in self.robot.postures.items() if len(angles) == len(names)]
            accepted = f"{', '.join(postures)} or {count}, in deg" if postures else f"{count}, in deg"
            scene.refuse("posture", scene.posture not in postures, accepted)
        for name, unit in (("posture", "deg"), ("torque", "N m"), ("speed", "deg/s")):
            value = getattr(scene, name)
            left_out = name != "torque" and value == ()
            known = isinstance(value, str) or len(value) == len(names) or left_out
            scene.refuse(name, not known, f"{count}, in {unit}")
        unknown = [name for name in scene.locked if name not in names]
        most = f"a tuple of at most {len(names) - 1} of {', '.join(names)}"
        scene.refuse("locked", unknown or len(scene.locked) >= len(names), most)
        moving = [name for name, rate in zip(names, scene.speed) if rate and name in scene.locked]
        scene.refuse("speed", moving, f"no speed of a locked joint ({', '.join(scene.locked)})")

    @property
    def name(self) -> str:
        return self.scene.name

    @property
    def duration(self) -> float:
        return self.scene.duration

    @property
    def steps(self) -> int:
        """The number of the coarsest steps."""
        return self.scene.steps

    @property
    def is_free(self) -> bool:
        """Whether no torque acts."""
        return self.scene.torque == "free"

    @property
    def is_held(self) -> bool:
        """Whether it starts at rest under the torque that holds it: its true motion is rest."""
        return self.scene.torque == "hold" and not any(self.scene.speed)

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints that are not locked."""
        return tuple(name for name in self.robot.joints if name not in self.scene.locked)

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.joints)

    @cached_property
    def whole(self) -> tmt.Tree:
        """The robot's Tree with the scene's damping added, and without gravity if the scene has none; no joint locked."""
        tree, scene = self.robot.tree, self.scene
        gravity = tree.gravity if scene.gravity else (0.0, 0.0, 0.0)
        return dataclasses.replace(tree, damping=tuple(d + scene.damping for d in tree.damping), gravity=gravity)

    @property
    def locked(self) -> Mapping[str, float]:
        """The angles of the locked joints, rad, by their names."""
        return {name: float(q) for name, q in zip(self.robot.joints, self.posture) if name in self.scene.locked}

    @cached_property
    def tree(self) -> tmt.Tree:
        """The whole Tree without the locked joints."""
        return self.whole.lock(self.locked)

    @property
    def posture(self) -> np.ndarray:
        """Angles of all joints at t = 0, rad."""
        return self.robot.posture(self.scene.posture)

    @cached_property
    def q(self) -> np.ndarray:
        """Angles of the free joints at t = 0, rad, (n,)."""
        return self.free(self.posture)

    @cached_property
    def v(self) -> np.ndarray:
        """Rates of the free joints at t = 0, rad/s, (n,)."""
        return self.free(np.radians(np.array(self.scene.speed or (0.0,) * len(self.robot.joints))))

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        """q and v."""
        return self.q, self.v

    @cached_property
    def tau(self) -> np.ndarray:
        """Torque at the free joints, N m, (n,)."""
        torque = self.scene.torque
        if torque == "hold":
            return self.free(tmt.gravity_balance(self.posture, self.whole))
        return self.free(np.array((0.0,) * len(self.robot.joints) if torque == "free" else torque))

    def free(self, values: np.ndarray) -> np.ndarray:
        """Of values for all joints those of the free ones."""
        return values[[self.robot.joints.index(name) for name in self.joints]]

    def changed(self, **changes) -> "Case":
        """The same robot in a scene with other values."""
        return Case(self.robot, dataclasses.replace(self.scene, **changes))


def is_number(value: object) -> bool:
    """Whether a value is one finite real number; neither text nor true and false."""
    try:
        number = np.asarray(value)
    except (TypeError, ValueError, OverflowError):
        return False
    return number.ndim == 0 and number.dtype.kind in "iuf" and bool(np.isfinite(number))


def are_numbers(values: object) -> bool:
    """Whether the values are such numbers in a row."""
    row = np.ndim(values) == 1 if isinstance(values, np.ndarray) else isinstance(values, tuple | list | range)
    return row and all(is_number(value) for value in values)


def shorten(text: str, length: int = 60) -> str:
    """A text that may stand in one line."""
    return text if len(text) <= length else text[: length - 4] + " ..."
