"""The places that are a factor: of terms, of their parts, of entries and coefficients; and all places of a search."""

from collections.abc import Iterator
from itertools import chain, combinations_with_replacement, product

import numpy as np

import tmt

from .model import BODY_TERMS, MOST_SPEEDS, OF_TERM, VELOCITY_TERMS, Entry, Equations, Path
from .places import ALL, FIT_ROUNDING, Place, factor, forces, groups, numbers, tied

TOGETHER = {  # terms that are often left out together
    "all moments of {} in the bias": ("Euler", "gyroscopic"),
    "velocity terms of {} in h": VELOCITY_TERMS,
    "all of the rotation of {}": ("rotation", "Euler", "gyroscopic"),
}
MOST_JOINTS = 4  # whose single entries of Mbar are tried


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
            if mass := tree.mass[b]:
                column = factor("number", "", added / mass, entries).column
                place = f"mass of {body} in the rows of the {name}"
                yield Place("number", place, mass, "kg", mass, column=column, least=0.0)


def terms(equations: Equations) -> Iterator[Place]:
    """The factor of every term of each body and of all bodies together; 1 is right."""
    called = {name: (term,) for term, name in OF_TERM.items()} | TOGETHER
    for name, together in called.items():
        added = np.sum([equations.terms[term] for term in together], axis=0)
        for body, those in groups(equations.tree).items():
            yield factor("term", name.format(body), added[those].sum(axis=0))


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
    """What each pair of lengths of a body adds to Mbar and h, (states, entries); beside a slide, its gravity too."""
    tree, parts = equations.tree, {}
    present: dict[tuple[int, str, str], list[tuple[str, int]]] = {}
    slides: set[str] = set()
    for b in range(len(tree.mass)):
        lengths = lengths_of(tree, b)
        slides |= {name for name, numbers in lengths.items() if numbers[0][0] == "axis"}
        for first, second in combinations_with_replacement(lengths, 2):
            present[b, first, second] = [("mass", b), *lengths[first], *lengths[second]]
        present |= {(b, "gravity", name): [("mass", b), ("gravity", 0), *of] for name, of in lengths.items()}
    values = dict(zip(present, alone(equations, list(present.values()))))
    for (b, first, second), column in values.items():
        if first == "gravity":
            continue
        name = f"mass of {tree.body_names[b]} * ({first})^2"
        if first != second:
            name = f"mass of {tree.body_names[b]} * {first} * {second}"
            column = column - values[b, first, first] - values[b, second, second]
            if first in slides:  # the first moment
                column = column + values[b, "gravity", second] - values[b, second, second]
        parts[name] = column
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

    for joint, those in speeds_of_joints(equations.tree).items():
        of_joint = [layout.of_row(i) for i in those]
        if len(those) > 1:
            yield factor("coefficient", f"h[{joint}]", right, list(chain.from_iterable(of_joint)))
        for k, name in enumerate(list(layout.parts)[1:] if layout.is_split else ()):
            yield factor("coefficient", f"{name} of h[{joint}]", right, [row[k] for row in of_joint])

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
