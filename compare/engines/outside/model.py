"""What an engine has made of a robot's file: the class that its module derives, and the numbers of a Tree in the same shapes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, NamedTuple, TypedDict

import numpy as np

import tmt
from tmt.derivation.method import joint_frames
from tmt.methods import by_speed

from ...robots.case import SEED
from ...robots.coordinates import Coordinates, free_joints, point_inertia
from .. import Array, Course

Numbers = Mapping[str, Array]
# what an engine reads: the robot's file, the model that MuJoCo compiled, or a URDF that this program writes of that
FROM_FILE, FROM_COMPILED, FROM_URDF = "file", "compiled", "urdf"


class File(NamedTuple):
    """A robot's file, and the joints of the Tree that is compared."""

    path: Path  # MJCF or URDF
    # of the joints; a free joint b is `b x`, `b y`, `b z` (slides) and `b turn` (a ball)
    names: tuple[str, ...]
    kinds: tuple[str, ...]  # hinge, slide or ball

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.names, self.kinds)

    @property
    def free(self) -> tuple[str, ...]:
        """The names of the free joints, as the file has them."""
        balls = [name for name, kind in zip(self.names, self.kinds) if kind == "ball"]
        names = [name.removesuffix(" turn") for name in balls]
        return tuple(name for name in names if f"{name} x" in self.names)

    def is_free(self, joint: int) -> bool:
        """Whether a joint of the Tree is the ball of a free joint."""
        return self.names[joint].removesuffix(" turn") in self.free


class Body(NamedTuple):
    """A body, or bodies that move as one; of those that are combined in common axes."""

    mass: float  # kg
    com: Array  # (3,) m
    inertia: Array  # (3, 3) kg m2, about the centre of mass


class Link(NamedTuple):
    """A body as engines list it."""

    name: object  # of the engine: text or a number
    parent: object
    joint: int | None  # of the Tree, by which it moves on its parent; None: it is fixed there
    body: Body


class EngineError(ValueError):
    """An engine fails; the message says why, in one line."""


class Unread(EngineError):
    """An engine cannot read a file; the message is the engine's."""


class OtherJoints(EngineError):
    """An engine has read other joints than the file has."""


class OtherNames(EngineError):
    """An engine gives a joint another name, by which this program does not find it."""


class Unasked(EngineError):
    """This program does not ask an engine about such a robot: a limit of its module here, not of the engine."""


class Unwritten(EngineError):
    """A URDF cannot have what the robot has; the engine was not asked."""


class TooLong(EngineError):
    """An engine does not answer within the time limit."""


class Reading(TypedDict):
    """What an engine has read, by the names of ReadModel.numbers."""

    read: dict[str, Array]
    stated: Numbers
    copied: (
        tuple[str, str] | None
    )  # of the error for which the engine has read a copy, see mjcf_text: its kind, its message
    way: str  # ReadModel.way
    lacking: tuple[str, ...]  # ReadModel.drops that the robot has
    unwritten: tuple[str, ...]  # ReadModel.unwritten that differ, and are set now
    mended: dict[str, bool]  # of the numbers that differ: whether they are set now
    seconds: float  # until the model was there
    has: set[str]  # the quantities that it gives


