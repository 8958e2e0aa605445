"""Other sines, cosines and orders of hinges: linearized, sums of angles, Euler angles, terms of an entry."""

from collections.abc import Iterable, Iterator
from dataclasses import replace
from itertools import chain, combinations, permutations, product

import numpy as np

from tmt.derivation import method

from ...core.words import listed
from ..fit import Search
from ..hypothesis import Hypothesis, slip
from ..model import TINY, Equations
from .terms import coefficients, terms, unit_columns

Parallel = tuple[str, np.ndarray, np.ndarray]  # a name, a column (states, entries) and its factors (states,)
OF_FACTORS = "coefficient", "term"  # kinds
ANGLE, FACTOR, ORDER = 0.45, 0.5, 0.25  # costs
CONSTANT = 1.05  # rather a number that nobody writes
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
        values = first_order(equations.q, those)
        yield slip(equations.right, place, "linearized, sin a = a and cos a = 1", values, ANGLE, "angle")
    if "ball" not in tree.kind:
        zero, unit = np.tile(tree.zero, (len(equations.q), 1)), 1j * TINY * np.eye(equations.nv)
        still = Equations(tree, zero, equations.qd)
        slopes = [Equations(tree, zero + step, equations.qd).parts[2].imag / TINY for step in unit]
        rest = still.parts[2] + np.einsum("jsi,sj->si", slopes, equations.q - zero)
        values = layout.packed(still.parts[0], 0.0 * rest, rest)
        yield slip(equations.right, "equations", "linearized about the zero position", values, ANGLE, "angle")


def sums_of_angles(equations: Equations) -> Iterator[Hypothesis]:
    """The angle of a hinge in M and h plus or minus that of another one, while the speeds are its own."""
    tree, layout = equations.tree, equations.layout
    hinges = [(name, joint.q.start) for name, joint in equations.joints.items() if joint.kind == "hinge"]
    for (name, k), (other, of_other) in permutations(hinges, 2) if len(hinges) <= MOST_HINGES else ():
        for sign, what in ((1.0, "plus"), (-1.0, "minus")):
            q = equations.q.copy()
            q[:, k] += sign * (q[:, of_other] - tree.reference[list(tree.joint_names).index(other)])
            values = Equations(tree, q, equations.qd, layout).right
            explains = f"{what} that of {other}, the speeds as they are"
            yield slip(equations.right, f"angle of {name}", explains, values, ANGLE, "angle")


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
                yield slip(equations.right, f"order of the rotations{where}", names, values, ORDER, "order")


def functions_of(equations: Equations) -> list[dict[str, np.ndarray]]:
    """Products of sines and cosines of hinges, and those of sums of their angles, (states,), by how they are said.

    One table, and for each slide those times its length and its square.
    """
    tree, one = equations.tree, np.ones(len(equations.q))
    hinges, slides = list[tuple[str, np.ndarray]](), list[tuple[str, np.ndarray]]()
    for (name, joint), zero in zip(equations.joints.items(), tree.reference):
        if joint.kind == "slide":
            slides.append((name, equations.q[:, joint.q.start]))
        elif joint.kind == "hinge":
            hinges.append((name, equations.q[:, joint.q.start] - zero))
    if not hinges:
        return []
    powers, are_few = list[dict[str, np.ndarray]](), len(hinges) <= MOST_HINGES
    for name, angle in hinges if are_few else ():
        sine, cosine = {f"sin({name})": np.sin(angle)}, {f"cos({name})": np.cos(angle)}
        (s, x), (c, y) = *sine.items(), *cosine.items()
        powers.append({"": one} | sine | cosine | {f"{s} {c}": x * y, f"{s}^2": x**2, f"{c}^2": y**2})
    table = {"1": one}
    for factors in product(*(of_hinge.items() for of_hinge in powers)):
        said = " ".join(name for name, _ in factors if name) or "1"
        table[said] = np.prod([values for _, values in factors], axis=0) * one
    for count in (1, 2, 3) if are_few else (1, 2):
        for (first, *others), signs in product(combinations(hinges, count), product("+-", repeat=count - 1)):
            name, angle = first
            for sign, (other, values) in zip(signs, others):
                name, angle = f"{name} {sign} {other}", angle + float(f"{sign}1") * values
            for function, values in {"sin": np.sin(angle), "cos": np.cos(angle)}.items():
                table |= {f"{function}({name})": values, f"{function}({name})^2": values**2}
    tables = [table]
    for (name, length), (power, suffix) in product(slides, ((1, ""), (2, "^2"))):
        of_length = {f"{name}{suffix} {said}".removesuffix(" 1"): x for said, x in table.items()}
        tables.append({said: length**power * x for said, x in of_length.items()})
    return tables


