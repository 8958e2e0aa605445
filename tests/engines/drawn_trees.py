"""Trees and states that hypothesis draws: for tmt/test_properties.py."""

from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from trees import possible_tensor, random_bodies, random_state, unit_quaternion

import tmt


class Drawn(NamedTuple):
    """A Tree, a state of it, and numbers for whatever else a test needs."""

    tree: tmt.Tree
    q: np.ndarray
    qd: np.ndarray
    tau: np.ndarray
    rng: np.random.Generator


@st.composite
def drawn_trees(draw, most=4) -> Drawn:
    """Up to `most` hinges, slides and balls with any parents, each with a body of its own: Mbar is never singular."""
    kinds = draw(st.lists(st.sampled_from(["hinge", "slide", "ball"]), min_size=1, max_size=most))
    parent = [draw(st.sampled_from([-1, *range(i)])) for i in range(len(kinds))]
    has_springs, has_armature, has_damping, has_references = draw(st.tuples(*[st.booleans()] * 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))  # hypothesis alone would draw mostly zeros
    axis, rest, reference = [], [], []
    for kind in kinds:
        if kind == "ball":
            turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            axis += list(turned * np.linalg.det(turned))
            rest += list(unit_quaternion(rng))
            reference.append(0.0)
        else:
            axis.append(rng.normal(size=3))
            rest.append(rng.uniform(-0.5, 0.5))
            reference.append(rng.uniform(-0.5, 0.5) * has_references)
    n, speeds = len(kinds), len(axis)
    tree = tmt.Tree(
        hinge_names=[f"{kind}{i}" for i, kind in enumerate(kinds)],
        parent=parent,
        offset=rng.uniform(-0.4, 0.4, (n, 3)),
        axis=axis,
        damping=rng.uniform(0.0, 0.5, speeds) * has_damping,
        **random_bodies(rng, range(n), [possible_tensor(rng) for _ in range(n)]),
        kind=kinds,
        armature=rng.uniform(0.0, 0.1, speeds) * has_armature,
        stiffness=rng.uniform(0.5, 3.0, n) * has_springs,
        rest=rest,
        reference=reference,
    )
    return Drawn(tree, *random_state(rng, tree), rng)
