"""The places where equations can be wrong by one number: of the model, of a term, of a coefficient.

A change x of a place adds x times a coefficient to numbers of the tree, or x times a column of values to
entries of Mbar or h. The zero of a joint is a convention and has rank 1; the other numbers have rank 2.
"""

from collections.abc import Iterator
from itertools import chain, combinations, combinations_with_replacement, product
from typing import NamedTuple

import numpy as np

import tmt

from ..core.cause import Cause
from ..core.words import listed
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
MOST_JOINTS = 4  # whose single entries of Mbar are tried
OF_ZERO = "zero position"  # the kind of a place
FIT_ROUNDING = 1e-11  # of the size of a number: what a fit leaves of a number that is 0
SMALL = 1e-9  # of the other numbers: a number that a regression leaves at 0
ALL = slice(None)  # entries of a state
Entries = slice | list[int]
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
    column: np.ndarray | None = None  # what a change of 1 adds to the values instead, (states, entries)
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
        """Whether no mass, inertia, damping or stiffness is below zero."""
        return self.value(change) >= self.least

    def cause(self, change: float) -> Cause:
        """The change as a cause."""
        rank, kind, stated, explains = self.rank, self.kind, float(self.stated), self.value(change)
        return Cause(rank=rank, kind=kind, place=self.name, stated=stated, explains=explains, unit=self.unit)


def factor(kind: str, name: str, column: np.ndarray, entries: Entries = ALL, stated: float = 1.0) -> Place:
    """The factor of what some entries of a column (states, entries) are; 1 is right."""
    chosen = np.zeros_like(column)
    chosen[:, entries] = column[:, entries]
    return Place(kind, name, stated, "times", 1.0, column=chosen)


def unit_of(unit: str, kind: str) -> str:
    """The unit of a number of a joint: as given, for a joint that turns, or its counterpart for a slide."""
    return OF_SLIDES.get(unit, unit) if kind == "slide" else unit


def is_common(factor: float) -> bool:
    """Whether a wrong term often has this factor."""
    return bool(np.isclose(factor, COMMON_FACTORS, rtol=0.0, atol=1e-6).any())


def all_places(equations: Equations) -> list[Place]:
    """The places that have an influence at some state, as far as that is known beforehand."""
    kinds = numbers, tied, masses_in_rows, terms, coefficients, forces_in_bias, parts_of_terms
    places = chain.from_iterable(places_of(equations) for places_of in kinds)
    return [place for place in places if place.column is None or place.column.any()]


def forces_in_bias(equations: Equations) -> Iterator[Place]:
    """Damping and springs of joints that were added to h."""
    zero = np.zeros_like(equations.right)
    for place in forces(equations.tree, equations.q, equations.qd):
        if place.column is not None and place.name.startswith(("damping", "stiffness")):
            part = "velocity terms" if place.name.startswith("damping") else "gravity"
            column = zero.copy()
            for i in range(equations.nv):
                column[:, equations.layout.of_row(i, part)] = place.column[:, i : i + 1]
            yield place._replace(kind="force", name=f"{place.name} in h", stated=0.0, column=column)


def forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Place]:
    """Damping, stiffness, rest of the spring, friction and a constant force of each joint, and damping of all together."""
    names = Coordinates(tree.joint_names, tree.kind).speeds

    def place(
        name: str, unit: str, stated: float, force: np.ndarray, least: float = 0.0, size: float = 1.0
    ) -> Place:
        return Place("number", name, stated, unit, size, column=force, least=least)

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


def tied(equations: Equations) -> Iterator[Place]:
    """The same number of bodies or joints that are alike, such as a left and a right one, changed together."""
    every = [place for place in numbers(equations) if place.kind == "number" and place.is_quadratic]
    for names in alike(equations.tree):
        of_each = [[place for place in every if place.name.endswith(f" of {name}")] for name in names]
        for same in zip(*of_each):
            name, moves = same[0].name.removesuffix(names[0]) + listed(names), (place.moves for place in same)
            yield same[0]._replace(name=name, moves=tuple(chain.from_iterable(moves)))


