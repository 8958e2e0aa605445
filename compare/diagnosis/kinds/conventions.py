"""Conventions in which right equations look different.

Order, senses, zeros and units of joints, angles from the world, quaternions, axes of velocities.

A convention says at which state of the model the equations are, and how the user's speeds become the model's:
qd = S v. M = S' Mbar S, h = S' (h + Mbar drift), with drift = dS/dt v. Each kind is a function in KINDS.
"""

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from itertools import chain, combinations, permutations, product

import numpy as np
from numpy import ndarray

import tmt
from tmt import literal
from tmt.derivation.mechanism import rotation_in_parent
from tmt.derivation.vectors import Matrix

from ...core.cause import Cause
from ...core.words import listed
from ...robots.joint_map import PER_UNIT, Joint, JointMap
from ..cause import together
from ..hypothesis import Hypothesis
from ..model import Equations, blocks
from .terms import speeds_of_joints

# of kinds
COSTS = {"sign": 0.0, "order": 0.25, "unit": 0.1, "angles": 0.0, "displacement": 0.1, "axes": 0.15}
FIRST, OF_NAME, OF_SLIDE = 0.1, 0.15, 0.2  # more, of the first joint, of each other, of a slide
PARALLEL = 1e-9  # of a cosine from 1
MOST_PERMUTED = 6  # joints in all orders; of more, orders in which programs count, and two exchanged
MOST_TURNED = 10  # joints with all combinations of senses
MOST_OF_BOTH = 4  # joints whose order and senses are tried together
MOST_ABSOLUTE = 6  # angles of which each may be measured from the world


@dataclass(frozen=True)
class Convention:
    """The joints of right equations as a user may take them, at the states of a comparison."""

    cause: Cause
    q: ndarray  # (states, nq), of the model
    qd: ndarray  # (states, nv), of the model
    S: ndarray  # (states, nv, nv)
    drift: ndarray  # (states, nv)
    joints: JointMap | None = None  # how it is to be stated; None: it cannot be

    def applied(self, M: ndarray, velocity_terms: ndarray, rest: ndarray) -> tuple[ndarray, ndarray, ndarray]:
        """The model's Mbar, velocity terms and h at rest as they are in this convention."""
        St = np.swapaxes(self.S, 1, 2)
        moved = velocity_terms + np.einsum("sij,sj->si", M, self.drift)
        return St @ M @ self.S, np.einsum("sij,sj->si", St, moved), np.einsum("sij,sj->si", St, rest)

    def removed(self, M: ndarray, right: ndarray, h: ndarray, rest: ndarray) -> tuple[ndarray, ...]:
        """Given Mbar, h and h at rest, in this convention, as the model has them. right: the model's Mbar."""
        back = np.linalg.inv(self.S)
        transposed = np.swapaxes(back, 1, 2)
        M = transposed @ M @ back
        known = np.where(np.isfinite(M), M, right)
        moved = np.einsum("sij,sj->si", transposed, h) - np.einsum("sij,sj->si", known, self.drift)
        return M, moved, np.einsum("sij,sj->si", transposed, rest)


def conventions(equations: Equations) -> Iterator[Hypothesis]:
    """The right equations in each convention, evaluated in blocks."""
    tree, here = equations.tree, forces(equations.tree, equations.q, equations.qd)
    for block in blocks((convention for kind in KINDS for convention in kind(equations)), 64):
        q, qd = (np.concatenate([getattr(convention, name) for convention in block]) for name in ("q", "qd"))
        parts = Equations(equations.tree, q, qd, equations.layout).parts
        for convention, *of_model in zip(block, *(np.split(part, len(block)) for part in parts)):
            M, *of_h = convention.applied(*of_model)
            if equations.layout.with_forces:
                S, there = convention.S, forces(tree, convention.q, convention.qd)
                of_h = [h + np.einsum("sji,sj->si", S, x) - y for h, x, y in zip(of_h, there, here)]
            values = equations.layout.packed(M, *of_h)
            yield Hypothesis(convention.cause, values - equations.right, convention=convention)


def forces(tree: tmt.Tree, q: ndarray, qd: ndarray) -> tuple[ndarray, ndarray]:
    """Those of damping, and of springs, that act against the motion, (states, nv)."""
    return np.array(tree.damping) * qd, literal.spring_torque(tree, q)


def named(kind: str, place: str, explains: str, cost: float = 0.0, rank: int = 1, stated: str = "") -> Cause:
    """The cause of a convention; cost: beside that of its kind."""
    about = partial(Cause, rank=rank, kind=kind, cost=COSTS[kind] + cost)
    return about(place=place, stated=stated, explains=explains)


def constant(equations: Equations, cause: Cause, S: ndarray, q: ndarray | None = None) -> Convention:
    """A convention with the same S (nv, nv) at all states."""
    q, everywhere = equations.q if q is None else q, np.broadcast_to(S, (len(equations.q), *S.shape))
    return Convention(cause, q, equations.qd @ S.T, everywhere, 0.0 * equations.qd)


# of joints, which can be stated


