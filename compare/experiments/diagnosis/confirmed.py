"""Whether a cause does what a made fault does, at states that the search did not have and without its code."""

import dataclasses

import numpy as np

import tmt

from ...diagnosis.words import Cause
from .derivation import derived
from .faults import SLIPS, TERM_NAMES, Fault, tmt_edited, tree_numbers
from .made_values import by_composite, in_own_joints, values_of_fault

SAME_EFFECT = 1e-5  # of a difference, that a cause may leave: its value is fitted


def confirmed(fault: Fault, cause: Cause, q: np.ndarray, qd: np.ndarray) -> bool | None:
    """Whether M and h with the cause are those with the fault, at states q, qd; None where the cause is of no kind known here."""
    made = with_cause(fault.tree, cause, q, qd)
    if made is None:
        return None
    given, right = values_of_fault(fault, q, qd), by_composite(fault.tree, q, qd)
    off = [np.linalg.norm(a - b) for a, b in zip(given, right)]
    left = [np.linalg.norm(a - b) for a, b in zip(given, made)]
    sizes = [np.linalg.norm(part) for part in right]
    return all(rest <= SAME_EFFECT * moved + 1e-12 * size for rest, moved, size in zip(left, off, sizes))


def with_cause(tree: tmt.Tree, cause: Cause, q: np.ndarray, qd: np.ndarray) -> tuple[np.ndarray, np.ndarray] | None:
    """M and h of a tree with what a cause says: one number or two, a term, a slip, gravity, order or senses."""
    numbers = {place: (field, index) for place, field, index, _ in tree_numbers(tree)}
    places, found = cause.place.split(" and "), str(cause.explains).split(" and ")
    if all(place in numbers for place in places):
        changed = tree
        stated = [cause.stated] if len(places) == 1 else cause.stated.split(" and ")
        try:
            for place, before, value in zip(places, stated, found):
                changed = tmt_edited(changed, *numbers[place], float(value) - float(before))
        except ValueError:  # no rigid body has this: it cannot be made as a Tree
            return None
        return by_composite(changed, q, qd)
    bodies = {name: (b,) for b, name in enumerate(tree.body_names)} | {"every body": tuple(range(len(tree.mass)))}
    for of, which in bodies.items():
        for term, name in TERM_NAMES.items():
            if cause.place == name.format(of):
                return derived(tree, q, qd, {(b, term): float(cause.explains) for b in which})
        for slip, name in SLIPS.items():
            if cause.place == name.format(of):
                return derived(tree, q, qd, {}, slip, which)
    if cause.place in ("gravity", "sign of gravity"):
        factor = {"gravity": 0.0, "sign of gravity": -1.0}[cause.place]
        return by_composite(dataclasses.replace(tree, gravity=tuple(factor * g for g in tree.gravity)), q, qd)
    joints = {name: i for i, name in enumerate(tree.hinge_names)}
    n = len(joints)
    plain = {
        "order": tuple(range(n)),
        "sense": (1.0,) * n,
        "at_zero": (0.0,) * n,
        "of_q": (1.0,) * n,
        "of_qd": (1.0,) * n,
    }
    if cause.kind == "order":
        own = {"order": tuple(joints[name] for name in found[0].split(", "))}
    elif cause.kind == "sign":
        turned = cause.place.removeprefix("sense of ").replace(" and ", ", ").split(", ")
        own = {"sense": tuple(-1.0 if name in turned else 1.0 for name in tree.hinge_names)}
    else:
        return None
    return in_own_joints(tree, q, qd, *(plain | own).values())
