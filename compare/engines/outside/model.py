"""What an engine has made of a robot's file: the class that its module derives, and the numbers of a Tree in the same shapes."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import ClassVar, NamedTuple, TypedDict

import numpy as np
from scipy.spatial.transform import Rotation

import tmt
from tmt.derivation.method import joint_frames
from tmt.methods import by_speed

from ...robots.case import SEED
from ...robots.coordinates import Coordinates, free_joints, point_inertia
from .. import Array, Course

Numbers = Mapping[str, Array]
# what an engine reads: the robot's file, the model that MuJoCo compiled, or a URDF that this program writes of that
FROM_FILE, FROM_COMPILED, FROM_URDF = "file", "compiled", "urdf"
STILL = 1e-3  # rad or m: what a movement of 1 moves goes further


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
    """A body as an engine lists it, at a posture."""

    name: object  # of the engine: text or a number
    parent: object
    joint: int | None  # of the Tree, by which it moves on its parent; None: it is fixed there
    turn: Array  # (3, 3) from its axes to those of the world
    origin: Array  # (3,) m in the world
    body: Body  # in its axes

    @property
    def in_world(self) -> Body:
        mass, com, inertia = self.body
        return Body(mass, self.origin + self.turn @ com, self.turn @ inertia @ self.turn.T)

    def in_own_axes(self, body: Body) -> Body:
        """A body of the world in the axes of this link."""
        com = self.turn.T @ (body.com - self.origin)
        return Body(body.mass, com, self.turn.T @ body.inertia @ self.turn)


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

    share: ClassVar[float] = 1e-13  # of the largest, that a number loses where it is set
    # numbers of the Tree that its equations do not have at all: they act as part of the torque
    drops: ClassVar[tuple[str, ...]] = ()
    way: ClassVar[str] = FROM_FILE
    unwritten: ClassVar[tuple[str, ...]] = ()  # numbers that a URDF cannot state
    has_places: ClassVar[bool] = False  # whether it tells where bodies and joints are
    copied: tuple[str, str] | None = None  # why it has read a copy of the file
    file: File
    stated: Numbers  # numbers_of the Tree
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
        links = self.links(self.stated["reference"])
        mass, com, inertia = together(links, len(self.file.names))
        numbers = {**self.fields(), "mass": mass, "moments": np.linalg.eigvalsh(inertia)}
        if self.has_places:
            moved = self.stated["moved"]
            numbers |= {"com": com, "inertia": inertia, **self.lines(self.stated["reference"], "")}
            _, numbers["com_moved"], _ = together(self.links(moved), len(self.file.names))
            numbers |= self.lines(moved, "_moved")
        return numbers

    def lines(self, q: Array, ending: str) -> Numbers:
        """axis and anchor of `numbers` at positions q: by what a movement of each joint alone, of 1 rad or m, does to a link."""
        axes, anchors = (self.stated[f"{name}{ending}"].copy() for name in ("axis", "anchor"))
        coordinates, before = self.file.coordinates, self.links(q)
        for joint, axis, anchor in zip(coordinates.places.joints, axes, anchors):
            equations = []  # (1 - turn) anchor = shift, of each movement
            for speed in np.eye(coordinates.nv)[joint.qd] if axis.any() or anchor.any() else ():
                turn, shift = movement(before, self.links(coordinates.move(q, speed)))
                equations.append(np.column_stack([np.eye(3) - turn, shift]))
                if axis.any():
                    axis[:] = shift if joint.kind == "slide" else Rotation.from_matrix(turn).as_rotvec()
            if anchor.any():
                system = np.vstack(equations)
                rest = system[:, 3] - system[:, :3] @ anchor
                anchor += np.linalg.lstsq(system[:, :3], rest, rcond=1e-3)[0]
        return {f"axis{ending}": axes, f"anchor{ending}": anchors}

    def fields(self) -> Numbers:
        """What it has read that is not of bodies."""
        raise NotImplementedError

    def links(self, q: Array) -> list[Link]:
        """Its bodies; where has_places at positions q."""
        raise NotImplementedError

    def set_field(self, name: str, values: Array) -> bool:
        """Set one of `fields`; False: that is not possible."""
        return False

    def set_body(self, link: Link, body: Body) -> None:
        """Set mass, centre of mass and inertia of a link, in its axes; all 0: none."""
        raise NotImplementedError

    def mend(self, name: str, values: Array) -> bool:
        """Set numbers that it has read differently, of the same shape as in `numbers`; False: that is not possible.

        Of the links that move as one, the first has all the mass.
        """
        if name in self.fields():
            return self.set_field(name, values)
        if type(self).set_body is ReadModel.set_body:
            return False
        read, stated, links = self.numbers(), self.stated, self.links(self.stated["reference"])
        # where only com and inertia differ, bodies are at another place
        right = self.near(read["mass"], stated["mass"]) & self.near(read["moments"], stated["moments"])
        joints = movers(links)
        for joint in np.flatnonzero(~right).tolist():
            body = Body(stated["mass"][joint], stated["com"][joint], stated["inertia"][joint])
            for link in [link for link, mover in zip(links, joints) if mover == joint]:
                self.set_body(link, link.in_own_axes(body) if body.mass else body)
                body = Body(0.0, np.zeros(3), np.zeros((3, 3)))
        return bool(self.near(self.numbers()[name], values).all())

    def near(self, read: Array, stated: Array) -> Array:
        """Whether numbers that were set are those stated, for each joint."""
        is_near = np.abs(read - stated) <= self.share * np.abs(stated).max(initial=0.0)
        return np.asarray(is_near.reshape(len(stated), -1).all(axis=1))

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


class SteppedModel(ReadModel):
    """An engine whose steps Python asks for, one by one."""

    def start(self, course: Course) -> None:
        """Prepare the steps of a course from its start."""
        raise NotImplementedError

    def engine_step(self) -> None:
        """The engine's own step, from where it is."""
        raise NotImplementedError

    def step(self, force: Array, v: Array) -> tuple[Array, Array]:
        """q and v after a step from speeds v."""
        raise NotImplementedError

    def springs(self, q: Array) -> Array | float:
        """The force of springs that the engine does not have."""
        return 0.0

    def step_alone(self, course: Course) -> Callable[[], object]:
        self.start(course)
        return self.engine_step

    def run(self, course: Course) -> tuple[Array, int]:
        (q, v), states = course[:2], [course.start]
        self.start(course)
        for step in range(1, course.steps + 1):
            q, v = self.step(course.force(q, v) + self.springs(q), v)
            if step % course.every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), course.steps


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
    axes = [[0.0] * 3 if kind == "ball" else [*frame.axes[0]] for kind, frame in zip(tree.kind, frames)]
    origins = np.array([[*frame.origin] for frame in frames])
    return *together(links_of(tree, q), len(frames)), origins, np.array(axes)


