"""What an engine has made of a robot's file: the class that its module derives."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import ClassVar, TypedDict

import numpy as np
from scipy.spatial.transform import Rotation

from .. import Array, Course
from .bodies import Body, Link, Numbers, movement, movers, together
from .file import File
from .order import Order, State

# what an engine reads: the robot's file, the model that MuJoCo compiled, or a URDF that this program writes of that
FROM_FILE, FROM_COMPILED, FROM_URDF = "file", "compiled", "urdf"
QUANTITIES = "mass_matrix", "bias", "acceleration"


class Reading(TypedDict):
    """What an engine has read, by the names of ReadModel.numbers."""

    read: dict[str, Array]
    stated: Numbers
    copied: (
        tuple[str, str] | None
    )  # of the error for which it has read a copy, see mjcf_text: kind and message
    way: str  # ReadModel.way
    lacking: tuple[str, ...]  # ReadModel.drops that the robot has
    unwritten: tuple[str, ...]  # ReadModel.unwritten that differ, and are set now
    mended: dict[str, bool]  # of the numbers that differ: whether they are set now
    seconds: float  # until the model was there
    has: set[str]  # the quantities that it gives


class ReadModel(ABC):
    """What an engine has made of a file, in the engine's own coordinates; `order` leads from those of the Tree to them.

    Units: rad, m, N m, N. No contacts, limits, actuators or friction losses act.
    """

    share: ClassVar[float] = 1e-13  # of the largest, that a number loses where it is set
    # numbers of the Tree that its equations do not have at all: they act as part of the torque
    drops: ClassVar[tuple[str, ...]] = ()
    way: ClassVar[str] = FROM_FILE
    unwritten: ClassVar[tuple[str, ...]] = ()  # numbers that a URDF cannot state
    has_links: ClassVar[bool] = (
        False  # whether it is asked about its bodies: not where it has them of this program
    )
    copied: tuple[str, str] | None = None  # why it has read a copy of the file
    file: File
    order: Order
    used: dict[str, Array]  # `fields`
    stated: Numbers  # numbers_of the Tree
    reading: Reading

    @abstractmethod
    def __init__(self, file: File, precision: str):
        """Read the file; Unread if that is not possible."""

    @property
    def quantities(self) -> tuple[str, ...]:
        """Those that it gives for this robot, of QUANTITIES and "derivatives"."""
        return QUANTITIES

    def fields(self) -> Numbers:
        """What it has read that is not of bodies, in the Tree's order; then what is set.

        gravity (3,) m/s2; armature, damping, stiffness (nv,); a name that is missing: it does not tell.
        """
        return self.used

    def links(self, at: State) -> list[Link]:
        """Its bodies at a state, where has_links."""
        return []

    def set_field(self, name: str, values: Array) -> bool:
        """Set one of `fields`; False: that is not possible for all joints."""
        is_wrong, self.used[name] = values != self.used[name], np.array(values, float)
        self.apply(name)
        return name == "gravity" or not (is_wrong & self.unable(name)).any()

    def apply(self, name: str) -> None:
        """Give the engine one of `used`."""
        return None

    def unable(self, name: str) -> Array:
        """Of which speeds of the Tree the engine cannot have such a number, (nv,)."""
        return np.zeros(self.file.coordinates.nv, bool)

    def set_body(self, link: Link, body: Body) -> bool:
        """Set mass, centre of mass and inertia of a link, in its axes, all 0: none; False: that is not possible."""
        return False

    @abstractmethod
    def mass_matrix(self, at: State) -> Array:
        """M (nv, nv), with the armature."""

    @abstractmethod
    def bias(self, at: State) -> Array:
        """The force (nv,) for an acceleration that is 0 in the Tree: h + M c, of Coriolis, centrifugal and gravity terms only."""

    @abstractmethod
    def acceleration(self, at: State, force: Array) -> Array:
        """(nv,), from M a = force - h by the engine's own forward dynamics; damping and springs are part of the force."""

    def derivatives(self, at: State, force: Array) -> Array:
        """Of `acceleration` by movements of q, by v and by the force, (3, nv, nv), by the engine's own derivatives."""
        raise TypeError("the engine has no derivatives")

    def prepare(self, course: Course) -> None:
        """Make what a run needs that does not depend on its start and length: objects, compiled code."""
        return None

    def step_alone(self, course: Course) -> Callable[[], object] | None:
        """A function that makes a step of a run once more, and nothing else; None: no Python runs between steps."""
        return None

    def batch(self, course: Course) -> tuple[Callable[[], Array], str]:
        """A function that follows many worlds to the end of a course and returns q of the first, and the device's name.

        q, v and tau of the course are those of the worlds, (worlds, n).
        """
        raise TypeError("the engine follows one world at a time")

    def run(self, course: Course) -> tuple[Array, int | None]:
        """States (nq + nv,) of the Tree at the times as (times, nq + nv), fewer if it breaks off; and its evaluations.

        The damping and the springs of the file act.
        """
        raise TypeError("the engine has no integrators")

    def numbers(self) -> Numbers:
        """What it has read, by name: `fields`, and the numbers of its bodies.

        Where has_links, mass (joints,) kg and moments (joints, 3) kg m2, ascending: of all bodies together that move with a
        joint and not with the next one, 0 if there is none, about their common centre of mass. Of the same bodies com (joints,
        3) m, the centre of mass, and inertia (joints, 3, 3) kg m2 about it: in the world, at the positions `reference` of
        `stated`. Of the joints there axis (joints, 3) and anchor (joints, 3) m, on the axis of a hinge next to the stated one,
        at the centre of a ball; 0 where that says nothing. com_moved, axis_moved and anchor_moved are those at the positions
        `moved`.
        """
        if not self.has_links:
            return self.fields()
        count, reference, moved = len(self.file.names), self.stated["reference"], self.stated["moved"]
        mass, com, inertia = together(self.links_at(reference), count)
        numbers = {"mass": mass, "moments": np.linalg.eigvalsh(inertia), "com": com, "inertia": inertia}
        _, numbers["com_moved"], _ = together(self.links_at(moved), count)
        return {**self.fields(), **numbers, **self.lines(reference, ""), **self.lines(moved, "_moved")}

    def links_at(self, q: Array) -> list[Link]:
        return self.links(self.order.state(q))

    def lines(self, q: Array, ending: str) -> Numbers:
        """axis and anchor of `numbers` at positions q: by what a movement of each joint alone, of 1 rad or m, does to a link."""
        axes, anchors = (self.stated[f"{name}{ending}"].copy() for name in ("axis", "anchor"))
        coordinates, before = self.file.coordinates, self.links_at(q)
        for joint, axis, anchor in zip(coordinates.places.joints, axes, anchors):
            equations = []  # (1 - turn) anchor = shift, of each movement
            for speed in np.eye(coordinates.nv)[joint.qd] if axis.any() or anchor.any() else ():
                turn, shift = movement(before, self.links_at(coordinates.move(q, speed)))
                equations.append(np.column_stack([np.eye(3) - turn, shift]))
                if axis.any():
                    axis[:] = shift if joint.kind == "slide" else Rotation.from_matrix(turn).as_rotvec()
            if anchor.any():
                system = np.vstack(equations)
                rest = system[:, 3] - system[:, :3] @ anchor
                anchor += np.linalg.lstsq(system[:, :3], rest, rcond=1e-3)[0]
        return {f"axis{ending}": axes, f"anchor{ending}": anchors}

    def mend(self, name: str, values: Array) -> bool:
        """Set numbers that it has read differently, of the same shape as in `numbers`; False: that is not possible.

        Of the links that move as one, the first has all the mass.
        """
        if name in self.fields():
            return self.set_field(name, values)
        read, stated, links = self.numbers(), self.stated, self.links_at(self.stated["reference"])
        # where only com and inertia differ, bodies are at another place
        right = self.near(read["mass"], stated["mass"]) & self.near(read["moments"], stated["moments"])
        joints = movers(links)
        for joint in np.flatnonzero(~right).tolist():
            body = Body(stated["mass"][joint], stated["com"][joint], stated["inertia"][joint])
            for link in [link for link, mover in zip(links, joints) if mover == joint]:
                if not self.set_body(link, link.in_own_axes(body) if body.mass else body):
                    return False
                body = Body(0.0, np.zeros(3), np.zeros((3, 3)))
        return bool(self.near(self.numbers()[name], values).all())

    def near(self, read: Array, stated: Array) -> Array:
        """Whether numbers that were set are those stated, for each joint."""
        is_near = np.abs(read - stated) <= self.share * np.abs(stated).max(initial=0.0)
        return np.asarray(is_near.reshape(len(stated), -1).all(axis=1))


