"""Explanations without a number to fit: options, slips of derivatives, other sines and cosines of hinges.

A variant is a cause with Mbar and h as they would be, as `Equations.values` has them.
"""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import combinations, permutations, product

import numpy as np

from tmt import literal

from ..core.words import listed
from .fit import Search
from .hypothesis import Hypothesis, hypothesis, option, slip
from .model import TINY, Equations, Layout, Path
from .terms import unit_columns

Functions = tuple[
    dict[str, np.ndarray], list[tuple[str, str]]
]  # functions by their names, (states,), and pairs
Parallel = tuple[str, np.ndarray, np.ndarray]  # a name, a column (states, entries) and its factors (states,)
OF_ENERGY = {  # slips in Mdot qd - d(qd' Mbar qd / 2)/dq: place, what it is, and the factors of both
    ("gradient of the kinetic energy in h", "left out"): (1.0, 0.0),
    ("gradient of the kinetic energy in h", "halved"): (1.0, 0.5),
    ("gradient of the kinetic energy in h", "of the other sign"): (1.0, -1.0),
    ("gradient of the kinetic energy in h", "twice"): (1.0, 2.0),
    ("Mdot qd in h", "left out"): (0.0, 1.0), ("Mdot qd in h", "halved"): (0.5, 1.0),
    ("Mdot qd in h", "halved, and no gradient of the kinetic energy"): (0.5, 0.0),
    ("C(q, qd) in h", "transposed, C' qd for C qd"): (0.0, -1.0),
}  # fmt: skip
OF_FACTORS = "coefficient", "term"  # kinds of places
OF_ROTATION = "rotation", "Euler", "gyroscopic"  # terms
MOST_HINGES = 4  # of which products of sines and cosines are tried
CLOSE = 1e-6  # of a coefficient, before the values are compared
OF_SLOPES = {"left out": 0.0, "of the other sign": -1.0, "halved": 0.5, "twice": 2.0}


def program_options(equations: Equations) -> Iterator[Hypothesis]:
    """What an option or a convention of the whole file or program changes."""
    tree, q, qd, (M, moving, rest) = equations.tree, equations.q, equations.qd, equations.parts
    drag = np.array(tree.damping) * qd
    of_h: list[tuple[str, str, str, np.ndarray | float, np.ndarray | float]] = [
        ("gravity", "on", "off", moving, 0.0), ("sign of gravity", "+", "-", moving, -rest),
        ("velocity terms in h", "there", "left out", 0.0, rest), ("bias", "there", "left out", 0.0, 0.0),
        ("sign of the bias", "Mbar qdd + h = tau", "Mbar qdd = tau + h", -moving, -rest),
    ]  # fmt: skip
    if any(tree.damping):
        of_h.append(("damping D qd", "not in h", "in h", moving + drag, rest))
        of_h.append(("damping D qd", "not in h", "in h, of the other sign", moving - drag, rest))
    if tree.has_springs:
        sprung = rest + literal.spring_torque(q, tree)
        of_h.append(("springs k (q - rest)", "not in h", "in h", moving, sprung))
    for place, stated, explains, of_speeds, of_gravity in of_h:
        yield option(place, stated, explains, equations.with_bias(of_speeds, of_gravity))
    if q.shape == qd.shape:
        orders = {"exchanged, bias(qd, q)": exchanged, "in turn, q1, qd1, q2, qd2, ...": in_turn}
        for explains, order in orders.items():
            h, still = (Equations(tree, *order(q, speeds)).h for speeds in (qd, 0.0 * qd))
            values = equations.with_bias(h - still, still)
            yield option("arguments of bias", "bias(q, qd)", explains, values)
    triangles = {"off": M - M * np.eye(equations.nv)}
    if not equations.layout.is_symmetric:
        triangles |= {"above": np.triu(M, 1), "below": np.tril(M, -1)}
    for where, change in triangles.items():
        for explains, factor in OF_SLOPES.items():
            values = equations.layout.packed(M + (factor - 1.0) * change, moving, rest)
            yield option(f"entries of M {where} the diagonal", "there", explains, values)
    if any(tree.armature):
        rotors = {Path("armature", (i,)): np.array([-rotor]) for i, rotor in enumerate(tree.armature)}
        yield option("armature", "on the diagonal of Mbar", "left out", equations.values(rotors)[0])