class ReadModel:
    """What an engine has made of a file; a base class.

    All methods take and return numbers in the Tree's order of joints and in MuJoCo's conventions: q with quaternions w x y z; of
    a free joint the position and velocity of the body's origin in the world, and the angular velocity in body axes. Units: rad,
    m, N m, N. No contacts, limits, actuators or friction losses act. The quantities of one state; q (nq,), v, tau (nv,).
    """

    # numbers of the Tree that its equations do not have at all: they act as part of the torque
    drops: ClassVar[tuple[str, ...]] = ()
    way: ClassVar[str] = FROM_FILE
    unwritten: ClassVar[tuple[str, ...]] = ()  # numbers that a URDF cannot state
    has_places: ClassVar[bool] = False  # whether it tells where bodies and joints are
    copied: tuple[str, str] | None = None  # why it has read a copy of the file
    stated: Numbers = MappingProxyType({})  # before its numbers are read: numbers_of the Tree
    reading: Reading

    def __init__(self, file: File, precision: str):
        """Read the file; Unread if that is not possible."""
        raise NotImplementedError

    @property
    def lacks(self) -> tuple[str, ...]:
        """Quantities that it cannot give for this robot."""
        return ()

    def numbers(self) -> Numbers:
        """What it has read, by name; a name that is missing: it does not tell.

        gravity (3,) m/s2; mass (joints,) kg and moments (joints, 3) kg m2, ascending: of all bodies together that move with a
        joint and not with the next one, 0 if there is none, about their common centre of mass; armature, damping, stiffness
        (nv,); rest (nq,) rad, m and quaternions: where the springs are without force. Of the same bodies com (joints, 3) m, the
        centre of mass, and inertia (joints, 3, 3) kg m2 about it: in the world, at the positions `reference` of `stated`. Of
        the joints there axis (joints, 3) and anchor (joints, 3) m, on the axis of a hinge next to the stated one, at the
        centre of a ball; 0 where that says nothing. com_moved, axis_moved and anchor_moved are those at the positions `moved`.
        """
        q = self.stated["reference"] if self.has_places else np.zeros(0)
        mass, com, inertia = map(np.array, zip(*map(combined, self.bodies(q))))
        numbers = {**self.fields(), "mass": mass, "moments": np.linalg.eigvalsh(inertia)}
        if self.has_places:
            numbers |= {"com": com, "inertia": inertia, **self.lines(q, "")}
            moved = self.stated["moved"]
            bodies = map(combined, self.bodies(moved))
            numbers |= {"com_moved": np.array([body.com for body in bodies]), **self.lines(moved, "_moved")}
        return numbers

    def lines(self, q: Array, ending: str) -> Numbers:
        """axis and anchor of `numbers` at positions q."""
        axis, anchor = (self.stated[f"{name}{ending}"].copy() for name in ("axis", "anchor"))
        for joint, (linear, angular, point) in self.twists(q).items():
            if not axis[joint].any():  # a ball
                anchor[joint] = point * anchor[joint].any()
                continue
            axis[joint] = angular if angular.any() else linear
            if angular.any():
                on_axis = point + np.cross(angular, linear)
                anchor[joint] = on_axis + (anchor[joint] - on_axis) @ angular * angular
        return {f"axis{ending}": axis, f"anchor{ending}": anchor}

    def twists(self, q: Array) -> Mapping[int, tuple[Array, Array, Array]]:
        """Of joints of the Tree, at positions q: velocity of a point of the moved body per unit of speed, angular velocity, and
        the point, in the world; of a ball zero, zero and its centre."""
        raise NotImplementedError

    def fields(self) -> Numbers:
        """What it has read that is not of bodies."""
        raise NotImplementedError

    def bodies(self, q: Array) -> Sequence[Sequence[Body]]:
        """Of each joint the bodies that move with it and not with the next one; where has_places at positions q."""
        raise NotImplementedError

    def mend(self, name: str, values: Array) -> bool:
        """Set numbers that it has read differently, of the same shape as in `numbers`; False: that is not possible."""
        return False

    def mass_matrix(self, q: Array) -> Array:
        """M (nv, nv), with the armature."""
        raise NotImplementedError

    def bias(self, q: Array, v: Array) -> Array:
        """h (nv,): Coriolis, centrifugal and gravity terms, with the sign of MuJoCo's qfrc_bias; no springs, no damping."""
        raise NotImplementedError

    def acceleration(self, q: Array, v: Array, force: Array) -> Array:
        """(nv,), from M a = force - h by the engine's own forward dynamics; damping and springs are part of the force."""
        raise NotImplementedError

    def derivatives(self, q: Array, v: Array, force: Array) -> Array:
        """Of `acceleration` by movements of q, by v and by the force, (3, nv, nv), by the engine's own derivatives."""
        raise NotImplementedError

    def prepare(self, course: Course) -> None:
        """What a run needs that does not depend on its start and length: objects, compiled code."""

    def step_alone(self, course: Course) -> Callable[[], object] | None:
        """A function that makes a step of a run once more, and nothing else; None: no Python runs between steps."""
        return None

    def batch(self, course: Course) -> tuple[Callable[[], Array], str]:
        """A function that follows many worlds to the end of a course and returns q of the first, and the device's name.

        q, v and tau of the course are those of the worlds, (worlds, n).
        """
        raise NotImplementedError

    def run(self, course: Course) -> tuple[Array, int | None]:
        """States (nq + nv,) at the times as (times, nq + nv), fewer if it breaks off; and its evaluations.

        The damping and the springs of the file act.
        """
        raise NotImplementedError


