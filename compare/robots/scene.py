"""A scene, as a small record.

It says what is held or let go, from where, for how long, of any robot. It carries changes and never values that would
hide what a file says: "no gravity", "so much damping more", "these joints locked".
"""

from dataclasses import dataclass

import numpy as np

from .given import WrongField, are_numbers, is_number

MOST_STEPS = 10_000_000  # of a run
TORQUES = ("free", "hold", "servos")


@dataclass(frozen=True)
class Scene:
    """A motion under constant torque, or under constant controls of the robot's own actuators.

    Raises ValueError, in one line, for what cannot be a scene of any robot.
    """

    name: str
    # a posture's name, or an angle in deg for each joint (m, a quaternion); (): the reference
    posture: str | tuple = ()
    # "free": none; "hold": what balances gravity and springs at the start, by TMT; "servos": the robot's own actuators; or N m
    torque: str | tuple = "free"
    speed: tuple = ()  # deg/s (m/s) at the start; (): at rest
    damping: float | tuple = 0.0  # N m s/rad (N s/m), added to that of every joint; or a number for each speed
    targets: float | tuple = 0.0  # deg (m), by how much the servos' targets are moved; or a number for each speed
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
            "torque": "free, hold, servos, or a torque in N m for each joint",
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
        each = are_numbers(self.damping) and len(self.damping) > 0
        wrong = not (each or is_number(self.damping)) or np.min(self.damping) < 0.0
        self.refuse("damping", wrong, "at least 0 N m s/rad")
        object.__setattr__(self, "damping", tuple(float(v) for v in self.damping) if each else float(self.damping))
        each = are_numbers(self.targets) and len(self.targets) > 0
        self.refuse(
            "targets", not (each or is_number(self.targets)), "a movement in deg (m), for all joints or for each"
        )
        object.__setattr__(self, "targets", tuple(float(v) for v in self.targets) if each else float(self.targets))
        self.refuse("targets", np.any(self.targets) and self.torque != "servos", 'torque = "servos"')
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
            raise WrongField(self.name, name, getattr(self, name), accepted)

    @property
    def steps(self) -> int:
        """The number of the coarsest steps."""
        return round(self.duration / self.dt)
