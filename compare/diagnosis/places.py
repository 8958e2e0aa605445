"""The places where equations can be wrong by one number: of the model, of a term, of a coefficient.

A change x of a place adds x times a coefficient to numbers of the tree, or x times a column of values to
entries of Mbar or h. The zero of a joint is a convention and has rank 1; the other numbers have rank 2.
"""

from collections.abc import Iterable, Iterator
from itertools import product
from typing import Any, NamedTuple

import numpy as np

import tmt

from ..core.cause import Cause
from ..core.words import listed
from ..robots.coordinates import Coordinates
from ..robots.joint_map import within_a_turn
from .hypothesis import EVERY
from .model import MOST_SPEEDS, WHOLE, Equations, Frame, Path

XYZ = "xyz"
INERTIA = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
EVERY_BODY = "every body"
COMMON_FACTORS = (-1.0, 0.0, 0.5, 1.0, 2.0)
OF_ZERO = "zero position"  # the kind of a place
# angles that are written in one unit and read in the other, rad: as they are read, and as they are meant
COMMON_ANGLES = np.radians(np.outer((90, 180, 45, 30, 60, 15, 120, 135, 150, 270), (1.0, -1.0)).ravel())
READ_ANGLES = np.concatenate([np.degrees(COMMON_ANGLES), np.radians(COMMON_ANGLES)])
MEANT_ANGLES = np.tile(COMMON_ANGLES, 2)
WRITTEN = 1e-6  # of a turn: what the digits of an angle leave
FIT_ROUNDING = 1e-11  # of the size of a number: what a fit leaves of a number that is 0
RARE, MASSLESS, OF_ALL = (
    0.15,
    0.2,
    0.1,
)  # what an anchor or armature, no mass, damping of all joints cost more
SMALL = 1e-9  # of the other numbers: a number that a regression leaves at 0
ALL = slice(None)  # entries of a state
ONE = np.array(1.0)
Entries = slice | list[int]
OF_FORCES = ("N m s/rad", "N m/rad", "N m")  # units of damping, stiffness and a force
OF_SLIDES = {"N m s/rad": "N s/m", "N m/rad": "N/m", "N m": "N", "kg m2": "kg", "rad": "m"}  # units


class Place(NamedTuple):
    """One number that can be wrong."""

    kind: str  # "number", "force", "term", "part" of a term, "coefficient", "whole" or OF_ZERO
    name: str
    stated: float
    unit: str
    size: float  # of a change that matters, for starts of a search
    moves: tuple[tuple[Path, float], ...] = ()  # numbers of the tree, and how far they go with a change of 1
    column: np.ndarray | None = None  # what a change of 1 adds to the values instead, (states, entries)
    least: float = -np.inf  # possible value
    cost: float = 0.0  # beside that of its kind and value
    form: str = ""  # as of a Cause
    owners: int = 1

    @property
    def rank(self) -> int:
        return 1 if self.kind == OF_ZERO else 2

    @property
    def is_quadratic(self) -> bool:
        """Whether Mbar and h are a polynomial of second degree in it."""
        return not any(path.field in ("axis", "reference") for path, _ in self.moves)

    def value(self, change: float) -> float:
        """The value after a change (of a zero, half a turn at most); 0 if only digits of a fit remain."""
        value = self.stated + (within_a_turn(change, self.unit == "m") if self.kind == OF_ZERO else change)
        return 0.0 if abs(value) < FIT_ROUNDING * self.size else float(value)

    def is_possible(self, change: float) -> bool:
        """Whether no mass, inertia, damping or stiffness is below zero, except the right one with the other sign."""
        value = self.value(change)
        return value >= self.least or bool(self.stated and np.isclose(value, -self.stated, rtol=SMALL))

    def cause(self, change: float) -> Cause:
        """The change as a cause; of a zero whose angle is read in another unit, both angles."""
        place, unit = self.name, self.unit
        if self.kind == OF_ZERO and unit == "rad":
            turns = (change - READ_ANGLES + MEANT_ANGLES) / (2.0 * np.pi)
            for k in np.flatnonzero(np.abs(turns - np.round(turns)) < WRITTEN).tolist():
                meant, read = abs(float(MEANT_ANGLES[k])), abs(float(READ_ANGLES[k]))
                return Cause(rank=2, kind="number", place=place, stated=meant, explains=read, unit=unit)
        stated, explains = float(self.stated), self.value(change)
        field = self.moves[0][0].field if self.moves else ""
        cost = self.cost + EVERY * (self.owners > 1) + MASSLESS * (field == "mass" and explains == 0.0)
        if field == "armature" and not (stated and is_common(explains / stated)):
            cost += RARE
        about: dict[str, Any] = {
            "rank": self.rank,
            "kind": self.kind,
            "place": place,
            "form": self.form,
            "owners": self.owners,
        }
        return Cause(stated=stated, explains=explains, unit=unit, cost=cost, **about)


