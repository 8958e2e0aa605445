"""Explanations without a number to fit: options and conventions of joints, rank 1; slips.py has those of the derivation.

Each gives Mbar and h as they would be, as `Equations.values` does.
"""

from collections.abc import Iterator, Sequence
from itertools import combinations, permutations, product
from typing import NamedTuple

import numpy as np

import tmt
from tmt import literal

from ..core.words import listed
from ..robots.coordinates import Coordinates
from ..robots.joint_map import PER_UNIT, Joint, JointMap
from .cause import Change
from .model import BODY_TERMS, Equations, Path, packed

PARALLEL = 1e-9  # of a cosine from 1
MOST_PERMUTED = 6  # joints: with more, only the sense and the unit of one are tried
MOST_TURNED = 4  # joints whose order and senses are tried together


class Variant(NamedTuple):
    """An explanation that applies or does not."""

    change: Change
    values: np.ndarray | None  # (states, entries); None: not yet evaluated in its joints
    rank: int = 1
    joints: JointMap | None = None  # of a convention of the joints


def program_options(equations: Equations) -> Iterator[Variant]:
    """What an option or a convention of the whole file or program changes."""
    tree, q, qd, count = equations.tree, equations.q, equations.qd, len(equations.triangle[0])
    right = equations.values()[0]
    h = right[:, count:]

    def option(name: str, stated: str, explains: str, values: np.ndarray) -> Variant:
        return Variant(Change("option", name, stated, explains), values)

    def with_factor(factor: float, *terms: str) -> np.ndarray:
        paths = [Path("factor", (b, BODY_TERMS.index(term))) for b in range(len(tree.mass)) for term in terms]
        return equations.values(dict.fromkeys(paths, np.array([factor - 1.0])))[0]

    def with_bias(h: np.ndarray) -> np.ndarray:
        return np.concatenate([right[:, :count], h], axis=1)

    yield option("gravity", "on", "off", with_factor(0.0, "gravity"))
    yield option("sign of gravity", "+", "-", with_factor(-1.0, "gravity"))
    yield option(
        "velocity terms in h", "there", "left out", with_factor(0.0, "convective", "Euler", "gyroscopic")
    )
    yield option("bias", "there", "left out", with_bias(0.0 * h))
    yield option("sign of the bias", "Mbar qdd + h = tau", "Mbar qdd = tau + h", with_bias(-h))
    if q.shape == qd.shape:
        exchanged = with_bias(Equations(tree, qd, q).values()[0][:, count:])
        yield option("arguments of bias", "bias(q, qd)", "exchanged, bias(qd, q)", exchanged)
    if any(tree.damping):
        drag = np.array(tree.damping) * qd
        yield option("damping D qd", "not in h", "in h", with_bias(h + drag))
        yield option("damping D qd", "not in h", "in h, of the other sign", with_bias(h - drag))
    if tree.has_springs:
        yield option(
            "springs k (q - rest)", "not in h", "in h", with_bias(h + literal.spring_torque(q, tree))
        )
    if any(tree.armature):
        rotors = {Path("armature", (i,)): np.array([-rotor]) for i, rotor in enumerate(tree.armature)}
        yield option("armature", "on the diagonal of Mbar", "left out", equations.values(rotors)[0])
    if (turns := absolute_angles(tree)) is not None:
        inner = Equations(tree, q @ turns.T, qd @ turns.T)
        values = inner.values()[0]
        absolute = packed(turns.T @ inner.full_mass_matrix(values) @ turns, values[:, count:] @ turns)
        yield option("angles", "between a body and the one before", "between a body and the world", absolute)


def absolute_angles(tree: tmt.Tree) -> np.ndarray | None:
    """Joint angles from the angles of bodies to the world, (nv, nv), in a row of parallel hinges; None: there is none."""
    if set(tree.kind) != {"hinge"}:
        return None
    turns = np.eye(len(tree.axis))
    for i, parent in enumerate(tree.parent):
        along = float(np.dot(tree.axis[i], tree.axis[parent])) if parent >= 0 else 0.0
        if abs(abs(along) - 1.0) < PARALLEL:
            turns[i, parent] = -np.sign(along)
    return turns if (turns != np.eye(len(turns))).any() else None


def conventions(tree: tmt.Tree) -> Iterator[Variant]:
    """Order, senses and units of the joints; the order and the senses of a few together, rank 3."""
    names, kinds = tree.joint_names, dict(zip(tree.joint_names, tree.kind))
    coordinates, straight = Coordinates(names, tree.kind), [name for name in names if kinds[name] != "ball"]

    def convention(rank, kind, name, stated, explains, order=names, turned=(), units=None) -> Variant:
        joints = [
            Joint(one, -1.0 if one in turned else 1.0, 0.0, (units or {}).get(one, ""), kinds[one] == "slide")
            for one in order
        ]
        explains = explains or ", ".join(map(str, joints))
        return Variant(Change(kind, name, stated, explains), None, rank, JointMap(coordinates, joints))

    orders = list(permutations(names))[1:] if len(names) <= MOST_PERMUTED else []
    for order in orders:
        yield convention(1, "order", "order of the joints", ", ".join(names), "", order)
    most = len(straight) if len(straight) <= MOST_PERMUTED else 1
    senses = [turned for count in range(1, most + 1) for turned in combinations(straight, count)]
    for turned in senses:
        yield convention(1, "sign", f"sense of {listed(turned)}", "+", "-", turned=turned)
    hinges = [name for name in straight if kinds[name] == "hinge"]
    for which in dict.fromkeys((*((name,) for name in hinges), tuple(hinges))):
        for unit in filter(None, PER_UNIT) if which else ():
            name = f"unit of {which[0] if len(which) == 1 else 'all hinges'}"
            yield convention(1, "unit", name, "rad", unit, units=dict.fromkeys(which, unit))
    for order, turned in product(orders, senses) if len(names) <= MOST_TURNED else ():
        yield convention(3, "order", "order and senses of the joints", ", ".join(names), "", order, turned)


def values_in(equations: Equations, maps: Sequence[JointMap], states: int) -> Iterator[np.ndarray]:
    """The values at the first states with each map of the joints, (states, entries), evaluated together."""
    q, qd = equations.q[:states], equations.qd[:states]
    positions, speeds = [one.positions(q) for one in maps], [one.speeds(qd) for one in maps]
    inner = Equations(equations.tree, np.concatenate(positions), np.concatenate(speeds))
    values = inner.values()[0].reshape(len(maps), len(q), -1)
    for one, M, h in zip(maps, inner.full_mass_matrix(values), values[..., -inner.nv :]):
        yield packed(one.own_mass_matrix(M), one.own_forces(h))
