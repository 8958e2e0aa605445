"""Scenes and cases: a scene states changes, a case is a robot with a scene."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

import tmt
from tmt import literal
from tmt.derivation.coordinates import Joint
from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.tree import GAINS

from ..core.words import some_of
from .actuators import Controller, controller
from .coordinates import KINDS as KINDS
from .coordinates import Coordinates as Coordinates
from .coordinates import fastest_rates as fastest_rates
from .coordinates import rates_at as rates_at
from .validation import WrongField, are_numbers, is_number

if TYPE_CHECKING:
    from .robot import Robot

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
    tags: tuple[str, ...] = ()  # see robots.Robot

    def __post_init__(self) -> None:
        is_name = isinstance(self.name, str) and bool(self.name.strip()) and self.name.isprintable()
        self.require("name", is_name, "a text in one line, not empty")
        is_posture = isinstance(self.posture, str) or are_numbers(self.posture)
        self.set("posture", is_posture, "the name of a posture, or numbers")
        is_torque = self.torque in TORQUES if isinstance(self.torque, str) else are_numbers(self.torque)
        self.set("torque", is_torque, "free, hold, servos, or a torque in N m for each joint")
        self.set("speed", are_numbers(self.speed), "a speed in deg/s for each joint")
        for name, time in (("duration", self.duration), ("dt", self.dt)):
            is_time = is_number(time) and TIMES[0] <= time <= TIMES[1]
            self.set(name, is_time, f"a time from {TIMES[0]:g} to {TIMES[1]:g} s")
        accepted = "a number of at least 0 N m s/rad, or one for each joint"
        self.set("damping", is_each(self.damping) and np.min(self.damping) >= 0.0, accepted)
        self.set("targets", is_each(self.targets), "a movement in deg (m), of all joints or each")
        self.require("targets", not np.any(self.targets) or self.torque == "servos", 'torque = "servos"')
        self.require("gravity", isinstance(self.gravity, bool | np.bool_), "true or false")
        object.__setattr__(self, "gravity", bool(self.gravity))
        divides = abs(self.steps * self.dt - self.duration) <= 1e-9 * self.duration and self.steps >= 1
        accepted = f"a step that divides {self.duration:g} s into at most {MAX_STEPS:,} steps"
        self.require("dt", divides and self.duration / self.dt <= MAX_STEPS, accepted)
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


def is_each(value: Any) -> bool:
    """Whether a value is a number, or a sequence of numbers that is not empty."""
    return is_number(value) or (are_numbers(value) and np.size(value) > 0)


@dataclass(frozen=True)
class Case:
    """A robot with a scene. Raises WrongField if this robot cannot have the scene."""

    robot: "Robot"
    scene: Scene

    def __post_init__(self) -> None:
        scene, names, coordinates = self.scene, self.robot.joints, self.robot.coordinates
        self.require_posture()
        units = {"torque": "{0.force}", "speed": "{0.speed_given}", "damping": "{0.force} s/{0.unit}"}
        for name, unit in (units | {"targets": "{0.movement_given}"}).items():
            value = getattr(scene, name)
            is_each = isinstance(value, tuple) and (value or name != "speed")
            scene.require(name, not is_each or len(value) == coordinates.nv, self.counted("speeds", unit))
        has_units = len({*coordinates.all_kinds} - {"ball"}) > 1  # of several kinds
        is_mixed = has_units and isinstance(scene.targets, float) and scene.targets != 0.0
        scene.require("targets", not is_mixed, self.counted("speeds", "{0.movement_given}"))
        if scene.torque == "servos":
            acts = self.controller is not None and any(u is not None for u in self.controller.controls)
            scene.require("torque", acts, "free, hold or numbers: this robot has no actuator that takes part")
            scene.require("locked", not scene.locked, "no locked joint together with servos")
        is_right = set(scene.locked) <= set(names) and len(scene.locked) < len(names)
        scene.require("locked", is_right, f"at most {len(names) - 1} of {some_of(names)}")
        locked = [coordinates.by_name[name] for name in scene.locked]
        moving = any(any(scene.speed[joint.qd]) for joint in locked)
        scene.require("speed", not moving, f"speed 0 for locked joints ({', '.join(scene.locked)})")

    def require_posture(self) -> None:
        """WrongField unless the posture is a name of the robot's, or one number per position and quaternions of length 1."""
        scene, robot, coordinates = self.scene, self.robot, self.robot.coordinates
        count = self.counted("positions", "{0.position_given}")
        if isinstance(scene.posture, str):
            named = [*robot.postures, *robot.positions]
            postures = [name for name in named if len(robot.posture(name)) == coordinates.nq]
            accepted = " or ".join(filter(None, [", ".join(postures), count]))
            scene.require("posture", scene.posture in postures, accepted)
        elif scene.posture:
            scene.require("posture", len(scene.posture) == coordinates.nq, count)
            for joint in coordinates.places.balls:
                is_unit = abs(np.linalg.norm(scene.posture[joint.q]) - 1.0) <= CLOSE_TO_ONE
                scene.require("posture", bool(is_unit), "a quaternion w, x, y, z of length 1 for each ball")

    def counted(self, what: str, unit: str) -> str:
        """How many numbers are accepted for the positions or the speeds of all joints, and in which units of a Kind."""
        names: tuple[str, ...] = getattr(self.robot.coordinates, what)
        units = dict.fromkeys(unit.format(KINDS[kind]) for kind in self.robot.coordinates.all_kinds)
        return f"{len(names)} numbers, one per joint ({some_of(names)}), in {', '.join(units)}"

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
        return Coordinates(self.joints, tuple(joint.kind for joint in self.unlocked))

    @cached_property
    def unlocked(self) -> tuple[Joint, ...]:
        """The joints that are not locked, with their places in q and v of all joints."""
        by_name = self.robot.coordinates.by_name
        return tuple(by_name[name] for name in self.joints)

    @cached_property
    def controller(self) -> Controller | None:
        """The robot's own actuators, if they act."""
        if self.scene.torque != "servos":
            return None
        coordinates = self.robot.coordinates
        q = self.posture[coordinates.places.first_positions]
        targets = np.broadcast_to(self.scene.targets, coordinates.nv)
        moved = coordinates.from_degrees(targets, positions=False)
        return controller(self.robot.drive, self.scene.posture, q, moved)

    @cached_property
    def unlocked_tree(self) -> tmt.Tree:
        """The robot's Tree with the damping, actuators and gravity of the scene; no joint is locked."""
        tree, scene = self.robot.tree, self.scene
        gravity = tree.gravity if scene.gravity else (0.0, 0.0, 0.0)
        gains = {name: getattr(self.controller, name) for name in GAINS} if self.controller else {}
        damping = tuple(np.add(tree.damping, scene.damping).tolist())
        return dataclasses.replace(tree, damping=damping, gravity=gravity, **gains)

    @property
    def locked(self) -> Mapping[str, float | tuple[float, ...]]:
        """The positions of the locked joints by name, rad or m; of a ball its quaternion."""
        joints = [name for name in self.robot.joints if name in self.scene.locked]
        by_name, posture = self.robot.coordinates.by_name, self.posture.tolist()
        positions = {name: posture[by_name[name].q] for name in joints}
        return {name: tuple(q) if len(q) > 1 else q[0] for name, q in positions.items()}

    @cached_property
    def tree(self) -> tmt.Tree:
        """The robot's Tree in the scene, without the locked joints."""
        return self.unlocked_tree.lock(self.locked)

    @property
    def posture(self) -> np.ndarray:
        """Positions of all joints at t = 0, rad, (nq,)."""
        return self.robot.posture(self.scene.posture)

    @cached_property
    def q(self) -> np.ndarray:
        """Positions of the unlocked joints at t = 0, rad, (nq,)."""
        return self.posture[self.indices("q")]

    @cached_property
    def v(self) -> np.ndarray:
        """Speeds of the unlocked joints at t = 0, rad/s, (nv,)."""
        coordinates = self.robot.coordinates
        speeds = self.scene.speed or (0.0,) * coordinates.nv
        return coordinates.from_degrees(speeds, positions=False)[self.indices("qd")]

    @property
    def start(self) -> tuple[np.ndarray, np.ndarray]:
        return self.q, self.v

    @cached_property
    def tau(self) -> np.ndarray:
        """Torque at the unlocked joints, N m, (nv,)."""
        torque: Any = self.scene.torque
        if torque == "hold":
            torque = literal.gravity_balance(self.posture, self.unlocked_tree)
            if self.unlocked_tree.has_springs:
                torque = torque + literal.spring_torque(self.posture, self.unlocked_tree)
        elif self.controller:
            torque = self.controller.torque
        elif torque == "free":
            torque = np.zeros(self.robot.coordinates.nv)
        return np.array(torque)[self.indices("qd")]

    @property
    def added_damping(self) -> np.ndarray:
        """The damping that the scene adds to the unlocked joints, N m s/rad, (nv,)."""
        return np.broadcast_to(self.scene.damping, self.robot.coordinates.nv)[self.indices("qd")]

    def indices(self, of: Literal["q", "qd"]) -> np.ndarray:
        """The indices of the unlocked joints in q or v of all joints."""
        return np.r_[tuple(getattr(joint, of) for joint in self.unlocked)]

    def positions_of_all(self, q: np.ndarray) -> np.ndarray:
        """Positions of all joints, (..., nq), from those of the unlocked joints, (..., nq)."""
        positions = np.tile(self.posture, (*np.shape(q)[:-1], 1))
        positions[..., self.indices("q")] = q
        return positions

    def changed(self, **changes: Any) -> "Case":
        """The same robot; the scene with other values."""
        return Case(self.robot, dataclasses.replace(self.scene, **changes))
