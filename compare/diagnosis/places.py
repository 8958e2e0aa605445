"""The places where equations can be wrong by one number: of the model, of a term, of a coefficient.

A change x of a place adds x times a coefficient to entries of the tree (or to factors of terms), or x times a column of values
to an entry of Mbar or h. The zero of a joint is a convention and has rank 1; the other numbers have rank 2.
"""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from .model import BODY_TERMS, Equations, Path

XYZ = "xyz"
INERTIA = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
OF_TERM = {
    "translation": "T' m T of {}", "rotation": "B' I B of {}", "gravity": "gravity term T' m g of {}",
    "convective": "convective term T' m v_conv of {}", "Euler": "Euler term B' I w_conv of {}",
    "gyroscopic": "gyroscopic term B' (omega x I omega) of {}",
}  # fmt: skip
TOGETHER = {  # terms that are often left out together
    "all moments of {} in the bias": ("Euler", "gyroscopic"),
    "velocity terms of {} in h": ("convective", "Euler", "gyroscopic"),
    "all of the rotation of {}": ("rotation", "Euler", "gyroscopic"),
}
OF_BIAS = ("gravity", "convective", "Euler", "gyroscopic")  # of the terms, those of h
EVERY_BODY = "every body"
OF_ZERO = "zero position"  # the kind of a place
MOST_SPEEDS = 12  # with more, coefficients of products of speeds are not tried: there are nv^2 (nv + 1) / 2


class Place(NamedTuple):
    """One number that can be wrong."""

    rank: int
    kind: str  # "number", "term", "coefficient"
    name: str
    stated: float
    unit: str
    size: float  # of a change that matters, for starts of a search
    moves: tuple[tuple[Path, float], ...] = ()  # entries of the tree, and how far they go with a change of 1
    entry: int | slice | None = None  # of the values of a state, with a column of its own instead
    column: np.ndarray | None = None  # (states,), of several entries (states, entries)

    @property
    def is_zero(self) -> bool:
        """Whether it is the zero of a joint."""
        return self.kind == OF_ZERO

    @property
    def is_quadratic(self) -> bool:
        """Whether Mbar and h are a polynomial of second degree in it."""
        return not any(path.field in ("axis", "reference") for path, _ in self.moves)


def all_places(equations: Equations) -> list[Place]:
    return [*numbers(equations), *terms(equations), *coefficients(equations), *forces_in_bias(equations)]


def forces_in_bias(equations: Equations) -> list[Place]:
    """Damping and springs of joints that were added to h."""
    tree, nv, places = equations.tree, equations.nv, []
    first = len(equations.entries) - nv

    def add(name, unit, entry, column):
        places.append(Place(2, "force", f"{name} in h", 0.0, unit, 1.0, entry=entry, column=column))

    for i, (joint, (kind, at, by)) in enumerate(zip(tree.hinge_names, tree.coordinates.joints)):
        of_speed, of_length = ("N s/m", "N/m") if kind == "slide" else ("N m s/rad", "N m/rad")
        for v in range(by.start, by.stop):
            name = joint if kind != "ball" else f"{joint} {XYZ[v - by.start]}"
            add(f"damping of {name}", of_speed, first + v, equations.qd[:, v])
        if kind != "ball":
            stretched = equations.q[:, at.start] - tree.reference[i]
            add(f"stiffness of {joint}", of_length, first + by.start, stretched)
    if nv > 1:
        add("the same damping of every joint", "N m s/rad", slice(first, first + nv), equations.qd)
    return places


