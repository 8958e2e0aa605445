"""Made faults that the diagnosis must name: `python -m tests.faults [COUNT]` prints outcomes; exit 1 if one is wrong.

Each fault is one number, term, slip in the derivation or convention of a joint. Outcomes: "named" (alone or among others that
explain as much); "tied" (only other causes, no less simple, and again at further states); "none"; "invisible"; "wrong".
"""

import sys
from collections import Counter
from collections.abc import Callable, Iterator
from concurrent.futures import ProcessPoolExecutor
from dataclasses import replace
from functools import partial
from itertools import combinations
from pathlib import Path
from typing import NamedTuple

import numpy as np

import tmt
from compare.diagnosis import STATES_ASKED, Diagnosis, Values, diagnose
from compare.diagnosis.model import OF_TERM
from compare.engines.mujoco import reading
from tmt import literal
from tmt.derivation import method
from tmt.derivation.composite import mass_matrix_and_bias

ARM6 = Path(__file__).parent / "models" / "arm6.xml"
SECONDS = 20.0  # of one search: what else the machine does must not change the outcome
SLIPS = {
    "turned the wrong way": "inertia of {}: turned back, R' I R for R I R'",
    "not turned": "inertia of {}: not turned to the inertial frame",
    "about the joint": "inertia of {}: about its joint, and m (c'c 1 - c c') counted again",
    "relative": "angular velocity of {}: relative to the body before, not to the world",
}  # fmt: skip


class Fault(NamedTuple):
    robot: str
    tree: tmt.Tree
    kind: str
    place: str  # of the cause that names it
    values: tuple[float, ...]  # which the cause must give
    make: Callable  # (tree, q, qd) -> Mbar, h


def derived(tree: tmt.Tree, q, qd, factors: dict | None = None, slip: str = "", bodies: tuple = ()):
    """Mbar (states, nv, nv) and h (states, nv), with factors {(body, term): number} and one slip in some bodies."""
    (T, B), w = literal.jacobians(tree, q), literal.angular_velocities(tree, q, qd)
    (a, alpha), M, h = literal.convective_terms(tree, q, qd), 0.0, 0.0
    turns = [frame.rotation for frame in method.joint_frames(tree, list(q.T))]
    for b, mass in enumerate(tree.mass):
        factor = {term: (factors or {}).get((b, term), 1.0) for term in OF_TERM}
        I, c, slips = np.array(tree.inertia[b]), np.array(tree.com[b]), slip if b in bodies else ""
        turn = turns[tree.body_joint[b]]
        R = np.array([[x + np.zeros(len(q)) for x in row] for row in turn]).transpose(2, 0, 1)
        Rt, own_w, own_alpha, own_B = np.swapaxes(R, 1, 2), w[:, b], alpha[:, b], B[:, b]
        if slips == "not turned":
            I = Rt @ I @ R
        elif slips == "turned the wrong way":
            I = Rt @ Rt @ I @ R @ R
        elif slips == "about the joint":
            I = I + mass * (c @ c * np.eye(3) - np.outer(c, c))
        elif slips == "relative":  # the axis of its own joint does not move in the body
            own_B = own_B * (np.arange(len(tree.axis)) == tree.body_joint[b])
            own_w, own_alpha = (own_B @ qd[..., None])[..., 0], 0.0 * own_alpha
        M = M + factor["translation"] * mass * np.swapaxes(T[:, b], 1, 2) @ T[:, b]
        M = M + factor["rotation"] * np.swapaxes(own_B, 1, 2) @ I @ own_B
        force = mass * (factor["convective"] * a[:, b] - factor["gravity"] * np.array(tree.gravity))
        moment = factor["Euler"] * (I @ own_alpha[..., None])[..., 0]
        moment = moment + factor["gyroscopic"] * np.cross(own_w, (I @ own_w[..., None])[..., 0])
        h = h + np.einsum("sci,sc->si", T[:, b], force) + np.einsum("sci,sc->si", own_B, moment)
    return M + np.diag(tree.armature), h


def with_another_gradient(tree: tmt.Tree, q, qd, row: int, factor: float):
    """Mbar and h, of which one row has the gradient of the kinetic energy d(qd' Mbar qd / 2)/dq = C' qd times a factor."""
    M, h = by_composite(tree, q, qd)
    C = tmt.coriolis_matrix(tree, q, qd)
    return M, h + (1.0 - factor) * np.einsum("sji,sj->si", C, qd) * np.eye(len(tree.axis))[row]


def with_sine_for_cosine(tree: tmt.Tree, q, qd, axis: int):
    """Mbar and h with T' m T and T' m (a - g) of the first body, whose T has sine for cosine of its hinge along one axis."""
    M, h = by_composite(tree, q, qd)
    moved, (T, _) = q.copy(), literal.jacobians(tree, q)
    moved[:, 0] = np.pi / 2.0 - q[:, 0]
    right, wrong = T[:, 0], T[:, 0].copy()
    signs = 1.0 - 2.0 * (np.arange(len(tree.axis)) == 0)
    wrong[:, axis] = literal.jacobians(tree, moved)[0][:, 0, axis] * signs
    force = tree.mass[0] * (literal.convective_terms(tree, q, qd)[0][:, 0] - np.array(tree.gravity))
    inertias = (tree.mass[0] * np.swapaxes(J, 1, 2) @ J for J in (wrong, right))
    return M + next(inertias) - next(inertias), h + np.einsum("sci,sc->si", wrong - right, force)


