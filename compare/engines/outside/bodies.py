"""The numbers of bodies and joints: those of a Tree and those of an engine's links, found in the same way."""

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, NamedTuple

import numpy as np
from scipy.spatial.transform import Rotation

import tmt
from tmt.derivation.method import joint_frames
from tmt.methods import by_speed

from ...robots.case import SEED
from ...robots.coordinates import Coordinates, point_inertia
from .. import Array

Numbers = Mapping[str, Array]
STILL = 1e-3  # rad or m: what a movement of 1 moves goes further
CUTOFF = 1e-3  # of the singular values of 1 - R: along the axis of a turn R any point is fixed
OF_BODIES = "mass", "com", "inertia", "axis", "anchor", "com_moved"
OF_JOINTS = "gravity", "armature", "damping", "stiffness"


class Body(NamedTuple):
    """A body, or bodies that move as one; of those that are combined in common axes."""

    mass: float  # kg
    com: Array  # (3,) m
    inertia: Array  # (3, 3) kg m2, about the centre of mass


class Link(NamedTuple):
    """A body as an engine has it, at a posture."""

    name: Any  # of the engine: text or a number
    joint: int | None  # of the Tree, with which it moves and not with the next one; None: none moves it
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


def numbers_of(tree: tmt.Tree) -> dict[str, Array]:
    """The Tree's numbers, in the shapes of ReadModel.numbers; and

    reference, moved: (nq,) the positions of body_numbers; rest: (nq,) of springs; levers: (bodies,) mass x
    com^2, kg m2.
    """
    coordinates = Coordinates(tree.joint_names, tree.kind)
    postures = np.array(tree.zero), coordinates.random(np.random.default_rng(SEED), 1)[0]
    numbers = body_numbers(partial(links_of, tree), coordinates, *postures)
    speeds = {"armature": tree.armature, "damping": tree.damping, "stiffness": by_speed(tree, tree.stiffness)}
    for name, values in speeds.items():
        numbers[name] = np.broadcast_to(np.array(values or 0.0, float), coordinates.nv)
    levers = [mass * float(np.dot(com, com)) for mass, com in zip(tree.mass, tree.com)]
    numbers |= {"reference": postures[0], "moved": postures[1], "levers": np.array(levers)}
    return numbers | {"gravity": np.array(tree.gravity, float), "rest": np.array(tree.rest, float)}


def links_of(tree: tmt.Tree, q: Array) -> list[Link]:
    """The bodies of a Tree at positions q that a joint moves."""
    frames, links = joint_frames(tree, q.tolist()), []
    for number, joint in enumerate(tree.body_joint):
        if joint >= 0:
            turn = np.array([[*row] for row in frames[joint].rotation])
            body = Body(tree.mass[number], np.array(tree.com[number]), np.array(tree.inertia[number]))
            links.append(Link(number, joint, turn, np.array([*frames[joint].origin]), body))
    return links


def body_numbers(
    links_at: Callable[[Array], Sequence[Link]], coordinates: Coordinates, reference: Array, moved: Array
) -> dict[str, Array]:
    """Numbers of bodies and joints, in the world, by what links do; links_at: positions (nq,) -> the links there.

    mass (joints,) kg, com (joints, 3) m and inertia (joints, 3, 3) kg m2 about it, at the positions
    `reference`: of all bodies together that move with a joint and not with the next one; 0 if there is none.
    com_moved: com at the positions `moved`. axis (joints, 3): of a hinge or slide at `reference`, by what a
    movement of 1 rad or 1 m does to the first link that moves; anchor (joints, 3) m: of a hinge, the point of
    its axis that is nearest to the world's origin; both 0 of a ball.
    """
    before, joints = links_at(reference), coordinates.places.joints

    def bodies(links: Sequence[Link]) -> list[Body]:
        parts = [[link.in_world for link in links if link.joint == joint] for joint in range(len(joints))]
        return [combined(of_joint) for of_joint in parts]

    numbers = dict(zip(Body._fields, map(np.array, zip(*bodies(before)))))
    numbers["com_moved"] = np.array([body.com for body in bodies(links_at(moved))])
    axis, anchor = np.zeros((2, len(joints), 3))
    for k, joint in enumerate(joints):
        if joint.kind == "ball":
            continue
        after = links_at(coordinates.move(reference, np.eye(coordinates.nv)[joint.qd.start]))
        turn, shift = movement(before, after)
        axis[k] = shift if joint.kind == "slide" else Rotation.from_matrix(turn).as_rotvec()
        if joint.kind == "hinge":
            anchor[k] = np.linalg.pinv(np.eye(3) - turn, CUTOFF) @ shift
    return numbers | {"axis": axis, "anchor": anchor}


def movement(before: Sequence[Link], after: Sequence[Link]) -> tuple[Array, Array]:
    """Turn and shift of the first link that moves: x becomes turn x + shift; those of no movement if none does."""
    for link, moved in zip(before, after):
        turn = moved.turn @ link.turn.T
        if np.abs(turn - np.eye(3)).max() > STILL or np.abs(moved.origin - link.origin).max() > STILL:
            return turn, moved.origin - turn @ link.origin
    return np.eye(3), np.zeros(3)


def combined(parts: Sequence[Body]) -> Body:
    """Bodies that move as one, with the inertia about their common centre of mass; of no bodies: 0."""
    mass, tensor = sum((body.mass for body in parts), 0.0), np.zeros((3, 3))
    centre = sum((body.mass * body.com for body in parts), np.zeros(3)) / (mass or 1.0)
    for m, com, inertia in parts:
        tensor += inertia + point_inertia(com - centre, m)
    return Body(mass, centre, tensor)


def size_of(stated: Numbers, number: str) -> float:
    """The size of what is added where an engine reads a number; it may keep inertias about the origin of a link.

    Of places and directions: the lengths of the tree, times the number of joints, as each turn on the way may
    round.
    """
    largest = {name: float(np.abs(values).max(initial=0.0)) for name, values in stated.items()}
    if number == "inertia":
        return largest[number] + largest["levers"]
    if number == "axis":
        return float(len(stated[number]))
    if number in ("com", "com_moved", "anchor"):
        return len(stated[number]) * (largest["com"] + largest["com_moved"] + largest["anchor"])
    return largest[number]


def differences(numbers: Numbers, stated: Numbers, share: float) -> tuple[str, ...]:
    """The names of the numbers that differ from those stated by more than a share of what is added."""
    largest = {name: np.abs(values - stated[name]).max(initial=0.0) for name, values in numbers.items()}
    return tuple(name for name, off in largest.items() if not off <= share * size_of(stated, name))
