"""Random faults of random trees, to which the search was not tuned."""

import numpy as np

import tmt

from ...diagnosis.places import OF_ZERO
from .derivation import ALL_TERMS
from .faults import TERM_NAMES, Fault, changed, own_joints, tree_numbers

SEED_OF_FAULTS = 13
MOST_JOINTS_OF_TREE = 5
KINDS_OF_FAULTS = ("number",) * 5 + ("term",) * 2 + ("convention",) * 2 + ("composition", "pair")


def generated(count: int) -> list[Fault]:
    """So many faults, each of a tree of its own."""
    rng = np.random.default_rng(SEED_OF_FAULTS)
    return [random_fault(rng, k) for k in range(count)]


def random_tree(rng: np.random.Generator) -> tmt.Tree:
    """A tree of two to five hinges and slides with tilted axes, often branched, a body on each joint."""
    while True:
        n = int(rng.integers(2, MOST_JOINTS_OF_TREE + 1))
        kind = tuple(rng.choice(["hinge", "slide"], p=[0.75, 0.25]) for _ in range(n))
        parent = tuple(i - 1 if rng.random() < 0.8 else int(rng.integers(-1, i)) if i else -1 for i in range(n))
        inertia = []
        for _ in range(n):
            second = np.diag(10.0 ** rng.uniform(-3.0, -1.0, 3))
            turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
            second = turn @ second @ turn.T
            inertia.append((np.trace(second) * np.eye(3) - (second + second.T) / 2.0).tolist())
        try:
            return tmt.Tree(
                hinge_names=tuple(f"j{i}" for i in range(n)),
                parent=parent,
                offset=rng.uniform(-0.5, 0.5, (n, 3)).tolist(),
                axis=rng.normal(size=(n, 3)).tolist(),
                damping=(rng.uniform(0.0, 2.0, n) * (rng.random() < 0.5)).tolist(),
                body_names=tuple(f"b{i}" for i in range(n)),
                body_hinge=tuple(range(n)),
                mass=(10.0 ** rng.uniform(-1.0, 1.0, n)).tolist(),
                com=rng.uniform(-0.3, 0.3, (n, 3)).tolist(),
                inertia=inertia,
                gravity=rng.uniform(-10.0, 10.0, 3).tolist(),
                kind=kind,
                armature=(rng.uniform(0.0, 0.5, n) * (rng.random(n) < 0.3)).tolist(),
            )
        except ValueError:  # its mass matrix would be singular
            continue


def random_fault(rng: np.random.Generator, k: int) -> Fault:
    """A fault of any kind and size of a random tree."""
    while True:
        tree, kind = random_tree(rng), str(rng.choice(KINDS_OF_FAULTS))
        made = {"number": number, "pair": pair, "term": term, "convention": convention, "composition": composition}[
            kind
        ]
        if (fault := made(rng, tree, f"random tree {k}")) is not None:
            return fault


def drawn_number(rng, tree) -> tuple | None:
    """A number of a tree changed by 1e-6 to 1 of its size: place, value, change, tree."""
    numbers = list(tree_numbers(tree))
    place, field, index, scale = numbers[int(rng.integers(len(numbers)))]
    made = changed(tree, field, index, rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, 0.0), scale)
    return made and (place, made[1], made[2], made[0])


def number(rng, tree, robot) -> Fault | None:
    if (one := drawn_number(rng, tree)) is None:
        return None
    place, value, size, edited = one
    return Fault(robot, tree, f"{place} {size:+.3g}", "number", "generator", size, (place,), (value,), ("tree", edited))


def pair(rng, tree, robot) -> Fault | None:
    one = drawn_number(rng, tree)
    other = one and drawn_number(rng, one[3])
    if not other or one[0] == other[0]:
        return None
    expected = f"{one[0]} and {other[0]}", f"{other[0]} and {one[0]}"
    name = f"{one[0]} {one[2]:+.3g} and {other[0]} {other[2]:+.3g}"
    return Fault(robot, tree, name, "pair", "generator", None, expected, (one[1], other[1]), ("tree", other[3]))


def term(rng, tree, robot) -> Fault:
    which, factor = str(rng.choice(ALL_TERMS)), float(rng.choice([0.0, 0.5, -1.0, 2.0, rng.uniform(-2.0, 2.0)]))
    body = int(rng.integers(len(tree.mass)))
    place = TERM_NAMES[which].format(tree.body_names[body])
    make = ("derived", {(body, which): factor})
    return Fault(robot, tree, f"{place} times {factor:.3g}", "term", "generator", factor, (place,), (factor,), make)


def convention(rng, tree, robot) -> Fault | None:
    """An order, or senses, or a zero."""
    n, names = len(tree.axis), tree.hinge_names
    kind = str(rng.choice(["order", "sign", OF_ZERO]))

    def fault(name, kind, size, expected, values, *make):
        return Fault(robot, tree, name, kind, "generator", size, tuple(expected), tuple(values), make)

    if kind == "order":
        order = rng.permutation(n).tolist()
        if order == list(range(n)) or any(tree.kind[i] != of for i, of in zip(order, tree.kind)):
            return None
        return own_joints(fault, f"order {order}", kind, ["order of the joints"], tree, order=tuple(order))
    if kind == "sign":
        sense = rng.choice([-1.0, 1.0], n)
        if sense.min() > 0.0:
            return None
        turned = [name for name, s in zip(names, sense) if s < 0.0]
        place = "sense of " + " and ".join(filter(None, (", ".join(turned[:-1]), turned[-1])))
        return own_joints(fault, place, kind, [place], tree, sense=tuple(sense))
    i = int(rng.integers(n))
    zero = tuple(float(rng.uniform(-1.5, 1.5)) if j == i else 0.0 for j in range(n))
    return own_joints(fault, f"zero of {names[i]} {zero[i]:+.3g}", kind, [f"zero of {names[i]}"], tree, at_zero=zero)


def composition(rng, tree, robot) -> Fault | None:
    """An order and senses together, or a sense and a zero."""
    n, names = len(tree.axis), tree.hinge_names

    def fault(name, kind, size, expected, values, *make):
        return Fault(robot, tree, name, kind, "generator", size, tuple(expected), tuple(values), make)

    order, sense = rng.permutation(n).tolist(), rng.choice([-1.0, 1.0], n)
    if rng.random() < 0.5:
        if order == list(range(n)) or sense.min() > 0.0 or any(tree.kind[i] != of for i, of in zip(order, tree.kind)):
            return None
        expected, own = ["order and senses of the joints"], {"order": tuple(order), "sense": tuple(sense)}
        return own_joints(fault, f"order {order}, senses {sense.tolist()}", "composition", expected, tree, **own)
    i, j = map(int, rng.choice(n, 2, replace=False))
    zero, sense = np.zeros(n), np.ones(n)
    zero[i], sense[j] = rng.uniform(-1.5, 1.5), -1.0
    expected = [f"sense of {names[j]} and zero of {names[i]}"]
    own = {"sense": tuple(sense), "at_zero": tuple(zero)}
    return own_joints(fault, f"sense of {names[j]}, zero of {names[i]}", "composition", expected, tree, **own)
