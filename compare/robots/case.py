"""What is compared: a robot, and cases of it, each with a scene that states changes."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np

import tmt
from tmt import literal
from tmt.model.tree import GAINS

from ..core.finding import Finding
from ..core.words import capital
from .actuators import Controller, Drive
from .coordinates import Coordinates as Coordinates
from .coordinates import rates_at as rates_at
from .printed import Claims, Feature, Printed, Question
from .scene import SEED as SEED
from .scene import Scene as Scene

Range = tuple[float, float] | None  # of a joint, rad or m; None: unlimited
Numbers = tuple[float, ...]


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot: a file for MuJoCo, the numbers that are compared with it, and scenes.

    Tags of scenes: "full only": not in a quick run; "speed": every method is run; "regular": errors are
    regular from large steps on; "falls": a free body falls and nothing else moves; "own": of a user or a
    file, only agreement is expected.
    """

    name: str
    mjcf: Path  # the file that MuJoCo runs
    tree: tmt.Tree  # the stated numbers
    postures: Mapping[str, Numbers]  # by name, q (rad, m, quaternions), joints in the order of the Tree
    scenes: tuple[Scene, ...]
    ranges: tuple[Range, ...] = ()  # of each joint; (): no ranges
    described: str = ""  # in a sentence: "a human arm"
    symbols: Mapping[str, str] = field(default_factory=dict)  # of joints, for figures
    # posture of a centre, a saddle, a marginal equilibrium
    kinds: Mapping[str, str] = field(default_factory=dict)
    # q (times, n) rad -> points, m, drawn as a chain; None: origins of the joints
    landmarks: Callable[[np.ndarray], list[Any]] | None = None
    sketched: tuple[str, ...] = ()  # postures of the sketch; (): the first two
    axes: tuple[str, str, str] = ("x", "y", "z")  # labels of the inertial frame
    printed: tuple[Printed, ...] = ()
    claims: Claims | None = None
    questions: tuple[Question, ...] = ()
    # (answers by item, dynamics by engine) -> Findings about the printed results
    remarks: Callable[[Mapping[str, Any], Mapping[str, Any]], list[Finding]] | None = None
    features: tuple[Feature, ...] = ()  # of a file; its numbers are those that MuJoCo compiled
    drive: Drive | None = None  # its actuators
    stated_in: str = ""  # another file, the solution, with the numbers for this one; "": none
    features_stated: tuple[Feature, ...] = ()  # of the solution, as `features`
    own: tuple[str, ...] = ()  # functions of a user's equations, "mass_matrix" ...; (): tmt's are compared

    @property
    def joints(self) -> tuple[str, ...]:
        return self.tree.joint_names

    @property
    def compared(self) -> tuple[str, str]:
        """The names of the two engines that are compared."""
        return ("own" if self.own else "tmt"), "mujoco"

    @property
    def is_read(self) -> bool:
        """Whether its numbers are from a file that MuJoCo compiled."""
        return bool(self.features)

    @property
    def is_stated(self) -> bool:
        """Whether its numbers are independent of the file that MuJoCo runs: stated here or in a solution."""
        return not self.is_read or bool(self.stated_in)

    @property
    def noun(self) -> str:
        """Its name in sentences; a file may have any name."""
        return "robot" if self.is_read else self.name

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.joints, self.tree.kind)

    def posture(self, posture: str | Numbers = ()) -> np.ndarray:
        """q (nq,), rad, of a posture: its name, or numbers in deg, m and quaternions; (): all zero."""
        if isinstance(posture, str):
            return np.array(self.postures[posture], dtype=float)
        return self.coordinates.from_degrees(posture, positions=True) if posture else np.array(self.tree.zero)

    @property
    def poses(self) -> dict[str, np.ndarray]:
        """The named postures, rad, (nq,) each; if there are none, all joints at zero."""
        named = {name: self.posture(name) for name in self.postures}
        return named or {"all joints at zero": self.posture()}

    def case(self, name: str = "as it is", **changes: Any) -> "Case":
        """The robot with changes, the fields of a Scene."""
        return Case(self, Scene(name, **changes))

    @cached_property
    def cases(self) -> "tuple[Case, ...]":
        return tuple(Case(self, scene) for scene in self.scenes)

    @property
    def cases_of_torque(self) -> "tuple[Case, ...]":
        """The cases without its own actuators."""
        return tuple(case for case in self.cases if not case.controller)

    def scene_begins(self, name: str) -> str:
        """A scene's name at the beginning of a sentence; the name of a user's scene stays as it is."""
        is_own = any(scene.name == name and "own" in scene.tags for scene in self.scenes)
        return f"Scene {name}" if is_own else capital(name)

    def with_scenes(self, scenes: tuple[Scene, ...]) -> "Robot":
        return replace(self, scenes=self.scenes + scenes)

    def with_joints(self, names: Sequence[str]) -> "Robot":
        """The same robot with other names of its joints, in the order of the Tree."""
        new_name = dict(zip(self.joints, names, strict=True))

        def renamed(joints: Sequence[str]) -> tuple[str, ...]:
            return tuple(new_name[joint] for joint in joints)

        return replace(
            self,
            tree=replace(self.tree, joint_names=tuple(names)),
            scenes=tuple(replace(scene, locked=renamed(scene.locked)) for scene in self.scenes),
            symbols={new_name[joint]: symbol for joint, symbol in self.symbols.items()},
            printed=tuple(item._replace(sizes=renamed(item.sizes)) for item in self.printed),
        )

    def symbol(self, joint: str) -> str:
        return self.symbols.get(joint, joint)


