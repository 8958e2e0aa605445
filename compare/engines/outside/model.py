"""What an engine has made of a robot's file: the class that its module derives."""

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

import tmt

from .. import Array, Course
from .bodies import Body, Link, Numbers, body_numbers, movers, numbers_of
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

    Units: rad, m, N m, N. No contacts, limits, actuators or friction losses act. A model sets `file`, `order` and `used`.
    """

    file: File
    order: Order
    # gravity (3,) m/s2; armature, damping, stiffness (nv,) in the Tree's order: what it has read, then what is set. One that is
    # missing is not in its equations; then it acts as part of the torque.
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

        M (nv, nv) with the armature; h (nv,), the force of Coriolis, centrifugal and gravity terms for an acceleration
        that is 0 in the Tree, h + M c; a (nv,) from M a = force - h by its forward dynamics: the force, (nv,), has
        damping and springs.
        """

    def prepare(self, course: Course) -> None:
        """Make what a run needs that does not depend on its start and length: objects, compiled code."""
        return None

    def step_alone(self, course: Course) -> Callable[[], object] | None:
        """A function that makes a step of a run once more, and nothing else; None: no Python runs between steps."""
        return None

    def run(self, course: Course) -> tuple[Array, int | None]:
        """States (nq + nv,) of the Tree at the times as (times, nq + nv), fewer if it breaks off; and its evaluations.

        The damping and the springs of the file act.
        """
        raise EngineError("the engine has no integrators")

    def numbers_stated(self, tree: tmt.Tree) -> Numbers:
        """The numbers with which `numbers` are compared, and those of numbers_of."""
        return numbers_of(tree)

    def numbers(self) -> Numbers:
        """What it has read: `used`, and the body_numbers of its links."""
        if not self.links(self.order.state(self.stated["reference"])):
            return dict(self.used)
        postures = self.stated["reference"], self.stated["moved"]
        return dict(self.used) | body_numbers(self.links_at, self.file.coordinates, *postures)

    def links_at(self, q: Array) -> Sequence[Link]:
        return self.links(self.order.state(q))

    def set_bodies(self, joints: Sequence[int]) -> None:
        """Set the bodies of joints as stated: of the links that move as one, the first has all the mass."""
        links = self.links_at(self.stated["reference"])
        for joint in joints:
            body = Body(*(self.stated[name][joint] for name in ("mass", "com", "inertia")))
            for link in [link for link, mover in zip(links, movers(links)) if mover == joint]:
                self.set_body(link, link.in_own_axes(body) if body.mass else body)
                body = Body(0.0, np.zeros(3), np.zeros((3, 3)))