def stated(equations: Equations, cause: Cause, joints: Iterable[Joint]) -> Convention:
    """A convention that can be stated by the joints."""
    joint_map, identity = JointMap(equations.coordinates, list(joints)), np.eye(equations.nv)
    S = np.broadcast_to(joint_map.own_forces(identity), (len(equations.q), *identity.shape))
    q, qd = joint_map.positions(equations.q), joint_map.speeds(equations.qd)
    return Convention(cause, q, qd, S, 0.0 * qd, joint_map)


def joints_of(equations: Equations) -> dict[str, Joint]:
    coordinates = equations.coordinates
    kinds = zip(coordinates.names, coordinates.all_kinds)
    return {name: Joint(name, slides=kind == "slide") for name, kind in kinds}


def senses(equations: Equations) -> Iterator[Convention]:
    """The senses of any number of joints, those of hinges before those with slides."""
    right = joints_of(equations)
    for chosen in chosen_senses(equations):
        turned = right | {name: right[name]._replace(sign=-1.0) for name in chosen}
        cost = cost_of(len(chosen)) + OF_SLIDE * sum(right[name].slides for name in chosen)
        cause = named("sign", f"sense of {listed(chosen)}", "-", cost, stated="+")
        yield stated(equations, cause, turned.values())


def cost_of(joints: int) -> float:
    """What a convention of some joints costs more."""
    return FIRST + OF_NAME * (joints - 1)


def chosen_senses(equations: Equations) -> list[tuple[str, ...]]:
    """Joints that may be turned together; of many joints one, and all hinges."""
    kinds = dict(zip(equations.coordinates.names, equations.coordinates.all_kinds))
    straight = [name for name, kind in kinds.items() if kind != "ball"]
    most = len(straight) if len(straight) <= MOST_TURNED else 1
    chosen = [names for count in range(1, most + 1) for names in combinations(straight, count)]
    if most == 1:
        chosen.append(tuple(name for name in straight if kinds[name] == "hinge"))
    return sorted(chosen, key=lambda names: (len(names), sum(kinds[name] == "slide" for name in names)))


def orders(equations: Equations) -> Iterator[Convention]:
    """The order of the joints, and for a few of them their senses too."""
    right = joints_of(equations)
    names = list(right)
    all_orders = permutations(names) if len(names) <= MOST_PERMUTED else named_orders(equations.tree)
    of_senses = chosen_senses(equations) if len(names) <= MOST_OF_BOTH else []
    for order in (list(order) for order in all_orders if list(order) != names):
        for chosen in ((), *of_senses):
            joints = [right[name]._replace(sign=-1.0 if name in chosen else 1.0) for name in order]
            what, rank = ("order and senses of the joints", 3) if chosen else ("order of the joints", 1)
            cause = named("order", what, ", ".join(map(str, joints)), rank=rank, stated=", ".join(names))
            yield stated(equations, cause, joints)


def named_orders(tree: tmt.Tree) -> Iterator[list[str]]:
    """Orders in which programs count joints: breadth first, alphabetical, reversed; two swapped."""
    names = list(tree.joint_names)
    depth = {name: len(tree.path(i)) for i, name in enumerate(names)}
    by_depth = sorted(names, key=depth.__getitem__), sorted(names, key=lambda name: (depth[name], name))
    yield from (*by_depth, sorted(names), names[::-1])
    for i, j in combinations(range(len(names)), 2):
        exchanged = list(names)
        exchanged[i], exchanged[j] = names[j], names[i]
        yield exchanged


def units(equations: Equations) -> Iterator[Convention]:
    right = joints_of(equations)
    hinges = [name for name, kind in zip(right, equations.coordinates.all_kinds) if kind == "hinge"]
    sets = [(name, [name]) for name in hinges] + [("all hinges", hinges)] * (len(hinges) > 1)
    for (place, those), unit in product(sets, filter(None, PER_UNIT)):
        in_unit = right | {name: right[name]._replace(unit=unit) for name in those}
        yield stated(equations, named("unit", f"unit of {place}", unit, stated="rad"), in_unit.values())


# of coordinates and speeds


def from_the_world(equations: Equations) -> Iterator[Convention]:
    """Angles or displacements measured from the world, not from the body before, of any of parallel joints."""
    tree, joints = equations.tree, equations.tree.coordinates.joints
    for kind, of_kind, name in (("hinge", "angles", "angle"), ("slide", "displacement", "displacement")):
        before = {i: parallel_before(tree, i) for i, other in enumerate(tree.kind) if other == kind}
        at_q, at_v = ([getattr(joints[i], part).start for i in before] for part in ("q", "qd"))
        absolute = np.eye(equations.nv)  # rows: angles from the world as sums of angles between bodies
        chained = [i for i, (parent, _) in before.items() if parent >= 0]
        for i in chained:
            parent, along = before[i]
            absolute[joints[i].qd.start] += along * absolute[joints[parent].qd.start]
        counts = range(1, len(chained) + 1) if len(chained) <= MOST_ABSOLUTE else (1, len(chained))
        for chosen in chain.from_iterable(combinations(chained, count) for count in counts):
            own, q = np.eye(equations.nv), equations.q.copy()
            rows = [joints[i].qd.start for i in chosen]
            own[rows] = absolute[rows]
            A = np.linalg.inv(own)
            q[:, at_q] = q[:, at_q] @ A[np.ix_(at_v, at_v)].T
            place = f"{name} of {listed([tree.joint_names[i] for i in chosen])}"
            explains, (parent, _) = "measured from the world", before[chosen[0]]
            if len(chosen) == 1 and parent in tree.body_joint:
                explains += f", not from {tree.body_names[tree.body_joint.index(parent)]}"
            cause = named(of_kind, place, explains, cost_of(len(chosen)), stated="from the body before")
            yield constant(equations, cause, A, q)


