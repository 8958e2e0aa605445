"""Factors of terms, of parts of them, of entries of Mbar and h and of coefficients of speeds."""

from collections.abc import Iterator, Sequence
from itertools import chain, combinations, combinations_with_replacement

import numpy as np
from numpy import ndarray

import tmt

from ...core.words import listed
from ..hypothesis import ALL, FIT_ROUNDING, Hypothesis, factor, number
from ..layout import MOST_SPEEDS, Entry
from ..model import OF_TERM, TINY, Equations
from .kinematics import SAME, Kinematics
from .numbers import XYZ, sets_of_bodies

TOGETHER = {  # terms that are often left out together
    "all moments of {} in the bias": ("Euler", "gyroscopic"),
    "velocity terms of {} in h": ("convective", "Euler", "gyroscopic"),
    "all of the rotation of {}": ("rotation", "Euler", "gyroscopic"),
}
MOST_ENTRIES = 10  # of Mbar, in which cross terms are tried alone
PART, COEFFICIENT = 0.3, 0.3  # costs of a part of a term, and of an entry, a coefficient or all


def unit_columns(equations: Equations) -> dict[str, ndarray]:
    """The values of 1 in an entry of Mbar, a row of h at rest, a coefficient of speeds in h, by names."""
    layout, (M, velocity_terms, rest), columns = equations.layout, equations.parts, {}
    for entry in equations.coefficients if equations.nv <= MOST_SPEEDS else ():
        parts = {"M": 0.0 * M, "velocity": 0.0 * velocity_terms, "gravity": 0.0 * rest}
        if entry.kind == "M":
            i, j = entry.at
            parts["M"][:, i, j] = parts["M"][:, j, i] = 1.0
            parts["M"][:, j, i] *= layout.is_symmetric or i == j
        else:
            i, *pair = entry.at
            parts[entry.kind][:, i] = np.prod(equations.qd[:, pair], axis=1)
        columns[entry.named(equations.speeds)] = layout.packed(*parts.values())
    return columns


def speeds_of_joints(tree: tmt.Tree) -> dict[str, list[int]]:
    """The numbers of the speeds of each joint, and of the three slides of each free joint."""
    of_joints = [list(range(joint.qd.start, joint.qd.stop)) for joint in tree.coordinates.joints]
    joints = dict(zip(tree.joint_names, of_joints))
    for i, kind in enumerate(tree.kind):
        slides = [tree.joint_names[k] for k in range(i - 3, i) if k >= 0 and tree.kind[k] == "slide"]
        if kind == "ball" and len(slides) == 3:
            joints[", ".join(slides)] = [v for name in slides for v in joints[name]]
    return joints


def entries_of_M(equations: Equations) -> dict[str, list[int]]:
    """Each entry of Mbar, and those that couple two joints of several speeds, by their names."""
    places, tree = list(zip(*equations.layout.places)), equations.tree
    sets = {entry.named(equations.speeds): [k] for k, entry in enumerate(equations.entries[equations.in_M])}
    for one, other in combinations_with_replacement(speeds_of_joints(tree).items(), 2):
        if max(len(one[1]), len(other[1])) > 1:
            inside = [k for k, pair in enumerate(places) if is_between(pair, one[1], other[1])]
            sets[f"M[{one[0]}][{other[0]}]"] = inside
            for (first, rows), (second, columns) in ((one, other), (other, one)):
                if not equations.layout.is_symmetric and one != other:  # each block by itself
                    block = [k for k in inside if places[k][0] in rows and places[k][1] in columns]
                    sets[f"M[{first}][{second}]"] = block
    return sets


def rows_of_h(equations: Equations) -> dict[str, list[int]]:
    """The speeds of each row of h, and of the rows of joints with several speeds, by their names."""
    joints = {joint: rows for joint, rows in speeds_of_joints(equations.tree).items() if len(rows) > 1}
    rows = {name: [i] for i, name in enumerate(equations.speeds)} | joints
    return {f"h[{name}]": row for name, row in rows.items()}


def is_between(pair: Sequence[int], first: list[int], second: list[int]) -> bool:
    """Whether an entry couples a speed of one joint with one of another."""
    i, j = pair
    return (i in first and j in second) or (j in first and i in second)


def terms(equations: Equations) -> Iterator[Hypothesis]:
    """Factors of terms of each body, and of several together: in all, in an entry of Mbar, a row of h."""
    bodies, is_small = sets_of_bodies(equations.tree), equations.nv <= MOST_SPEEDS
    of_rows = {name: equations.layout.of_rows(rows) for name, rows in rows_of_h(equations).items()}
    for name, together in ({name: (term,) for term, name in OF_TERM.items()} | TOGETHER).items():
        added = np.sum([equations.terms[term] for term in together], axis=0)
        for body, those in bodies:
            column = added[those].sum(axis=0)
            yield factor("term", name.format(body), column, form=name, owners=len(those))
            if is_small and len(together) == len(those) == 1:
                for where, entries in (entries_of_M(equations) | of_rows).items():
                    if len(entries) == 1 or where in of_rows:
                        yield factor("term", f"{name.format(body)} in {where}", column, entries)


