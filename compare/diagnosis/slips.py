"""Slips in a derivation that students make: what Mbar and h are with each of them.

They are made on the Jacobians and convective terms of each body, of one body or of all.
"""

from collections.abc import Callable, Iterator
from functools import cache
from itertools import combinations

import numpy as np

from tmt.equations import method

from .model import Equations, Path
from .places import EVERY_BODY, bias_at_rest, entry_name
from .variants import Variant

PARALLEL_AXIS = "parallel-axis term m (c'c 1 - c c') of {} left out"
IN_MASS_ALONE = " in M alone"


class Parts:
    """T, B, convective terms and turns of every body as arrays: (states, ...)."""

    def __init__(self, equations: Equations):
        tree, q, qd = equations.tree, equations.q, equations.qd
        states = len(q)

        def stacked(vectors) -> np.ndarray:
            return np.stack([np.stack([np.broadcast_to(c, states) for c in vector], -1) for vector in vectors], 1)

        bodies = method.bodies(tree, list(q.T), list(qd.T))
        frames = method.joint_frames(tree, list(q.T), list(qd.T))
        self.tree, self.equations = tree, equations
        self.T = np.stack([stacked(body.T) for body in bodies], 1).swapaxes(2, 3)  # (states, bodies, 3, nv)
        self.B = np.stack([stacked(body.B) for body in bodies], 1).swapaxes(2, 3)  # body axes
        self.v_conv, self.w_conv, self.omega = (
            stacked(getattr(b, name) for b in bodies) for name in ("v_conv", "w_conv", "omega")
        )
        turns = [frames[joint].turn if joint >= 0 else method.IDENTITY for joint in tree.body_hinge]
        self.R = np.stack([stacked(turn.rows) for turn in turns], 1)  # body axes -> inertial axes
        self.mass, self.inertia = np.array(tree.mass), np.broadcast_to(tree.inertia, (states, len(bodies), 3, 3))
        self.gravity = np.array(tree.gravity)

    def values(self, **changed: np.ndarray) -> np.ndarray:
        """Mbar and h with some of the arrays in place of these, (1, states, entries)."""
        of = vars(self) | changed
        T, B, m, I, w = of["T"], of["B"], of["mass"], of["inertia"], of["omega"]
        M = (
            np.einsum("sbci,b,sbcj->sij", T, m, T)
            + np.einsum("sbci,sbcd,sbdj->sij", B, I, B)
            + np.diag(self.tree.armature)
        )
        force = m[:, None] * (of["v_conv"] - self.gravity)
        spin = np.einsum("sbcd,sbd->sbc", I, w)
        moment = np.einsum("sbcd,sbd->sbc", I, of["w_conv"]) + np.cross(w, spin)
        h = np.einsum("sbci,sbc->si", T, force) + np.einsum("sbci,sbc->si", B, moment)
        i, j = self.equations.triangle
        return np.concatenate([M[:, i, j], h], axis=1)[None]

    def of_one_rate(self) -> tuple[np.ndarray, np.ndarray]:
        """v_conv and w_conv of each rate alone, summed: without the products of different rates."""
        tree, q, qd = self.tree, self.equations.q, self.equations.qd
        sums = np.zeros_like(self.v_conv), np.zeros_like(self.w_conv)
        for j in range(qd.shape[1]):
            alone = Parts(Equations(tree, q, np.where(np.arange(qd.shape[1]) == j, qd, 0.0)))
            for total, part in zip(sums, (alone.v_conv, alone.w_conv)):
                total += part
        return sums


