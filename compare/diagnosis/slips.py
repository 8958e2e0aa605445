"""Common slips in a derivation: Mbar and h with each of them, made in the Jacobians and convective terms of one body or all."""

from collections.abc import Callable, Iterator
from functools import cache, partial
from itertools import combinations
from types import SimpleNamespace

import numpy as np

from tmt.equations import method

from .model import TINY, Equations, Path
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

    def of_single_speeds(self) -> list[np.ndarray]:
        """v_conv and w_conv of each speed alone, summed: without the products of different speeds."""
        tree, q, qd = self.tree, self.equations.q, self.equations.qd
        alone = [Parts(Equations(tree, q, qd * unit)) for unit in np.eye(qd.shape[1])]
        return [sum(getattr(part, name) for part in alone) for name in ("v_conv", "w_conv")]

    def values_with(self, changed: dict, bodies: list[int]) -> np.ndarray:
        """The values with arrays changed for some bodies."""
        mixed = {name: np.array(getattr(self, name)) for name in changed}
        for name, value in changed.items():
            mixed[name][:, bodies] = value[:, bodies]
        return self.values(**mixed)


def slips(equations: Equations) -> Iterator[Variant]:
    """Each slip, of each body alone and of all together."""
    parts, tree = Parts(equations), equations.tree
    groups = {name: [b] for b, name in enumerate(tree.body_names)}
    if len(groups) > 1:
        groups[EVERY_BODY] = list(range(len(groups)))
    v_alone, w_alone = parts.of_single_speeds()
    R, turning = parts.R, {name: getattr(parts, name) for name in ("omega", "w_conv", "B")}
    world = {name: turned(R, value) for name, value in turning.items()}
    com, mass = np.array(tree.com), np.array(tree.mass)[:, None, None]
    of_com = mass * ((com**2).sum(axis=1)[:, None, None] * np.eye(3) - com[:, :, None] * com[:, None, :])
    without_parallel = {"inertia": parts.inertia - of_com}
    changes = {
        "R for R' in the angular velocity of {}": {name: turned(R, value) for name, value in world.items()},
        "inertia of {} not turned to the inertial frame": world,
        "R' I R for R I R' of {}": world | {"inertia": np.swapaxes(R, 2, 3) @ parts.inertia @ R},
        "inertia of {} about its joint and mass counted again": {"inertia": parts.inertia + of_com},
        PARALLEL_AXIS: without_parallel,
        "products of different rates in v_conv of {} left out": {"v_conv": v_alone},
        "products of different rates in v_conv of {} once for twice": {"v_conv": (v_alone + parts.v_conv) / 2.0},
        "products of different rates in w_conv of {} left out": {"w_conv": w_alone},
        "products of different rates in v_conv and w_conv of {} left out": {"v_conv": v_alone, "w_conv": w_alone},
        "squares of rates in v_conv of {} left out": {"v_conv": parts.v_conv - v_alone},
    }
    for name, changed in changes.items():
        for body, which in groups.items():
            yield slip(name.format(body), partial(parts.values_with, changed, which))
    for body, which in groups.items():
        yield from in_mass_alone(equations, PARALLEL_AXIS.format(body), parts.values_with(without_parallel, which))
    for b, body in enumerate(tree.body_names):
        for x, y in combinations(range(3), 2):
            order = [y if k == x else x if k == y else k for k in range(3)]
            swapped = {"inertia": parts.inertia[..., order, :][..., order]}
            name = f"axes {'xyz'[x]} and {'xyz'[y]} of the inertia of {body} exchanged"
            yield slip(name, partial(parts.values_with, swapped, [b]))
    yield from plain_numbers(equations)
    if "ball" not in tree.kind:
        yield from lagrange(equations)


def turned(R: np.ndarray, value: np.ndarray) -> np.ndarray:
    """Vectors (states, bodies, 3), or columns of them, in other axes."""
    return R @ value if value.ndim == 4 else np.einsum("sbcd,sbd->sbc", R, value)


