"""The places where equations can be wrong by one number: of the model, of a term, of a coefficient.

A change x of a place adds x times a coefficient to numbers of the tree, or x times a column of values to
entries of Mbar or h. The zero of a joint is a convention and has rank 1; the other numbers have rank 2.
"""

from collections.abc import Iterator
from itertools import chain, combinations_with_replacement, product
from typing import NamedTuple

import numpy as np

import tmt

from ..core.cause import Cause
from ..robots.coordinates import Coordinates
from ..robots.joint_map import within_a_turn
from .model import BODY_TERMS, MOST_SPEEDS, OF_TERM, VELOCITY_TERMS, Entry, Equations, Path

XYZ = "xyz"
INERTIA = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
TOGETHER = {  # terms that are often left out together
    "all moments of {} in the bias": ("Euler", "gyroscopic"),
    "velocity terms of {} in h": VELOCITY_TERMS,
    "all of the rotation of {}": ("rotation", "Euler", "gyroscopic"),
}
EVERY_BODY = "every body"
COMMON_FACTORS = (-1.0, 0.0, 0.5, 1.0, 2.0)
MOST_HINGES = 3  # whose single terms of Mbar are tried
OF_ZERO = "zero position"  # the kind of a place
FIT_ROUNDING = 1e-11  # of the size of a number: what a fit leaves of a number that is 0
ALL = slice(None)  # entries of a state
OF_FORCES = ("N m s/rad", "N m/rad", "N m")  # units of damping, stiffness and a force
OF_SLIDES = {"N m s/rad": "N s/m", "N m/rad": "N/m", "N m": "N", "kg m2": "kg", "rad": "m"}  # units


class Place(NamedTuple):
    """One number that can be wrong."""

    kind: str  # "number", "force", "term", "part" of a term, "coefficient" or OF_ZERO
    name: str
    stated: float
    unit: str
    size: float  # of a change that matters, for starts of a search
    moves: tuple[tuple[Path, float], ...] = ()  # numbers of the tree, and how far they go with a change of 1
    column: np.ndarray | None = None  # what a change of 1 adds to `entry` instead, (states, ...)
    entry: int | slice = ALL  # of the values of a state
    least: float = -np.inf  # possible value

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
        """Whether no mass, inertia, damping or stiffness is below zero, and a part has a common factor."""
        return self.value(change) >= self.least and (self.kind != "part" or is_common(self.value(change)))

    def cause(self, change: float) -> Cause:
        """The change as a cause."""
        rank, kind, stated, explains = self.rank, self.kind, float(self.stated), self.value(change)
        return Cause(rank=rank, kind=kind, place=self.name, stated=stated, explains=explains, unit=self.unit)


def factor(kind: str, name: str, column: np.ndarray, entry: int | slice, stated: float = 1.0) -> Place:
    """The factor of something in entries of a state; 1 is right."""
    return Place(kind, name, stated, "times", 1.0, column=column, entry=entry)


def unit_of(unit: str, kind: str) -> str:
    """The unit of a number of a joint: as given, for a joint that turns, or its counterpart for a slide."""
    return OF_SLIDES.get(unit, unit) if kind == "slide" else unit


def is_common(factor: float) -> bool:
    """Whether a wrong term often has this factor."""
    return bool(np.isclose(factor, COMMON_FACTORS, rtol=0.0, atol=1e-6).any())


def all_places(equations: Equations) -> list[Place]:
    """The places that have an influence at some state, as far as that is known beforehand."""
    kinds = numbers, terms, coefficients, forces_in_bias, parts_of_terms
    places = chain.from_iterable(places_of(equations) for places_of in kinds)
    return [place for place in places if place.column is None or place.column.any()]


def forces_in_bias(equations: Equations) -> Iterator[Place]:
    """Damping and springs of joints that were added to h."""
    for place in forces(equations.tree, equations.q, equations.qd):
        if place.name.startswith(("damping", "stiffness")):
            yield place._replace(kind="force", name=f"{place.name} in h", stated=0.0, entry=equations.in_h)


def forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Place]:
    """Damping, stiffness, friction and a constant force of each joint, and damping of all together."""
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
            yield place(f"constant force at {names[v]}", of_force, 0.0, constant, -np.inf)
            if joint.kind != "ball":
                rest = tree.rest[joint.q.start] if tree.stiffness[i] else tree.reference[i]
                stretched = (q[:, joint.q] - rest) * at_joint
                yield place(f"stiffness of {names[v]}", of_stiffness, tree.stiffness[i], stretched)
    if len(tree.joint_names) > 1:
        yield place("damping added to every joint", "N m s/rad", 0.0, qd)


def numbers(equations: Equations) -> Iterator[Place]:
    """Every number of the tree. "anchor": the joint moves, all that it carries stays in place."""
    tree, stated = equations.tree, equations.stated
    length = max(1e-3, float(np.abs(stated["offset"]).max()), float(np.abs(stated["com"]).max()))
    heaviest = stated["mass"].max()

    def number(name: str, unit: str, size: float, path: Path, least: float = -np.inf) -> Place:
        now = float(stated[path.field][path.at])
        return Place("number", name, now, unit, float(size), ((path, 1.0),), least=least)

    def triple(name: str, unit: str, size: float, field: str, *index: int) -> list[Place]:
        return [number(name.format(axis), unit, size, Path(field, (*index, k))) for k, axis in enumerate(XYZ)]

    for b, body in enumerate(tree.body_names):
        heavy = stated["mass"][b] or heaviest
        yield number(f"mass of {body}", "kg", heavy, Path("mass", (b,)), least=0.0)
        yield from triple(f"CoM {{}} of {body}", "m", length, "com", b)
        size = np.abs(stated["inertia"][b]).max() or heavy * length**2
        for name, i, j in INERTIA:
            path, mirrored = Path("inertia", (b, i, j)), Path("inertia", (b, j, i))
            place = number(f"inertia {name} of {body}", "kg m2", size, path, 0.0 if i == j else -np.inf)
            yield place if i == j else place._replace(moves=((path, 1.0), (mirrored, 1.0)))
    for i, (name, joint) in enumerate(zip(tree.joint_names, tree.coordinates.joints)):
        carried = [("com", b) for b, of_joint in enumerate(tree.body_joint) if of_joint == i]
        carried += [("offset", j) for j, parent in enumerate(tree.parent) if parent == i]
        for k, place in enumerate(triple(f"offset {{}} of {name}", "m", length, "offset", i)):
            yield place
            if joint.kind != "slide":
                stays = [(Path(field, (index, k)), -1.0) for field, index in carried]
                yield place._replace(name=f"anchor {XYZ[k]} of {name}", moves=(*place.moves, *stays))
        if joint.kind != "ball":
            size = length if joint.kind == "slide" else 1.0
            zero = number(f"zero of {name}", unit_of("rad", joint.kind), size, Path("reference", (i,)))
            yield zero._replace(kind=OF_ZERO)
            yield from triple(f"axis {{}} of {name}", "", 0.5, "axis", joint.qd.start)
        for speed in range(joint.qd.start, joint.qd.stop):
            size = heaviest * (1.0 if joint.kind == "slide" else length**2)
            path, unit = Path("armature", (speed,)), unit_of("kg m2", joint.kind)
            yield number(f"armature of {equations.speeds[speed]}", unit, size, path, least=0.0)
    yield from triple("gravity {}", "m/s2", 9.81, "gravity")


def terms(equations: Equations) -> Iterator[Place]:
    """The factor of every term of each body and of all bodies together; 1 is right."""
    called = {name: (term,) for term, name in OF_TERM.items()} | TOGETHER
    for name, together in called.items():
        added = np.sum([equations.terms[term] for term in together], axis=0)
        for body, numbers in groups(equations.tree).items():
            yield factor("term", name.format(body), added[numbers].sum(axis=0), ALL)


