"""Numbers of a model exchanged, negated, left out or in another unit: several that one slip changes together.

Each kind is a function in KINDS. It yields edits: the place, what it explains, and the Tree's fields that
differ.
"""

from collections.abc import Callable, Iterator
from functools import partial
from itertools import combinations, permutations, product
from typing import Any

import numpy as np
from numpy import ndarray

from ...core.words import listed
from ...robots.coordinates import point_inertia
from ..hypothesis import Hypothesis, slip
from ..model import Equations, Path
from .numbers import XYZ, Owners, sets_of_bodies, sets_of_joints

UNITS = {  # factors of units that are taken for others, and the fields of a tree that have them
    "lengths": ((1e3, 1e2, 1e-3, 1e-2, 1.0 / 0.0254, 0.0254), ("offset", "com")),
    "masses": ((1e3, 1e-3, 1.0 / 0.45359237, 0.45359237), ("mass",)),
    "moments of inertia": ((1e3, 1e4, 1e6, 1e7, 1e9, 1e-3), ("inertia",)),
}  # fmt: skip
ORDERS = sorted(list(permutations(range(3)))[1:], key=lambda order: -sum(k == order[k] for k in range(3)))
EXCHANGES = ORDERS[:3]  # of two axes
DIAGONAL = np.eye(3, dtype=bool)
BODY, NUMBERS = 0.12, 0.2  # costs: of a body left out, of other edits
EQUAL = 1e-12  # of a moment of inertia: two that are equal except for rounding
# the place, what it explains, the fields that differ; the owner of the place, of how many
Edit = tuple[Any, ...]
Kind = Callable[[Equations], Iterator[Edit]]
Way = Callable[[ndarray], ndarray]


def edits(equations: Equations) -> Iterator[Hypothesis]:
    """Each edit that changes a number, once."""
    stated, chosen = equations.stated, dict[frozenset[tuple[Path, str]], Hypothesis]()
    for of_kind in KINDS:
        cost, kind = (BODY, "body") if of_kind is absent else (NUMBERS, "numbers")
        for place, explains, fields, *owner in of_kind(equations):
            moved: dict[Path, float] = {}
            for name, field in fields.items():
                changed = np.argwhere(field != stated[name]).tolist()
                moved |= {Path(name, at := tuple(k)): float(field[at] - stated[name][at]) for k in changed}
            if moved:
                key = frozenset((path, f"{x:.12g}") for path, x in moved.items())
                one = slip(equations.right, place, explains, equations.right, cost, kind, 2, "", *owner)
                chosen.setdefault(key, one._replace(column=None, moves=tuple(moved.items())))
    yield from chosen.values()


def in_order(order: tuple[int, ...]) -> str:
    moved = [XYZ[k] for k in range(3) if order[k] != k]
    if len(moved) == 2:
        return f"{listed(moved)} exchanged"
    return f"in the order {', '.join(XYZ[k] for k in order)}"


def of_tensors(equations: Equations) -> Iterator[Edit]:
    """Axes of a tensor permuted, or those of its moments or products alone; products negated or left out."""
    ways: dict[tuple[str, str], Way] = {}

    def permuted(I: ndarray, order: tuple[int, ...], entries: ndarray | bool = True) -> ndarray:
        return np.where(entries, I[np.ix_(order, order)], I)

    for order in ORDERS:
        axes = f"axes {in_order(order)}"
        ways[f"inertia of {{}}, {axes}", ""] = partial(permuted, order=order)
        ways[f"moments of inertia of {{}}, {axes}", ""] = partial(permuted, order=order, entries=DIAGONAL)
    for order in EXCHANGES:
        fixed = next(k for k in range(3) if order[k] == k)
        names = ["".join(sorted(XYZ[fixed] + XYZ[k])) for k in range(3) if k != fixed]
        place = f"products of inertia {listed(names)} of {{}}"
        ways[place, "exchanged"] = partial(permuted, order=order, entries=~DIAGONAL)
    ways |= {
        ("axial and transverse inertia of {}", "exchanged"): axial_for_transverse,
        ("products of inertia of {}", "negated"): lambda I: np.where(DIAGONAL, I, -I),
        ("products of inertia of {}", "left out"): lambda I: np.where(DIAGONAL, I, 0.0),
        ("inertia of {}", "left out, a point mass"): lambda I: 0.0 * I,
    }
    yield from of_rows(equations, "inertia", sets_of_bodies(equations.tree), ways)


def axial_for_transverse(I: ndarray) -> ndarray:
    """The tensor of a body of revolution with both its moments exchanged; another tensor as it is."""
    moments = np.diag(I)
    for k in range(3):
        axial, (first, second) = moments[k], np.delete(moments, k)
        if abs(first - second) <= EQUAL * axial and first != axial:
            return np.where(DIAGONAL, np.diag(np.where(np.arange(3) == k, first, axial)), I)
    return I


