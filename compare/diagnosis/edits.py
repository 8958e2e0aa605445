"""Numbers of a model exchanged, negated, left out or in another unit: several that one slip changes together.

An edit is the place, what it explains, and the new numbers of the tree. Each kind is one function in KINDS.
"""

from collections.abc import Callable, Iterator, Mapping
from functools import partial
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np
from numpy import ndarray

import tmt

from ..core.words import listed
from ..robots.coordinates import Coordinates
from .model import Changes, Equations, Path
from .places import EVERY_BODY, XYZ, alike
from .variants import Variant, variant

UNITS = {"length": (1e3, 1e2, 1e-3, 1e-2), "mass": (1e3, 1e-3), "inertia": (1e3, 1e4, 1e6, 1e7, 1e9, 1e-3)}
FIELDS = {"length": ("offset", "com"), "mass": ("mass",), "inertia": ("inertia",)}
Numbers = Mapping[str, ndarray]  # fields of a tree


class Edit(NamedTuple):
    """Other numbers of a tree: the fields that differ."""

    place: str
    explains: str
    fields: dict[str, ndarray]
    kind: str = "numbers"


def edits(equations: Equations) -> list[Variant]:
    """The values with each edit that changes a number, evaluated together."""
    stated, known = equations.stated, set()
    chosen: list[Edit] = []
    changes: list[dict[Path, float]] = []
    for kind in KINDS:
        for edit in kind(equations.tree, stated):
            moved = {
                Path(name, at): x
                for name, field in edit.fields.items()
                for at, x in np.ndenumerate(field - stated[name])
            }
            moved = {path: x for path, x in moved.items() if x}
            same = tuple((path, f"{x:.12g}") for path, x in moved.items())
            if moved and same not in known:
                known.add(same)
                chosen.append(edit)
                changes.append(moved)
    if not chosen:
        return []
    paths = dict.fromkeys(path for moved in changes for path in moved)
    rows: Changes = {path: np.array([moved.get(path, 0.0) for moved in changes]) for path in paths}
    values = equations.values(rows)
    return [variant(2, edit.kind, edit.place, "", edit.explains, row) for edit, row in zip(chosen, values)]


def sets_of_bodies(tree: tmt.Tree) -> dict[str, list[int]]:
    """Each body, those that are alike, and all."""
    sets = {name: [b] for b, name in enumerate(tree.body_names)}
    for names in alike(tree):
        if set(names) <= set(tree.body_names):
            sets[listed(names)] = [tree.body_names.index(name) for name in names]
    return sets | ({EVERY_BODY: list(range(len(tree.mass)))} if len(tree.mass) > 1 else {})


def changed(field: ndarray, bodies: list[int], new: Callable[[ndarray], ndarray]) -> ndarray:
    """A field of which the rows of some bodies are changed."""
    after = field.copy()
    for b in bodies:
        after[b] = new(field[b])
    return after


def tensors(tree: tmt.Tree, stated: Numbers) -> Iterator[Edit]:
    """Axes of a tensor permuted; products of inertia negated, left out or exchanged."""
    off_diagonal = ~np.eye(3, dtype=bool)
    ways: dict[str, tuple[str, Callable[[ndarray], ndarray]]] = {}
    orders = sorted(list(permutations(range(3)))[1:], key=lambda order: -sum(k == order[k] for k in range(3)))
    for order in orders:
        moved = [XYZ[k] for k in range(3) if order[k] != k]
        what = (
            f"axes {listed(moved)} exchanged"
            if len(moved) == 2
            else f"axes in the order {', '.join(XYZ[k] for k in order)}"
        )
        ways[f"inertia of {{}}, {what}"] = "", partial(permuted, order=list(order))
        ways[f"moments of inertia of {{}}, {what}"] = "", partial(with_moments, order=list(order))
    ways["axial and transverse inertia of {}"] = "exchanged", axial_for_transverse
    ways["products of inertia of {}"] = "negated", lambda I: np.where(off_diagonal, -I, I)
    ways["products of inertia of {} "] = "left out", lambda I: np.where(off_diagonal, 0.0, I)
    ways["inertia of {} "] = "left out, a point mass", lambda I: 0.0 * I
    for first, second in combinations(((0, 1), (0, 2), (1, 2)), 2):
        names = [XYZ[i] + XYZ[j] for i, j in (first, second)]
        ways[f"products of inertia {listed(names)} of {{}}"] = (
            "exchanged",
            partial(exchanged, first=first, second=second),
        )
    for name, bodies in sets_of_bodies(tree).items():
        for place, (explains, new) in ways.items():
            yield Edit(
                place.format(name).rstrip(), explains, {"inertia": changed(stated["inertia"], bodies, new)}
            )


def permuted(I: ndarray, order: list[int]) -> ndarray:
    return I[np.ix_(order, order)]


def with_moments(I: ndarray, order: list[int]) -> ndarray:
    """A tensor with its moments in another order, and the same products."""
    J = I.copy()
    np.fill_diagonal(J, np.diag(I)[order])
    return J


def axial_for_transverse(I: ndarray) -> ndarray:
    """The tensor of a body of revolution with both its moments exchanged; another tensor as it is."""
    moments = np.diag(I)
    for k in range(3):
        axial, (first, second) = moments[k], np.delete(moments, k)
        if first == second != axial:
            J = I.copy()
            np.fill_diagonal(J, np.where(np.arange(3) == k, first, axial))
            return J
    return I


