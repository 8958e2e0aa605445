"""A case: a robot with what a scene changes."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

import tmt
from tmt import literal
from tmt.model.lock import CLOSE_TO_ONE
from tmt.model.tree import GAINS

from .controller import Controller, controller
from .coordinates import Coordinates
from .coordinates import fastest_rates as fastest_rates
from .coordinates import rates_at as rates_at
from .given import some
from .scene import TORQUES as TORQUES
from .scene import Scene as Scene

SEED = 10  # of every random number in a report


@dataclass(frozen=True)
class Case:
    """A robot with what a scene changes. Raises ValueError, in one line, for what cannot be a scene of this robot."""

    robot: object  # a robots.Robot
    scene: Scene

    def __post_init__(self):
        names, scene, whole = self.robot.joints, self.scene, self.robot.coordinates
        sizes = {"posture": whole.nq, "torque": whole.nv, "speed": whole.nv}
        of_kinds = {"hinge": "deg", "slide": "m", "ball": "a quaternion"}
        units = ", ".join(of_kinds[kind] for kind in dict.fromkeys(whole.all_kinds))
        if isinstance(scene.posture, str):
            count = f"{whole.nq} numbers, one per joint ({some(whole.positions)})"
            named = self.robot.postures or self.robot.positions
            postures = [name for name, q in self.robot.poses.items() if len(q) == whole.nq and named]
            accepted = f"{', '.join(postures)} or {count}, in {units}" if postures else f"{count}, in {units}"
            scene.refuse("posture", scene.posture not in postures, accepted)
        for name, unit in (("posture", units), ("torque", "N m"), ("speed", "deg/s")):
            value = getattr(scene, name)
            left_out = name != "torque" and value == ()
            known = isinstance(value, str) or len(value) == sizes[name] or left_out
            each = whole.positions if name == "posture" else whole.speeds
            scene.refuse(name, not known, f"{sizes[name]} numbers, one per joint ({some(each)}), in {unit}")
        if not isinstance(scene.posture, str) and scene.posture:
            for joint in whole.places.balls:
                wrong = abs(np.linalg.norm(scene.posture[joint.q]) - 1.0) > CLOSE_TO_ONE
                scene.refuse("posture", wrong, "a quaternion w, x, y, z of length 1 for each ball")
        known = not isinstance(scene.damping, tuple) or len(scene.damping) == whole.nv
        scene.refuse("damping", not known, f"one number, or {whole.nv}, one per joint ({some(whole.speeds)}),")
        one, kinds = not isinstance(scene.targets, tuple), {*whole.all_kinds} - {"ball"}
        known = scene.targets == 0.0 or len(kinds) < 2 if one else len(scene.targets) == whole.nv
        scene.refuse("targets", not known, f"{whole.nv} numbers, one per joint ({some(whole.speeds)}), in {units},")
        if scene.torque == "servos":
            idle = all(u is None for u in self.controller.controls)
            scene.refuse("torque", idle, "free, hold or numbers, as no actuator of this robot takes part,")
            scene.refuse("locked", scene.locked, "no locked joint where servos act")
        unknown = [name for name in scene.locked if name not in names]
        most = f"a tuple of at most {len(names) - 1} of {some(names)}"
        scene.refuse("locked", unknown or len(scene.locked) >= len(names), most)
        moving = [
            name
            for name, joint in zip(names, whole.places.joints)
            if name in scene.locked and any(scene.speed[joint.qd])
        ]
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
        kinds = tuple(
            kind for name, kind in zip(self.robot.joints, self.robot.tree.kind) if name not in self.scene.locked
        )
        return Coordinates(self.joints, kinds)

    @cached_property
    def controller(self) -> Controller | None:
        """What the robot's own actuators do, if they act."""
        if self.scene.torque != "servos":
            return None
        whole = self.robot.coordinates
        q = np.array([self.posture[at.start] for at, by in whole.places.places for _ in range(by.start, by.stop)])
        targets = whole.from_degrees(np.broadcast_to(self.scene.targets, whole.nv), positions=False)
        return controller(self.robot.drive, self.scene.posture, q, targets)

    @cached_property
    def whole(self) -> tmt.Tree:
        """The robot's Tree with the scene's damping added, its actuators, and without gravity if the scene has none.

        No joint is locked.
        """
        tree, scene = self.robot.tree, self.scene
        gravity = tree.gravity if scene.gravity else (0.0, 0.0, 0.0)
        gains = {name: getattr(self.controller, name) for name in GAINS} if self.controller else {}
        return dataclasses.replace(tree, damping=np.add(tree.damping, scene.damping), gravity=gravity, **gains)

    @property
    def locked(self) -> Mapping[str, float | tuple]:
        """The positions of the locked joints, rad or m, of a ball its quaternion, by their names."""
        held = {}
        for name, (kind, at, _) in zip(self.robot.joints, self.robot.coordinates.places.joints):
            if name in self.scene.locked:
                values = tuple(map(float, self.posture[at]))
                held[name] = values if kind == "ball" else values[0]
        return held

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
        """q and v."""
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
        """What the scene adds to the damping of the free joints, N m s/rad, (nv,)."""
        return np.broadcast_to(self.scene.damping, self.robot.coordinates.nv)[self._free("qd")]

    def free(self, values: np.ndarray) -> np.ndarray:
        """Of one value for each speed of all joints, (nv,), those of the free ones."""
        return values[self._free("qd")]

    def whole_positions(self, q: np.ndarray) -> np.ndarray:
        """Positions of all joints, (..., nq), where the free ones are at q, (..., their nq)."""
        return self._whole(self.posture, q, "q")

    def whole_speeds(self, v: np.ndarray) -> np.ndarray:
        """Speeds of all joints, (..., nv), where the free ones have v, (..., their nv)."""
        return self._whole(np.zeros(self.robot.coordinates.nv), v, "qd")

    def _whole(self, locked, values, which):
        """Values of the free joints among those of the locked ones."""
        whole = np.tile(locked, (*np.shape(values)[:-1], 1))
        whole[..., self._free(which)] = values
        return whole

    def _free(self, which):
        """The places of the free joints in q or qd of all."""
        whole = self.robot.coordinates.places
        places = [getattr(joint, which) for name, joint in zip(self.robot.joints, whole.joints) if name in self.joints]
        return [i for place in places for i in range(place.start, place.stop)]

    def changed(self, **changes) -> "Case":
        """The same robot in a scene with other values."""
        return Case(self.robot, dataclasses.replace(self.scene, **changes))