def slips(equations: Equations) -> Iterator[Variant]:
    """Each slip, of each body alone and of all together."""
    parts, tree = Parts(equations), equations.tree
    bodies = range(len(tree.mass))
    groups = {name: [b] for b, name in enumerate(tree.body_names)} | (
        {EVERY_BODY: list(bodies)} if len(bodies) > 1 else {}
    )
    v_alone, w_alone = parts.of_one_rate()
    turned = np.einsum("sbcd,sbdi->sbci", parts.R, parts.B)
    to_world = {"omega": "sbcd,sbd->sbc", "w_conv": "sbcd,sbd->sbc"}
    world = {name: np.einsum(how, parts.R, getattr(parts, name)) for name, how in to_world.items()} | {"B": turned}
    twice = {name: np.einsum(how, parts.R, world[name]) for name, how in to_world.items()}
    twice["B"] = np.einsum("sbcd,sbdi->sbci", parts.R, turned)
    about_joint = parts.inertia + np.array([shifted(m, np.array(c)) for m, c in zip(tree.mass, tree.com)])
    without_parallel = 2.0 * parts.inertia - about_joint
    wrong_way = np.einsum("sbdc,sbde,sbef->sbcf", parts.R, parts.inertia, parts.R)
    slipped = {
        "R for R' in the angular velocity of {}": twice,
        "inertia of {} not turned to the inertial frame": world,
        "R' I R for R I R' of {}": world | {"inertia": wrong_way},
        "inertia of {} about its joint and mass counted again": {"inertia": about_joint},
        PARALLEL_AXIS: {"inertia": without_parallel},
        "products of different rates in v_conv of {} left out": {"v_conv": v_alone},
        "products of different rates in v_conv of {} once for twice": {"v_conv": (v_alone + parts.v_conv) / 2.0},
        "products of different rates in w_conv of {} left out": {"w_conv": w_alone},
        "products of different rates in v_conv and w_conv of {} left out": {"v_conv": v_alone, "w_conv": w_alone},
        "squares of rates in v_conv of {} left out": {"v_conv": parts.v_conv - v_alone},
    }
    for name, changed in slipped.items():
        for of, which in groups.items():
            yield slip(name.format(of), "no", "yes", lambda c=changed, w=which: parts.values(**only(parts, c, w)))
    for of, which in groups.items():
        yield from in_mass_alone(parts, PARALLEL_AXIS.format(of), {"inertia": without_parallel}, which)
    for b, body in enumerate(tree.body_names):
        for x, y in ((0, 1), (0, 2), (1, 2)):
            order = [0, 1, 2]
            order[x], order[y] = y, x
            swapped = parts.inertia.copy()
            swapped[:, b] = swapped[:, b][:, order][:, :, order]
            axes = "xyz"[x] + " and " + "xyz"[y]
            yield slip(
                f"axes {axes} of the inertia of {body} exchanged",
                "no",
                "yes",
                lambda i=swapped: parts.values(inertia=i),
            )
    yield from plain_numbers(equations)
    yield from lagrange(equations)


def in_mass_alone(parts: Parts, name: str, changed: dict, which: list[int]) -> Iterator[Variant]:
    """A slip in Mbar alone, and in each of its entries alone."""
    equations, right = parts.equations, parts.equations.values()
    values = parts.values(**only(parts, changed, which))
    entries = [k for k, entry in enumerate(equations.entries) if entry[0] == "M"]
    differing = [k for k in entries if np.abs(values[0, :, k] - right[0, :, k]).max() > 0.0]
    if not differing:
        return
    for together in [differing, *([k] for k in differing)] if len(differing) > 1 else [differing]:
        of = f" in {entry_name(equations.entries[together[0]], equations.names)} alone"
        mixed = right.copy()
        mixed[..., together] = values[..., together]
        yield slip(name + (IN_MASS_ALONE if len(together) > 1 else of), "no", "yes", lambda v=mixed: v)


