"""The numbers of bodies and joints: those of a Tree, and those that follow from an engine's links, in the same shapes."""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

import tmt
from tmt.derivation.method import joint_frames
from tmt.methods import by_speed

from ...robots.case import SEED
from ...robots.coordinates import Coordinates, free_joints, point_inertia
from .. import Array

Numbers = Mapping[str, Array]
STILL = 1e-3  # rad or m: what a movement of 1 moves goes further


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


def combined(parts: Sequence[Body]) -> Body:
    """Bodies that move as one, with the inertia about their common centre of mass; of no bodies: 0."""
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
