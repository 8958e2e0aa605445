"""What an engine has made of a robot's file: the class that its module derives."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

import tmt

from ...judge.scale import FACTOR
from .. import Array, Course
from .bodies import OF_BODIES, Body, Link, Numbers, body_numbers, differences, numbers_of, size_of
from .file import EngineError, File
from .order import Order, State


class Reading(NamedTuple):
    """What an engine has read, by the names of ReadModel.numbers."""

    read: dict[str, Array]
    stated: Numbers
    lacking: tuple[str, ...]  # numbers of the robot that its equations do not have
    differing: tuple[str, ...]  # that it has read otherwise
    not_set: tuple[str, ...]  # of these, those that still differ once all were set
    seconds: float  # until the model was there


class ReadModel(ABC):
    """What an engine has made of a file, in the engine's own coordinates; `order` leads from those of the Tree to them.

    Units: rad, m, N m, N. No contacts, limits, actuators or friction losses act. A model sets `file`, `order`
    and `used`.
    """

    file: File
    order: Order
    # gravity (3,) m/s2; armature, damping, stiffness (nv,) in the Tree's order: what it has read, then what
    # is set. One that is missing is not in its equations; then it acts as part of the torque.
    used: dict[str, Array]
    stated: Numbers  # numbers_stated of the Tree that is compared

    @abstractmethod
    def __init__(self, file: File, precision: str):
        """Read the file; Unread if that is not possible."""

    def set(self, name: str, values: Array) -> None:
        """Set one of `used`, as far as the engine has a public field for it."""
        return None

    def links(self, at: State) -> Sequence[Link]:
        """Its bodies at a state; none: it does not tell."""
        return ()

    def set_body(self, link: Link, body: Body) -> None:
        """Set mass, centre of mass and inertia of a link, in its axes, all 0: none; as far as the engine has public fields."""
        return None

    @abstractmethod
    def dynamics(self, at: State, force: Array) -> tuple[Array, Array, Array]:
        """M, h and a at a state, of its own equations.

        M (nv, nv) with the armature; h (nv,), the force of Coriolis, centrifugal and gravity terms for an
        acceleration that is 0 in the Tree, h + M c; a (nv,) from M a = force - h by its forward dynamics: the
        force, (nv,), has damping and springs.
        """

    def prepare(self, course: Course) -> None:
        """Make what a run needs that does not depend on its start and length: objects, compiled code."""
        return None

    def step_alone(self, course: Course) -> Callable[[], object] | None:
        """A function that makes a step from the start and on, and nothing else; None: no Python runs between steps."""
        return None

    def reached(self) -> tuple[Array, Array]:
        """q and v of the Tree after such a step."""
        raise EngineError("the engine has no integrators")

    def run(self, course: Course) -> tuple[Array, int | None]:
        """States (nq + nv,) of the Tree at the times as (times, nq + nv), fewer if it breaks off; and its evaluations.

        The damping and the springs of the file act. Evaluations: None: as many in a step as the order says.
        """
        step, states = self.step_alone(course) or self.reached, [course.start]
        for _ in course.times[1:]:
            for _ in range(course.every):
                step()
            states.append(np.concatenate(self.reached()))
        return np.array(states), None

    def numbers_stated(self, tree: tmt.Tree) -> Numbers:
        """The numbers with which `numbers` are compared, and those of numbers_of."""
        return numbers_of(tree)

    def numbers(self) -> Numbers:
        """What it has read: `used`, and the body_numbers of its links."""
        postures = self.stated["reference"], self.stated["moved"]
        if not self.links_at(postures[0]):
            return dict(self.used)
        return dict(self.used) | body_numbers(self.links_at, self.file.coordinates, *postures)

    def links_at(self, q: Array) -> Sequence[Link]:
        return self.links(self.order.state(q))

    def compare(self, tree: tmt.Tree, eps: float) -> Reading:
        """What was read beside a Tree, whose numbers are then set. Where places alone differ, the mass of bodies is right."""
        self.stated = stated = self.numbers_stated(tree)
        read, share = {name: np.array(values, float) for name, values in self.numbers().items()}, FACTOR * eps
        lacking = [name for name in ("damping", "stiffness") if name not in read and stated[name].any()]
        differing = differences(read, stated, share)
        for name in [name for name in differing if name not in OF_BODIES]:
            self.set(name, stated[name])
        if {*differing} & {*OF_BODIES}:
            moments = (np.linalg.eigvalsh(numbers["inertia"]) for numbers in (read, stated))
            off = np.abs(np.subtract(*moments)).max(axis=1) > share * size_of(stated, "inertia")
            off |= np.abs(read["mass"] - stated["mass"]) > share * size_of(stated, "mass")
            for joint in np.flatnonzero(off).tolist():
                # of the links that move as one the first has all the mass
                body = Body(*(stated[name][joint] for name in Body._fields))
                for link in [link for link in self.links_at(stated["reference"]) if link.joint == joint]:
                    self.set_body(link, link.in_own_axes(body) if body.mass else body)
                    body = Body(0.0, np.zeros(3), np.zeros((3, 3)))
        not_set = differences(self.numbers(), stated, share) if differing else ()
        return Reading(read, stated, tuple(lacking), differing, not_set, 0.0)