def in_mass_alone(equations: Equations, name: str, values: np.ndarray) -> Iterator[Variant]:
    """A slip in Mbar alone, and in each of its entries alone. values: with the slip everywhere."""
    right, entries = equations.values(), range(len(equations.triangle[0]))
    differing = [k for k in entries if np.abs(values[0, :, k] - right[0, :, k]).max() > 0.0]
    for together in [differing, *([k] for k in differing)] if len(differing) > 1 else [differing] * len(differing):
        of_entry = f" in {entry_name(equations.entries[together[0]], equations.names)} alone"
        mixed = right.copy()
        mixed[..., together] = values[..., together]
        yield slip(name + (IN_MASS_ALONE if len(together) > 1 else of_entry), lambda v=mixed: v)


def lagrange(equations: Equations) -> Iterator[Variant]:
    """Slips in h = Mdot qd - d(kinetic energy)/dq + dV/dq, of hinges and slides."""
    qd, nv, (i, j) = equations.qd, equations.nv, equations.triangle

    @cache
    def terms() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        tiny = {k: {Path("reference", (k,)): np.array([1j * TINY])} for k in range(nv)}
        slopes = -np.stack([equations.values(tiny[k])[0].imag / TINY for k in range(nv)], axis=1)
        M = np.zeros((len(qd), nv, nv, nv))
        M[:, :, i, j] = M[:, :, j, i] = slopes[:, :, : len(i)]
        Mdot_qd, gradient = np.einsum("skij,sk,sj->si", M, qd, qd), np.einsum("skij,si,sj->sk", M, qd, qd) / 2.0
        return Mdot_qd, gradient, bias_at_rest(equations)

    def values(of_Mdot: float, of_gradient: float) -> np.ndarray:
        Mdot_qd, gradient, weight = terms()
        M = equations.values()[0][:, : len(i)]
        return np.concatenate([M, of_Mdot * Mdot_qd - of_gradient * gradient + weight], axis=1)[None]

    for name, explains, *factors in (
        ("gradient of the kinetic energy in h", "left out", 1.0, 0.0),
        ("gradient of the kinetic energy in h", "of the other sign", 1.0, -1.0),
        ("gradient of the kinetic energy in h", "twice", 1.0, 2.0),
        ("Mdot qd in h", "left out", 0.0, 1.0),
        ("Mdot qd in h", "halved", 0.5, 1.0),
        ("Mdot qd in h", "halved, and no gradient of the kinetic energy", 0.5, 0.0),
    ):
        yield slip(name, partial(values, *factors), "Mdot qd - d(qd' Mbar qd / 2)/dq", explains)


def slip(name: str, values: Callable[[], np.ndarray], stated: str = "no", explains: str = "yes") -> Variant:
    def made() -> SimpleNamespace:
        changed = values()
        return SimpleNamespace(values=lambda changes=None: changed)

    return Variant(2, "slip", name, stated, explains, made, is_simple=False)


def plain_numbers(equations: Equations) -> Iterator[Variant]:
    """A CoM at its joint, exchanged masses, an axis along another one of the frame: evaluated together, as changes of numbers."""
    tree, made = equations.tree, []  # name, stated, explains, what is added to numbers
    for b, (body, com) in enumerate(zip(tree.body_names, tree.com)):
        added = {Path("com", (b, k)): -com[k] for k in range(3) if com[k]}
        made.append((f"CoM of {body}", "as stated", "at the joint", added))
    for (a, one), (b, other) in combinations(enumerate(tree.body_names), 2):
        more = tree.mass[b] - tree.mass[a]
        added = {Path("mass", (a,)): more, Path("mass", (b,)): -more}
        made.append((f"masses of {one} and {other}", "as stated", "exchanged", added))
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
    values = equations.values(changes)
    values = np.broadcast_to(values, (len(made), *values.shape[1:]))
    for row, (name, stated, explains, _) in enumerate(made):
        yield slip(name, lambda r=row: values[r : r + 1], stated, explains)