class SteppedModel(ReadModel):
    """An engine whose steps Python asks for, one by one."""

    @abstractmethod
    def start(self, at: State, dt: float, method: str | None) -> None:
        """Prepare steps of dt from a state; method None: of the first method, without damping and springs."""

    @abstractmethod
    def set_force(self, force: Array) -> None:
        """Set the generalized force of the next step."""

    @abstractmethod
    def step(self) -> None:
        """The engine's own step, from where it is."""

    @abstractmethod
    def reached(self) -> tuple[Array, Array]:
        """Positions and speeds after a step, the start of the next one."""

    def other_force(self, q: Array, v: Array) -> Array | float:
        """What the engine does not have of the robot's own force, of the Tree."""
        return 0.0

    def acceleration(self, at: State, force: Array) -> Array:
        self.start(at, 1.0, None)
        self.set_force(force)
        self.step()
        return self.reached()[1] - at.u

    def step_alone(self, course: Course) -> Callable[[], object]:
        self.start(self.order.state(course.q, course.v), course.dt, course.method)
        return self.step

    def run(self, course: Course) -> tuple[Array, int]:
        (q, v), states = course[:2], [course.start]
        at = self.order.state(q, v)
        self.start(at, course.dt, course.method)
        for step in range(1, course.steps + 1):
            self.set_force(at.force(course.force(q, v) + self.other_force(q, v)))
            self.step()
            q, v = self.order.tree_state(*self.reached())
            at = self.order.state(q, v)
            if step % course.every == 0:
                states.append(np.concatenate([q, v]))
        return np.array(states), course.steps
