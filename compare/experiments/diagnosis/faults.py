"""Made faults: what is wrong, how it is made, and what a diagnosis must call it."""

import dataclasses
from collections.abc import Iterator, Sequence
from itertools import combinations, permutations
from typing import NamedTuple

import numpy as np

import tmt

from ...diagnosis.places import OF_ZERO, XYZ

OF_INERTIA = (("xx", 0, 0), ("yy", 1, 1), ("zz", 2, 2), ("xy", 0, 1), ("xz", 0, 2), ("yz", 1, 2))
TERM_NAMES = {
    "translation": "T' m T of {}", "rotation": "B' I B of {}", "gravity": "gravity term T' m g of {}",
    "convective": "convective term T' m v_conv of {}", "Euler": "Euler term B' I w_conv of {}",
    "gyroscopic": "gyroscopic term B' (omega x I omega) of {}",
}  # fmt: skip
SLIPS = {  # of the second derivation, by the name that a diagnosis has for it
    "R for R'": "R for R' in the angular velocity of {}",
    "not turned": "inertia of {} not turned to the inertial frame",
    "turned the wrong way": "R' I R for R I R' of {}",
    "about the joint": "inertia of {} about its joint and mass counted again",
    "products of rates out of v": "products of different rates in v_conv of {} left out",
    "half the products of rates in v": "products of different rates in v_conv of {} once for twice",
    "products of rates out of w": "products of different rates in w_conv of {} left out",
    "products of rates out of both": "products of different rates in v_conv and w_conv of {} left out",
    "squares of rates out of v": "squares of rates in v_conv of {} left out",
}
LAGRANGE = {  # factors of Mdot qd and of the gradient of the kinetic energy
    "gradient of the kinetic energy in h": ((1.0, 0.0), (1.0, -1.0), (1.0, 2.0)),
    "Mdot qd in h": ((0.0, 1.0), (0.5, 1.0), (0.5, 0.0)),
}
SIZES = (1.0, -1.0, 0.3, -0.3, 0.1, -0.1, 0.01, -0.01)  # of which the first that a rigid body can have


class Fault(NamedTuple):
    """One thing that is made wrong."""

    robot: str
    tree: tmt.Tree  # the right one
    name: str
    kind: str
    source: str  # "list" or "generator"
    size: float | None
    expected: tuple[str, ...]  # places of a cause that names it: any of these
    values: tuple[float, ...]  # which the cause must give, () where there are none
    make: tuple  # how: see `values_of_fault`


def fault_list(robot: str, tree: tmt.Tree, every_size: bool) -> Iterator[Fault]:
    """Every kind of fault of one robot. every_size: numbers are changed by several sizes, and flipped;
    terms are omitted, halved and flipped, else one of these."""

    def fault(name, kind, size, expected, values, *make) -> Fault:
        return Fault(robot, tree, name, kind, "list", size, tuple(expected), tuple(values), make)

    for place, field, index, scale in tree_numbers(tree):
        for share in (0.1, 1e-4, -2.0) if every_size else (0.07,):
            if (made := changed(tree, field, index, share, scale)) is not None:
                edited, value, size = made
                yield fault(f"{place} {size:+.3g}", "number", size, [place], [value], "tree", edited)
    bodies = range(len(tree.mass))
    for t, (term, name) in enumerate(TERM_NAMES.items()):
        for which in [[b] for b in bodies] + [list(bodies)]:
            place = name.format(tree.body_names[which[0]] if len(which) == 1 else "every body")
            forms = ((0.0, "omitted"), (0.5, "halved"), (-1.0, "flipped"))
            for factor, word in forms if every_size else [forms[(t + which[0]) % 3]]:
                factors = {(b, term): factor for b in which}
                yield fault(f"{place} {word}", "term", factor, [place], [factor], "derived", factors)
    for slip, name in SLIPS.items():
        for which in [(b,) for b in bodies] + [tuple(bodies)]:
            place = name.format(tree.body_names[which[0]] if len(which) == 1 else "every body")
            yield fault(place, "slip", None, [place], [], "derived", {}, slip, which)
    for b, (i, j) in ((b, pair) for b in bodies for pair in combinations(XYZ, 2)):
        place = f"axes {i} and {j} of the inertia of {tree.body_names[b]} exchanged"
        yield fault(place, "slip", None, [place], [], "derived", {}, f"exchanged {i} {j}", (b,))
    for place, forms in LAGRANGE.items():
        for factors in forms:
            yield fault(f"{place}: {factors[0]:g}, {factors[1]:g}", "slip", None, [place], [], "lagrange", *factors)
    yield fault("sign of the bias", "option", None, ["sign of the bias"], [], "negative")
    if any(tree.damping):
        yield fault("damping in the bias", "option", None, ["damping D qd"], [], "damped", 1.0)
        yield fault("damping in the bias, flipped", "option", None, ["damping D qd"], [], "damped", -1.0)
    yield from conventions_of(robot, tree)
    yield from entries_of(robot, tree)
    yield from pairs_of(robot, tree)