def factor(
    kind: str, name: str, column: np.ndarray, entries: Entries = ALL, stated: float = 1.0, **more: Any
) -> Place:
    """The factor of what some entries of a column (states, entries) are; 1 is right."""
    chosen = np.zeros_like(column)
    chosen[:, entries] = column[:, entries]
    return Place(kind, name, stated, "times", 1.0, column=chosen, **more)


def unit_of(unit: str, kind: str) -> str:
    """The unit of a number of a joint: as given, for a joint that turns, or its counterpart for a slide."""
    return OF_SLIDES.get(unit, unit) if kind == "slide" else unit


def is_common(factor: float) -> bool:
    """Whether a wrong term often has this factor."""
    return bool(np.isclose(factor, COMMON_FACTORS, rtol=0.0, atol=1e-6).any())


def forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Place]:
    """Damping, spring, friction and a constant force of each joint, and damping of all together."""
    names = Coordinates(tree.joint_names, tree.kind).speeds

    def place(name: str, unit: str, stated: float, force: np.ndarray, least: float = 0.0) -> Place:
        return Place("number", name, stated, unit, 1.0, column=force, least=least)

    for i, joint in enumerate(tree.coordinates.joints):
        of_damping, of_stiffness, of_force = (unit_of(unit, joint.kind) for unit in OF_FORCES)
        for v in range(joint.qd.start, joint.qd.stop):
            speed, at_joint = qd[:, v : v + 1], np.eye(qd.shape[1])[v]
            yield place(f"damping of {names[v]}", of_damping, tree.damping[v], speed * at_joint)
            yield place(f"friction of {names[v]}", of_force, 0.0, np.sign(speed) * at_joint)
            constant = np.ones_like(speed) * at_joint
            has_spring = joint.kind != "ball" and tree.stiffness[i] > 0.0
            if joint.kind != "ball":
                rest = tree.rest[joint.q.start] if has_spring else tree.reference[i]
                stretched = (q[:, joint.q] - rest) * at_joint
                if has_spring:
                    pull, unit = -tree.stiffness[i] * constant, unit_of("rad", joint.kind)
                    yield place(f"springref of {names[v]}", unit, rest, pull, -np.inf)
                yield place(f"stiffness of {names[v]}", of_stiffness, tree.stiffness[i], stretched)
            if not has_spring:
                yield place(f"constant force at {names[v]}", of_force, 0.0, constant, -np.inf)
    yield from others(tree, q, qd)
    if len(tree.joint_names) > 1:
        yield place("damping added to every joint", "N m s/rad", 0.0, qd)._replace(cost=OF_ALL)


def others(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Place]:
    """Forces at a hinge or slide of the speed or displacement of another one, or of the cube of its own."""
    straight = [(i, joint) for i, joint in enumerate(tree.coordinates.joints) if joint.kind != "ball"]
    for (i, joint), (k, other) in product(straight, straight) if len(straight) <= MOST_SPEEDS else ():
        name, of_other = tree.joint_names[i], tree.joint_names[k]
        force, at_joint = unit_of("N m", joint.kind), np.eye(qd.shape[1])[joint.qd.start]
        moved = q[:, other.q] - tree.reference[k]
        unit = "m" if other.kind == "slide" else "rad"
        if i == k:
            yield Place(
                "cross",
                f"force at {name} of {name}^3",
                0.0,
                f"{force}/{unit}3",
                1.0,
                column=moved**3 * at_joint,
            )
            continue
        column = qd[:, other.qd] * at_joint
        yield Place(
            "cross",
            f"force at {name} of the speed of {of_other}",
            0.0,
            f"{force} s/{unit}",
            1.0,
            column=column,
        )
        column = moved * at_joint
        yield Place("cross", f"force at {name} of {of_other}", 0.0, f"{force}/{unit}", 1.0, column=column)


