"""Mbar and h with common slips in the derivatives: of the kinetic energy, and of sines and cosines."""

from collections.abc import Iterator

import numpy as np

from .model import TINY, Equations
from .variants import Variant, slip, variant


def lagrange(equations: Equations) -> Iterator[Variant]:
    """Slips in h = Mdot qd - d(kinetic energy)/dq + dV/dq, of hinges and slides."""
    if "ball" in equations.tree.kind:
        return
    tree, q, qd, (_, velocity_terms, rest) = equations.tree, equations.q, equations.qd, equations.parts
    slopes = (
        np.stack(
            [Equations(tree, q + 1j * TINY * unit, qd).parts[0].imag for unit in np.eye(equations.nv)],
            axis=-1,
        )
        / TINY
    )
    Mdot_qd = np.einsum("sijk,sk,sj->si", slopes, qd, qd)
    gradient = Mdot_qd - velocity_terms
    for name, explains, of_Mdot, of_gradient in (
        ("gradient of the kinetic energy in h", "left out", 1.0, 0.0),
        ("gradient of the kinetic energy in h", "halved", 1.0, 0.5),
        ("gradient of the kinetic energy in h", "of the other sign", 1.0, -1.0),
        ("gradient of the kinetic energy in h", "twice", 1.0, 2.0),
        ("Mdot qd in h", "left out", 0.0, 1.0),
        ("Mdot qd in h", "halved", 0.5, 1.0),
        ("Mdot qd in h", "halved, and no gradient of the kinetic energy", 0.5, 0.0),
    ):
        yield slip(
            name,
            "Mdot qd - d(qd' Mbar qd / 2)/dq",
            explains,
            equations.with_bias(of_Mdot * Mdot_qd - of_gradient * gradient, rest),
        )
    for i, j in zip(*np.tril_indices(equations.nv)):
        for k in range(equations.nv):
            alone = np.zeros_like(slopes)
            alone[:, i, j, k] = slopes[:, i, j, k]
            alone[:, j, i, k] = slopes[:, j, i, k]
            of_slope = (
                np.einsum("sijk,sk,sj->si", alone, qd, qd) - np.einsum("sijk,si,sj->sk", alone, qd, qd) / 2.0
            )
            name = f"dM[{equations.speeds[i]}][{equations.speeds[j]}]/d {equations.speeds[k]} in h"
            for explains, factor in (
                ("left out", 0.0),
                ("of the other sign", -1.0),
                ("halved", 0.5),
                ("twice", 2.0),
            ):
                if of_slope.any():
                    values = equations.with_bias(velocity_terms + (factor - 1.0) * of_slope, rest)
                    yield slip(name, "once", explains, values)


def other_angles(equations: Equations) -> Iterator[Variant]:
    """Sine and cosine of a hinge exchanged, or its sine with the other sign, in an entry or a part of the equations."""
    tree, layout, right, starts = (
        equations.tree,
        equations.layout,
        equations.right,
        equations.tree.coordinates.joints,
    )
    places = {
        f"in {entry.named(equations.speeds)}": [k]
        for k, entry in enumerate(equations.entries[equations.in_M])
    }
    places |= {f"in {name}": np.arange(right.shape[1])[part].tolist() for name, part in layout.parts.items()}
    for name in list(layout.parts)[1:]:
        rows = {speed: layout.of_row(i, name) for i, speed in enumerate(equations.speeds)}
        places |= {f"in {name} of h[{speed}]": row for speed, row in rows.items() if name != "h"}
        places |= {f"in h[{speed}]": row for speed, row in rows.items() if name == "h"}
    for i in (i for i, kind in enumerate(tree.kind) if kind == "hinge"):
        for what, mirror in {
            "sine and cosine of {} exchanged": np.pi / 2.0,
            "sine of {} of the other sign": 0.0,
        }.items():
            q, reference = equations.q.copy(), tree.reference[i]
            q[:, starts[i].q] = mirror - (q[:, starts[i].q] - reference) + reference
            other = Equations(tree, q, equations.qd, layout).right
            for place, entries in places.items():
                values = right.copy()
                values[:, entries] = other[:, entries]
                yield variant(2, "angle", f"{what.format(tree.joint_names[i])} {place}", "", "", values)