def parallel_before(tree: tmt.Tree, i: int) -> tuple[int, float]:
    """The joint that carries a hinge, or a slide, of its kind and parallel to it, or -1, and the cosine of their axes."""
    skipped = "slide" if tree.kind[i] == "hinge" else ""
    parent = next((k for k in tree.path(tree.parent[i]) if tree.kind[k] != skipped), -1)
    if parent < 0 or tree.kind[parent] != tree.kind[i]:
        return -1, 0.0
    joints = tree.coordinates.joints
    along = float(np.dot(tree.axis[joints[i].qd.start], tree.axis[joints[parent].qd.start]))
    return (parent, float(np.sign(along))) if abs(abs(along) - 1.0) < PARALLEL else (-1, 0.0)


def of_balls(equations: Equations) -> Iterator[Convention]:
    """Of each ball and free joint: order and sense of the quaternion, axes of the velocities, and both."""
    tree, q, qd, of_speeds = equations.tree, equations.q, equations.qd, speeds_of_joints(equations.tree)
    for i, joint in ((i, joint) for i, joint in enumerate(tree.coordinates.joints) if joint.kind == "ball"):
        name, slides = tree.joint_names[i], ", ".join(tree.joint_names[max(i - 3, 0) : i])
        is_free = slides in of_speeds and i >= 3
        order, sense = q.copy(), q.copy()
        order[:, joint.q] = np.roll(q[:, joint.q], 1, axis=1)
        sense[:, joint.q] = q[:, joint.q] * [1.0, -1.0, -1.0, -1.0]
        quaternions = {"": q, "read as x, y, z, w": order, "of the inverse rotation": sense}
        ways = product(quaternions.items(), (False, True), (False, True) if is_free else (False,))
        for (of_q, own_q), in_world, in_body in ways:
            said = {f"quaternion of {name}": of_q, f"angular velocity of {name}": "in world axes" * in_world}
            said[f"linear velocity of {slides}"] = "in body axes" * in_body
            R = matrices(rotation_in_parent(tree, i, list(own_q.T)), len(q))
            S, drift = np.tile(np.eye(equations.nv), (len(q), 1, 1)), 0.0 * qd
            if in_world:
                S[:, joint.qd, joint.qd] = np.swapaxes(R, 1, 2)
            own_qd = np.einsum("sij,sj->si", S, qd)
            if in_body:
                v = slice(of_speeds[slides][0], joint.qd.start)
                S[:, v, v] = R
                drift[:, v] = np.einsum("sij,sj->si", R, np.cross(own_qd[:, joint.qd], qd[:, v]))
                own_qd = np.einsum("sij,sj->si", S, qd)
            causes = [named("axes", place, explains) for place, explains in said.items() if explains]
            if causes:
                yield Convention(together(causes, 0.0), own_q, own_qd, S, drift)
        factors = {"twice as large, q' = q omega for q omega / 2": 2.0, "half as large": 0.5}
        for explains, factor in factors.items():
            S = np.eye(equations.nv)
            S[joint.qd, joint.qd] *= factor
            yield constant(equations, named("axes", f"angular velocity of {name}", explains), S)


def orders_of_speeds(equations: Equations) -> Iterator[Convention]:
    """The order of the speeds where there are balls: (angular, linear) of a free joint, a hinge first."""
    tree = equations.tree
    if "ball" not in tree.kind:
        return
    of_joints, blocks = speeds_of_joints(tree), dict[str, list[int]]()
    for name, kind in zip(tree.joint_names, tree.kind):
        slides = next((key for key in of_joints if ", " in key and name in key.split(", ")), name)
        blocks[slides if kind == "slide" else name] = of_joints[slides if kind == "slide" else name]
    for order in list(permutations(blocks))[1:] if len(blocks) <= MOST_OF_BOTH else ():
        S = np.eye(equations.nv)[:, [v for name in order for v in blocks[name]]]
        yield constant(equations, named("order", "order of the speeds", "; ".join(order)), S)


def matrices(turn: Matrix, count: int) -> ndarray:
    """A rotation matrix of scalars (states,) as an array (states, 3, 3)."""
    return np.moveaxis(np.array([[np.broadcast_to(x, count) for x in row] for row in turn]), 2, 0)


KINDS: tuple[Callable[[Equations], Iterator[Convention]], ...] = (
    senses, orders, units, from_the_world, of_balls, orders_of_speeds,
)  # fmt: skip
