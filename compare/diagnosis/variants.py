"""Explanations without a number to fit: what an option or a convention of a whole program changes, rank 1.

A variant is a cause with Mbar and h as they would be, as `Equations.values` has them.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from tmt import literal

from ..core.cause import Cause
from .model import Equations, Path

Variant = tuple[Cause, np.ndarray]  # the values: (states, entries)


def variant(rank: int, kind: str, place: str, stated: str, explains: str, values: np.ndarray) -> Variant:
    return Cause(rank=rank, kind=kind, place=place, stated=stated, explains=explains), values


option, slip = partial(variant, 1, "option"), partial(variant, 2, "slip")


def program_options(equations: Equations) -> Iterator[Variant]:
    """What an option or a convention of the whole file or program changes."""
    tree, q, qd, (_, velocity_terms, rest) = equations.tree, equations.q, equations.qd, equations.parts
    with_bias = equations.with_bias
    yield option("gravity", "on", "off", with_bias(velocity_terms, 0.0))
    yield option("sign of gravity", "+", "-", with_bias(velocity_terms, -rest))
    yield option("velocity terms in h", "there", "left out", with_bias(0.0, rest))
    yield option("bias", "there", "left out", with_bias(0.0, 0.0))
    yield option(
        "sign of the bias", "Mbar qdd + h = tau", "Mbar qdd = tau + h", with_bias(-velocity_terms, -rest)
    )
    if q.shape == qd.shape:
        together = np.concatenate([q, qd], axis=1)
        orders = {
            "exchanged, bias(qd, q)": (qd, q),
            "in turn, q1, qd1, q2, qd2, ...": (together[:, ::2], together[:, 1::2]),
        }
        for explains, (positions, speeds) in orders.items():
            _, moved, at_rest = Equations(tree, positions, speeds).parts
            if equations.layout.is_split:  # at rest too the arguments are in this order
                still = (
                    Equations(tree, 0.0 * q, q)
                    if explains.startswith("exchanged")
                    else in_turn_at_rest(equations)
                )
                moved, at_rest = moved + at_rest - still.h, still.h
            yield option("arguments of bias", "bias(q, qd)", explains, with_bias(moved, at_rest))
    M = equations.parts[0]
    triangles = {"above": np.tril(M), "below": np.triu(M), "off": M * np.eye(equations.nv)}
    for where, left in triangles.items():
        yield option(
            f"entries of M {where} the diagonal",
            "there",
            "left out",
            equations.layout.packed(left, velocity_terms, rest),
        )
    if any(tree.damping):
        drag = np.array(tree.damping) * qd
        yield option("damping D qd", "not in h", "in h", with_bias(velocity_terms + drag, rest))
        yield option(
            "damping D qd", "not in h", "in h, of the other sign", with_bias(velocity_terms - drag, rest)
        )
    if tree.has_springs:
        sprung = rest + literal.spring_torque(q, tree)
        yield option("springs k (q - rest)", "not in h", "in h", with_bias(velocity_terms, sprung))
    if any(tree.armature):
        rotors = {Path("armature", (i,)): np.array([-rotor]) for i, rotor in enumerate(tree.armature)}
        yield option("armature", "on the diagonal of Mbar", "left out", equations.values(rotors)[0])


def in_turn_at_rest(equations: Equations) -> Equations:
    """The equations with the positions q and speeds 0 read as position, speed, position, ..."""
    together = np.concatenate([equations.q, 0.0 * equations.qd], axis=1)
    return Equations(equations.tree, together[:, ::2], together[:, 1::2])