def by_composite(tree: tmt.Tree, q, qd, edited: tmt.Tree | None = None):
    M, h = mass_matrix_and_bias(edited or tree, list(q.T), list(qd.T))
    M = [np.stack([np.broadcast_to(x, len(q)) for x in row], axis=-1) for row in M]
    return np.stack(M, axis=1), np.stack([np.broadcast_to(x, len(q)) for x in h], axis=-1)


def in_own_joints(tree: tmt.Tree, q, qd, order=None, sense=1.0, zero=0.0, units=1.0):
    """In other joints: own = (sense x model's + zero) x units, in this order; q and qd are taken as these."""
    order, sense = list(range(q.shape[1])) if order is None else order, sense * np.ones(q.shape[1])
    back = np.argsort(order)
    M, h = by_composite(tree, ((q / units - zero) * sense)[:, back], (qd / units * sense)[:, back])
    return M[:, order][:, :, order] * sense[:, None] * sense, h[:, order] * sense


def tree_numbers(tree: tmt.Tree) -> Iterator[tuple[str, str, tuple, float]]:
    """Place, field of the Tree, index and natural size of each number."""
    length = max(np.abs(tree.offset).max(), np.abs(tree.com).max(), 1e-3)
    for b, body in enumerate(tree.body_names):
        yield f"mass of {body}", "mass", (b,), tree.mass[b]
        yield from ((f"CoM {axis} of {body}", "com", (b, k), length) for k, axis in enumerate("xyz"))
        size = np.abs(tree.inertia[b]).max()
        for name in ("xx", "yy", "zz", "xy", "xz", "yz"):
            yield f"inertia {name} of {body}", "inertia", (b, *map("xyz".index, name)), size
    for i, joint in enumerate(tree.joint_names):
        for k, axis in enumerate("xyz"):
            yield f"offset {axis} of {joint}", "offset", (i, k), length
            yield f"axis {axis} of {joint}", "axis", (i, k), 1.0
        yield f"armature of {joint}", "armature", (i,), max(tree.armature[i], 0.1)
    yield from ((f"gravity {axis}", "gravity", (k,), 9.81) for k, axis in enumerate("xyz"))


def changed(tree: tmt.Tree, number: tuple, rng: np.random.Generator) -> tuple[tmt.Tree, float] | None:
    """The tree with one number changed by 1e-6 to 1 of its size, and the new number; None if no rigid body has it."""
    _, field, index, scale = number
    values = np.array(getattr(tree, field), float)
    values[index] += rng.choice([-1.0, 1.0]) * 10.0 ** rng.uniform(-6.0, 0.0) * scale
    if field == "inertia":
        values[index[0], index[2], index[1]] = values[index]
    try:
        return replace(tree, **{field: values.tolist()}), float(values[index])
    except ValueError:
        return None


def faults_of(robot: str, tree: tmt.Tree, rng: np.random.Generator) -> list[Fault]:
    found, names, n, bodies = [], tree.joint_names, len(tree.axis), range(len(tree.mass))

    def add(kind, place, make, *values, **more):
        found.append(Fault(robot, tree, kind, place, values, partial(make, **more)))

    for number in tree_numbers(tree):
        if one := changed(tree, number, rng):
            add("number", number[0], by_composite, one[1], edited=one[0])
    for which in [*((b,) for b in bodies), tuple(bodies)]:
        of = tree.body_names[which[0]] if len(which) == 1 else "every body"
        for term, name in OF_TERM.items():
            factor = float(rng.choice([0.0, 0.5, -1.0, 2.0]))
            add("term", name.format(of), derived, factor, factors={(b, term): factor for b in which})
        for slip, name in SLIPS.items():
            add("slip", name.format(of), derived, slip=slip, bodies=which)
    for a, b in combinations(bodies, 2):
        masses = list(tree.mass)
        masses[a], masses[b] = masses[b], masses[a]
        both = f"{tree.body_names[a]} and {tree.body_names[b]}"
        add("exchange", f"masses of {both}", by_composite, edited=replace(tree, mass=masses))
    for b, body in enumerate(tree.body_names):
        tensors = [np.array(I)[::-1, ::-1] if k == b else np.array(I) for k, I in enumerate(tree.inertia)]
        edited = replace(tree, inertia=np.array(tensors).tolist())
        add("exchange", f"inertia of {body}, axes x and z exchanged", by_composite, edited=edited)
    for i, name in enumerate(names):
        for factor, explains in {0.0: "left out", -1.0: "of the other sign"}.items():
            place = f"gradient of the kinetic energy in h[{name}]: {explains}"
            add("lagrange", place, with_another_gradient, row=i, factor=factor)
    if tree.body_joint[0] == 0:
        for axis, name in enumerate("xyz"):
            explains = f"sine and cosine of {names[0]} exchanged in {name}, with the right accelerations"
            place = f"CoM of {tree.body_names[0]}: {explains}"
            add("sine", place, with_sine_for_cosine, axis=axis)
    order = rng.permutation(n).tolist()
    if order != sorted(order) and len(set(tree.kind)) == 1:
        add("convention", "order of the joints", in_own_joints, order=order)
    for i, (name, unit) in enumerate(zip(names, np.eye(n))):
        add("convention", f"sense of {name}", in_own_joints, sense=1.0 - 2.0 * unit)
        add("convention", f"zero of {name}", in_own_joints, zero=rng.uniform(-1.5, 1.5) * unit)
        if tree.kind[i] == "hinge":
            add("convention", f"unit of {name}", in_own_joints, units=1.0 + (180.0 / np.pi - 1.0) * unit)
    return found


