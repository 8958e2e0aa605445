"""Other sines, cosines and orders of hinges: linearized, sums of angles, Euler angles, terms of an entry."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import combinations, permutations, product

import numpy as np

from tmt.derivation import method

from ..core.words import listed
from .fit import Search
from .hypothesis import Hypothesis, hypothesis
from .model import TINY, Equations
from .terms import unit_columns

Functions = tuple[
    dict[str, np.ndarray], list[tuple[str, str]]
]  # functions by their names, (states,), and pairs
Parallel = tuple[str, np.ndarray, np.ndarray]  # a name, a column (states, entries) and its factors (states,)
OF_FACTORS = "coefficient", "term"  # kinds of places
ORDERED = " in the angular velocity", " in the positions"  # where alone an order may be another
MOST_HINGES = 4  # of which products of sines and cosines are tried
CLOSE = 1e-6  # of a coefficient, before the values are compared


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
    """Hinges in a row through one point, as Euler angles, in another order: in all, or in a part."""
    tree, joints, carriers = equations.tree, equations.tree.coordinates.joints, set(equations.tree.body_joint)
    rows: list[list[int]] = []
    for i, kind in enumerate(tree.kind):
        follows = bool(rows) and tree.parent[i] == rows[-1][-1] and i - 1 not in carriers
        if kind == "hinge" and follows and not np.any(tree.offset[i]):
            rows[-1].append(i)
        elif kind == "hinge":
            rows.append([i])
    for those in (those for those in rows if 1 < len(those) <= 3):
        for order in list(permutations(those))[1:]:
            at_q, at_v, reference = np.arange(len(tree.zero)), np.arange(equations.nv), list(tree.reference)
            for i, k in zip(those, order):
                at_q[joints[i].q.start], at_v[joints[i].qd.start] = joints[k].q.start, joints[k].qd.start
                reference[i] = tree.reference[k]
            axis = tuple(tree.axis[v] for v in at_v)
            other_tree = replace(tree, axis=axis, reference=tuple(reference))
            others = method.bodies(other_tree, [*equations.q.T[at_q]], [*equations.qd.T[at_v]])
            parts = {where: list[method.Body]() for where in ("", *ORDERED)}
            for body, other in zip(equations.bodies, others):
                T, B = ([columns[k] for k in np.argsort(at_v)] for columns in (other.T, other.B))
                turning = body._replace(B=B, omega=other.omega, w_conv=other.w_conv)
                moving = body._replace(T=T, v_conv=other.v_conv)
                both = turning._replace(T=T, v_conv=other.v_conv)
                for bodies, wrong in zip(parts.values(), (both, turning, moving)):
                    bodies.append(wrong)
            names = listed([tree.joint_names[i] for i in order])
            for where, bodies in parts.items():
                values = equations.layout.packed(*equations.summed(bodies, tree.gravity, tree.armature))
                yield hypothesis(2, "order", f"order of the rotations{where}", "", names, values)


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