def alike(tree: tmt.Tree) -> Iterator[list[str]]:
    """The names of bodies with the same numbers, and of joints that carry them and have the same numbers."""
    bodies: dict[str, list[int]] = {}
    for b in range(len(tree.mass)):
        bodies.setdefault(repr((tree.mass[b], tree.com[b], tree.inertia[b])), []).append(b)
    for same in bodies.values():
        joints = [tree.body_joint[b] for b in same]
        numbers_of_joints = {repr((tree.kind[i], tree.offset[i])) for i in joints}
        if len(same) > 1:
            yield [tree.body_names[b] for b in same]
            if len(numbers_of_joints) == 1 and min(joints) >= 0:
                yield [tree.joint_names[i] for i in joints]


def masses_in_rows(equations: Equations) -> Iterator[Place]:
    """The mass of a body in the rows and columns of the hinges alone, or of the slides."""
    tree, layout = equations.tree, equations.layout
    of_slides = [joint.qd.start for joint in tree.coordinates.joints if joint.kind == "slide"]
    rows = {"hinges": [v for v in range(equations.nv) if v not in of_slides], "slides": of_slides}
    for name, those in rows.items() if all(rows.values()) else ():
        entries = [k for k, (i, j) in enumerate(zip(*layout.places)) if i in those and j in those]
        entries += [k for i in those for k in layout.of_row(i)]
        for b, body in enumerate(tree.body_names):
            added = np.sum(
                [equations.terms[term][b] for term in ("translation", "gravity", "convective")], axis=0
            )
            if tree.mass[b]:
                column = factor("number", "", added / tree.mass[b], entries).column
                yield Place(
                    "number",
                    f"mass of {body} in the rows of the {name}",
                    tree.mass[b],
                    "kg",
                    tree.mass[b],
                    column=column,
                    least=0.0,
                )


def terms(equations: Equations) -> Iterator[Place]:
    """The factor of every term of each body and of all bodies together; 1 is right."""
    called = {name: (term,) for term, name in OF_TERM.items()} | TOGETHER
    for name, together in called.items():
        added = np.sum([equations.terms[term] for term in together], axis=0)
        for body, numbers in groups(equations.tree).items():
            yield factor("term", name.format(body), added[numbers].sum(axis=0))


def parts_of_terms(equations: Equations) -> Iterator[Place]:
    """The factor of each part of a term of a body, in all and, for few joints, in an entry of M.

    T is a sum over the lengths that carry the body and its CoM, T' m T over pairs of these lengths.
    """
    if equations.nv > MOST_SPEEDS:
        return
    in_M = equations.in_M
    entries = [entry.named(equations.speeds) for entry in equations.entries[in_M]]
    for b, body in enumerate(equations.tree.body_names):
        for term, (k, entry) in product(BODY_TERMS[:2], enumerate(entries)):
            yield factor("term", f"{OF_TERM[term].format(body)} in {entry}", equations.terms[term][b], [k])
    for name, column in parts_of_bodies(equations).items():
        active = np.abs(column).max(axis=0) > FIT_ROUNDING * np.abs(column).max()
        for k in np.flatnonzero(active[in_M]).tolist() if equations.nv <= MOST_JOINTS else ():
            yield factor("part", f"{name} in {entries[k]}", column, [k])
        yield factor("part", name, column)