def exchanged(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return qd, q


def in_turn(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    together = np.concatenate([q, qd], axis=1)
    return together[:, ::2], together[:, 1::2]


def lagrange(equations: Equations) -> Iterator[Hypothesis]:
    """Slips in h = Mdot qd - d(kinetic energy)/dq + dV/dq, of hinges and slides."""
    if "ball" in equations.tree.kind:
        return
    tree, q, qd, (_, velocity_terms, rest) = equations.tree, equations.q, equations.qd, equations.parts
    moved = (Equations(tree, q + 1j * TINY * unit, qd).parts[0] for unit in np.eye(equations.nv))
    slopes = np.stack([M.imag / TINY for M in moved], axis=-1)
    Mdot_qd = np.einsum("sijk,sk,sj->si", slopes, qd, qd)
    gradient = Mdot_qd - velocity_terms
    for (name, explains), (of_Mdot, of_gradient) in OF_ENERGY.items():
        values = equations.with_bias(of_Mdot * Mdot_qd - of_gradient * gradient, rest)
        yield slip(name, "Mdot qd - d(qd' Mbar qd / 2)/dq", explains, values)
    speeds = equations.speeds
    for i, (explains, factor) in product(range(equations.nv), OF_SLOPES.items()):
        added = np.zeros_like(gradient)
        added[:, i] = (1.0 - factor) * gradient[:, i]
        if equations.nv > 1 and added.any():
            place = f"gradient of the kinetic energy in h[{speeds[i]}]"
            yield slip(place, "once", explains, equations.with_bias(velocity_terms + added, rest))
    entries = [(i, j) for i in range(equations.nv) for j in range(i + 1)]
    for (i, j), k in product(entries, range(equations.nv)):
        alone = np.zeros_like(slopes)
        alone[:, [i, j], [j, i], k] = slopes[:, [i, j], [j, i], k]
        added = np.einsum("sijk,sk,sj->si", alone, qd, qd) - np.einsum("sijk,si,sj->sk", alone, qd, qd) / 2.0
        for explains, factor in OF_SLOPES.items() if added.any() else ():
            values = equations.with_bias(velocity_terms + (factor - 1.0) * added, rest)
            place = f"dM[{speeds[i]}][{speeds[j]}]/d {speeds[k]} in h"
            yield hypothesis(2, "derivative", place, "once", explains, values)


def linearized(equations: Equations) -> Iterator[Hypothesis]:
    """Sines and cosines of a hinge, or of all, to first order: sin a = a, cos a = 1; or all of the equations."""
    tree, layout = equations.tree, equations.layout
    joints = [(i, joint) for i, joint in enumerate(tree.coordinates.joints) if joint.kind == "hinge"]

    def first_order(q: np.ndarray, those: list[int]) -> np.ndarray:
        """Values, to first order in some hinges; exact for sums of their sines and cosines."""
        if not those:
            return Equations(tree, q, equations.qd, layout).right
        k, zero = tree.coordinates.joints[those[0]].q.start, tree.reference[those[0]]
        at = {angle: q.copy() for angle in (0.0, 0.5, -0.5)}
        for angle, moved in at.items():
            moved[:, k] = zero + np.pi * angle
        still, up, down = (first_order(moved, those[1:]) for moved in at.values())
        return still + (q[:, k : k + 1] - zero) * (up - down) / 2.0

    sets = {tree.joint_names[i]: [i] for i, _ in joints}
    if 1 < len(joints) <= MOST_HINGES:
        sets[listed([*sets])] = [i for i, _ in joints]
    for name, those in sets.items():
        place = f"sine and cosine of {name}"
        yield hypothesis(
            2, "angle", place, "", "linearized, sin a = a and cos a = 1", first_order(equations.q, those)
        )
    if "ball" not in tree.kind:
        zero, unit = np.tile(tree.zero, (len(equations.q), 1)), 1j * TINY * np.eye(equations.nv)
        still = Equations(tree, zero, equations.qd)
        slopes = [Equations(tree, zero + step, equations.qd).parts[2].imag / TINY for step in unit]
        rest = still.parts[2] + np.einsum("jsi,sj->si", slopes, equations.q - zero)
        values = layout.packed(still.parts[0], 0.0 * rest, rest)
        yield hypothesis(2, "angle", "equations", "", "linearized about the zero position", values)


def sums_of_angles(equations: Equations) -> Iterator[Hypothesis]:
    """The angle of a hinge in M and h plus or minus that of another one, while the speeds are its own."""
    tree, layout = equations.tree, equations.layout
    hinges = [(name, joint.q.start) for name, joint in equations.joints.items() if joint.kind == "hinge"]
    for (name, k), (other, of_other) in permutations(hinges, 2) if len(hinges) <= MOST_HINGES else ():
        for sign, what in ((1.0, "plus"), (-1.0, "minus")):
            q = equations.q.copy()
            q[:, k] += sign * (q[:, of_other] - tree.reference[list(tree.joint_names).index(other)])
            values = Equations(tree, q, equations.qd, layout).right
            yield hypothesis(
                2, "angle", f"angle of {name}", "", f"{what} that of {other}, the speeds as they are", values
            )


def orders_of_rotation(equations: Equations) -> Iterator[Hypothesis]:
    """Hinges in a row through one point, as Euler angles, in another order: in all, or in the angular velocity."""
    tree, nv = equations.tree, equations.nv
    joints, carriers = tree.coordinates.joints, set(tree.body_joint)
    rows: list[list[int]] = []
    for i, kind in enumerate(tree.kind):
        follows = bool(rows) and tree.parent[i] == rows[-1][-1] and i - 1 not in carriers
        if kind == "hinge" and follows and not np.any(tree.offset[i]):
            rows[-1].append(i)
        elif kind == "hinge":
            rows.append([i])
    for those in (those for those in rows if 1 < len(those) <= 3):
        for order in list(permutations(those))[1:]:
            at_q, at_v = np.arange(len(tree.zero)), np.arange(nv)
            for i, k in zip(those, order):
                at_q[joints[i].q.start], at_v[joints[i].qd.start] = joints[k].q.start, joints[k].qd.start
            axis, reference = tuple(tree.axis[v] for v in at_v), list(tree.reference)
            for i, k in zip(those, order):
                reference[i] = tree.reference[k]
            q, qd, back = equations.q[:, at_q], equations.qd[:, at_v], np.argsort(at_v)

            other = Equations(
                replace(tree, axis=axis, reference=tuple(reference)), q, qd, Layout(nv, True, False)
            )
            own = Equations(tree, equations.q, equations.qd, other.layout)
            of_rotation, moved = (
                {name: part.sum(axis=0) for name, part in of.terms.items()} for of in (other, own)
            )
            turning = {name: of_rotation[name] for name in OF_ROTATION}
            moving = {name: term for name, term in of_rotation.items() if name not in OF_ROTATION}
            names = listed([tree.joint_names[i] for i in order])
            for place, added in (
                ("", of_rotation),
                (" in the angular velocity", turning),
                (" in the positions", moving),
            ):
                values = own.right.copy()
                for name, term in added.items():
                    M, velocity_terms, rest = (
                        term[:, : nv * nv].reshape(-1, nv, nv),
                        *np.split(term[:, nv * nv :], 2, 1),
                    )
                    parts = M[:, back][:, :, back].reshape(len(M), -1), velocity_terms[:, back], rest[:, back]
                    values += np.concatenate(parts, axis=1) - moved[name]
                M, velocity_terms, rest = (
                    values[:, : nv * nv].reshape(-1, nv, nv),
                    *np.split(values[:, nv * nv :], 2, 1),
                )
                values = equations.layout.packed(M, velocity_terms, rest)
                yield hypothesis(2, "order", f"order of the rotations{place}", "", names, values)


def functions_of(equations: Equations, hinges: dict[str, np.ndarray]) -> Functions:
    """Sines and cosines of hinges and of their sums, their squares, and products of those of several hinges.

    And these times the lengths of slides; with the pairs that are taken for each other, the wrong one first.
    """
    values = {"0": 0.0 * equations.q[:, 0], "1": 0.0 * equations.q[:, 0] + 1.0}
    angles, pairs = sums_of(hinges), []
    for name, angle in angles.items():
        sine, cosine = f"sin({name})", f"cos({name})"
        values |= {sine: np.sin(angle), f"{sine}^2": np.sin(angle) ** 2}
        values |= {cosine: np.cos(angle), f"{cosine}^2": np.cos(angle) ** 2}
        pairs += [(sine, "0"), (cosine, "0"), ("1", sine), ("1", cosine), (sine, cosine)]
        pairs += [(sine, f"{sine}^2"), (cosine, f"{cosine}^2"), (f"{sine}^2", f"{cosine}^2")]
    for first, second in combinations(angles, 2):
        pairs += [(f"{function}({first})", f"{function}({second})") for function in ("sin", "cos")]
    tables = [factors_of(name) for name in hinges] if len(hinges) <= MOST_HINGES else []
    for factors in product(*tables):
        name = named(factors)
        values.setdefault(name, np.prod([values[factor] for factor in name.split(" ")], axis=0))
        for k, factor in enumerate(factors):
            pairs += [(named((*factors[:k], other, *factors[k + 1 :])), name) for other in tables[k][factor]]
    every, all_pairs = dict(values), list(pairs)
    for name, joint in equations.joints.items():
        for power, called in {1: name, 2: f"{name}^2"}.items() if joint.kind == "slide" else ():
            length = equations.q[:, joint.q.start] ** power
            every |= {f"{called} {function}": length * column for function, column in values.items()}
            times = {function: f"{called} {function}" if function != "0" else "0" for function in values}
            all_pairs += [(times[wrong], times[right]) for wrong, right in pairs if wrong in times]
    return every, [(wrong, right) for wrong, right in all_pairs if wrong in every]


def sums_of(hinges: dict[str, np.ndarray]) -> dict[str, np.ndarray]:
    """The angles of hinges, and sums and differences of two or three of them."""
    angles = dict(hinges)
    for count in (2, 3) if len(hinges) <= MOST_HINGES else (2,):
        for (first, *others), signs in product(combinations(hinges, count), product("+-", repeat=count - 1)):
            name, angle = first, hinges[first]
            for sign, other in zip(signs, others):
                name, angle = f"{name} {sign} {other}", angle + float(f"{sign}1") * hinges[other]
            angles[name] = angle
    return angles


def named(factors: Iterable[str]) -> str:
    return " ".join(filter(None, factors)) or "1"


def factors_of(hinge: str) -> dict[str, tuple[str, ...]]:
    """What a product may have of a hinge, and what is taken for it."""
    sine, cosine = f"sin({hinge})", f"cos({hinge})"
    return {
        "": (), sine: (cosine, ""), cosine: (sine, ""),
        f"{sine} {cosine}": (f"{sine}^2", f"{cosine}^2", sine, cosine),
        f"{sine}^2": (f"{cosine}^2", sine, ""), f"{cosine}^2": (f"{sine}^2", cosine, ""),
    }  # fmt: skip


def other_angles(equations: Equations, search: Search) -> Iterator[Hypothesis]:
    """Terms of an entry or a coefficient with another sine or cosine: left out, added, one for the other."""
    joints = zip(equations.joints.items(), equations.tree.reference)
    hinges = {name: equations.q[:, at.q.start] - zero for (name, at), zero in joints if at.kind == "hinge"}
    added = list(parallel(search, unit_columns(equations).items()))
    places = [place for place in search.places if place.kind in OF_FACTORS]
    places.sort(key=lambda place: OF_FACTORS.index(place.kind))
    columns = [(place.name, place.column) for place in places if place.column is not None]
    multiplied = list(parallel(search, columns))
    if not hinges or not (added or multiplied):
        return
    functions, pairs = functions_of(equations, hinges)
    changes = np.array([functions[wrong] - functions[right] for wrong, right in pairs])
    squares = (changes**2).sum(axis=1)
    for place, column, found in added:
        sizes = changes @ found / squares
        left = np.abs(sizes[:, None] * changes - found).max(axis=1)
        for k in np.flatnonzero(left <= CLOSE * np.abs(sizes)).tolist():
            size = float(sizes[k])
            yours, other = pairs[k] if size > 0.0 else pairs[k][::-1]
            terms = {name: f"{abs(size):.6g} {name}".removesuffix(" 1") for name in (yours, other)}
            said = f"{terms[yours]} instead of {terms[other]}"
            said = f"{terms[other]} left out" if yours == "0" else said
            said = f"{terms[yours]} added" if other == "0" else said
            yield hypothesis(
                2, "angle", place, "", said, search.right + (size * changes[k])[:, None] * column
            )
    for (place, column, _), name in product(multiplied, hinges):
        for yours, other in permutations(("1", f"sin({name})", f"cos({name})"), 2):
            change = functions[yours] / functions[other] - 1.0
            said = f"{yours} for {other}"
            said = f"{other} left out" if yours == "1" else said
            said = f"{yours} too many" if other == "1" else said
            yield hypothesis(2, "factor", place, "", said, search.right + change[:, None] * column)


def parallel(search: Search, columns: Iterable[tuple[str, np.ndarray]]) -> Iterator[Parallel]:
    """The columns that leave nothing with a factor for each state."""
    for name, column in columns:
        weighted = column * search.weight
        squares = (weighted**2).sum(axis=1)
        found = (weighted * search.off).sum(axis=1) / np.where(squares > 0.0, squares, 1.0)
        if np.abs(search.off - found[:, None] * weighted).max() <= 1.0:
            yield name, column, found
