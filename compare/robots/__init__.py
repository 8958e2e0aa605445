"""What is known of one robot. Everything that only the assignment's arm has is in arm.py."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

import tmt

from .actuators import Drive
from .case import Case, Coordinates, Scene


class Printed(NamedTuple):
    """One printed answer."""

    item: str
    quantity: str  # "holding torque", "qdd" or "Mbar"
    posture: str
    values: tuple
    unit: str
    half_digit: float  # half a unit of the last printed digit
    torque: str = "none"  # or the item whose answer acts: the torque that holds its posture
    is_rounding: bool = False  # zero except for rounding: compared with the exact value, not with what is printed
    to_every_digit: tuple = ()  # who meets the digits of what is rounding alone, of "exact", "tmt"
    sizes: tuple = ()  # the joints whose component exact arithmetic shares in its size alone


class Question(NamedTuple):
    """One question of an assignment, and where its answer is found."""

    part: str
    asked: str
    answered_in: str
    answer: tuple  # of (kind, ...): ("figure", name), ("printed", items), ("largest", experiment, quantity, {column: value})


class Claims(NamedTuple):
    """What is claimed of a robot that is held at a posture with the torque that balances gravity there, by RK4."""

    dt: float  # s, the step of the claims
    duration: float  # s, of a run of the claims
    left: str  # the posture that is left, because of rounding
    left_after: float  # s, about
    kept: str  # the posture that is not left
    end: str  # the posture at which a run from `kept` is said to end
    printed_torque: str  # the item of the torque at `left` as it is printed
    of_scenes: Mapping[str, str]  # what is claimed of a scene, in words, by the scene's name
    figures: Mapping[str, int]  # the number of the figure that shows a scene, by the scene's name


class Conditioning(NamedTuple):
    """Where the condition number of Mbar is said to be largest: two joints by name, their angles, deg; the others at 0."""

    joints: tuple
    worst: tuple  # and, mirrored, with the other sign of the first


@dataclass(frozen=True, eq=False)
class Robot:
    """One robot: a file, the numbers that are stated of it, and what is asked of it.

    Scenes may have tags: "full only": a quick run leaves it out; "digits": compared with many digits of its own scheme (a small
    run takes the last of them); "speed": followed by every method; "regular": errors fall regularly there from coarse steps on;
    "fewer joints": some of its joints never move; "falls": a free body falls and nothing else moves; "own": a user's, or one
    made for a file, of which nothing is expected but agreement. A scene without tags is part of every run.
    """

    name: str
    mjcf: Path  # the file that MuJoCo runs
    tree: tmt.Tree  # the stated numbers
    postures: Mapping[
        str, tuple
    ]  # deg (of a slide m, of a ball a quaternion), by name; the joints in the order of the Tree
    scenes: tuple[Scene, ...]
    positions: Mapping[str, tuple] = field(default_factory=dict)  # further postures, as q of the Tree (rad, m), by name
    ranges: tuple = ()  # of each joint (low, high), rad or m, or None; (): none has one
    described: str = ""  # in a sentence: "a human arm"
    symbols: Mapping[str, str] = field(default_factory=dict)  # how a joint's name is written in a figure
    # centre, saddle, marginal: the posture that stands for it; resonant: a centre at which a swing of three steps grows
    kinds: Mapping[str, str] = field(default_factory=dict)
    landmarks: Callable | None = None  # q (n,) rad -> {name: point in m}, drawn as a chain; None: the joints' origins
    sketched: tuple[str, ...] = ()  # the postures of the sketch; none: the first two
    axes: tuple[str, str, str] = ("x", "y", "z")  # of the inertial frame, as they are written there
    printed: tuple[Printed, ...] = ()
    claims: Claims | None = None
    conditioning: Conditioning | None = None
    questions: tuple[Question, ...] = ()
    remarks: Callable | None = None  # (answers by item, dynamics by engine) -> sentences on what is printed
    # what a file has and how it is treated, see engines.mujoco.inventory; then the numbers are those that MuJoCo compiled
    features: tuple = ()
    drive: Drive = field(default_factory=Drive)  # actuators and what else acts beside gravity and springs
    stated_in: str = ""  # the solution, another file, whose numbers are stated of this one; "": none is
    features_stated: tuple = ()  # of the solution, as `features`
    own: tuple[
        str, ...
    ] = ()  # what a user's own equations give, "mass_matrix" ..., where they are compared; (): tmt's are

    @property
    def joints(self) -> tuple[str, ...]:
        return self.tree.hinge_names

    @property
    def compared(self) -> tuple[str, str]:
        """The names of the two engines that are compared."""
        return ("own" if self.own else "tmt"), "mujoco"

    @property
    def is_read(self) -> bool:
        """Whether its numbers are those of a file, as MuJoCo compiled it; else they are stated here."""
        return bool(self.features)

    @property
    def is_stated(self) -> bool:
        """Whether its numbers are stated apart from the file that MuJoCo runs: here, or in a solution."""
        return not self.is_read or bool(self.stated_in)

    @property
    def noun(self) -> str:
        """What a sentence calls it: a file may have any name."""
        return "robot" if self.is_read else self.name

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.joints, self.tree.kind)

    def posture(self, posture: str | tuple = ()) -> np.ndarray:
        """A posture by its name, or of angles in deg, lengths in m and quaternions (none: the reference): rad, (nq,)."""
        if isinstance(posture, str) and posture in self.positions:
            return np.array(self.positions[posture], dtype=float)
        posture = self.postures[posture] if isinstance(posture, str) else posture
        return self.coordinates.from_degrees(posture, positions=True) if posture else np.array(self.tree.zero)

    @property
    def poses(self) -> dict[str, np.ndarray]:
        """The named postures, rad, (nq,) each; all joints at zero if there are none."""
        named = {name: self.posture(name) for name in (*self.postures, *self.positions)}
        return named or {"all joints at zero": self.posture()}

    def case(self, name: str = "as it is", **changes) -> Case:
        """The robot with changes, the fields of a Scene."""
        return Case(self, Scene(name, **changes))

    @property
    def cases(self) -> tuple[Case, ...]:
        """Its scenes."""
        return tuple(Case(self, scene) for scene in self.scenes)

    @property
    def cases_of_torque(self) -> tuple[Case, ...]:
        """Those under constant torque, in which its own actuators do not act."""
        return tuple(case for case in self.cases if not case.controller)

    def with_scenes(self, scenes: tuple[Scene, ...]) -> "Robot":
        """The same robot with more scenes."""
        return replace(self, scenes=self.scenes + scenes)

    def with_joints(self, names: Sequence[str]) -> "Robot":
        """The same robot whose joints are called otherwise. names: of all, in the order of the Tree."""
        called = dict(zip(self.joints, names, strict=True))

        def renamed(joints: Sequence[str]) -> tuple[str, ...]:
            return tuple(called[joint] for joint in joints)

        return replace(
            self,
            tree=replace(self.tree, hinge_names=tuple(names)),
            scenes=tuple(replace(scene, locked=renamed(scene.locked)) for scene in self.scenes),
            symbols={called[joint]: symbol for joint, symbol in self.symbols.items()},
            printed=tuple(item._replace(sizes=renamed(item.sizes)) for item in self.printed),
            conditioning=self.conditioning and self.conditioning._replace(joints=renamed(self.conditioning.joints)),
        )

    def symbol(self, joint: str) -> str:
        return self.symbols.get(joint, joint)