def tree_numbers(tree: tmt.Tree) -> Iterator[tuple[str, str, tuple, float]]:
    """Place, field of the Tree, index and natural size of each number."""
    length = max(np.abs(tree.offset).max(), np.abs(tree.com).max(), 1e-3)
    for b, body in enumerate(tree.body_names):
        yield f"mass of {body}", "mass", (b,), tree.mass[b]
        for k in range(3):
            yield f"CoM {XYZ[k]} of {body}", "com", (b, k), length
        for name, i, j in OF_INERTIA:
            yield f"inertia {name} of {body}", "inertia", (b, i, j), float(np.abs(tree.inertia[b]).max())
    for i, joint in enumerate(tree.hinge_names):
        for k in range(3):
            yield f"offset {XYZ[k]} of {joint}", "offset", (i, k), length
            if tree.kind[i] != "slide":
                yield f"anchor {XYZ[k]} of {joint}", "anchor", (i, k), length
            yield f"axis {XYZ[k]} of {joint}", "axis", (i, k), 1.0
        yield f"zero of {joint}", "reference", (i,), 1.0
        yield f"armature of {joint}", "armature", (i,), max(tree.armature[i], 0.1)
    for k in range(3):
        yield f"gravity {XYZ[k]}", "gravity", (k,), 9.81


def changed(
    tree: tmt.Tree, field: str, index: tuple, share: float, scale: float
) -> tuple[tmt.Tree, float, float] | None:
    """The tree with one number changed by a share of its scale (-2: of the other sign), its new value, and the change."""
    of = "offset" if field == "anchor" else field
    stated = float(np.array(getattr(tree, of))[index])
    if share == -2.0 and not stated:
        return None
    for smaller in SIZES if share != -2.0 else (1.0,):
        size = -2.0 * stated if share == -2.0 else share * smaller * scale
        try:
            edited = tmt_edited(tree, field, index, size)
        except ValueError:  # no rigid body has this
            continue
        return edited, stated + size, size
    return None


def tmt_edited(tree: tmt.Tree, field: str, index: tuple, size: float) -> tmt.Tree:
    """The tree with a number changed by this; an anchor moves and all that its joint carries stays."""
    fields = {name: np.array(getattr(tree, name), float) for name in ("offset", "com", field) if name != "anchor"}
    fields["offset" if field == "anchor" else field][index] += size
    if field == "inertia" and index[1] != index[2]:
        fields["inertia"][index[0], index[2], index[1]] += size
    if field == "anchor":
        joint, k = index
        for b, of in enumerate(tree.body_hinge):
            fields["com"][b, k] -= size * (of == joint)
        for j, parent in enumerate(tree.parent):
            fields["offset"][j, k] -= size * (parent == joint)
    return dataclasses.replace(tree, **{name: value.tolist() for name, value in fields.items()})


