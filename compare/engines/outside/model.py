"""What an engine has made of a robot's file: the class that its module derives, and the numbers of a Tree in the same shapes."""

from collections.abc import Mapping
from pathlib import Path
from types import MappingProxyType
from typing import NamedTuple

import numpy as np

import tmt
from tmt.methods import by_speed

from ...robots.case import Coordinates
from ...robots.joint_map import places_of


class File(NamedTuple):
    """A robot's file, and the joints of the Tree that is compared."""

    path: Path  # MJCF or URDF
    names: tuple[
        str, ...
    ]  # of the joints; a free joint b is `b x`, `b y`, `b z` (slides) and `b turn` (a ball)
    kinds: tuple[str, ...]  # hinge, slide or ball

    @property
    def coordinates(self) -> Coordinates:
        return Coordinates(self.names, self.kinds)

    @property
    def free(self) -> tuple[str, ...]:
        """The names of the free joints, as the file has them."""
        return tuple(name.removesuffix(" turn") for name, kind in zip(self.names, self.kinds)
                     if kind == "ball" and f"{name.removesuffix(' turn')} x" in self.names)  # fmt: skip


class EngineError(ValueError):
    """An engine fails; the message says why, in one line."""


class Unread(EngineError):
    """An engine cannot read a file."""


class TooLong(EngineError):
    """An engine does not answer within the time limit."""


class ReadModel:
    """What an engine has made of a file; a base class.

    All methods take and return numbers in the Tree's order of joints and in MuJoCo's conventions: q with quaternions w x y z; of
    a free joint the position and velocity of the body's origin in the world, and the angular velocity in body axes. Units: rad,
    m, N m, N. No contacts, limits, actuators or friction losses act. The quantities of one state; q (nq,), v, tau (nv,).
    """

    drops = ()  # numbers of the Tree that its equations do not have at all: they act as part of the torque
    lacks = ()  # quantities that it cannot give for this robot
    stated: Mapping = MappingProxyType({})  # before its numbers are read: numbers_of the Tree

    def __init__(self, file: File, precision: str):
        """Read the file; Unread if that is not possible."""
        raise NotImplementedError

    def numbers(self) -> Mapping[str, np.ndarray]:
        """What it has read, by name; a name that is missing: it does not tell.

        gravity (3,) m/s2; mass (joints,) kg and moments (joints, 3) kg m2, ascending: of all bodies together that move with a
        joint and not with the next one, 0 if there is none, about their common centre of mass; armature, damping, stiffness
        (nv,); rest (nq,) rad, m and quaternions: where the springs are without force. Of the same bodies com (joints, 3) m, the
        centre of mass, and inertia (joints, 3, 3) kg m2 about it: in the world, at the positions `reference` of `stated`.
        """
        raise NotImplementedError

    def mend(self, name: str, values: np.ndarray) -> bool:
        """Set numbers that it has read differently, of the same shape as in `numbers`; False: that is not possible."""
        return False

    def mass_matrix(self, q):
        """M (nv, nv), with the armature."""
        raise NotImplementedError

    def bias(self, q, v):
        """h (nv,): Coriolis, centrifugal and gravity terms, with the sign of MuJoCo's qfrc_bias; no springs, no damping."""
        raise NotImplementedError

    def acceleration(self, q, v, force):
        """(nv,), from M a = force - h by the engine's own forward dynamics; damping and springs are part of the force."""
        raise NotImplementedError

    def prepare(self, method: str, tau, dt: float | None, tolerance: float | None) -> None:
        """What a run needs that does not depend on its length: objects, compiled code."""

    def run(self, q, v, tau, times, steps: int | None, method: str, tolerance: float | None):
        """States (nq + nv,) at equal times, s, the first at 0, as (times, nq + nv), fewer if it breaks off; and its evaluations.

        steps: of equal length, a multiple of len(times) - 1; None: within a tolerance. tau constant; the damping and the
        springs of the file act.
        """
        raise NotImplementedError


def numbers_of(tree: tmt.Tree) -> dict[str, np.ndarray]:
    """The Tree's numbers in the shapes of ReadModel.numbers; and about_origin (joints,): mass x com^2 from the joint, kg m2."""
    nv = tree.coordinates.nv
    origins, *_ = places_of(tree)  # of the joints, at the reference positions
    groups = [[] for _ in tree.kind]
    for body, joint in enumerate(tree.body_joint):
        if joint >= 0:
            groups[joint].append(
                (tree.mass[body], origins[joint] + tree.com[body], np.array(tree.inertia[body]))
            )
    mass, com, inertia = (np.array(values) for values in zip(*map(combined, groups)))
    each = {"armature": tree.armature, "damping": tree.damping, "stiffness": by_speed(tree, tree.stiffness)}
    each = {name: np.broadcast_to(np.array(values or 0.0, float), nv) for name, values in each.items()}
    each["about_origin"] = mass * ((com - origins) ** 2).sum(axis=1)
    each |= {
        "gravity": np.array(tree.gravity, float),
        "rest": np.array(tree.rest),
        "reference": np.array(tree.zero),
    }
    return {"mass": mass, "com": com, "moments": np.linalg.eigvalsh(inertia), "inertia": inertia} | each


def size_of(stated: Mapping[str, np.ndarray], number: str) -> float:
    """The size of what is added where an engine reads a number: it may keep inertias about the origin of a joint."""
    size = np.abs(stated[number]).max(initial=0.0)
    return size + (stated["about_origin"].max(initial=0.0) if number in ("moments", "inertia") else 0.0)


def together(bodies: list[tuple[float, np.ndarray, np.ndarray]]) -> tuple[float, np.ndarray]:
    """The mass of bodies that move as one, and the moments of inertia about their centre of mass, ascending, (3,)."""
    mass, _, inertia = combined(bodies)
    return mass, np.linalg.eigvalsh(inertia)


def combined(bodies: list[tuple[float, np.ndarray, np.ndarray]]) -> tuple[float, np.ndarray, np.ndarray]:
    """The mass of bodies that move as one, their centre of mass, and the inertia about it; of no bodies: 0.

    bodies: mass, kg, centre of mass, m, and inertia about it, kg m2 (3, 3), in common axes.
    """
    mass, tensor = sum(body[0] for body in bodies), np.zeros((3, 3))
    centre = sum((m * c for m, c, _ in bodies), np.zeros(3)) / (mass or 1.0)
    for m, c, inertia in bodies:
        d = c - centre
        tensor += inertia + m * (d @ d * np.eye(3) - np.outer(d, d))
    return mass, centre, tensor


def passive(tree: tmt.Tree, q, v) -> np.ndarray:
    """The forces of damping and springs of the joints, N m, (..., nv): D v + k (q - rest)."""
    drag = np.array(tree.damping) * v
    return drag + tmt.literal.spring_torque(q, tree) if tree.has_springs else drag
