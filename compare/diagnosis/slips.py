"""Mbar and h with common slips in the Jacobians and convective terms of one body or all."""

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from tmt.derivation import method
from tmt.derivation.vectors import IDENTITY, Matrix, total_vector

from .model import TINY, Equations
from .places import groups
from .variants import Variant, slip


def slips(equations: Equations) -> Iterator[list[Variant]]:
    """For each slip: in single bodies; in all. The first list that explains is meant."""
    right, bodies = equations.right, groups(equations.tree)
    gravity, parts = equations.tree.gravity, np.sum(list(equations.terms.values()), axis=0)
    for name, changed in changed_bodies(equations):
        added = np.stack([equations.summed([b], gravity)[0] for b in changed]) - parts
        variants = [
            slip(name.format(body), "no", "", right + added[numbers].sum(axis=0))
            for body, numbers in bodies.items()
        ]
        yield [*variants[: len(parts)]]
        yield [*variants[len(parts) :]]
    if "ball" not in equations.tree.kind:
        yield list(lagrange(equations))


def changed_bodies(equations: Equations) -> Iterator[tuple[str, list[method.Body]]]:
    """Each slip by its name, made in every body."""
    tree, q, qd, bodies = equations.tree, list(equations.q.T), equations.qd, equations.bodies
    frames = method.joint_frames(tree, q)
    turns = [frames[joint].turn if joint >= 0 else IDENTITY for joint in tree.body_joint]
    world = [turned(b, R) for b, R in zip(bodies, turns)]
    moved = [Matrix(m * (np.dot(c, c) * np.eye(3) - np.outer(c, c))) for m, c in zip(tree.mass, tree.com)]
    alone = [method.bodies(tree, q, list((qd * unit).T)) for unit in np.eye(equations.nv)]
    v = [total_vector(b.v_conv for b in of_rates) for of_rates in zip(*alone)]  # of the squares of rates
    w = [total_vector(b.w_conv for b in of_rates) for of_rates in zip(*alone)]

    def with_field(field: str, values: Sequence[Any]) -> list[method.Body]:
        return [b._replace(**{field: value}) for b, value in zip(bodies, values)]

    yield "R for R' in the angular velocity of {}", [turned(b, R) for b, R in zip(world, turns)]
    yield "inertia of {} not turned to the inertial frame", world
    wrong_way = [b._replace(inertia=R.transposed @ b.inertia @ R) for b, R in zip(world, turns)]
    yield "R' I R for R I R' of {}", wrong_way
    again, less = zip(*((b.inertia + more, b.inertia - more) for b, more in zip(bodies, moved)))
    yield "inertia of {} about its joint and mass counted again", with_field("inertia", again)
    yield "parallel-axis term m (c'c 1 - c c') of {} left out", with_field("inertia", less)
    products, without = "products of different rates in {} of {{}} {}", with_field("v_conv", v)
    yield products.format("v_conv", "left out"), without
    half = [(squares + b.v_conv) * 0.5 for b, squares in zip(bodies, v)]
    yield products.format("v_conv", "once for twice"), with_field("v_conv", half)
    yield products.format("w_conv", "left out"), with_field("w_conv", w)
    both = [b._replace(w_conv=of_w) for b, of_w in zip(without, w)]
    yield products.format("v_conv and w_conv", "left out"), both
    others = [b.v_conv - squares for b, squares in zip(bodies, v)]
    yield "squares of rates in v_conv of {} left out", with_field("v_conv", others)


def turned(body: method.Body, R: Matrix) -> method.Body:
    """A body whose vectors in its own axes are in other axes."""
    return body._replace(B=[R @ column for column in body.B], omega=R @ body.omega, w_conv=R @ body.w_conv)


def lagrange(equations: Equations) -> Iterator[Variant]:
    """Slips in h = Mdot qd - d(kinetic energy)/dq + dV/dq, of hinges and slides."""
    tree, q, qd, (M, velocity_terms, rest) = equations.tree, equations.q, equations.qd, equations.parts
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