def of_vectors(equations: Equations) -> Iterator[Edit]:
    """CoMs and offsets at zero, of the other sign, with two coordinates exchanged."""
    tree = equations.tree
    of_fields = {"com": ("CoM of {}", sets_of_bodies(tree)), "offset": ("offset of {}", sets_of_joints(tree))}
    for field, (place, sets) in of_fields.items():
        ways: dict[tuple[str, str], Way] = {
            (place, "zero"): lambda r: 0.0 * r, (place, "of the other sign"): lambda r: -r,
        }  # fmt: skip
        for order in EXCHANGES:
            ways[place, f"coordinates {in_order(order)}"] = partial(np.take, indices=order)
        yield from of_rows(equations, field, sets, ways)


def of_rows(
    equations: Equations, field: str, sets: list[Owners], ways: dict[tuple[str, str], Way]
) -> Iterator[Edit]:
    """A field of bodies or joints changed in one, those that are alike, or all; in the frames of the file."""
    tree, stated = equations.tree, equations.stated[field]
    for (name, rows), ((place, explains), way) in product(sets, ways.items()):
        after = stated.copy()
        for row in rows:
            if field == "offset":
                R, origin = equations.axes_at(tree.parent[row]), np.zeros(3)
            else:
                origin, R = equations.frame_of(row)
            if field == "inertia":
                after[row] = R @ way(R.T @ stated[row] @ R) @ R.T
            else:
                after[row] = R @ way(R.T @ (stated[row] - origin)) + origin
        yield place, explains, {field: after}, name, len(rows)


def parallel_axes(equations: Equations) -> Iterator[Edit]:
    """Slips of I about another point, I + m (c'c 1 - c c'): counted again, left out, a part of it, a sign."""
    stated = equations.stated
    for name, bodies in sets_of_bodies(equations.tree):
        ways: dict[str, ndarray] = {}
        for b in bodies:
            origin, R = equations.frame_of(b)
            c, mass = R.T @ (stated["com"][b] - origin), float(stated["mass"][b])
            moved = point_inertia(c, mass)
            for explains, change in {
                "about its joint, and m (c'c 1 - c c') counted again": moved,
                "m (c'c 1 - c c') of its CoM left out": -moved,
                "its moments about its joint, and m (c'c 1 - c c') counted again": np.where(DIAGONAL, moved, 0.0),
                "products of m (c'c 1 - c c') left out": np.where(DIAGONAL, 0.0, -moved),
                "m (c'c 1 - c c') on the diagonal alone": np.where(DIAGONAL, 0.0, moved),
                "m (c'c 1 + c c') for m (c'c 1 - c c')": -2.0 * mass * np.outer(c, c),
            }.items():  # fmt: skip
                after = ways.setdefault(explains, stated["inertia"].copy())
                after[b] = after[b] + R @ change @ R.T
        for explains, after in ways.items():
            yield "inertia of {}", explains, {"inertia": after}, name, len(bodies)
    for k, axis in enumerate(XYZ if len(stated["mass"]) > 1 else ""):  # as of thin rods
        after = stated["inertia"].copy()
        for b, I in enumerate(after):
            along = equations.frame_of(b).axes[:, k]
            after[b] = I - along @ I @ along * np.outer(along, along)
        yield f"inertia {axis}{axis} of every body", "left out", {"inertia": after}


def absent(equations: Equations) -> Iterator[Edit]:
    """A body, or all that a joint carries, left out."""
    tree, stated, count = equations.tree, equations.stated, len(equations.tree.mass)
    carried = [[b] for b in range(count)]
    carried += [[b for b in range(count) if tree.moves(b)[i]] for i in range(len(tree.parent))]
    for bodies in (those for those in carried if len(those) < max(count, 2)):
        fields = {field: stated[field].copy() for field in ("mass", "inertia")}
        for field in fields.values():
            field[bodies] = 0.0
        yield listed([tree.body_names[b] for b in bodies]), "left out", fields


def swapped(equations: Equations) -> Iterator[Edit]:
    """Numbers of two bodies or joints exchanged; the length and the CoM of a link; all mass at one CoM."""
    tree, stated = equations.tree, equations.stated

    def exchanged(i: int, j: int, *names: str) -> dict[str, ndarray]:
        order = np.arange(len(stated[names[0]]))
        order[[i, j]] = j, i
        return {name: stated[name][order] for name in names}

    fields: dict[str, tuple[str, ...]] = {"masses": ("mass",), "CoMs": ("com",), "inertias": ("inertia",)}
    fields |= {"masses, CoMs and inertias": ("mass", "com", "inertia")}
    for (a, b), (name, those) in product(combinations(range(len(tree.mass)), 2), fields.items()):
        place = f"{name} of {listed([tree.body_names[a], tree.body_names[b]])}"
        yield place, "exchanged", exchanged(a, b, *those)
    for i, j in combinations(np.flatnonzero(stated["armature"]).tolist(), 2):
        names = equations.speeds[i], equations.speeds[j]
        yield f"armatures of {listed(names)}", "exchanged", exchanged(i, j, "armature")
    for (b, i), (j, parent) in product(enumerate(tree.body_joint), enumerate(tree.parent)):
        if parent == i >= 0:
            offset, com = stated["offset"].copy(), stated["com"].copy()
            offset[j], com[b] = stated["com"][b], stated["offset"][j]
            place = f"CoM of {tree.body_names[b]} and offset of {tree.joint_names[j]}"
            yield place, "exchanged", {"offset": offset, "com": com}
    for name, at in zip(tree.body_names, np.eye(len(tree.mass))):
        yield "masses of every body", f"at the CoM of {name}", {"mass": sum(tree.mass) * at}