def lagrange(equations: Equations) -> Iterator[Variant]:
    """Slips in h = Mdot qd - d(kinetic energy)/dq + dV/dq, where all joints are hinges and slides."""
    tree, nv = equations.tree, equations.nv
    if "ball" in tree.kind:
        return
    i, j = equations.triangle

    @cache
    def parts() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        slopes = -np.stack(
            [equations.values({Path("reference", (k,)): np.array([1e-100j])})[0].imag / 1e-100 for k in range(nv)],
            axis=1,
        )
        M = np.zeros((len(equations.q), nv, nv, nv))
        M[:, :, i, j] = M[:, :, j, i] = slopes[:, :, : len(i)]
        qd = equations.qd
        return (
            np.einsum("skij,sk,sj->si", M, qd, qd),
            np.einsum("skij,si,sj->sk", M, qd, qd) / 2.0,
            bias_at_rest(equations),
        )

    def values(of_Mdot: float, of_gradient: float) -> np.ndarray:
        Mdot_qd, gradient, weight = parts()
        right = equations.values()[0]
        return np.concatenate([right[:, : len(i)], of_Mdot * Mdot_qd - of_gradient * gradient + weight], axis=1)[None]

    named = {
        "gradient of the kinetic energy in h": (
            ("left out", 1.0, 0.0),
            ("of the other sign", 1.0, -1.0),
            ("twice", 1.0, 2.0),
        ),
        "Mdot qd in h": (
            ("left out", 0.0, 1.0),
            ("halved", 0.5, 1.0),
            ("halved, and no gradient of the kinetic energy", 0.5, 0.0),
        ),
    }
    for name, forms in named.items():
        for explains, *factors in forms:
            yield slip(name, "Mdot qd - d(qd' Mbar qd / 2)/dq", explains, lambda f=factors: values(*f))


def slip(name: str, stated: str, explains: str, values: Callable[[], np.ndarray]) -> Variant:
    """A variant whose values are known as they are."""
    return Variant(2, "slip", name, stated, explains, lambda: Known(values()), is_simple=False)


class Known:
    """Values in place of equations."""

    def __init__(self, known: np.ndarray):
        self.known = known

    def values(self, changes: dict | None = None) -> np.ndarray:
        return self.known


def only(parts: Parts, changed: dict, which: list[int]) -> dict:
    """Arrays changed for some bodies alone."""
    mixed = {}
    for name, value in changed.items():
        mixed[name] = np.array(getattr(parts, name))
        mixed[name][:, which] = value[:, which]
    return mixed


def shifted(mass: float, com: np.ndarray) -> np.ndarray:
    """What a mass adds to the inertia about a point at this distance."""
    return mass * (com @ com * np.eye(3) - np.outer(com, com))


def plain_numbers(equations: Equations) -> Iterator[Variant]:
    """A centre of mass at its joint, an axis along another one of the frame's: evaluated together, as changes of numbers."""
    tree, made = equations.tree, []  # name, stated, explains, what is added to numbers
    for b, (body, com) in enumerate(zip(tree.body_names, tree.com)):
        added = {Path("com", (b, k)): -com[k] for k in range(3) if com[k]}
        made.append((f"CoM of {body}", "as stated", "at the joint", added))
    for (a, one), (b, other) in combinations(enumerate(tree.body_names), 2):
        more = tree.mass[b] - tree.mass[a]
        made.append(
            (
                f"masses of {one} and {other}",
                "as stated",
                "exchanged",
                {Path("mass", (a,)): more, Path("mass", (b,)): -more},
            )
        )
    for joint, (kind, _, by) in zip(tree.hinge_names, tree.coordinates.joints):
        stated = np.array(tree.axis[by.start])
        shown = "(" + ", ".join(f"{a:.4g}" for a in stated) + ")"
        for k, sign in ((k, sign) for k in range(3) for sign in (1.0, -1.0)):
            if kind != "ball" and abs(abs(stated[k]) - 1.0) > 1e-9:
                added = dict(zip((Path("axis", (by.start, i)) for i in range(3)), sign * np.eye(3)[k] - stated))
                made.append((f"axis of {joint}", shown, "-" * (sign < 0.0) + "xyz"[k], added))
    changes = {path: np.zeros(len(made)) for *_, added in made for path in added}
    for row, (*_, added) in enumerate(made):
        for path, change in added.items():
            changes[path][row] = change
    values = np.broadcast_to(all_values := equations.values(changes), (len(made), *all_values.shape[1:]))
    for row, (name, stated, explains, _) in enumerate(made):
        yield slip(name, stated, explains, lambda r=row: values[r : r + 1])