def coefficients(equations: Equations) -> Iterator[Hypothesis]:
    """Factors of entries of Mbar, rows of h and their two parts, and coefficients of products of speeds."""
    layout, right, (M, velocity_terms, rest) = equations.layout, equations.right, equations.parts
    for name, entries in entries_of_M(equations).items():
        yield factor("coefficient", name, right, entries, COEFFICIENT)
    parts = {"M": equations.in_M, "h": equations.in_h, "M and h": ALL} if layout.qdd is None else {}
    for name, part in parts.items():
        yield factor("whole", f"all of {name}", right, part, COEFFICIENT)
    of_h = {"": (velocity_terms, rest), "velocity terms of ": (velocity_terms, 0.0 * rest)}
    of_h |= {"gravity of ": (0.0 * rest, rest)}
    for name, rows in rows_of_h(equations).items():
        for before, values in of_h.items():
            column, of_row = layout.packed(0.0 * M, *values), layout.of_rows(rows)
            yield factor("coefficient", f"{before}{name}", column, of_row, COEFFICIENT)
    if equations.nv > MOST_SPEEDS:
        return

    def together(name: str, terms: list[tuple[Entry, ndarray]]) -> Hypothesis:
        """The factor of some velocity terms."""
        column = sum(values[:, None] * units[entry.named(equations.speeds)] for entry, values in terms)
        return factor("coefficient", name, column + 0.0 * right, cost=COEFFICIENT)

    terms = [(entry, values) for entry, values in equations.coefficients.items() if entry.kind == "velocity"]
    largest, units = max(np.abs(values).max() for _, values in terms), unit_columns(equations)
    for term in terms:
        name = term[0].named(equations.speeds)
        if np.abs(term[1]).max() > FIT_ROUNDING * largest:
            yield together(name, [term])
        else:
            yield number(name, 0.0, "", COEFFICIENT, "added", column=units[name])
    joints = speeds_of_joints(equations.tree)
    for first, second in combinations_with_replacement(joints, 2):
        those = [term for term in terms if is_between(term[0].at[1:], joints[first], joints[second])]
        yield together(f"products of the speeds of {first} and {second} in h", those)
    for i, j in chain.from_iterable(((i, j), (j, i)) for i, j in combinations(range(equations.nv), 2)):
        moved = np.zeros_like(rest)
        moved[:, i] = rest[:, j]
        name, column = f"gravity of h[{equations.speeds[j]}] in h[{equations.speeds[i]}]", 0.0 * rest
        column = layout.packed(0.0 * M, column, moved)
        yield factor("coefficient", name, column, cost=COEFFICIENT, stated=0.0)


def squares_of_velocities(equations: Equations) -> Iterator[Hypothesis]:
    """Factors in v^2 of a body's CoM, and the mass with which it moves along some axes.

    v is the sum of those of its segments, v^2 of their squares and products: in all, in an entry of Mbar.
    """
    if equations.nv > MOST_SPEEDS:
        return
    kinematics, layout, tree = Kinematics(equations), equations.layout, equations.tree
    entries = [entry.named(equations.speeds) for entry in equations.entries[equations.in_M]]
    n = len(equations.q)

    def column(pairs: list[tuple[ndarray, ndarray]], gravity: ndarray) -> ndarray:
        """What a mass of 1 adds whose v^2 has these products of Jacobians, and its weight."""
        M, h = 0.0 * equations.parts[0], 0.0 * equations.qd
        for J, other in pairs:
            a = np.einsum("vsc,sv->sc", other[:, -n:].imag / TINY, equations.qd)
            M = M + np.einsum("vsc,wsc->svw", J[:, :n].real, other[:, :n].real)
            h = h + np.einsum("vsc,sc->sv", J[:, :n].real, a)
        return layout.packed(M, h, -np.einsum("vsc,c->sv", pairs[0][0][:, :n].real, gravity))

    for b in (b for b, joint in enumerate(tree.body_joint) if joint >= 0):
        body, segments, mass = tree.body_names[b], kinematics.segments(b), float(tree.mass[b])
        pairs = combinations_with_replacement(segments, 2) if len(segments) > 1 else ()
        for first, second in pairs:
            both = [(first.jacobian, second.jacobian), (second.jacobian, first.jacobian)]
            added = mass * column(both if first is not second else both[:1], np.zeros(3))
            name = f"2 ({first.name}) * ({second.name}) in v^2 of {body}"
            name = f"({first.name})^2 in v^2 of {body}" if first is second else name
            yield factor("part", name, added, cost=PART)
            active = np.abs(added[:, layout.in_M]).max(axis=0) > SAME * np.abs(added).max()
            for k in np.flatnonzero(active).tolist() if len(entries) <= MOST_ENTRIES else ():
                yield factor("part", f"{name} in {entries[k]}", added, [k], PART)
        chosen = [np.isin(range(3), axes) for count in (1, 2) for axes in combinations(range(3), count)]
        for axes in chosen if mass and equations.nv > 1 else ():
            J, along = kinematics.J[b] * axes, listed([XYZ[k] for k in np.flatnonzero(axes)])
            added, name = column([(J, J)], np.array(tree.gravity) * axes), f"mass of {body} along {along}"
            yield number(name, mass, "kg", PART, "part", column=added, size=mass, least=0.0)
