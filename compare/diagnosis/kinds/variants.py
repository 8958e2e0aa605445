"""Explanations without a number to fit: options of a file or a program, slips of derivatives."""

from collections.abc import Iterator
from itertools import combinations, product

import numpy as np

from tmt import literal

from ..hypothesis import Hypothesis, option, slip
from ..model import TINY, Changes, Equations, Path
from .terms import speeds_of_joints

OF_ENERGY = {  # slips in Mdot qd - d(qd' Mbar qd / 2)/dq: place, what it is, and the factors of both
    ("gradient of the kinetic energy in h", "left out"): (1.0, 0.0),
    ("gradient of the kinetic energy in h", "halved"): (1.0, 0.5),
    ("gradient of the kinetic energy in h", "of the other sign"): (1.0, -1.0),
    ("gradient of the kinetic energy in h", "twice"): (1.0, 2.0),
    ("Mdot qd in h", "left out"): (0.0, 1.0), ("Mdot qd in h", "halved"): (0.5, 1.0),
    ("Mdot qd in h", "halved, and no gradient of the kinetic energy"): (0.5, 0.0),
    ("C(q, qd) in h", "transposed, C' qd for C qd"): (0.0, -1.0),
}  # fmt: skip
OF_ONE = 0.36  # cost of a slip in the derivative of one entry
OF_SLOPES = {"left out": 0.0, "of the other sign": -1.0, "halved": 0.5, "twice": 2.0}


def program_options(equations: Equations) -> Iterator[Hypothesis]:
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
        sprung = rest + literal.spring_torque(tree, q)
        of_h.append(("springs k (q - rest)", "not in h", "in h", moving, sprung))
    for place, stated, explains, of_speeds, of_gravity in of_h:
        yield option(equations.right, place, stated, explains, equations.with_bias(of_speeds, of_gravity))
    if q.shape == qd.shape:
        together = [np.concatenate([q, speeds], axis=1) for speeds in (qd, 0.0 * qd)]
        in_turn = [Equations(tree, both[:, ::2], both[:, 1::2]).h for both in together]
        exchanged = [Equations(tree, speeds, q).h for speeds in (qd, 0.0 * qd)]
        orders = {"exchanged, bias(qd, q)": exchanged, "in turn, q1, qd1, q2, qd2, ...": in_turn}
        for explains, (h, still) in orders.items():
            values = equations.with_bias(h - still, still)
            yield option(equations.right, "arguments of bias", "bias(q, qd)", explains, values)
    triangles = {"off": M - M * np.eye(equations.nv)}
    if not equations.layout.is_symmetric:
        triangles |= {"above": np.triu(M, 1), "below": np.tril(M, -1)}
    for where, change in triangles.items():
        for explains, factor in OF_SLOPES.items():
            values = equations.layout.packed(M + (factor - 1.0) * change, moving, rest)
            yield option(equations.right, f"entries of M {where} the diagonal", "there", explains, values)
    rotors: Changes = {Path("armature", (i,)): np.array([-rotor]) for i, rotor in enumerate(tree.armature)}
    for (first, rows), (second, columns) in combinations(speeds_of_joints(tree).items(), 2):
        above, below = np.ix_(range(len(q)), rows, columns), np.ix_(range(len(q)), columns, rows)
        upper, lower = f"M[{first}][{second}]", f"M[{second}][{first}]"
        blocks = {upper: [above], lower: [below], f"{upper} and {lower}": [above, below]}
        for place, those in blocks.items() if len(rows) == len(columns) > 1 else ():
            turned = M.copy()
            for at in those:
                turned[at] = np.swapaxes(M[at], 1, 2)
            values = equations.layout.packed(turned, moving, rest)
            yield option(equations.right, place, "there", "transposed", values)
    if any(tree.armature):
        without = equations.values(rotors)[0]
        yield option(equations.right, "armature", "on the diagonal of Mbar", "left out", without)


def lagrange(equations: Equations) -> Iterator[Hypothesis]:
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
        yield slip(equations.right, name, explains, values)
    speeds = equations.speeds
    for i, (explains, factor) in product(range(equations.nv), OF_SLOPES.items()):
        added = np.zeros_like(gradient)
        added[:, i] = (1.0 - factor) * gradient[:, i]
        if equations.nv > 1 and added.any():
            place = f"gradient of the kinetic energy in h[{speeds[i]}]"
            yield slip(equations.right, place, explains, equations.with_bias(velocity_terms + added, rest))
    entries = [(i, j) for i in range(equations.nv) for j in range(i + 1)]
    for (i, j), k in product(entries, range(equations.nv)):
        alone = np.zeros_like(slopes)
        alone[:, [i, j], [j, i], k] = slopes[:, [i, j], [j, i], k]
        added = np.einsum("sijk,sk,sj->si", alone, qd, qd) - np.einsum("sijk,si,sj->sk", alone, qd, qd) / 2.0
        for explains, factor in OF_SLOPES.items() if added.any() else ():
            values = equations.with_bias(velocity_terms + (factor - 1.0) * added, rest)
            place = f"dM[{speeds[i]}][{speeds[j]}]/d {speeds[k]} in h"
            yield slip(equations.right, place, explains, values, OF_ONE, "derivative")