def parts_of_terms(equations: Equations) -> Iterator[Place]:
    """The factor of each part of a term of a body in an entry of M, in M, and in M and h, for a few hinges.

    T is a sum over the offsets that carry the body and its CoM, T' m T over pairs of these lengths.
    """
    tree, in_M = equations.tree, equations.in_M
    if set(tree.kind) != {"hinge"} or equations.nv > MOST_HINGES:
        return
    entries = [entry.named(equations.speeds) for entry in equations.entries[in_M]]
    for name, column in parts_of_bodies(equations).items():
        active = np.abs(column).max(axis=0) > FIT_ROUNDING * np.abs(column).max()
        in_entries = np.flatnonzero(active[in_M]).tolist()
        for k in in_entries:
            yield factor("part", f"{name} in {entries[k]}", column[:, k], k)
        if name.startswith("mass") and len(in_entries) > 1:  # `terms` has those of B' I B
            yield factor("part", f"{name} in M", column[:, in_M], in_M)
        if name.startswith("mass") and active[equations.in_h].any():
            yield factor("part", name, column, ALL)


def parts_of_bodies(equations: Equations) -> dict[str, np.ndarray]:
    """What each part of a term of a body adds to Mbar and h, (states, entries)."""
    tree, parts = equations.tree, {}
    fields = ("mass", "inertia", "offset", "com", "gravity", "armature")
    all_numbers = [(Path(name, at), x) for name in fields for at, x in np.ndenumerate(equations.stated[name])]

    def alone(*present: tuple[str, int]) -> np.ndarray:
        """Mbar and h if all masses, tensors and lengths are zero except some."""
        absent = [(path, x) for path, x in all_numbers if (path.field, path.at[0]) not in present]
        return equations.values({path: np.array([-x]) for path, x in absent})[0]

    carried = [i for i, parent in enumerate(tree.parent) if parent >= 0]
    lengths = {f"offset of {tree.joint_names[i]}": ("offset", i) for i in carried}
    for b, body in enumerate(tree.body_names):
        mass = ("mass", b)
        parts[f"B' I B of {body}"] = alone(("inertia", b))
        of_body = lengths | {f"CoM of {body}": ("com", b)}
        squares = {name: alone(mass, length) for name, length in of_body.items()}
        for first, second in combinations_with_replacement(of_body, 2):
            if first == second:
                parts[f"mass of {body} * ({first})^2"] = squares[first]
            else:
                both = alone(mass, of_body[first], of_body[second])
                parts[f"mass of {body} * {first} * {second}"] = both - (squares[first] + squares[second])
    return parts


def groups(tree: tmt.Tree) -> dict[str, list[int]]:
    """Each body alone, and all together."""
    alone = {body: [b] for b, body in enumerate(tree.body_names)}
    return alone | ({EVERY_BODY: list(range(len(alone)))} if len(alone) > 1 else {})


def coefficients(equations: Equations) -> Iterator[Place]:
    """Entries of Mbar, entries of gravity, and the coefficients of products of rates in h; 1 is right."""
    nv, speeds, right, first_h = equations.nv, equations.speeds, equations.right, equations.in_M.stop
    for k, entry in enumerate(equations.entries):
        yield factor("coefficient", entry.named(speeds), right[:, k], k)
    for name, part in {"M": equations.in_M, "h": equations.in_h, "M and h": ALL}.items():
        yield factor("coefficient", f"all of {name}", right[:, part], part)
    rows = [Entry("h", (i,)).named(speeds) for i in range(nv)]
    at_rest = [equations.coefficients[Entry("gravity", (i,))] for i in range(nv)]
    for entry, column in equations.coefficients.items():
        i, *pair = entry.at
        if entry.kind == "gravity":
            yield factor("coefficient", f"{rows[i]} at rest", column, first_h + i)
        elif entry.kind == "velocity":
            rates = np.prod(equations.qd[:, pair], axis=1)
            yield factor("coefficient", entry.named(speeds), column * rates, first_h + i)
    if nv > MOST_SPEEDS:
        return
    for i, j in np.argwhere(~np.eye(nv, dtype=bool)).tolist():
        yield factor("coefficient", f"{rows[j]} at rest in {rows[i]}", at_rest[j], first_h + i, stated=0.0)
    for term, (b, body) in product(BODY_TERMS[2:], enumerate(equations.tree.body_names)):
        added = equations.terms[term][b]
        for i, row in enumerate(rows):  # the factor of a term of a body in one row of h alone
            yield factor("term", f"{OF_TERM[term].format(body)} in {row}", added[:, first_h + i], first_h + i)