def lengths_of(tree: tmt.Tree, b: int) -> dict[str, list[tuple[str, int]]]:
    """What carries the CoM of a body: numbers of the tree by names; slides that follow each other are one."""
    lengths: dict[str, list[tuple[str, int]]] = {}
    moving = [i for i in range(len(tree.parent)) if tree.moves(b)[i]]
    slides: list[int] = []
    for i in moving:
        name = tree.joint_names[i]
        if tree.parent[i] >= 0 and np.any(tree.offset[i]):
            lengths[f"offset of {name}"] = [("offset", i)]
        if tree.kind[i] == "slide":
            together = bool(slides) and tree.parent[i] == slides[-1]
            before = lengths.pop(", ".join(tree.joint_names[k] for k in slides), []) if together else []
            slides = [*slides, i] if together else [i]
            called = ", ".join(tree.joint_names[k] for k in slides)
            lengths[called] = [*before, ("axis", tree.coordinates.joints[i].qd.start)]
    return lengths | {f"CoM of {tree.body_names[b]}": [("com", b)]}


def parts_of_bodies(equations: Equations) -> dict[str, np.ndarray]:
    """What each part of a term of a body adds to Mbar and h, (states, entries)."""
    tree, sets = equations.tree, {}  # name: numbers that are there, and whether gravity is
    moved_by_slides: set[str] = set()
    for b, body in enumerate(tree.body_names):
        lengths, mass = lengths_of(tree, b), ("mass", b)
        for (first, numbers), (second, others) in combinations_with_replacement(lengths.items(), 2):
            name = (
                f"mass of {body} * ({first})^2" if first == second else f"mass of {body} * {first} * {second}"
            )
            sets[name] = [mass, *numbers, *others]
            if numbers[0][0] == "axis" and first != second:
                moved_by_slides.add(name)
        sets |= {f"gravity of {body} at {name}": [mass, ("gravity", 0), *of] for name, of in lengths.items()}
    values = alone(equations, list(sets.values()))
    parts = dict(zip(sets, values))
    for b, body in enumerate(tree.body_names):
        for first, second in combinations(lengths_of(tree, b), 2):
            name = f"mass of {body} * {first} * {second}"
            parts[name] = (
                parts[name] - parts[f"mass of {body} * ({first})^2"] - parts[f"mass of {body} * ({second})^2"]
            )
        for name in lengths_of(tree, b):
            parts[f"gravity of {body} at {name}"] = (
                parts[f"gravity of {body} at {name}"] - parts[f"mass of {body} * ({name})^2"]
            )
        for first, second in combinations(lengths_of(tree, b), 2):
            name = f"mass of {body} * {first} * {second}"
            if name in moved_by_slides:  # the first moment, of gravity too
                parts[name] = parts[name] + parts[f"gravity of {body} at {second}"]
    return {name: column for name, column in parts.items() if column.any()}


def alone(equations: Equations, sets: list[list[tuple[str, int]]]) -> np.ndarray:
    """Mbar and h if all masses, tensors and lengths are zero except sets of them, (sets, states, entries)."""
    changes: dict[Path, np.ndarray] = {}
    of_slides = {joint.qd.start for joint in equations.tree.coordinates.joints if joint.kind == "slide"}
    for field in ("mass", "inertia", "offset", "com", "gravity", "armature", "axis"):
        for at, x in np.ndenumerate(equations.stated[field]):
            number = (field, 0 if field == "gravity" else at[0])
            if x and (field != "axis" or at[0] in of_slides):
                changes[Path(field, at)] = np.array([0.0 if number in present else -x for present in sets])
    return equations.values(changes)


def groups(tree: tmt.Tree) -> dict[str, list[int]]:
    """Each body alone, and all together."""
    alone = {body: [b] for b, body in enumerate(tree.body_names)}
    return alone | ({EVERY_BODY: list(range(len(alone)))} if len(alone) > 1 else {})