def numbers(equations: Equations) -> Iterator[Place]:
    """Every number of the tree. "anchor": the joint moves, all that it carries stays in place."""
    tree, stated = equations.tree, equations.stated
    length = max(1e-3, float(np.abs(stated["offset"]).max()), float(np.abs(stated["com"]).max()))
    heaviest = stated["mass"].max()

    def number(
        name: str, unit: str, size: float, path: Path, along: np.ndarray = ONE,
        origin: np.ndarray | float = 0.0, least: float = -np.inf,
    ) -> Place:  # fmt: skip
        """A number, or a component of a vector or tensor along an axis, or the product of two, of a frame."""
        now = float((along * (stated[path.field][path.at] - origin)).sum() / (along * along).sum())
        moves = [(Path(path.field, (*path.at, *at)), float(x)) for at, x in np.ndenumerate(along) if x]
        now = 0.0 if abs(now) < WHOLE * size else now
        return Place("number", name, now, unit, float(size), tuple(moves), least=least)

    def triple(name: str, unit: str, size: float, path: Path, frame: Frame) -> list[Place]:
        axes = zip(XYZ, frame.axes.T)
        return [number(name.format(axis), unit, size, path, along, frame.origin) for axis, along in axes]

    for b, body in enumerate(tree.body_names):
        heavy = stated["mass"][b] or heaviest
        yield number(f"mass of {body}", "kg", heavy, Path("mass", (b,)), least=0.0)
        frame = equations.frame_of(b)
        yield from triple(f"CoM {{}} of {body}", "m", length, Path("com", (b,)), frame)
        size = np.abs(stated["inertia"][b]).max() or heavy * length**2
        for name, i, j in INERTIA:
            along = np.outer(frame.axes[:, i], frame.axes[:, j])
            along, least = (along, 0.0) if i == j else (along + along.T, -np.inf)
            called = f"inertia {name} of {body}"
            yield number(called, "kg m2", size, Path("inertia", (b,)), along, least=least)
    for i, (name, joint) in enumerate(equations.joints.items()):
        carried = [("com", b) for b, of_joint in enumerate(tree.body_joint) if of_joint == i]
        carried += [("offset", j) for j, parent in enumerate(tree.parent) if parent == i]
        of_parent = Frame(np.zeros(3), equations.axes_at(tree.parent[i]))
        for place in triple(f"offset {{}} of {name}", "m", length, Path("offset", (i,)), of_parent):
            yield place
            if joint.kind != "slide":
                pairs = product(carried, place.moves)
                stays = [(Path(field, (index, path.at[1])), -x) for (field, index), (path, x) in pairs]
                anchor = place.name.replace("offset", "anchor", 1)
                yield place._replace(name=anchor, moves=(*place.moves, *stays), cost=RARE)
        if joint.kind != "ball":
            size = length if joint.kind == "slide" else 1.0
            zero = number(f"zero of {name}", unit_of("rad", joint.kind), size, Path("reference", (i,)))
            yield zero._replace(kind=OF_ZERO)
            own = Frame(np.zeros(3), equations.axes_at(i))
            yield from triple(f"axis {{}} of {name}", "", 0.5, Path("axis", (joint.qd.start,)), own)
        for speed in range(joint.qd.start, joint.qd.stop):
            size = heaviest * (1.0 if joint.kind == "slide" else length**2)
            path, unit = Path("armature", (speed,)), unit_of("kg m2", joint.kind)
            yield number(f"armature of {equations.speeds[speed]}", unit, size, path, least=0.0)
    yield from triple("gravity {}", "m/s2", 9.81, Path("gravity", ()), Frame(np.zeros(3), np.eye(3)))


def sets_of_bodies(tree: tmt.Tree) -> dict[str, list[int]]:
    """Each body, and all."""
    return sets_of(list(tree.body_names), (), EVERY_BODY)


def sets_of_joints(tree: tmt.Tree) -> dict[str, list[int]]:
    """Each joint, hinges about equal axes, and all."""
    axes: dict[str, list[str]] = {}
    for name, joint in zip(tree.joint_names, tree.coordinates.joints):
        if joint.kind == "hinge":
            axes.setdefault(repr(tree.axis[joint.qd.start]), []).append(name)
    return sets_of(list(tree.joint_names), axes.values(), "every joint")


def sets_of(names: list[str], together: Iterable[list[str]], every: str) -> dict[str, list[int]]:
    sets = {name: [i] for i, name in enumerate(names)}
    for those in together:
        sets[listed(those)] = [names.index(name) for name in those]
    return sets | ({every: list(range(len(names)))} if len(names) > 1 else {})
