"""Common slips in a derivation: Mbar and h with each of them, made in the Jacobians and convective terms of one body or all."""

from collections.abc import Iterator
from types import SimpleNamespace

import numpy as np

from tmt.derivation import method
from tmt.derivation.vectors import Matrix, total_vector

from .cause import Change
from .model import BODY_TERMS, TINY, Equations
from .places import groups
from .variants import Variant


def slips(equations: Equations) -> Iterator[list[list[Variant]]]:
    """For each slip: of single bodies; of all; these in M alone. The first of these lists that explains is meant."""
    tree, right, count = equations.tree, equations.values()[0], len(equations.triangle[0])
    of_one = SimpleNamespace(
        gravity=tree.gravity, armature=[0.0] * equations.nv, factor=np.ones((1, len(BODY_TERMS)))
    )
    bodies = method.bodies(tree, list(equations.q.T), list(equations.qd.T))
    parts = [equations.summed(of_one, [b])[0] for b in bodies]
    for name, changed in changed_bodies(equations, bodies):
        added = [equations.summed(of_one, [b])[0] - part for b, part in zip(changed, parts)]
        sums = {body: right + sum(added[b] for b in which) for body, which in groups(tree).items()}
        variants = [
            Variant(Change("slip", name.format(body), "no", ""), values, 2) for body, values in sums.items()
        ]
        alone = [change._replace(place=f"{change.place} in M alone") for change, *_ in variants]
        of_M = [np.hstack([values[:, :count], right[:, count:]]) for _, values, *_ in variants]
        in_mass = [Variant(change, values, 2) for change, values in zip(alone, of_M)]
        yield [variants[: len(added)], variants[len(added) :], in_mass[: len(added)], in_mass[len(added) :]]
    if "ball" not in tree.kind:
        yield [list(lagrange(equations))]


def changed_bodies(
    equations: Equations, bodies: list[method.Body]
) -> Iterator[tuple[str, list[method.Body]]]:
    """Each slip by its name, made in every body."""
    tree, q, qd = equations.tree, list(equations.q.T), equations.qd
    frames = method.joint_frames(tree, q)
    turns = [frames[joint].turn if joint >= 0 else method.IDENTITY for joint in tree.body_joint]
    world = [turned(b, R) for b, R in zip(bodies, turns)]
    moved = [Matrix(m * (np.dot(c, c) * np.eye(3) - np.outer(c, c))) for m, c in zip(tree.mass, tree.com)]
    alone = zip(*(method.bodies(tree, q, list((qd * unit).T)) for unit in np.eye(equations.nv)))
    v, w = zip(*((total_vector(b.v_conv for b in of), total_vector(b.w_conv for b in of)) for of in alone))

    def with_field(field: str, values) -> list[method.Body]:
        return [b._replace(**{field: value}) for b, value in zip(bodies, values)]

    yield "R for R' in the angular velocity of {}", [turned(b, R) for b, R in zip(world, turns)]
    yield "inertia of {} not turned to the inertial frame", world
    wrong_way = [b._replace(inertia=R.transposed @ b.inertia @ R) for b, R in zip(world, turns)]
    yield "R' I R for R I R' of {}", wrong_way
    again = with_field("inertia", [b.inertia + more for b, more in zip(bodies, moved)])
    yield "inertia of {} about its joint and mass counted again", again
    less = with_field("inertia", [b.inertia - more for b, more in zip(bodies, moved)])
    yield "parallel-axis term m (c'c 1 - c c') of {} left out", less
    products = "products of different rates in {} of {{}} {}"
    yield products.format("v_conv", "left out"), with_field("v_conv", v)
    half = with_field("v_conv", [(own + b.v_conv) * 0.5 for b, own in zip(bodies, v)])
    yield products.format("v_conv", "once for twice"), half
    yield products.format("w_conv", "left out"), with_field("w_conv", w)
    both = [b._replace(v_conv=of_v, w_conv=of_w) for b, of_v, of_w in zip(bodies, v, w)]
    yield products.format("v_conv and w_conv", "left out"), both
    squares = with_field("v_conv", [b.v_conv - own for b, own in zip(bodies, v)])
    yield "squares of rates in v_conv of {} left out", squares


def turned(body: method.Body, R: Matrix) -> method.Body:
    """A body whose vectors in its own axes are in other axes."""
    return body._replace(B=[R @ column for column in body.B], omega=R @ body.omega, w_conv=R @ body.w_conv)


def lagrange(equations: Equations) -> Iterator[Variant]:
    """Slips in h = Mdot qd - d(kinetic energy)/dq + dV/dq, of hinges and slides."""
    tree, q, qd, nv = equations.tree, equations.q, equations.qd, equations.nv
    right, rest = (Equations(tree, q, speeds).values()[0] for speeds in (qd, 0.0 * qd))
    slopes = Equations(tree, q + 1j * TINY * qd, qd).values()[0].imag / TINY  # along the motion
    Mdot_qd = np.einsum("sij,sj->si", equations.full_mass_matrix(slopes), qd)
    gradient = Mdot_qd - (right - rest)[:, -nv:]
    for name, explains, of_Mdot, of_gradient in (
        ("gradient of the kinetic energy in h", "left out", 1.0, 0.0),
        ("gradient of the kinetic energy in h", "of the other sign", 1.0, -1.0),
        ("Mdot qd in h", "left out", 0.0, 1.0),
        ("Mdot qd in h", "halved", 0.5, 1.0),
        ("Mdot qd in h", "halved, and no gradient of the kinetic energy", 0.5, 0.0),
    ):
        h = of_Mdot * Mdot_qd - of_gradient * gradient + rest[:, -nv:]
        change = Change("slip", name, "Mdot qd - d(qd' Mbar qd / 2)/dq", explains)
        yield Variant(change, np.hstack([right[:, :-nv], h]), 2)