def scaled(equations: Equations) -> Iterator[Edit]:
    """All lengths, masses or tensors in another unit; gravity along another axis."""
    for plural, (factors, names) in UNITS.items():
        for factor in factors:
            fields = {name: factor * equations.stated[name] for name in names}
            yield f"all {plural}", f"{factor:g} times the right ones: in another unit?", fields
    g = equations.stated["gravity"]
    for order in ORDERS:
        for new in (g[list(order)], -g[list(order)]):
            along = XYZ[int(np.argmax(np.abs(new)))]
            if not np.array_equal(new, -g):  # an option
                yield "gravity", f"along {'-' if new.min() < 0.0 else ''}{along}", {"gravity": new}


def axes(equations: Equations) -> Iterator[Edit]:
    """A hinge or slide along another axis of its frame; its other sense is a convention."""
    joints, stated = enumerate(equations.tree.coordinates.joints), equations.stated["axis"]
    straight = ((i, joint.qd.start) for i, joint in joints if joint.kind != "ball")
    for (i, v), k, sign in product(straight, range(3), (1.0, -1.0)):
        new = stated.copy()
        new[v] = sign * equations.axes_at(i)[:, k]
        if not np.allclose(new[v], -stated[v]):
            place = f"axis of {equations.tree.joint_names[i]}"
            yield place, f"{'-' if sign < 0.0 else ''}{XYZ[k]}", {"axis": new}


def turns(equations: Equations) -> Iterator[Edit]:
    """The fixed turn (euler, rpy) of a body, or all of them: left out, transposed, in another order."""
    tree, before = equations.tree, [equations.axes_at(parent) for parent in equations.tree.parent]
    ways: dict[str, Way] = {
        "left out": lambda turn: turn @ turn.T,
        "transposed": np.transpose,
        "angles in the other order": in_other_order,
        "angles in the other order, z, y, x": lambda turn: in_other_order(turn.T).T,
    }
    fixed = [before[i].T @ equations.axes_at(i) for i in range(len(before))]
    turned = [i for i, turn in enumerate(fixed) if not np.allclose(turn, np.eye(3))]
    sets = [(tree.joint_names[i], [i]) for i in turned] + [("every joint", turned)] * (len(turned) > 1)
    for (name, joints), (explains, way) in product(sets, ways.items()):
        after = {field: equations.stated[field].copy() for field in ("axis", "offset", "com", "inertia")}
        for i in joints[::-1]:  # from the tips, with all that each carries, where all joints are at zero
            by = before[i] @ way(fixed[i]) @ fixed[i].T @ before[i].T
            carried = [k for k in range(len(tree.parent)) if i in tree.path(k)]
            speeds = [v for k in carried for v in np.arange(len(tree.axis))[tree.coordinates.joints[k].qd]]
            bodies = [b for b, k in enumerate(tree.body_joint) if k in carried]
            for field, those in {"axis": speeds, "offset": carried[1:], "com": bodies}.items():
                after[field][those] = after[field][those] @ by.T
            after["inertia"][bodies] = by @ after["inertia"][bodies] @ by.T
        yield f"fixed turn at {name} (euler, quat or rpy)", explains, after


def in_other_order(turn: ndarray) -> ndarray:
    """A turn by angles about x, y, z with the same angles about z, y, x."""
    from scipy.spatial.transform import Rotation  # slow import

    return np.asarray(Rotation.from_euler("XYZ", angles_of(turn)).as_matrix())


def angles_of(turn: ndarray) -> ndarray:
    """Roll, pitch and yaw, rad: turn = Rz(yaw) Ry(pitch) Rx(roll)."""
    from scipy.spatial.transform import Rotation  # slow import

    if np.hypot(turn[0, 0], turn[1, 0]) < EQUAL:  # yaw and roll turn about the same axis
        return np.array([np.arctan2(-turn[1, 2], turn[1, 1]), -np.pi / 2.0 * turn[2, 0], 0.0])
    return np.asarray(Rotation.from_matrix(turn).as_euler("xyz"))


KINDS: tuple[Kind, ...] = (absent, of_tensors, of_vectors, parallel_axes, swapped, scaled, axes, turns)