def instead_of(found: np.ndarray, table: dict[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    """How a change (states,) is said, and its values: a function added or left out, and one instead of another.

    Of several of these, which are the same by an identity, the shortest.
    """
    names, values = list(table), np.array([*table.values()])
    alone, pairs = list[tuple[str, np.ndarray]](), list[tuple[str, np.ndarray]]()
    for k, right in enumerate([np.zeros_like(found), *values]):
        changes = values - right
        sizes = changes @ found / np.fmax((changes**2).sum(axis=1), 1e-300)
        left = np.abs(sizes[:, None] * changes - found).max(axis=1)
        for j in np.flatnonzero((left <= CLOSE * np.abs(sizes)) & (sizes > 0.0 if k else True)).tolist():
            size = f"{abs(sizes[j]):.6g}"
            said = f"{size} {names[j]} {'added' if sizes[j] > 0.0 else 'left out'}"
            if k:
                said = f"{size} {names[j]} instead of {size} {names[k - 1]}"
            said = said.replace(" 1 ", " ").removesuffix(" 1")
            (pairs if k else alone).append((said, sizes[j] * changes[j]))
    for likely in (alone, pairs):
        least = min((len(said) for said, _ in likely), default=0)
        yield from (pair for pair in likely if len(pair[0]) == least)


def other_angles(equations: Equations, search: Search) -> Iterator[Hypothesis]:
    """Terms of an entry or a coefficient with another sine or cosine: left out, added, one for the other."""
    tables = functions_of(equations)
    if not tables:
        return
    for place, column, found in parallel(search, unit_columns(equations).items()):
        for said, change in chain.from_iterable(instead_of(found, table) for table in tables):
            values, is_constant = search.right + change[:, None] * column, np.ptp(change) == 0.0
            yield slip(equations.right, place, said, values, CONSTANT if is_constant else ANGLE, "angle")
    factors = [*coefficients(equations), *terms(equations)]
    columns = [(one.cause.place, np.asarray(one.column)) for one in factors if one.cause.kind in OF_FACTORS]
    hinges = [name for name, kind in zip(equations.joints, equations.tree.kind) if kind == "hinge"]
    for (place, column, _), name in product(parallel(search, columns), hinges):
        for yours, other in permutations(("1", f"sin({name})", f"cos({name})"), 2):
            change = tables[0][yours] / tables[0][other] - 1.0
            said = f"{other} left out" if yours == "1" else f"{yours} too many"
            said = said if "1" in (yours, other) else f"{yours} for {other}"
            values = search.right + change[:, None] * column
            yield slip(equations.right, place, said, values, FACTOR, "factor")


def parallel(search: Search, columns: Iterable[tuple[str, np.ndarray]]) -> Iterator[Parallel]:
    """The columns that leave nothing with a factor for each state."""
    for name, column in columns:
        weighted = column * search.weight
        squares = (weighted**2).sum(axis=1)
        found = (weighted * search.off).sum(axis=1) / np.where(squares > 0.0, squares, 1.0)
        if np.abs(search.off - found[:, None] * weighted).max() <= 1.0:
            yield name, column, found