@dataclass(frozen=True)
class Case:
    """A robot with a scene. Raises WrongField if this robot cannot have the scene."""

    robot: Robot
    scene: Scene

    def __post_init__(self) -> None:
        scene = self.scene
        scene.require_coordinates(self.robot.coordinates, self.robot.postures)
        if scene.torque == "servos":
            acts = self.controller is not None and any(u is not None for u in self.controller.controls)
            scene.require("torque", acts, "free, hold or numbers: this robot has no actuator that takes part")

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
        by_name = self.robot.coordinates.by_name
        return Coordinates(self.joints, tuple(by_name[name].kind for name in self.joints))

    @cached_property
    def controller(self) -> Controller | None:
        """The robot's own actuators, if they act."""
        if self.scene.torque != "servos" or self.robot.drive is None:
            return None
        targets = np.broadcast_to(self.scene.targets, self.robot.coordinates.nv)
        moved = self.robot.coordinates.from_degrees(targets, positions=False)
        return self.robot.drive.controller(self.scene.posture, self.posture, moved)

    @cached_property
    def unlocked_tree(self) -> tmt.Tree:
        """The robot's Tree with the damping, actuators and gravity of the scene; no joint is locked."""
        tree, scene = self.robot.tree, self.scene
        gravity = tree.gravity if scene.gravity else (0.0, 0.0, 0.0)
        gains = {name: getattr(self.controller, name) for name in GAINS} if self.controller else {}
        damping = tuple(np.add(tree.damping, scene.damping).tolist())
        return replace(tree, damping=damping, gravity=gravity, **gains)

    @property
    def locked(self) -> Mapping[str, float | tuple[float, ...]]:
        """The positions of the locked joints by name, rad or m; of a ball its quaternion."""
        by_name, posture = self.robot.coordinates.by_name, self.posture.tolist()
        positions = {name: posture[joint.q] for name, joint in by_name.items() if name in self.scene.locked}
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
            torque = literal.gravity_balance(self.unlocked_tree, self.posture)
            if self.unlocked_tree.has_springs:
                torque = torque + literal.spring_torque(self.unlocked_tree, self.posture)
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
        by_name = self.robot.coordinates.by_name
        return np.r_[tuple(getattr(by_name[name], of) for name in self.joints)]

    def positions_of_all(self, q: np.ndarray) -> np.ndarray:
        """Positions of all joints, (..., nq), from those of the unlocked joints, (..., nq)."""
        positions = np.tile(self.posture, (*np.shape(q)[:-1], 1))
        positions[..., self.indices("q")] = q
        return positions

    def changed(self, **changes: Any) -> "Case":
        """The same robot; the scene with other values."""
        return Case(self.robot, replace(self.scene, **changes))