def links_of(tree: tmt.Tree, q: Array) -> list[Link]:
    """The bodies of a Tree at positions q that a joint moves."""
    frames, links = joint_frames(tree, q.tolist()), []
    for number, joint in enumerate(tree.body_joint):
        if joint >= 0:
            turn = np.array([[*row] for row in frames[joint].turn])
            body = Body(tree.mass[number], np.array(tree.com[number]), np.array(tree.inertia[number]))
            links.append(Link(number, None, joint, turn, np.array([*frames[joint].origin]), body))
    return links


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


def movers(links: Sequence[Link]) -> list[int | None]:
    """The Tree's joint with which each link moves, and not with the next one; None: none moves it."""
    by_name = {link.name: link for link in links}

    def mover(link: Link | None) -> int | None:
        while link is not None and link.joint is None:
            link = by_name.get(link.parent)
        return link.joint if link else None

    return [mover(link) for link in links]


def together(links: Sequence[Link], joints: int) -> tuple[Array, Array, Array]:
    """mass, com and inertia of ReadModel.numbers."""
    bodies: list[list[Body]] = [[] for _ in range(joints)]
    for link, joint in zip(links, movers(links)):
        if joint is not None:
            bodies[joint].append(link.in_world)
    mass, com, inertia = map(np.array, zip(*map(combined, bodies)))
    return mass, com, inertia


def movement(before: Sequence[Link], after: Sequence[Link]) -> tuple[Array, Array]:
    """Turn and shift of the first link that moves: x becomes turn x + shift; those of no movement if none does."""
    for link, moved in zip(before, after):
        turn = moved.turn @ link.turn.T
        if np.abs(turn - np.eye(3)).max() > STILL or np.abs(moved.origin - link.origin).max() > STILL:
            return turn, moved.origin - turn @ link.origin
    return np.eye(3), np.zeros(3)


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
