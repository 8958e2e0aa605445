"""The description of a robot."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

import tmt

from ..core.finding import Finding
from ..core.words import capital
from .actuators import Drive
from .case import Case, Scene
from .coordinates import Coordinates

Range = tuple[float, float] | None  # of a joint, rad or m; None: unlimited
Numbers = tuple[float, ...]


class Printed(NamedTuple):
    item: str
    quantity: str  # "holding torque", "qdd" or "Mbar"
    posture: str
    values: ArrayLike
    unit: str
    half_digit: float  # half a unit of the last printed digit
    torque: str = "none"  # or the item whose result is applied
    is_rounding: bool = False  # zero except for rounding: compared with the exact value
    to_every_digit: tuple[str, ...] = ()  # "exact", "tmt": computations that reproduce the digits of rounding
    sizes: tuple[str, ...] = ()  # joints whose component agrees with exact arithmetic only in size


class Question(NamedTuple):
    """A question of the assignment, and where the report answers it."""

    part: str
    question: str
    answered_in: str
    # (kind, ...): ("figure", name), ("printed", items), ("largest", experiment, quantity, {column: value})
    answer: tuple[Any, ...]


class Claims(NamedTuple):
    """Claims about RK4 runs of a robot that is held at a posture by the torque that balances gravity."""

    dt: float  # s
    duration: float  # s
    left: str  # posture that the robot leaves because of rounding
    left_after: float  # s, about
    kept: str  # posture that it keeps
    end: str  # claimed last posture of a run from `kept`
    of_scenes: Mapping[str, str]  # the claim in words, by scene
    figures: Mapping[str, int]  # number of the printed figure, by scene


@dataclass(frozen=True)
class Feature:
    """What a file has beside masses and frames, see engines.mujoco.inventory."""

    feature: str
    names: tuple[str, ...]  # of the elements that have it
    treatment: str  # modelled, switched_off, open_tree, left_out
    reason: str

    @property
    def count(self) -> int:
        return len(self.names)


@dataclass(frozen=True, eq=False)
class Robot:
    """A robot: a file for MuJoCo, the numbers that are compared with it, and scenes.

    Tags of scenes: "full only": not in a quick run; "speed": every method is run; "regular": errors are regular from large steps
    on; "falls": a free body falls and nothing else moves; "own": only agreement is expected; "user": of a user.
    """

    name: str
    mjcf: Path  # the file that MuJoCo runs
    tree: tmt.Tree  # the stated numbers
    postures: Mapping[str, Numbers]  # by name, deg (m, quaternion), joints in the order of the Tree
    scenes: tuple[Scene, ...]
    positions: Mapping[str, Numbers] = field(default_factory=dict)  # further postures as q (rad, m), by name
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
    drive: Drive = field(default_factory=Drive)  # its actuators
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
        if isinstance(posture, str) and posture in self.positions:
            return np.array(self.positions[posture], dtype=float)
        numbers = self.postures[posture] if isinstance(posture, str) else posture
        return self.coordinates.from_degrees(numbers, positions=True) if numbers else np.array(self.tree.zero)

    @property
    def poses(self) -> dict[str, np.ndarray]:
        """The named postures, rad, (nq,) each; if there are none, all joints at zero."""
        named = {name: self.posture(name) for name in (*self.postures, *self.positions)}
        return named or {"all joints at zero": self.posture()}

    def case(self, name: str = "as it is", **changes: Any) -> Case:
        """The robot with changes, the fields of a Scene."""
        return Case(self, Scene(name, **changes))

    @property
    def cases(self) -> tuple[Case, ...]:
        return tuple(Case(self, scene) for scene in self.scenes)

    @property
    def cases_of_torque(self) -> tuple[Case, ...]:
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