def numbers_of(tree: tmt.Tree) -> dict[str, Array]:
    """The Tree's numbers in the shapes of ReadModel.numbers; and about_origin (joints,): mass x com^2 from the joint, kg m2."""
    nv, zero = tree.coordinates.nv, np.array(tree.zero)
    moved = Coordinates(tree.joint_names, tree.kind).random(np.random.default_rng(SEED), 1)[0]
    (mass, com, inertia, origins, axis), of_moved = placed(tree, zero), placed(tree, moved)
    numbers = {"mass": mass, "com": com, "moments": np.linalg.eigvalsh(inertia), "inertia": inertia}
    numbers |= {"axis": axis, "com_moved": of_moved[1], "axis_moved": of_moved[4], "moved": moved}
    has_anchor = np.array([[kind != "slide"] for kind in tree.kind])
    numbers |= {"anchor": origins * has_anchor, "anchor_moved": of_moved[3] * has_anchor}
    for first in free_joints(tree):  # their speeds are in no engine those of an axis
        for name in ("axis", "anchor", "axis_moved", "anchor_moved"):
            numbers[name][first : first + 4] = 0.0
    speeds = {"armature": tree.armature, "damping": tree.damping, "stiffness": by_speed(tree, tree.stiffness)}
    for name, values in speeds.items():
        numbers[name] = np.broadcast_to(np.array(values or 0.0, float), nv)
    numbers["about_origin"] = mass * ((com - origins) ** 2).sum(axis=1)
    others = {"gravity": tree.gravity, "rest": tree.rest, "reference": tree.zero}
    return numbers | {name: np.array(values, float) for name, values in others.items()}


def placed(tree: tmt.Tree, q: Array) -> tuple[Array, ...]:
    """mass, com and inertia of ReadModel.numbers at positions q of a Tree; origin and axis of each joint, (joints, 3)."""
    frames = joint_frames(tree, q.tolist())
    origins = np.array([[*frame.origin] for frame in frames])
    turns = np.array([[[*row] for row in frame.turn] for frame in frames])
    axes = [[0.0] * 3 if kind == "ball" else [*frame.axes[0]] for kind, frame in zip(tree.kind, frames)]
    groups: list[list[Body]] = [[] for _ in frames]
    for body, joint in enumerate(tree.body_joint):
        if joint >= 0:
            turn, inertia = turns[joint], np.array(tree.inertia[body])
            com = origins[joint] + turn @ tree.com[body]
            groups[joint].append(Body(tree.mass[body], com, turn @ inertia @ turn.T))
    return *map(np.array, zip(*map(combined, groups))), origins, np.array(axes)


def size_of(stated: Numbers, number: str) -> float:
    """The size of what is added where an engine reads a number: it may keep inertias about the origin of a joint.

    Of places and directions: the lengths of the tree, times the number of joints, as each turn on the way may round.
    """
    largest = {name: float(np.abs(values).max(initial=0.0)) for name, values in stated.items()}
    if number in ("moments", "inertia"):
        return largest[number] + largest["about_origin"]
    if number.startswith("axis"):
        return len(stated[number]) * 1.0
    if number.startswith(("com", "anchor")):
        return len(stated[number]) * (largest[number] + largest["com"] + largest["anchor"])
    return largest[number]


def carried(links: Iterable[Link], joints: int) -> list[list[Body]]:
    """The bodies that move with each of the Tree's joints and not with the next one. Parents come before their children."""
    bodies: list[list[Body]] = [[] for _ in range(joints)]
    moved_by: dict[object, int | None] = {}  # the joint that moves a link
    for link in links:
        joint = moved_by.get(link.parent) if link.joint is None else link.joint
        moved_by[link.name] = joint
        if joint is not None:
            bodies[joint].append(link.body)
    return bodies


def combined(bodies: Iterable[tuple[float, Array, Array]]) -> Body:
    """Bodies that move as one, with the inertia about their common centre of mass; of no bodies: 0."""
    parts = [Body(*body) for body in bodies]
    mass, tensor = sum((body.mass for body in parts), 0.0), np.zeros((3, 3))
    centre = sum((body.mass * body.com for body in parts), np.zeros(3)) / (mass or 1.0)
    for m, com, inertia in parts:
        d = com - centre
        tensor += inertia + point_inertia(d, m)
    return Body(mass, centre, tensor)


def passive(tree: tmt.Tree, q: Array, v: Array) -> Array:
    """The forces of damping and springs of the joints, N m, (..., nv): D v + k (q - rest)."""
    drag = np.array(tree.damping) * v
    return drag + tmt.literal.spring_torque(q, tree) if tree.has_springs else drag