def numbers(equations: Equations) -> list[Place]:
    """Every number of the tree. "anchor": the joint moves, all that it carries stays in place."""
    tree, stated = equations.tree, equations.stated
    length = max(1e-3, float(np.abs(stated["offset"]).max()), float(np.abs(stated["com"]).max()))
    places = []

    def add(kind, name, field, index, unit, size, *more, rank=2):
        moves = ((Path(field, index), 1.0), *more)
        places.append(Place(rank, kind, name, float(stated[field][index]), unit, float(size), moves))

    for b, body in enumerate(tree.body_names):
        heavy = stated["mass"][b] or stated["mass"].max()
        add("number", f"mass of {body}", "mass", (b,), "kg", heavy)
        for k, axis in enumerate(XYZ):
            add("number", f"CoM {axis} of {body}", "com", (b, k), "m", length)
        size = np.abs(stated["inertia"][b]).max() or heavy * length**2
        for name, i, j in INERTIA:
            mirrored = () if i == j else ((Path("inertia", (b, j, i)), 1.0),)
            add("number", f"inertia {name} of {body}", "inertia", (b, i, j), "kg m2", size, *mirrored)
    carried = [[b for b, joint in enumerate(tree.body_hinge) if joint == i] for i in range(len(tree.parent))]
    following = [[j for j, parent in enumerate(tree.parent) if parent == i] for i in range(len(tree.parent))]
    for i, (joint, (kind, _, by)) in enumerate(zip(tree.hinge_names, tree.coordinates.joints)):
        for k, axis in enumerate(XYZ):
            add("number", f"offset {axis} of {joint}", "offset", (i, k), "m", length)
            if kind != "slide":
                stays = [(Path("com", (b, k)), -1.0) for b in carried[i]]
                stays += [(Path("offset", (j, k)), -1.0) for j in following[i]]
                add("number", f"anchor {axis} of {joint}", "offset", (i, k), "m", length, *stays)
        if kind != "ball":
            unit = "m" if kind == "slide" else "rad"
            add(OF_ZERO, f"zero of {joint}", "reference", (i,), unit, length if kind == "slide" else 1.0, rank=1)
            for k, axis in enumerate(XYZ):
                add("number", f"axis {axis} of {joint}", "axis", (by.start, k), "", 0.5)
        for speed in range(by.start, by.stop):
            rotor = "kg" if kind == "slide" else "kg m2"
            size = stated["mass"].max() * (1.0 if kind == "slide" else length**2)
            name = joint if kind != "ball" else f"{joint} {XYZ[speed - by.start]}"
            add("number", f"armature of {name}", "armature", (speed,), rotor, size)
    for k, axis in enumerate(XYZ):
        add("number", f"gravity {axis}", "gravity", (k,), "m/s2", 9.81)
    return places


def terms(equations: Equations) -> list[Place]:
    """The factor of every term of each body and of all bodies together; 1 is right."""
    bodies = equations.tree.body_names
    groups = {body: [b] for b, body in enumerate(bodies)}
    if len(bodies) > 1:
        groups[EVERY_BODY] = list(range(len(bodies)))
    called = {name: (term,) for term, name in OF_TERM.items()} | TOGETHER
    places = []
    for name, together in called.items():
        for body, which in groups.items():
            moves = tuple((Path("factor", (b, BODY_TERMS.index(term))), 1.0) for b in which for term in together)
            places.append(Place(2, "term", name.format(body), 1.0, "times", 1.0, moves))
    return places


def entry_name(entry: tuple, names: Sequence[str]) -> str:
    """An entry of Mbar or h, "M[hip][knee]"; the entry of Mbar above the diagonal names both."""
    kind, *indices = entry
    return kind + "".join(f"[{names[i]}]" for i in sorted(indices))


def rates_name(j: int, k: int, names: Sequence[str]) -> str:
    """A product of two speeds, "hip' knee'"."""
    return f"{names[j]}'^2" if j == k else f"{names[j]}' {names[k]}'"


