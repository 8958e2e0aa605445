"""Scenes and cases: a scene states changes, a case is a robot with a scene."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import tmt
from tmt import literal
from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.tree import GAINS

from ..core.words import some_of
from .actuators import Controller, controller
from .coordinates import KINDS as KINDS
from .coordinates import Coordinates
from .coordinates import fastest_rates as fastest_rates
from .coordinates import rates_at as rates_at
from .validation import WrongField, are_numbers, is_number

SEED = 10  # of every random number in a report
MAX_STEPS = 20_000  # of a run; the finest of an experiment takes 128 times as many
TIMES = 1e-9, 1e6  # s, the shortest and the longest that is accepted
TORQUES = ("free", "hold", "servos")


@dataclass(frozen=True)
class Scene:
    """A motion of any robot under constant torque, or under constant controls of its actuators.

    It states changes of the model ("no gravity", "additional damping", "these joints locked"), never absolute values that would
    hide those of the file. Raises WrongField for values that no robot can have.
    """

    name: str
    posture: str | tuple = ()  # name, or one number per joint, deg (m, quaternion); (): all zero
    torque: str | tuple = (
        "free"  # "hold": balance of gravity and springs at the start; "servos": own actuators; or N m
    )
    speed: tuple = ()  # deg/s (m/s) at the start; (): at rest
    damping: float | tuple = 0.0  # N m s/rad (N s/m), added to that of all joints, or of each speed
    targets: float | tuple = 0.0  # deg (m), shift of the targets of the servos, of all joints or each speed
    gravity: bool = True  # that of the model, or none
    locked: tuple = ()  # names of joints that keep their position
    duration: float = 5.0  # s
    dt: float = 5.0 / 64  # s, the largest step; all others divide it
    judged: float | None = None  # s during which the band of rounding must be narrow; None: always
    tags: tuple = ()  # see robots.Robot

    def __post_init__(self):
        self.require("name", is_text(self.name), "a text in one line, not empty")
        is_posture = isinstance(self.posture, str) or are_numbers(self.posture)
        self.set("posture", is_posture, "the name of a posture, or numbers")
        is_torque = self.torque in TORQUES if isinstance(self.torque, str) else are_numbers(self.torque)
        self.set("torque", is_torque, "free, hold, servos, or a torque in N m for each joint")
        self.set("speed", are_numbers(self.speed), "a speed in deg/s for each joint")
        accepted = f"a time from {TIMES[0]:g} to {TIMES[1]:g} s"
        for name in ("duration", "dt"):
            self.set(
                name, is_number(getattr(self, name)) and TIMES[0] <= getattr(self, name) <= TIMES[1], accepted
            )
        accepted = "a number of at least 0 N m s/rad, or one for each joint"
        self.set("damping", is_each(self.damping) and np.min(self.damping) >= 0.0, accepted)
        self.set("targets", is_each(self.targets), "a movement in deg (m), of all joints or each")
        self.require("targets", not np.any(self.targets) or self.torque == "servos", 'torque = "servos"')
        self.require("gravity", isinstance(self.gravity, bool | np.bool_), "true or false")
        object.__setattr__(self, "gravity", bool(self.gravity))
        accepted = f"a step that divides {self.duration:g} s into at most {MAX_STEPS:,} steps"
        self.require("dt", self.duration / self.dt <= MAX_STEPS, accepted)
        left = abs(self.steps * self.dt - self.duration)
        self.require("dt", self.steps >= 1 and left <= 1e-9 * self.duration, accepted)
        if self.judged is not None:
            is_time = is_number(self.judged) and 0.0 <= self.judged <= self.duration
            self.set("judged", is_time, f"a time in s of at most {self.duration:g}")
        for name in ("locked", "tags"):
            value = getattr(self, name)
            is_names = isinstance(value, tuple | list) and all(isinstance(part, str) for part in value)
            self.require(name, is_names, "a list of names")
            object.__setattr__(self, name, tuple(dict.fromkeys(value)))

    def require(self, name: str, is_right: bool, accepted: str) -> None:
        """Raise WrongField for a field unless it is right."""
        if not is_right:
            raise WrongField(self.name, name, getattr(self, name), accepted)

    def set(self, name: str, is_right: bool, accepted: str) -> None:
        """Require that a field is right, and store its numbers as floats."""
        self.require(name, is_right, accepted)
        value = getattr(self, name)
        if not isinstance(value, str):
            object.__setattr__(self, name, tuple(map(float, value)) if np.ndim(value) else float(value))

    @property
    def steps(self) -> int:
        """The number of steps of length dt."""
        return round(self.duration / self.dt)


def is_text(value: object) -> bool:
    return isinstance(value, str) and bool(value.strip()) and value.isprintable()


def is_each(value: object) -> bool:
    """Whether a value is a number, or a sequence of numbers that is not empty."""
    return is_number(value) or (are_numbers(value) and len(value) > 0)


@dataclass(frozen=True)
class Case:
    """A robot with a scene. Raises WrongField if this robot cannot have the scene."""

    robot: object  # a robots.Robot
    scene: Scene

    def __post_init__(self):
        names, scene, whole = self.robot.joints, self.scene, self.robot.coordinates

        def numbers(each: tuple, unit: str) -> str:
            units = ", ".join(dict.fromkeys(unit.format(KINDS[kind]) for kind in whole.all_kinds))
            return f"{len(each)} numbers, one per joint ({some_of(each)}), in {units}"

        count = numbers(whole.positions, "{0.position_given}")
        if isinstance(scene.posture, str):
            named = self.robot.postures or self.robot.positions
            postures = [name for name, q in self.robot.poses.items() if len(q) == whole.nq and named]
            accepted = " or ".join(filter(None, [", ".join(postures), count]))
            scene.require("posture", scene.posture in postures, accepted)
        elif scene.posture:
            scene.require("posture", len(scene.posture) == whole.nq, count)
            for joint in whole.places.balls:
                is_unit = abs(np.linalg.norm(scene.posture[joint.q]) - 1.0) <= CLOSE_TO_ONE
                scene.require("posture", is_unit, "a quaternion w, x, y, z of length 1 for each ball")
        units = {"torque": "{0.force}", "speed": "{0.speed_given}", "damping": "{0.force} s/{0.unit}"}
        for name, unit in (units | {"targets": "{0.movement_given}"}).items():
            value = getattr(scene, name)
            is_each = isinstance(value, tuple) and (value or name != "speed")
            scene.require(name, not is_each or len(value) == whole.nv, numbers(whole.speeds, unit))
        mixed = len({*whole.all_kinds} - {"ball"}) > 1 and isinstance(scene.targets, float) and scene.targets
        scene.require("targets", not mixed, numbers(whole.speeds, "{0.movement_given}"))
        if scene.torque == "servos":
            acts = any(u is not None for u in self.controller.controls)
            scene.require("torque", acts, "free, hold or numbers: this robot has no actuator that takes part")
            scene.require("locked", not scene.locked, "no locked joint together with servos")
        is_right = set(scene.locked) <= set(names) and len(scene.locked) < len(names)
        scene.require("locked", is_right, f"at most {len(names) - 1} of {some_of(names)}")
        moving = (
            any(any(scene.speed[self.places[name].qd]) for name in scene.locked) if scene.speed else False
        )
        scene.require("speed", not moving, f"speed 0 for locked joints ({', '.join(scene.locked)})")

    @cached_property
    def places(self) -> dict:
        """The kind of each joint of the robot and its indices in q and v, by name."""
        return dict(zip(self.robot.joints, self.robot.coordinates.places.joints))

    @property
    def name(self) -> str:
        return self.scene.name

    @property
    def duration(self) -> float:
        return self.scene.duration

    @property
    def steps(self) -> int:
        """The number of steps of length dt."""
        return self.scene.steps

    @property
    def is_free(self) -> bool:
        return self.scene.torque == "free"

    @property
    def is_held(self) -> bool:
        """Whether the exact motion is rest."""
        return self.scene.torque == "hold" and not any(self.scene.speed)

    @property
    def joints(self) -> tuple[str, ...]:
        """The names of the joints that are not locked."""
        return tuple(name for name in self.robot.joints if name not in self.scene.locked)

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.joints, tuple(self.places[name].kind for name in self.joints))

    @cached_property
    def controller(self) -> Controller | None:
        """The robot's own actuators, if they act."""
        if self.scene.torque != "servos":
            return None
        whole = self.robot.coordinates
        q = self.posture[whole.places.first_positions]
        targets = whole.from_degrees(np.broadcast_to(self.scene.targets, whole.nv), positions=False)
        return controller(self.robot.drive, self.scene.posture, q, targets)

    @cached_property
    def whole(self) -> tmt.Tree:
        """The robot's Tree with the damping, actuators and gravity of the scene; no joint is locked."""
        tree, scene = self.robot.tree, self.scene
        gravity = tree.gravity if scene.gravity else (0.0, 0.0, 0.0)
        gains = {name: getattr(self.controller, name) for name in GAINS} if self.controller else {}
        return dataclasses.replace(
            tree, damping=np.add(tree.damping, scene.damping), gravity=gravity, **gains
        )

    @property
    def locked(self) -> Mapping[str, float | tuple]:
        """The positions of the locked joints by name, rad or m; of a ball its quaternion."""
        values = {name: tuple(map(float, self.posture[place.q])) for name, place in self.places.items()}
        return {name: q if len(q) > 1 else q[0] for name, q in values.items() if name in self.scene.locked}

    @cached_property
    def tree(self) -> tmt.Tree:
        """The whole Tree without the locked joints."""
        return self.whole.lock(self.locked)

    @property
    def posture(self) -> np.ndarray:
        """Positions of all joints at t = 0, rad, (nq,)."""
        return self.robot.posture(self.scene.posture)

    @cached_property
    def q(self) -> np.ndarray:
        """Positions of the free joints at t = 0, rad, (nq,)."""
        return self.posture[self._free("q")]

    @cached_property
    def v(self) -> np.ndarray:
        """Speeds of the free joints at t = 0, rad/s, (nv,)."""
        whole = self.robot.coordinates
        return whole.from_degrees(self.scene.speed or (0.0,) * whole.nv, positions=False)[self._free("qd")]

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        return self.q, self.v

    @cached_property
    def tau(self) -> np.ndarray:
        """Torque at the free joints, N m, (nv,)."""
        torque = self.scene.torque
        if torque == "hold":
            torque = literal.gravity_balance(self.posture, self.whole)
            if self.whole.has_springs:
                torque = torque + literal.spring_torque(self.posture, self.whole)
        elif self.controller:
            torque = self.controller.torque
        elif torque == "free":
            torque = (0.0,) * self.robot.coordinates.nv
        return np.array(torque)[self._free("qd")]

    @property
    def added_damping(self) -> np.ndarray:
        """The damping that the scene adds to the free joints, N m s/rad, (nv,)."""
        return self.free(np.broadcast_to(self.scene.damping, self.robot.coordinates.nv))

    def free(self, values: np.ndarray) -> np.ndarray:
        """The entries of the free joints, of values for all speeds, (nv,)."""
        return values[self._free("qd")]

    def whole_positions(self, q: np.ndarray) -> np.ndarray:
        """Positions of all joints, (..., nq), from those of the free joints, (..., nq)."""
        whole = np.tile(self.posture, (*np.shape(q)[:-1], 1))
        whole[..., self._free("q")] = q
        return whole

    def _free(self, which):
        """The indices of the free joints in q or qd of all."""
        slices = [getattr(self.places[name], which) for name in self.joints]
        return [i for at in slices for i in range(at.start, at.stop)]

    def changed(self, **changes) -> "Case":
        """The same robot; the scene with other values."""
        return Case(self.robot, dataclasses.replace(self.scene, **changes))