def exchanged(I: ndarray, first: tuple[int, int], second: tuple[int, int]) -> ndarray:
    """A tensor with two products of inertia exchanged."""
    J = I.copy()
    J[first], J[second] = I[second], I[first]
    J[first[::-1]], J[second[::-1]] = I[second], I[first]
    return J


def vectors(tree: tmt.Tree, stated: Numbers) -> Iterator[Edit]:
    """A CoM or an offset at zero, of the other sign, with two coordinates exchanged; the CoM at half or twice its place."""
    ways: dict[str, Callable[[ndarray], ndarray]] = {
        "zero": lambda r: 0.0 * r,
        "of the other sign": lambda r: -r,
    }
    for i, j in combinations(range(3), 2):
        order = [0, 1, 2]
        order[i], order[j] = j, i
        ways[f"coordinates {XYZ[i]} and {XYZ[j]} exchanged"] = partial(np.take, indices=order)
    for name, bodies in sets_of_bodies(tree).items():
        for explains, new in ways.items():
            yield Edit(f"CoM of {name}", explains, {"com": changed(stated["com"], bodies, new)})
    for i, name in enumerate(tree.joint_names):
        for explains, new in ways.items():
            yield Edit(f"offset of {name}", explains, {"offset": changed(stated["offset"], [i], new)})


def absent(tree: tmt.Tree, stated: Numbers) -> Iterator[Edit]:
    """A body, or all that a joint carries, left out."""
    carried = {name: bodies for name, bodies in sets_of_bodies(tree).items() if name != EVERY_BODY}
    for i, joint in enumerate(tree.joint_names):
        bodies = [b for b in range(len(tree.mass)) if tree.moves(b)[i]]
        if 1 < len(bodies) < len(tree.mass):
            carried.setdefault(listed([tree.body_names[b] for b in bodies]), bodies)
    for name, bodies in carried.items():
        nothing = {field: changed(stated[field], bodies, lambda x: 0.0 * x) for field in ("mass", "inertia")}
        yield Edit(name, "left out", nothing, "body")


def swapped(tree: tmt.Tree, stated: Numbers) -> Iterator[Edit]:
    """The masses of two bodies exchanged; the mass of one that of another; the length and the CoM of a link exchanged."""
    for a, b in combinations(range(len(tree.mass)), 2):
        masses, both = stated["mass"].copy(), listed([tree.body_names[a], tree.body_names[b]])
        masses[[a, b]] = masses[[b, a]]
        yield Edit(f"masses of {both}", "exchanged", {"mass": masses})
    armatures = stated["armature"] if len(stated["armature"]) else np.zeros(0)
    names = Coordinates(tree.joint_names, tree.kind).speeds
    for i, j in combinations(np.flatnonzero(armatures).tolist(), 2):
        others = armatures.copy()
        others[[i, j]] = others[[j, i]]
        yield Edit(f"armatures of {names[i]} and {names[j]}", "exchanged", {"armature": others})
    for b, i in enumerate(tree.body_joint):
        for j in (j for j, parent in enumerate(tree.parent) if parent == i >= 0):
            offset, com = stated["offset"].copy(), stated["com"].copy()
            offset[j], com[b] = com[b], offset[j]
            yield Edit(
                f"CoM of {tree.body_names[b]} and offset of {tree.joint_names[j]}",
                "exchanged",
                {"offset": offset, "com": com},
            )


def scaled(tree: tmt.Tree, stated: Numbers) -> Iterator[Edit]:
    """All lengths, masses or tensors in another unit; gravity along another axis."""
    for what, factors in UNITS.items():
        for factor in factors:
            fields = {field: factor * stated[field] for field in FIELDS[what]}
            plural = {"length": "lengths", "mass": "masses", "inertia": "moments of inertia"}[what]
            yield Edit(f"all {plural}", f"{factor:g} times the right ones: in another unit?", fields)
    g = stated["gravity"]
    for order in list(permutations(range(3)))[1:]:
        for sign in (1.0, -1.0):
            new = sign * g[list(order)]
            along = XYZ[int(np.argmax(np.abs(new)))]
            if not np.array_equal(new, -g):  # an option
                yield Edit("gravity", f"along {'-' if new.min() < 0.0 else ''}{along}", {"gravity": new})


def axes(tree: tmt.Tree, stated: Numbers) -> Iterator[Edit]:
    """A hinge or slide along another axis of its frame."""
    for i, joint in enumerate(tree.coordinates.joints):
        if joint.kind == "ball":
            continue
        for k, name in enumerate(XYZ):
            for sign, shown in ((1.0, ""), (-1.0, "-")):
                new = stated["axis"].copy()
                new[joint.qd.start] = sign * np.eye(3)[k]
                if np.allclose(new[joint.qd.start], -stated["axis"][joint.qd.start]):
                    continue  # another sense
                yield Edit(f"axis of {tree.joint_names[i]}", f"{shown}{name}", {"axis": new})


KINDS: tuple[Callable[[tmt.Tree, Numbers], Iterator[Edit]], ...] = (
    absent,
    tensors,
    vectors,
    swapped,
    scaled,
    axes,
)