def own_joints(fault_of, name: str, kind: str, expected: Sequence[str], tree: tmt.Tree, **own) -> Fault:
    n = len(tree.axis)
    one = (1.0,) * n
    asked = {"order": tuple(range(n)), "sense": one, "at_zero": (0.0,) * n, "of_q": one, "of_qd": one}
    return fault_of(name, kind, None, expected, [], "joints", *(asked | own).values())


def conventions_of(robot: str, tree: tmt.Tree, most: int = 12) -> Iterator[Fault]:
    """Order, sense, zero and unit of the joints."""

    def fault(name, kind, size, expected, values, *make) -> Fault:
        return Fault(robot, tree, name, kind, "list", size, tuple(expected), tuple(values), make)

    n, names, degrees = len(tree.axis), tree.hinge_names, 180.0 / np.pi
    orders = [order for order in permutations(range(n)) if list(order) != list(range(n))]
    for order in orders[:: max(1, len(orders) // most)]:
        name = f"order {', '.join(names[i] for i in order)}"
        yield own_joints(fault, name, "order", ["order of the joints"], tree, order=order)
    for which in [(i,) for i in range(n)] + list(combinations(range(n), 2))[:most]:
        sense = tuple(-1.0 if i in which else 1.0 for i in range(n))
        name = f"sense of {' and '.join(names[i] for i in which)}"
        yield own_joints(fault, name, "sign", [name], tree, sense=sense)
    for i, zero in ((i, zero) for i in range(n) for zero in (np.pi / 2.0, -0.3)):
        at = tuple(zero if j == i else 0.0 for j in range(n))
        yield own_joints(fault, f"zero of {names[i]} {zero:+.3g}", OF_ZERO, [f"zero of {names[i]}"], tree, at_zero=at)
    for which, of in [((i,), names[i]) for i in range(n)] + [(tuple(range(n)), "all hinges")]:
        units = tuple(degrees if j in which else 1.0 for j in range(n))
        yield own_joints(fault, f"{of} in deg", "unit", [f"unit of {of}"], tree, of_q=units, of_qd=units)
        yield own_joints(fault, f"{of} in deg, rates in rad/s", "unit", [f"unit of {of}"], tree, of_q=units)


def entries_of(robot: str, tree: tmt.Tree) -> Iterator[Fault]:
    """One coefficient with a factor."""

    def fault(place, factor, *entry) -> Fault:
        make = ("entry", entry, factor)
        return Fault(robot, tree, f"{place} times {factor:g}", "coefficient", "list", factor, (place,), (factor,), make)

    n = min(3, len(tree.axis))
    for i in range(n):
        for j in range(i + 1):
            yield fault(f"M[{i}][{j}]", 1.3, "M", i, j)
        yield fault(f"h[{i}] at rest", -1.0, "h", i)
        for j in range(n):
            for k in range(j, n):
                rates = f"qd{j}^2" if j == k else f"qd{j} qd{k}"
                yield fault(f"h[{i}], coefficient of {rates}", (-1.0, 2.0, 0.5)[(i + j + k) % 3], "h", i, j, k)


def pairs_of(robot: str, tree: tmt.Tree, count: int = 12) -> Iterator[Fault]:
    """Two numbers together, drawn once for all."""
    rng, numbers = np.random.default_rng(1), list(tree_numbers(tree))
    made = 0
    while made < count:
        first, second = (numbers[k] for k in rng.choice(len(numbers), 2, replace=False))
        one = changed(tree, *first[1:3], 0.1, first[3])
        both = one and changed(one[0], *second[1:3], 0.07, second[3])
        if both:
            names, values = (first[0], second[0]), (one[1], both[1])
            expected = [" and ".join(names), " and ".join(names[::-1])]
            name = f"{names[0]} {one[2]:+.3g} and {names[1]} {both[2]:+.3g}"
            yield Fault(robot, tree, name, "pair", "list", None, tuple(expected), values, ("tree", both[0]))
            made += 1
