"""Random Trees and their states: for the tests of tmt, and wherever one arm is not enough."""

from dataclasses import replace

import numpy as np
from models.made import random_turn

from tmt import Tree

UNIT = np.eye(3)


def tree_of_kinds(rng, bodies=4, kinds=("hinge", "slide", "ball", "free"), most=2) -> Tree:
    """Bodies on one to `most` joints each, with all that a Tree may have; "free": the first is free."""
    parent, offset, axis, kind, body_joint, inertias = [], [], [], [], [], []
    for b in range(bodies):
        before, is_free = -1 if b == 0 else int(rng.choice([-1, *body_joint])), "free" in kinds and b == 0
        others = [name for name in kinds if name != "free"]
        chosen = ["slide"] * 3 + ["ball"] if is_free else list(rng.choice(others, rng.integers(1, most + 1)))
        if chosen == ["ball", "ball"]:  # in one body they are singular
            chosen[0] = "slide"
        for name in chosen:
            parent.append(before)
            before = len(parent) - 1
            offset.append(rng.uniform(-0.4, 0.4, 3) * (not is_free))
            kind.append(str(name))
            frame, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            frame *= np.linalg.det(frame)
            axis += list(frame) if name == "ball" else [np.eye(3)[len(axis)] if is_free else frame[0]]
        body_joint.append(before)
        points = rng.uniform(-0.1, 0.1, (6, 3))  # with masses, so that a body can have the tensor
        inertias.append(sum(np.dot(r, r) * UNIT - np.outer(r, r) for r in points))
    n, nv = len(parent), len(axis)
    rest = []
    for name in kind:
        rest += list(random_turn(rng)) if name == "ball" else [rng.uniform(-0.5, 0.5)]
    return Tree(
        joint_names=[f"{name}{i}" for i, name in enumerate(kind)], parent=parent, offset=offset, axis=axis,
        damping=rng.uniform(0.0, 0.5, nv), body_names=[f"body{b}" for b in range(bodies)], body_joint=body_joint,
        mass=rng.uniform(0.5, 2.0, bodies), com=rng.uniform(-0.3, 0.3, (bodies, 3)), inertia=inertias,
        gravity=5.0 * rng.normal(size=3), kind=kind, rest=rest,
        armature=rng.uniform(0.0, 0.1, nv) * rng.integers(0, 2, nv),
        stiffness=rng.uniform(0.0, 3.0, n) * rng.integers(0, 2, n),
        reference=[0.0 if name == "ball" else rng.uniform(-0.5, 0.5) for name in kind],
    )  # fmt: skip


def random_tree(rng, bodies=4, damping=0.0) -> Tree:
    """Hinges alone, without armature, springs and references."""
    tree = tree_of_kinds(rng, bodies, ("hinge",), most=3)
    n = len(tree.axis)
    plain = dict.fromkeys(("armature", "stiffness", "rest", "reference"), (0.0,) * n)
    return replace(tree, damping=rng.uniform(0.0, 1.0, n) * damping, **plain)


def small_tree() -> Tree:
    """A hinge and a ball on a slide, with springs, damping and a controller."""
    rng = np.random.default_rng(48)
    tree = tree_of_kinds(rng, bodies=3, kinds=("hinge", "slide", "ball"))
    flat = [joint.kind != "ball" for joint in tree.coordinates.joints for _ in tree.axis[joint.qd]]
    gains = (np.eye(len(flat)) + 0.2 * rng.normal(size=(2, len(flat), len(flat)))) * np.outer(flat, flat)
    return replace(tree, stiffness=(1.0, 2.0, 3.0), position_gain=gains[0], speed_gain=gains[1])


def one_body(axis, kind=(), com=(0.0, 0.0, 0.0), inertia=UNIT, **more) -> Tree:
    """A body of 1 kg on joints in a row through one point, hinges by default; `more`: other fields of a Tree."""
    n = len(kind or axis)
    fields = {
        "joint_names": tuple("abcdefgh"[:n]), "parent": range(-1, n - 1), "offset": np.zeros((n, 3)),
        "damping": np.zeros(len(axis)), "body_names": ["body"], "body_joint": [n - 1], "mass": [1.0],
        "gravity": (0.0, 0.0, -9.81),
    }  # fmt: skip
    return Tree(axis=axis, kind=kind or ["hinge"] * n, com=[com], inertia=[inertia], **fields | more)


def wrist() -> Tree:
    """Three hinges through one point, z y z: Mbar is singular where the second is at zero."""
    inertia = np.diag([0.01, 0.02, 0.025])
    return one_body(UNIT[[2, 1, 2]], (), (0.1, 0.0, 0.2), inertia, body_names=["hand"])


def random_state(rng, tree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A random q (nq,), and qd and tau (nv,)."""
    q, most = [], {"hinge": 3.0, "slide": 1.0}
    for kind in tree.kind:
        q += list(random_turn(rng)) if kind == "ball" else [rng.uniform(-most[kind], most[kind])]
    return np.array(q), *rng.uniform(-3.0, 3.0, (2, len(tree.axis)))


def random_states(rng, tree, count) -> list[np.ndarray]:
    """Rows of q (count, nq), qd and tau (count, nv)."""
    return [np.array(rows) for rows in zip(*(random_state(rng, tree) for _ in range(count)))]