def coefficients(equations: Equations) -> Iterator[Place]:
    """Entries of Mbar, entries of gravity, and the coefficients of products of rates in h; 1 is right."""
    nv, speeds, right, layout = equations.nv, equations.speeds, equations.right, equations.layout
    zero = np.zeros_like(right)
    for k, entry in enumerate(equations.entries[equations.in_M]):
        yield factor("coefficient", entry.named(speeds), right, [k])
    for block, entries in blocks(equations).items():
        yield factor("coefficient", block, right, entries)
    parts = {"M": equations.in_M, "h": equations.in_h, "M and h": ALL} if layout.qdd is None else {}
    for name, part in parts.items():
        yield factor("coefficient", f"all of {name}", right, part)
    rows = [Entry("h", (i,)).named(speeds) for i in range(nv)]
    for i, row in enumerate(rows):
        yield factor("coefficient", row, right, layout.of_row(i))

    def in_row(values: np.ndarray, i: int, part: str) -> np.ndarray:
        column = zero.copy()
        column[:, layout.of_row(i, part)] = values[:, None]
        return column

    for entry, values in equations.coefficients.items():
        i, *pair = entry.at
        if entry.kind == "gravity":
            yield factor("coefficient", f"{rows[i]} at rest", in_row(values, i, "gravity"))
        elif entry.kind == "velocity":
            rates = np.prod(equations.qd[:, pair], axis=1)
            yield factor("coefficient", entry.named(speeds), in_row(values * rates, i, "velocity terms"))
    if nv > MOST_SPEEDS:
        return
    for (first, of_first), (second, of_second) in combinations_with_replacement(
        speeds_of_joints(equations.tree).items(), 2
    ):
        column = zero.copy()
        for entry, values in equations.coefficients.items():
            i, *pair = entry.at
            if entry.kind == "velocity" and is_between(pair[0], pair[1], of_first, of_second):
                column[:, layout.of_row(i, "velocity terms")] += (
                    values * np.prod(equations.qd[:, pair], axis=1)
                )[:, None]
        yield factor("coefficient", f"products of the speeds of {first} and {second} in h", column)
    at_rest = [equations.coefficients[Entry("gravity", (i,))] for i in range(nv)]
    for i, j in np.argwhere(~np.eye(nv, dtype=bool)).tolist():
        yield factor(
            "coefficient", f"{rows[j]} at rest in {rows[i]}", in_row(at_rest[j], i, "gravity"), stated=0.0
        )
    for term, (b, body) in product(BODY_TERMS[2:], enumerate(equations.tree.body_names)):
        for i, row in enumerate(rows):  # the factor of a term of a body in one row of h alone
            yield factor(
                "term", f"{OF_TERM[term].format(body)} in {row}", equations.terms[term][b], layout.of_row(i)
            )


def blocks(equations: Equations) -> dict[str, list[int]]:
    """Entries of Mbar that couple two joints of several speeds, by their name; slides of a free joint are one."""
    joints, found = speeds_of_joints(equations.tree), {}
    for (first, of_first), (second, of_second) in combinations_with_replacement(joints.items(), 2):
        inside = [
            k
            for k, (i, j) in enumerate(zip(*equations.layout.places))
            if is_between(i, j, of_first, of_second)
        ]
        if max(len(of_first), len(of_second)) > 1:
            found[f"M[{first}][{second}]"] = inside
    return found


def speeds_of_joints(tree: tmt.Tree) -> dict[str, list[int]]:
    """The numbers of the speeds of each joint, and of the three slides of each free joint."""
    joints = {
        name: list(range(joint.qd.start, joint.qd.stop))
        for name, joint in zip(tree.joint_names, tree.coordinates.joints)
    }
    for i, kind in enumerate(tree.kind):
        slides = [tree.joint_names[k] for k in range(i - 3, i) if k >= 0 and tree.kind[k] == "slide"]
        if kind == "ball" and len(slides) == 3:
            joints[", ".join(slides)] = [v for name in slides for v in joints[name]]
    return joints


def is_between(i: int, j: int, first: list[int], second: list[int]) -> bool:
    """Whether an entry couples a speed of one joint with one of another."""
    return (i in first and j in second) or (j in first and i in second)
