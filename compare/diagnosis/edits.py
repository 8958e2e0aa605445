"""Numbers of a model exchanged, negated, left out or in another unit: several that one slip changes together.

Each kind is a function in KINDS. It yields the place, what it explains, and the Tree's fields that differ.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from itertools import combinations, permutations, product
from typing import Any

import numpy as np
from numpy import ndarray

import tmt

from ..core.words import listed
from ..robots.coordinates import point_inertia
from .hypothesis import Hypothesis, hypothesis
from .model import Changes, Equations, Frame, Path
from .places import EVERY_BODY, XYZ, sets_of_bodies, sets_of_joints

UNITS = {  # factors of units that are taken for others, and the fields of a tree that have them
    "lengths": ((1e3, 1e2, 1e-3, 1e-2, 1.0 / 0.0254, 0.0254), ("offset", "com")),
    "masses": ((1e3, 1e-3, 1.0 / 0.45359237, 0.45359237), ("mass",)),
    "moments of inertia": ((1e3, 1e4, 1e6, 1e7, 1e9, 1e-3), ("inertia",)),
}  # fmt: skip
ORDERS = sorted(list(permutations(range(3)))[1:], key=lambda order: -sum(k == order[k] for k in range(3)))
EXCHANGES = ORDERS[:3]  # of two axes
DIAGONAL = np.eye(3, dtype=bool)
BLOCK = 64  # edits that are evaluated together
EQUAL = 1e-12  # of a moment of inertia: two that are equal except for rounding
Edit = tuple[
    Any, ...
]  # the place, what it explains, the fields that differ; the owner of the place, of how many
Way = Callable[[ndarray], ndarray]
Ways = dict[tuple[str, str], Way]  # of a field, by the place and what it explains


def edits(equations: Equations) -> Iterator[Hypothesis]:
    """The values with each edit that changes a number."""
    stated = equations.stated
    chosen: dict[tuple[tuple[Path, str], ...], tuple[Edit, dict[Path, float]]] = {}
    for edit in (edit for kind in KINDS for edit in kind(equations)):
        moved: dict[Path, float] = {}
        for name, field in edit[2].items():
            moved |= {Path(name, at): x for at, x in np.ndenumerate(field - stated[name]) if x}
        if moved:
            chosen.setdefault(tuple((path, f"{x:.12g}") for path, x in moved.items()), (edit, moved))
    kinds, every = {name: "body" for name, *_ in absent(equations)}, list(chosen.values())
    for start in range(0, len(every), BLOCK):
        block = every[start : start + BLOCK]
        paths = dict.fromkeys(path for _, moved in block for path in moved)
        rows: Changes = {path: np.array([moved.get(path, 0.0) for _, moved in block]) for path in paths}
        for ((place, explains, _, *owner), _), values in zip(block, equations.values(rows)):
            yield hypothesis(2, kinds.get(place, "numbers"), place, "", explains, values, *owner)


def in_order(order: tuple[int, ...]) -> str:
    moved = [XYZ[k] for k in range(3) if order[k] != k]
    if len(moved) == 2:
        return f"{listed(moved)} exchanged"
    return f"in the order {', '.join(XYZ[k] for k in order)}"


def ways_of_tensors() -> Ways:
    """Axes of a tensor permuted, or those of its moments or products alone; products negated or left out."""
    ways: Ways = {}
    for order in ORDERS:
        axes = f"axes {in_order(order)}"
        ways[f"inertia of {{}}, {axes}", ""] = permuted(order)
        ways[f"moments of inertia of {{}}, {axes}", ""] = permuted(order, products=False)
    for order in EXCHANGES:
        fixed = next(k for k in range(3) if order[k] == k)
        products = ["".join(sorted(XYZ[fixed] + XYZ[k])) for k in range(3) if k != fixed]
        ways[f"products of inertia {listed(products)} of {{}}", "exchanged"] = permuted(order, moments=False)
    return ways | {
        ("axial and transverse inertia of {}", "exchanged"): axial_for_transverse,
        ("products of inertia of {}", "negated"): lambda I: np.where(DIAGONAL, I, -I),
        ("products of inertia of {}", "left out"): lambda I: np.where(DIAGONAL, I, 0.0),
        ("inertia of {}", "left out, a point mass"): lambda I: 0.0 * I,
    }


def permuted(order: Sequence[int], moments: bool = True, products: bool = True) -> Way:
    """A tensor with its moments or products those of axes in another order."""

    def change(I: ndarray) -> ndarray:
        new = I[np.ix_(order, order)]
        return np.where(DIAGONAL, new if moments else I, new if products else I)

    return change


def axial_for_transverse(I: ndarray) -> ndarray:
    """The tensor of a body of revolution with both its moments exchanged; another tensor as it is."""
    moments = np.diag(I)
    for k in range(3):
        axial, (first, second) = moments[k], np.delete(moments, k)
        if abs(first - second) <= EQUAL * axial and first != axial:
            return np.where(DIAGONAL, np.diag(np.where(np.arange(3) == k, first, axial)), I)
    return I


def ways_of_vectors(name: str) -> Ways:
    """At zero, of the other sign, with two coordinates exchanged."""
    ways: Ways = {(name, "zero"): lambda r: 0.0 * r, (name, "of the other sign"): lambda r: -r}
    return ways | {
        (name, f"coordinates {in_order(order)}"): partial(np.take, indices=order) for order in EXCHANGES
    }


def of_rows(equations: Equations) -> Iterator[Edit]:
    """The tensors, CoMs and offsets of bodies and joints, one, those that are alike, or all."""
    bodies, joints = sets_of_bodies(equations.tree), sets_of_joints(equations.tree)
    frames = [equations.frame_of(b) for b in range(len(equations.tree.mass))]
    of_parents = [Frame(np.zeros(3), equations.axes_at(parent)) for parent in equations.tree.parent]
    kinds = (
        ("inertia", bodies, ways_of_tensors(), frames), ("com", bodies, ways_of_vectors("CoM of {}"), frames),
        ("offset", joints, ways_of_vectors("offset of {}"), of_parents),
    )  # fmt: skip
    for field, sets, ways, axes in kinds:
        for name, rows in sets.items():
            for (place, explains), new in ways.items():
                after = equations.stated[field].copy()
                for row in rows:
                    after[row] = in_frame(new, axes[row])(after[row])
                yield place, explains, {field: after}, name, len(rows)


def in_frame(new: Way, frame: Frame) -> Way:
    """The change of a vector or tensor whose components are those in a frame."""
    origin, R = frame

    def change(row: ndarray) -> ndarray:
        if row.ndim == 2:
            return R @ new(R.T @ row @ R) @ R.T
        return R @ new(R.T @ (row - origin)) + origin

    return change


def parallel_axes(equations: Equations) -> Iterator[Edit]:
    """Slips of I about another point, I + m (c'c 1 - c c'): counted again, left out, a part of it, a sign."""
    stated = equations.stated
    for name, bodies in sets_of_bodies(equations.tree).items():
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


def about_one_axis(equations: Equations) -> Iterator[Edit]:
    """The moment of inertia about one axis left out of every body, as of thin rods."""
    for k, axis in enumerate(XYZ if len(equations.tree.mass) > 1 else ""):
        after = equations.stated["inertia"].copy()
        for b, I in enumerate(after):
            along = equations.frame_of(b).axes[:, k]
            after[b] = I - along @ I @ along * np.outer(along, along)
        yield f"inertia {axis}{axis} of {EVERY_BODY}", "left out", {"inertia": after}


def absent(equations: Equations) -> Iterator[Edit]:
    """A body, or all that a joint carries, left out."""
    tree, stated = equations.tree, equations.stated
    carried = {name: bodies for name, bodies in sets_of_bodies(tree).items() if name != EVERY_BODY}
    for i in range(len(tree.parent)):
        bodies = [b for b in range(len(tree.mass)) if tree.moves(b)[i]]
        if 1 < len(bodies) < len(tree.mass):
            carried.setdefault(listed([tree.body_names[b] for b in bodies]), bodies)
    for name, bodies in carried.items():
        fields = {field: stated[field].copy() for field in ("mass", "inertia")}
        for field in fields.values():
            field[bodies] = 0.0
        yield name, "left out", fields


def concentrated(equations: Equations) -> Iterator[Edit]:
    """The mass of all bodies at the CoM of one of them."""
    mass = equations.stated["mass"]
    for name, at in zip(equations.tree.body_names, np.eye(len(mass))):
        yield "masses of every body", f"at the CoM of {name}", {"mass": mass.sum() * at}


def swapped(equations: Equations) -> Iterator[Edit]:
    """Numbers of two bodies or joints exchanged; the length and the CoM of a link exchanged."""
    tree, stated = equations.tree, equations.stated

    def exchanged(field: str, i: int, j: int) -> dict[str, ndarray]:
        after = stated[field].copy()
        after[[i, j]] = after[[j, i]]
        return {field: after}

    for a, b in combinations(range(len(tree.mass)), 2):
        both = listed([tree.body_names[a], tree.body_names[b]])
        together: dict[str, ndarray] = {}
        for field, name in {"mass": "masses", "com": "CoMs", "inertia": "inertias"}.items():
            together |= exchanged(field, a, b)
            yield f"{name} of {both}", "exchanged", exchanged(field, a, b)
        yield f"masses, CoMs and inertias of {both}", "exchanged", together
    for i, j in combinations(np.flatnonzero(stated["armature"]).tolist(), 2):
        names = equations.speeds[i], equations.speeds[j]
        yield f"armatures of {listed(names)}", "exchanged", exchanged("armature", i, j)
    for (b, i), (j, parent) in product(enumerate(tree.body_joint), enumerate(tree.parent)):
        if parent == i >= 0:
            offset, com = stated["offset"].copy(), stated["com"].copy()
            offset[j], com[b] = stated["com"][b], stated["offset"][j]
            place = f"CoM of {tree.body_names[b]} and offset of {tree.joint_names[j]}"
            yield place, "exchanged", {"offset": offset, "com": com}


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
    sets = {tree.joint_names[i]: [i] for i in turned} | ({"every joint": turned} if len(turned) > 1 else {})
    for (name, joints), (explains, way) in product(sets.items(), ways.items()):
        after = {field: equations.stated[field].copy() for field in ("axis", "offset", "com", "inertia")}
        for i in joints[::-1]:  # from the tips
            turn(tree, i, after, before[i] @ way(fixed[i]) @ fixed[i].T @ before[i].T)
        yield f"fixed turn at {name} (euler, quat or rpy)", explains, after


def turn(tree: tmt.Tree, joint: int, fields: dict[str, ndarray], by: ndarray) -> None:
    """Turn all that a joint carries, where all joints are at zero."""
    carried = [k for k in range(len(tree.parent)) if joint in tree.path(k)]
    bodies = [b for b, k in enumerate(tree.body_joint) if k in carried]
    speeds = [v for k in carried for v in np.arange(len(tree.axis))[tree.coordinates.joints[k].qd].tolist()]
    rows: dict[str, list[int]] = {"axis": speeds, "offset": carried[1:], "com": bodies}
    for field, those in rows.items():
        fields[field][those] = fields[field][those] @ by.T
    fields["inertia"][bodies] = by @ fields["inertia"][bodies] @ by.T


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


KINDS: tuple[Callable[[Equations], Iterator[Edit]], ...] = (
    absent, concentrated, of_rows, parallel_axes, about_one_axis, swapped, scaled, axes, turns,
)  # fmt: skip