def random_tree(rng: np.random.Generator) -> tmt.Tree:
    """A tree of two to five hinges and slides with tilted axes, often branched, a body on each joint."""
    n = int(rng.integers(2, 6))
    turns = np.linalg.qr(rng.normal(size=(n, 3, 3)))[0]
    second = turns * 10.0 ** rng.uniform(-3.0, -1.0, (n, 1, 3)) @ np.swapaxes(turns, 1, 2)
    second = (second + np.swapaxes(second, 1, 2)) / 2.0
    inertia = np.einsum("nii->n", second)[:, None, None] * np.eye(3) - second
    return tmt.Tree(
        joint_names=tuple(f"j{i}" for i in range(n)),
        kind=("hinge", *(str(kind) for kind in rng.choice(["hinge", "slide"], n - 1, p=[0.75, 0.25]))),
        parent=(-1, *(i - 1 if rng.random() < 0.8 else int(rng.integers(-1, i)) for i in range(1, n))),
        offset=rng.uniform(-0.5, 0.5, (n, 3)).tolist(), axis=rng.normal(size=(n, 3)).tolist(), damping=(0.0,) * n,
        body_names=tuple(f"b{i}" for i in range(n)), body_joint=tuple(range(n)),
        mass=(10.0 ** rng.uniform(-1.0, 1.0, n)).tolist(), com=rng.uniform(-0.3, 0.3, (n, 3)).tolist(),
        inertia=inertia.tolist(), gravity=rng.uniform(-10.0, 10.0, 3).tolist(),
        armature=(rng.uniform(0.0, 0.5, n) * (rng.random(n) < 0.3)).tolist(),
    )  # fmt: skip


def all_faults() -> list[Fault]:
    rng = np.random.default_rng(13)
    found = faults_of("arm", tmt.ARM, rng) + faults_of("arm6", reading.read(ARM6).tree, rng)
    for k in range(len(found)):
        of_tree = faults_of(f"random tree {k}", random_tree(rng), rng)
        found.append(of_tree[int(rng.integers(len(of_tree)))])
    return found


def diagnosis_of(fault: Fault, seed: int) -> Diagnosis:
    tree = fault.tree
    q, qd = np.random.default_rng(seed).uniform(-3.0, 3.0, (2, STATES_ASKED, len(tree.axis)))
    return diagnose(tree, Values.of(tree, q, qd, *fault.make(tree, q, qd)), SECONDS)


def outcome(fault: Fault) -> tuple[str, list[str]]:
    found = diagnosis_of(fault, seed=3)
    places = [cause.place for cause in found.causes]
    said = [(cause, (cause.place, f"{cause.place}: {cause.explains}")) for cause in found.causes]
    named = [cause for cause, names in said if fault.place in names]
    if named and (not fault.values or np.isclose(named[0].explains, fault.values[0], rtol=1e-6, atol=1e-9)):
        return "named", places
    if not found.causes:
        return ("none" if found.differs else "invisible"), places
    if not named and min(cause.rank for cause in found.causes) <= (1 if fault.kind == "convention" else 2):
        again = {cause.place for cause in diagnosis_of(fault, seed=4).causes}
        return ("tied" if again >= set(places) else "wrong"), places
    return "wrong", places


def main() -> int:
    faults = all_faults()
    count = int(sys.argv[1]) if sys.argv[1:] else len(faults)
    faults = [faults[k] for k in np.random.default_rng(2).permutation(len(faults))[:count]]
    with ProcessPoolExecutor() as pool:
        outcomes = list(pool.map(outcome, faults, chunksize=4))
    kinds = Counter((fault.kind, which) for fault, (which, _) in zip(faults, outcomes))
    for (kind, which), number in sorted(kinds.items()):
        print(f"{kind:<12} {which:<10} {number:5d}")
    for fault, (which, places) in zip(faults, outcomes):
        if which == "wrong":
            print(f"WRONG {fault.robot}, {fault.place}: {'; '.join(places)}")
    return int(any(which == "wrong" for which, _ in outcomes))


if __name__ == "__main__":
    sys.exit(main())
