"""Explanations without a number to fit: options and conventions of joints, rank 1; slips.py has those of the
derivation.

A variant is a cause with Mbar and h as they would be, as `Equations.values` has them.
"""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from functools import partial
from itertools import combinations, permutations, product

import numpy as np

import tmt
from tmt import literal

from ..core.cause import Cause
from ..core.words import listed
from ..robots.joint_map import PER_UNIT, Joint, JointMap
from .model import VELOCITY_TERMS, Equations, Path, packed

PARALLEL = 1e-9  # of a cosine from 1
MOST_PERMUTED = 6  # joints: with more, only the sense and the unit of one are tried
MOST_TURNED = 4  # joints whose order and senses are tried together

Variant = tuple[Cause, np.ndarray]  # the values: (states, entries)
Convention = tuple[Cause, JointMap]  # the joints of equations that have it


def variant(rank: int, kind: str, place: str, stated: str, explains: str, values: np.ndarray) -> Variant:
    return Cause(rank=rank, kind=kind, place=place, stated=stated, explains=explains), values


option, slip = partial(variant, 1, "option"), partial(variant, 2, "slip")


def program_options(equations: Equations) -> Iterator[Variant]:
    """What an option or a convention of the whole file or program changes."""
    tree, q, qd, h = equations.tree, equations.q, equations.qd, equations.right[:, equations.in_h]
    with_bias, terms = equations.with_bias, equations.terms
    weight = terms["gravity"].sum(axis=0)
    of_speeds = np.sum([terms[name] for name in VELOCITY_TERMS], axis=(0, 1))
    yield option("gravity", "on", "off", equations.right - weight)
    yield option("sign of gravity", "+", "-", equations.right - 2.0 * weight)
    yield option("velocity terms in h", "there", "left out", equations.right - of_speeds)
    yield option("bias", "there", "left out", with_bias(0.0 * h))
    yield option("sign of the bias", "Mbar qdd + h = tau", "Mbar qdd = tau + h", with_bias(-h))
    if q.shape == qd.shape:
        exchanged = with_bias(Equations(tree, qd, q).right[:, equations.in_h])
        yield option("arguments of bias", "bias(q, qd)", "exchanged, bias(qd, q)", exchanged)
    if any(tree.damping):
        drag = np.array(tree.damping) * qd
        yield option("damping D qd", "not in h", "in h", with_bias(h + drag))
        yield option("damping D qd", "not in h", "in h, of the other sign", with_bias(h - drag))
    if tree.has_springs:
        sprung = with_bias(h + literal.spring_torque(q, tree))
        yield option("springs k (q - rest)", "not in h", "in h", sprung)
    if any(tree.armature):
        rotors = {Path("armature", (i,)): np.array([-rotor]) for i, rotor in enumerate(tree.armature)}
        yield option("armature", "on the diagonal of Mbar", "left out", equations.values(rotors)[0])
    turns = absolute_angles(tree)
    if turns is not None:
        inner = Equations(tree, q @ turns.T, qd @ turns.T)
        M = turns.T @ inner.full_mass_matrix(inner.right) @ turns
        absolute = packed(M, inner.right[:, inner.in_h] @ turns)
        yield option("angles", "between a body and the one before", "between a body and the world", absolute)


def absolute_angles(tree: tmt.Tree) -> np.ndarray | None:
    """Joint angles from angles to the world, (nv, nv), in a row of parallel hinges; None: there is none."""
    if set(tree.kind) != {"hinge"}:
        return None
    turns = np.eye(len(tree.axis))
    for i, parent in enumerate(tree.parent):
        along = float(np.dot(tree.axis[i], tree.axis[parent])) if parent >= 0 else 0.0
        if abs(abs(along) - 1.0) < PARALLEL:
            turns[i, parent] = -np.sign(along)
    return turns if (turns != np.eye(len(turns))).any() else None


def conventions(equations: Equations) -> Iterator[Convention]:
    """Order, senses and units of the joints; the order and the senses of a few together, rank 3."""
    coordinates, names = equations.coordinates, equations.coordinates.names
    kinds, in_order = dict(zip(names, coordinates.all_kinds)), ", ".join(names)
    right = {name: Joint(name, slides=kinds[name] == "slide") for name in names}

    def turned(joints: Sequence[str]) -> dict[str, Joint]:
        return right | {name: right[name]._replace(sign=-1.0) for name in joints}

    def convention(kind: str, place: str, stated: str, explains: str, joints: Iterable[Joint]) -> Convention:
        cause = Cause(rank=1, kind=kind, place=place, stated=stated, explains=explains)
        return cause, JointMap(coordinates, list(joints))

    orders = list(permutations(names))[1:] if len(names) <= MOST_PERMUTED else []
    for order in orders:
        in_other = [right[name] for name in order]
        yield convention("order", "order of the joints", in_order, ", ".join(order), in_other)
    straight = [name for name in names if kinds[name] != "ball"]
    most = len(straight) if len(straight) <= MOST_PERMUTED else 1
    senses = [chosen for count in range(1, most + 1) for chosen in combinations(straight, count)]
    for chosen in senses:
        yield convention("sign", f"sense of {listed(chosen)}", "+", "-", turned(chosen).values())
    hinges = [name for name in straight if kinds[name] == "hinge"]
    places = {name: [name] for name in hinges} | ({"all hinges": hinges} if len(hinges) > 1 else {})
    for (place, those), unit in product(places.items(), filter(None, PER_UNIT)):
        in_unit = right | {name: right[name]._replace(unit=unit) for name in those}
        yield convention("unit", f"unit of {place}", "rad", unit, in_unit.values())
    for order, chosen in product(orders, senses) if len(names) <= MOST_TURNED else ():
        both, place = [turned(chosen)[name] for name in order], "order and senses of the joints"
        cause, joints = convention("order", place, in_order, ", ".join(map(str, both)), both)
        yield replace(cause, rank=3), joints


def values_in(equations: Equations, maps: Sequence[JointMap], states: int) -> Iterator[np.ndarray]:
    """The values at the first states with each map of the joints, (states, entries), evaluated together."""
    q, qd = equations.q[:states], equations.qd[:states]
    positions, speeds = [joints.positions(q) for joints in maps], [joints.speeds(qd) for joints in maps]
    inner = Equations(equations.tree, np.concatenate(positions), np.concatenate(speeds))
    values = inner.right.reshape(len(maps), len(q), -1)
    for joints, M, h in zip(maps, inner.full_mass_matrix(values), values[..., inner.in_h]):
        yield packed(joints.own_mass_matrix(M), joints.own_forces(h))
