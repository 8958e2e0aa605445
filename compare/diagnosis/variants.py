"""Explanations without a number to fit: options, slips of derivatives, and sines and cosines of a hinge.

A variant is a cause with Mbar and h as they would be, as `Equations.values` has them.
"""

from collections.abc import Iterator
from functools import partial

import numpy as np

from tmt import literal

from ..core.cause import Cause
from .model import TINY, Equations, Path
from .terms import entries_of_M, in_rows, rows_of_h

Variant = tuple[Cause, np.ndarray]  # the values: (states, entries)
OF_ENERGY = {  # slips in Mdot qd - d(qd' Mbar qd / 2)/dq: place, what it is, and the factors of both
    ("gradient of the kinetic energy in h", "left out"): (1.0, 0.0),
    ("gradient of the kinetic energy in h", "halved"): (1.0, 0.5),
    ("gradient of the kinetic energy in h", "of the other sign"): (1.0, -1.0),
    ("gradient of the kinetic energy in h", "twice"): (1.0, 2.0),
    ("Mdot qd in h", "left out"): (0.0, 1.0), ("Mdot qd in h", "halved"): (0.5, 1.0),
    ("Mdot qd in h", "halved, and no gradient of the kinetic energy"): (0.5, 0.0),
}  # fmt: skip
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
        together, at_rest = (np.concatenate([q, speeds], axis=1) for speeds in (qd, 0.0 * qd))
        orders = {  # the states, and those at rest
            "exchanged, bias(qd, q)": (qd, q, 0.0 * q, q),
            "in turn, q1, qd1, q2, qd2, ...": (*in_turn(together), *in_turn(at_rest)),
        }
        for explains, states in orders.items():
            h, still = Equations(tree, *states[:2]).h, Equations(tree, *states[2:]).h
            values = equations.with_bias(h - still, still)
            yield option("arguments of bias", "bias(q, qd)", explains, values)
    for where, left in {"above": np.tril(M), "below": np.triu(M), "off": M * np.eye(equations.nv)}.items():
        values = equations.layout.packed(left, moving, rest)
        yield option(f"entries of M {where} the diagonal", "there", "left out", values)
    if any(tree.armature):
        rotors = {Path("armature", (i,)): np.array([-rotor]) for i, rotor in enumerate(tree.armature)}
        yield option("armature", "on the diagonal of Mbar", "left out", equations.values(rotors)[0])


def in_turn(together: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
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


def other_angles(equations: Equations) -> Iterator[Variant]:
    """Sine and cosine of a hinge exchanged, or its sine with the other sign, in an entry or a part of the equations."""
    layout, right, tree = equations.layout, equations.right, equations.tree
    places = entries_of_M(equations) | {
        name: np.arange(right.shape[1])[part].tolist() for name, part in layout.parts.items()
    }
    for row, numbers in rows_of_h(equations).items():
        places[row] = in_rows(equations, numbers)
        for name in ("velocity terms", "gravity") if layout.is_split else ():
            places[f"{name} of {row}"] = [layout.parts[name].start + i for i in numbers]
    ways = {"sine and cosine of {} exchanged": np.pi / 2.0, "sine of {} of the other sign": 0.0}
    for name, zero, joint in zip(tree.joint_names, tree.reference, tree.coordinates.joints):
        for what, mirror in ways.items() if joint.kind == "hinge" else ():
            q = equations.q.copy()
            q[:, joint.q] = mirror - (q[:, joint.q] - zero) + zero
            other = Equations(tree, q, equations.qd, layout).right
            for place, entries in places.items():
                values = right.copy()
                values[:, entries] = other[:, entries]
                yield variant(2, "angle", f"{what.format(name)} in {place}", "", "", values)
