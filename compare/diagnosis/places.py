"""The places where equations can be wrong by one number: of the model, of a term, of a coefficient.

A change x of a place adds x times a coefficient to entries of the tree (or to factors of terms), or x times a column of values
to entries of Mbar or h. The zero of a joint is a convention and has rank 1; the other numbers have rank 2.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations_with_replacement
from typing import NamedTuple

import numpy as np

import tmt

from ..robots.joint_map import within_a_turn
from .cause import Change
from .model import BODY_TERMS, MOST_SPEEDS, OF_TERM, Equations, Path

XYZ = "xyz"
INERTIA = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
TOGETHER = {  # terms that are often left out together
    "all moments of {} in the bias": ("Euler", "gyroscopic"),
    "velocity terms of {} in h": ("convective", "Euler", "gyroscopic"),
    "all of the rotation of {}": ("rotation", "Euler", "gyroscopic"),
}
EVERY_BODY = "every body"
COMMON_FACTORS = (-1.0, 0.0, 0.5, 1.0, 2.0)
MOST_HINGES = 3  # whose single terms of Mbar are tried
OF_ZERO = "zero position"  # the kind of a place
FIT_ROUNDING = 1e-11  # of the size of a number: what a fit leaves of a number that is 0
TURNING = ("N m s/rad", "N m/rad", "N m")
UNITS_OF_FORCES = {
    "hinge": TURNING,
    "slide": ("N s/m", "N/m", "N"),
    "ball": TURNING,
}  # of damping, stiffness, force


class Place(NamedTuple):
    """One number that can be wrong."""

    rank: int
    kind: str  # "number", "force", "term", "part" of a term, "coefficient" or OF_ZERO
    name: str
    stated: float
    unit: str
    size: float  # of a change that matters, for starts of a search
    moves: tuple[tuple[Path, float], ...] = ()  # entries of the tree, and how far they go with a change of 1
    column: np.ndarray | None = None  # what a change of 1 adds to `entry` instead, (states, ...)
    entry: int | slice = slice(None)  # of the values of a state
    least: float = -np.inf  # possible value

    @property
    def is_quadratic(self) -> bool:
        """Whether Mbar and h are a polynomial of second degree in it."""
        return not any(path.field in ("axis", "reference") for path, _ in self.moves)

    def value(self, change: float) -> float:
        """The value after a change; 0 where only the digits of a fit remain."""
        value = self.stated + change
        return 0.0 if abs(value) < FIT_ROUNDING * self.size else float(value)

    def is_possible(self, change: float) -> bool:
        """Whether no mass, moment of inertia, damping or stiffness is below zero, and a part has a common factor."""
        return self.value(change) >= self.least and (self.kind != "part" or is_common(self.value(change)))

    def changed(self, change: float) -> Change:
        """The change as it is said; the zero of a hinge is at most half a turn from the stated one."""
        value = self.value(within_a_turn(change, self.unit == "m") if self.kind == OF_ZERO else change)
        return Change(self.kind, self.name, float(self.stated), value, self.unit)


def is_common(factor: float) -> bool:
    """Whether a wrong term often has this factor."""
    return bool(np.isclose(factor, COMMON_FACTORS, rtol=0.0, atol=1e-6).any())


def all_places(equations: Equations) -> list[Place]:
    kinds = numbers, terms, coefficients, forces_in_bias, parts_of_terms
    return [place for places_of in kinds for place in places_of(equations)]


def forces_in_bias(equations: Equations) -> Iterator[Place]:
    """Damping and springs of joints that were added to h."""
    tree, bias = equations.tree, slice(-equations.nv, None)
    for place in forces(tree, equations.q, equations.qd):
        if place.name.startswith(("damping", "stiffness")):
            yield place._replace(kind="force", name=f"{place.name} in h", stated=0.0, entry=bias)


def forces(tree: tmt.Tree, q: np.ndarray, qd: np.ndarray) -> Iterator[Place]:
    """Damping, stiffness, friction and a constant force of each joint, and damping of all together."""

    def place(name: str, unit: str, stated: float, force: np.ndarray, least: float = 0.0) -> Place:
        return Place(2, "number", name, stated, unit, 1.0, column=force, least=least)

    joints = tree.coordinates.joints
    for i, (name, joint) in enumerate(zip(tree.joint_names, joints)):
        of_damping, of_stiffness, of_force = UNITS_OF_FORCES[joint.kind]
        for v in range(joint.qd.start, joint.qd.stop):
            axis = name if joint.kind != "ball" else f"{name} {XYZ[v - joint.qd.start]}"
            own, speed = np.eye(qd.shape[1])[v], qd[:, v : v + 1]
            yield place(f"damping of {axis}", of_damping, tree.damping[v], speed * own)
            yield place(f"friction of {axis}", of_force, 0.0, np.sign(speed) * own)
            yield place(f"constant force at {axis}", of_force, 0.0, np.ones_like(speed) * own, -np.inf)
            if joint.kind != "ball":
                rest = tree.rest[joint.q.start] if tree.stiffness[i] else tree.reference[i]
                yield place(
                    f"stiffness of {axis}", of_stiffness, tree.stiffness[i], (q[:, joint.q] - rest) * own
                )
    if len(joints) > 1:
        yield place("damping added to every joint", "N m s/rad", 0.0, qd)


def numbers(equations: Equations) -> list[Place]:
    """Every number of the tree. "anchor": the joint moves, all that it carries stays in place."""
    tree, stated = equations.tree, equations.stated
    length = max(1e-3, float(np.abs(stated["offset"]).max()), float(np.abs(stated["com"]).max()))
    places = []

    def add(name, field, index, unit, size, *more, least=-np.inf, rank=2, kind="number"):
        moves = ((Path(field, index), 1.0), *more)
        places.append(
            Place(rank, kind, name, float(stated[field][index]), unit, float(size), moves, least=least)
        )

    for b, body in enumerate(tree.body_names):
        heavy = stated["mass"][b] or stated["mass"].max()
        add(f"mass of {body}", "mass", (b,), "kg", heavy, least=0.0)
        for k, axis in enumerate(XYZ):
            add(f"CoM {axis} of {body}", "com", (b, k), "m", length)
        size = np.abs(stated["inertia"][b]).max() or heavy * length**2
        for name, i, j in INERTIA:
            mirrored = () if i == j else ((Path("inertia", (b, j, i)), 1.0),)
            least = 0.0 if i == j else -np.inf
            add(f"inertia {name} of {body}", "inertia", (b, i, j), "kg m2", size, *mirrored, least=least)
    carried = [[b for b, joint in enumerate(tree.body_joint) if joint == i] for i in range(len(tree.parent))]
    following = [[j for j, parent in enumerate(tree.parent) if parent == i] for i in range(len(tree.parent))]
    for i, (name, joint) in enumerate(zip(tree.joint_names, tree.coordinates.joints)):
        for k, axis in enumerate(XYZ):
            add(f"offset {axis} of {name}", "offset", (i, k), "m", length)
            if joint.kind != "slide":
                stays = [(Path("com", (b, k)), -1.0) for b in carried[i]]
                stays += [(Path("offset", (j, k)), -1.0) for j in following[i]]
                add(f"anchor {axis} of {name}", "offset", (i, k), "m", length, *stays)
        if joint.kind != "ball":
            unit, size = ("m", length) if joint.kind == "slide" else ("rad", 1.0)
            add(f"zero of {name}", "reference", (i,), unit, size, rank=1, kind=OF_ZERO)
            for k, axis in enumerate(XYZ):
                add(f"axis {axis} of {name}", "axis", (joint.qd.start, k), "", 0.5)
        for speed in range(joint.qd.start, joint.qd.stop):
            rotor, scale = ("kg", 1.0) if joint.kind == "slide" else ("kg m2", length**2)
            axis = name if joint.kind != "ball" else f"{name} {XYZ[speed - joint.qd.start]}"
            add(f"armature of {axis}", "armature", (speed,), rotor, stated["mass"].max() * scale, least=0.0)
    for k, axis in enumerate(XYZ):
        add(f"gravity {axis}", "gravity", (k,), "m/s2", 9.81)
    return places


def terms(equations: Equations) -> Iterator[Place]:
    """The factor of every term of each body and of all bodies together; 1 is right."""
    called = {name: (term,) for term, name in OF_TERM.items()} | TOGETHER
    for name, together in called.items():
        for body, which in groups(equations.tree).items():
            moves = tuple(
                (Path("factor", (b, BODY_TERMS.index(term))), 1.0) for b in which for term in together
            )
            yield Place(2, "term", name.format(body), 1.0, "times", 1.0, moves)


def parts_of_terms(equations: Equations) -> Iterator[Place]:
    """The factor of each part of a term of a body in an entry of M, in M, and in M and h, for a few hinges.

    T is a sum over the offsets of the joints that carry the body and its CoM, T' m T over pairs of these lengths.
    """
    tree, count = equations.tree, len(equations.triangle[0])
    if set(tree.kind) != {"hinge"} or equations.nv > MOST_HINGES:
        return
    entries = [entry_name(entry, equations.names) for entry in equations.entries[:count]]
    lengths = [
        (f"offset of {name}", ("offset", i)) for i, name in enumerate(tree.joint_names) if tree.parent[i] >= 0
    ]

    def alone(*kept: tuple[str, int]) -> np.ndarray:
        """Mbar and h if all masses, tensors and lengths are zero except some."""
        fields = ("mass", "inertia", "offset", "com", "gravity", "armature")
        entries = [(field, at, x) for field in fields for at, x in np.ndenumerate(equations.stated[field])]
        others = {Path(field, at): np.array([-x]) for field, at, x in entries if (field, at[0]) not in kept}
        return equations.values(others)[0]

    for b, body in enumerate(tree.body_names):
        added = {f"B' I B of {body}": alone(("inertia", b))}
        for one, other in combinations_with_replacement([*lengths, (f"CoM of {body}", ("com", b))], 2):
            name = f"({one[0]})^2" if one == other else f"{one[0]} * {other[0]}"
            squares = 0.0 if one == other else sum(alone(("mass", b), of) for _, of in (one, other))
            added[f"mass of {body} * {name}"] = alone(("mass", b), one[1], other[1]) - squares
        for name, column in added.items():
            active = np.abs(column).max(axis=0) > FIT_ROUNDING * np.abs(column).max()
            parts = {f"{name} in {entries[k]}": k for k in np.flatnonzero(active[:count])}
            if name.startswith("mass"):  # `terms` has those of B' I B
                parts |= {f"{name} in M": slice(count)} if len(parts) > 1 else {}
                parts |= {name: slice(None)} if active[count:].any() else {}
            for place, part in parts.items():
                yield Place(2, "part", place, 1.0, "times", 1.0, column=column[:, part], entry=part)


def groups(tree: tmt.Tree) -> dict[str, list[int]]:
    """Each body alone, and all together."""
    alone = {body: [b] for b, body in enumerate(tree.body_names)}
    return alone | ({EVERY_BODY: list(range(len(alone)))} if len(alone) > 1 else {})


def entry_name(entry: tuple, names: Sequence[str]) -> str:
    """An entry of Mbar or h, "M[hip][knee]", or a coefficient of h, "h[hip], gravity"; see `coefficients_of`."""
    kind, *indices = entry
    if kind == "gravity":
        return f"h[{names[indices[0]]}], gravity"
    if kind == "velocity":
        i, j, k = indices
        rates = f"{names[j]}'^2" if j == k else f"{names[j]}' {names[k]}'"
        return f"h[{names[i]}], coefficient of {rates}"
    return kind + "".join(f"[{names[i]}]" for i in sorted(indices))


def coefficients(equations: Equations) -> list[Place]:
    """Entries of Mbar, entries of gravity, and the coefficients of products of rates in h; 1 is right."""
    nv, names, qd, right = equations.nv, equations.names, equations.qd, equations.values()[0]
    parts, places = len(equations.triangle[0]), []

    def add(name, entry, column, stated=1.0, kind="coefficient"):
        if np.abs(column).max() > 0.0:
            places.append(Place(2, kind, name, stated, "times", 1.0, column=column, entry=entry))

    for k, entry in enumerate(equations.entries):
        add(entry_name(entry, names), k, right[:, k])
    for name, part in {"M": slice(parts), "h": slice(parts, None), "M and h": slice(None)}.items():
        add(f"all of {name}", part, right[:, part])
    of_h = equations.coefficients()
    for (kind, i, *pair), column in of_h.items():
        name = (
            f"{entry_name(('h', i), names)} at rest"
            if kind == "gravity"
            else entry_name((kind, i, *pair), names)
        )
        add(name, parts + i, column * np.prod(qd[:, pair], axis=1))
    if nv > MOST_SPEEDS:
        return places
    for i, j in np.argwhere(~np.eye(nv, dtype=bool)).tolist():
        name = f"{entry_name(('h', j), names)} at rest in {entry_name(('h', i), names)}"
        add(name, parts + i, of_h["gravity", j], 0.0)
    of_bias = [
        place for place in terms(equations) if len(place.moves) == 1 and place.moves[0][0].index[1] > 1
    ]
    for place in of_bias:  # the factor of each term of each body in one row of h alone
        added = (equations.values({place.moves[0][0]: np.ones(1)})[0] - right)[:, -nv:]
        for i in range(nv):
            add(f"{place.name} in {entry_name(('h', i), names)}", parts + i, added[:, i], kind="term")
    return places
