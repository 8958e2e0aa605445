"""Explanations without a number to fit: options, slips of derivatives, and sines and cosines of a hinge.

A variant is a cause with Mbar and h as they would be, as `Equations.values` has them.
"""

from collections.abc import Iterable, Iterator
from functools import partial
from itertools import chain, combinations, permutations, product

import numpy as np

from tmt import literal

from ..core.cause import Cause
from ..core.words import listed
from .fit import Search
from .model import MOST_SPEEDS, TINY, Equations, Path
from .terms import unit_columns

Variant = tuple[Cause, np.ndarray]  # the values: (states, entries)
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
OF_FACTORS = "coefficient", "term", "part"  # kinds of places
MOST_HINGES = 4  # of which products of sines and cosines are tried
CLOSE = 1e-6  # of a coefficient, before the values are compared
OF_SLOPES = {"left out": 0.0, "of the other sign": -1.0, "halved": 0.5, "twice": 2.0}


def variant(rank: int, kind: str, place: str, stated: str, explains: str, values: np.ndarray) -> Variant:
    return Cause(rank=rank, kind=kind, place=place, stated=stated, explains=explains), values


option, slip = partial(variant, 1, "option"), partial(variant, 2, "slip")


def program_options(equations: Equations) -> Iterator[Variant]:
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


def exchanged_entries(equations: Equations) -> Iterator[Variant]:
    """Two entries of Mbar or two rows of h exchanged."""
    entries, layout = equations.entries, equations.layout
    of_M = [(entry, [k]) for k, entry in enumerate(entries[equations.in_M])]
    of_h = [(entries[layout.in_M.stop + i], layout.of_row(i)) for i in range(equations.nv)]
    pairs = chain(combinations(of_M, 2), combinations(of_h, 2)) if equations.nv <= MOST_SPEEDS else ()
    for (first, here), (second, there) in pairs:
        values = equations.right.copy()
        values[:, [*here, *there]] = values[:, [*there, *here]]
        names = [entry.named(equations.speeds) for entry in (first, second)]
        yield variant(2, "numbers", listed(names), "", "exchanged", values)


def other_variables(equations: Equations) -> Iterator[Variant]:
    """The position, the speed or both of a joint taken for those of another of its kind."""
    tree, q, qd, layout = equations.tree, equations.q, equations.qd, equations.layout
    straight = [(name, joint) for name, joint in equations.joints.items() if joint.kind != "ball"]
    for (name, joint), (other, by) in permutations(straight, 2) if len(straight) <= MOST_SPEEDS else ():
        if joint.kind != by.kind:
            continue
        moved, faster = q.copy(), qd.copy()
        moved[:, joint.q], faster[:, joint.qd] = q[:, by.q], qd[:, by.qd]
        for what, state in {"q": (moved, qd), "qd": (q, faster), "q and qd": (moved, faster)}.items():
            values = Equations(tree, *state, layout).right
            yield slip(f"{what} of {other} taken for that of {name}", "", "", values)


def exchanged(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    return qd, q


def in_turn(q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    together = np.concatenate([q, qd], axis=1)
    return together[:, ::2], together[:, 1::2]


def lagrange(equations: Equations) -> Iterator[Variant]:
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
    for (i, j), k in ((pair, k) for pair in zip(*np.tril_indices(equations.nv)) for k in range(equations.nv)):
        alone = np.zeros_like(slopes)
        alone[:, [i, j], [j, i], k] = slopes[:, [i, j], [j, i], k]
        added = np.einsum("sijk,sk,sj->si", alone, qd, qd) - np.einsum("sijk,si,sj->sk", alone, qd, qd) / 2.0
        for explains, factor in OF_SLOPES.items() if added.any() else ():
            values = equations.with_bias(velocity_terms + (factor - 1.0) * added, rest)
            place = f"dM[{speeds[i]}][{speeds[j]}]/d {speeds[k]} in h"
            yield variant(2, "derivative", place, "once", explains, values)


def exchanged_angles(equations: Equations) -> Iterator[Variant]:
    """Sine and cosine of a hinge exchanged in a part of the equations."""
    tree, layout = equations.tree, equations.layout
    for (name, joint), zero in zip(equations.joints.items(), tree.reference):
        if joint.kind == "hinge":
            q = equations.q.copy()
            q[:, joint.q] = np.pi / 2.0 + 2.0 * zero - q[:, joint.q]
            other = Equations(tree, q, equations.qd, layout).right
            for part, entries in layout.parts.items():
                values = equations.right.copy()
                values[:, entries] = other[:, entries]
                yield variant(2, "angle", f"sine and cosine of {name} exchanged in {part}", "", "", values)


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
            all_pairs += [(f"{called} {wrong}", f"{called} {right}") for wrong, right in pairs]
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


def other_angles(equations: Equations, search: Search) -> Iterator[Variant]:
    """Terms of an entry or a coefficient with another sine or cosine: left out, added, one for the other."""
    joints = zip(equations.joints.items(), equations.tree.reference)
    hinges = {name: equations.q[:, at.q.start] - zero for (name, at), zero in joints if at.kind == "hinge"}
    yield from exchanged_angles(equations)
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
            yield variant(2, "angle", place, "", said, search.right + (size * changes[k])[:, None] * column)
    for (place, column, _), name in product(multiplied, hinges):
        for yours, other in permutations(("1", f"sin({name})", f"cos({name})"), 2):
            change = functions[yours] / functions[other] - 1.0
            said = f"{yours} for {other}"
            said = f"{other} left out" if yours == "1" else said
            said = f"{yours} too many" if other == "1" else said
            yield variant(2, "factor", place, "", said, search.right + change[:, None] * column)


def parallel(search: Search, columns: Iterable[tuple[str, np.ndarray]]) -> Iterator[Parallel]:
    """The columns that leave nothing with a factor for each state."""
    for name, column in columns:
        weighted = column * search.weight
        squares = (weighted**2).sum(axis=1)
        found = (weighted * search.off).sum(axis=1) / np.where(squares > 0.0, squares, 1.0)
        if np.abs(search.off - found[:, None] * weighted).max() <= 1.0:
            yield name, column, found
