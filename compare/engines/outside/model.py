"""What an engine has made of a robot's file: the class that its module derives, and the numbers of a Tree in the same shapes."""

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from types import MappingProxyType
from typing import ClassVar, NamedTuple, TypedDict

import numpy as np

import tmt
from tmt.methods import by_speed

from ...robots.coordinates import Coordinates
from ...robots.joint_map import places_of
from .. import Array, Course

Numbers = Mapping[str, Array]


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
    """An engine cannot read a file."""


class TooLong(EngineError):
    """An engine does not answer within the time limit."""


class Reading(TypedDict):
    """What an engine has read, by the names of ReadModel.numbers."""

    read: dict[str, Array]
    stated: Numbers
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
    has_places: ClassVar[bool] = False  # whether `bodies` are where `numbers` says for com and inertia
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
        centre of mass, and inertia (joints, 3, 3) kg m2 about it: in the world, at the positions `reference` of `stated`.
        """
        mass, com, inertia = map(np.array, zip(*map(combined, self.bodies())))
        places = {"com": com, "inertia": inertia} if self.has_places else {}
        return {**self.fields(), "mass": mass, **places, "moments": np.linalg.eigvalsh(inertia)}

    def fields(self) -> Numbers:
        """What it has read that is not of bodies."""
        raise NotImplementedError

    def bodies(self) -> Sequence[Sequence[Body]]:
        """Of each joint the bodies that move with it and not with the next one."""
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

    def run(self, course: Course) -> tuple[Array, int | None]:
        """States (nq + nv,) at the times as (times, nq + nv), fewer if it breaks off; and its evaluations.

        The damping and the springs of the file act.
        """
        raise NotImplementedError


def numbers_of(tree: tmt.Tree) -> dict[str, Array]:
    """The Tree's numbers in the shapes of ReadModel.numbers; and about_origin (joints,): mass x com^2 from the joint, kg m2."""
    nv = tree.coordinates.nv
    origins, *_ = places_of(tree)  # of the joints, at the reference positions
    groups: list[list[Body]] = [[] for _ in tree.kind]
    for body, joint in enumerate(tree.body_joint):
        if joint >= 0:
            com = origins[joint] + tree.com[body]
            groups[joint].append(Body(tree.mass[body], com, np.array(tree.inertia[body])))
    mass, com, inertia = (np.array(values) for values in zip(*map(combined, groups)))
    numbers = {"mass": mass, "com": com, "moments": np.linalg.eigvalsh(inertia), "inertia": inertia}
    speeds = {"armature": tree.armature, "damping": tree.damping, "stiffness": by_speed(tree, tree.stiffness)}
    for name, values in speeds.items():
        numbers[name] = np.broadcast_to(np.array(values or 0.0, float), nv)
    numbers["about_origin"] = mass * ((com - origins) ** 2).sum(axis=1)
    others = {"gravity": tree.gravity, "rest": tree.rest, "reference": tree.zero}
    return numbers | {name: np.array(values, float) for name, values in others.items()}


def size_of(stated: Numbers, number: str) -> float:
    """The size of what is added where an engine reads a number: it may keep inertias about the origin of a joint."""
    sizes = [np.abs(stated[number]).max(initial=0.0)]
    if number in ("moments", "inertia"):
        sizes.append(stated["about_origin"].max(initial=0.0))
    return float(sum(sizes))


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
        tensor += inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    return Body(mass, centre, tensor)


def passive(tree: tmt.Tree, q: Array, v: Array) -> Array:
    """The forces of damping and springs of the joints, N m, (..., nv): D v + k (q - rest)."""
    drag = np.array(tree.damping) * v
    return drag + tmt.literal.spring_torque(q, tree) if tree.has_springs else drag