def coefficients(equations: Equations) -> list[Place]:
    """Entries of Mbar, entries of gravity, and the coefficients of products of rates in h; 1 is right."""
    nv, states, names = equations.nv, len(equations.q), equations.names
    values = dict(zip(equations.entries, equations.values()[0].T))
    at = {entry: k for k, entry in enumerate(equations.entries)}
    places = []

    def add(name, entry, column, stated=1.0):
        places.append(Place(2, "coefficient", name, stated, "times", 1.0, entry=entry, column=column))

    for i, j in zip(*map(np.ndarray.tolist, equations.triangle)):
        add(entry_name(("M", i, j), names), at["M", i, j], values["M", i, j])
    whole, parts = equations.values()[0], len(equations.triangle[0])
    for name, part in {"M": slice(parts), "h": slice(parts, None), "M and h": slice(None)}.items():
        add(f"all of {name}", part, whole[:, part])
    of_rates, weight = products_of_rates(equations) if nv <= MOST_SPEEDS else ({}, bias_at_rest(equations))
    for i in range(nv):
        row, entry = entry_name(("h", i), names), at["h", i]
        add(row, entry, values["h", i])
        add(f"{row} at rest", entry, weight[:, i])
        for j in range(nv) if nv <= MOST_SPEEDS else ():
            if j != i:
                add(f"{entry_name(('h', j), names)} at rest in {row}", entry, weight[:, j], stated=0.0)
        for (j, k), column in of_rates.items():
            name = f"{row}, coefficient of {rates_name(j, k, names)}"
            add(name, entry, column[:, i] * equations.qd[:, j] * equations.qd[:, k])
    places += terms_of_rows(equations) if nv <= MOST_SPEEDS else []
    return [place for place in places if np.abs(place.column).max() > 0.0 and len(place.column) == states]


def terms_of_rows(equations: Equations) -> list[Place]:
    """The factor of each term of each body in one row of h alone."""
    nv, right = equations.nv, equations.values()[0]
    names = [name for name in OF_TERM if name in OF_BIAS]
    indices = [(b, BODY_TERMS.index(name)) for b in range(len(equations.tree.mass)) for name in names]
    changes = {Path("factor", index): row for index, row in zip(indices, np.eye(len(indices)))}
    added = equations.values(changes) - right  # of each term doubled, (terms, states, entries)
    places = []
    for (b, term), column in zip(indices, added[..., -nv:]):
        for i in range(nv):
            of = OF_TERM[BODY_TERMS[term]].format(equations.tree.body_names[b])
            name = f"{of} in {entry_name(('h', i), equations.names)}"
            at = right.shape[1] - nv + i
            places.append(Place(2, "term", name, 1.0, "times", 1.0, entry=at, column=column[:, i]))
    return places


def bias_at_rest(equations: Equations) -> np.ndarray:
    """h without rates, (states, nv)."""
    still = Equations(equations.tree, equations.q, np.zeros_like(equations.qd))
    return still.values()[0][:, -equations.nv :]


def products_of_rates(equations: Equations) -> tuple[dict, np.ndarray]:
    """The coefficient of qd_j qd_k in h, {(j, k): (states, nv)} with j at most k, and h at rest, (states, nv).

    h is quadratic in the rates: c_jj = (h(e_j) + h(-e_j) - 2 h(0)) / 2, c_jk = h(e_j + e_k) - h(e_j) - h(e_k) + h(0).
    """
    nv, states = equations.nv, len(equations.q)
    pairs = [(j, k) for j in range(nv) for k in range(j, nv)]
    rates = [np.zeros(nv)] + [np.eye(nv)[j] + (np.eye(nv)[k] if k != j else 0.0) for j, k in pairs]
    q, qd = np.tile(equations.q, (len(rates), 1)), np.repeat(rates, states, axis=0)
    h = Equations(equations.tree, q, qd).values()[0, :, -nv:].reshape(len(rates), states, nv)
    weight, single = h[0], {j: h[1 + pairs.index((j, j))] for j in range(nv)}
    of = {
        (j, k): single[j] - weight if j == k else h[1 + pairs.index((j, k))] - single[j] - single[k] + weight
        for j, k in pairs
    }
    return of, weight
