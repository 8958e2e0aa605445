"""Trees and states that hypothesis draws, and the same as MJCF: for tmt/test_properties.py and engines/test_mujoco_trees.py."""

from typing import NamedTuple

import numpy as np
from hypothesis import strategies as st
from trees import possible_tensor, random_state, unit_quaternion

import tmt


class Drawn(NamedTuple):
    """A Tree, a state of it, and numbers for whatever else a test needs."""

    tree: tmt.Tree
    q: np.ndarray
    qd: np.ndarray
    tau: np.ndarray
    rng: np.random.Generator


@st.composite
def drawn_trees(draw, most=4, as_mjcf=False) -> Drawn:
    """Up to `most` hinges, slides and balls with any parents, each with a body of its own: Mbar is never singular.

    as_mjcf: joints in MuJoCo's order, depth first, and what its ball joints cannot have is left out: axes of their own, a rest
    that is turned, damping and armature that are not the same about the three axes.
    """
    kinds = draw(st.lists(st.sampled_from(["hinge", "slide", "ball"]), min_size=1, max_size=most))
    parent = []
    for i in range(len(kinds)):
        others = [-1, *(ancestors(parent, i - 1) if as_mjcf else range(i))]
        parent.append(draw(st.sampled_from(others)))
    has_springs, has_armature, has_damping, has_references = draw(st.tuples(*[st.booleans()] * 4))
    rng = np.random.default_rng(draw(st.integers(0, 2**32 - 1)))  # hypothesis alone would draw mostly zeros

    def of_speeds(most):
        """A number for each speed."""
        if as_mjcf:
            return np.repeat(rng.uniform(0.0, most, len(kinds)), [3 if kind == "ball" else 1 for kind in kinds])
        return rng.uniform(0.0, most, sum(3 if kind == "ball" else 1 for kind in kinds))

    axis, rest, reference = [], [], []
    for kind in kinds:
        if kind == "ball":
            turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
            axis += list(np.eye(3) if as_mjcf else turned * np.linalg.det(turned))
            rest += [1.0, 0.0, 0.0, 0.0] if as_mjcf else list(unit_quaternion(rng))
            reference.append(0.0)
        else:
            axis.append(rng.normal(size=3))
            rest.append(rng.uniform(-0.5, 0.5))
            reference.append(rng.uniform(-0.5, 0.5) * has_references)
    n = len(kinds)
    tree = tmt.Tree(
        hinge_names=[f"{kind}{i}" for i, kind in enumerate(kinds)],
        parent=parent,
        offset=rng.uniform(-0.4, 0.4, (n, 3)),
        axis=axis,
        damping=of_speeds(0.5) * has_damping,
        body_names=[f"body{i}" for i in range(n)],
        body_hinge=range(n),
        mass=rng.uniform(0.5, 2.0, n),
        com=rng.uniform(-0.3, 0.3, (n, 3)),
        inertia=[possible_tensor(rng) for _ in range(n)],
        gravity=5.0 * rng.normal(size=3),
        kind=kinds,
        armature=of_speeds(0.1) * has_armature,
        stiffness=rng.uniform(0.5, 3.0, n) * has_springs,
        rest=rest,
        reference=reference,
    )
    return Drawn(tree, *random_state(rng, tree), rng)


def ancestors(parent, i) -> list[int]:
    """The joint i, its parent, and so on."""
    return [] if i < 0 else [i, *ancestors(parent, parent[i])]


def numbers(values) -> str:
    return " ".join(repr(float(v)) for v in np.ravel(values))


def mjcf_of(tree) -> str:
    """A Tree that was drawn as_mjcf."""

    def body(i):
        by, at = tree.coordinates.joints[i].qd, tree.coordinates.joints[i].q
        given = (
            f'damping="{tree.damping[by.start]}" armature="{tree.armature[by.start]}" stiffness="{tree.stiffness[i]}"'
        )
        if tree.kind[i] != "ball":
            given += (
                f' axis="{numbers(tree.axis[by.start])}" ref="{tree.reference[i]}" springref="{tree.rest[at.start]}"'
            )
        # principal moments and axes: MuJoCo turns a fullinertia only to about 1e-8
        moments, axes = np.linalg.eigh(np.array(tree.inertia[i]))
        axes[:, 0] *= np.linalg.det(axes)
        inside = "".join(body(k) for k, parent in enumerate(tree.parent) if parent == i)
        return f"""<body name="{tree.body_names[i]}" pos="{numbers(tree.offset[i])}">
            <joint name="{tree.hinge_names[i]}" type="{tree.kind[i]}" {given}/>
            <inertial pos="{numbers(tree.com[i])}" mass="{tree.mass[i]}" xyaxes="{numbers(axes[:, :2].T)}"
             diaginertia="{numbers(moments)}"/>{inside}</body>"""

    bodies = "".join(body(i) for i, parent in enumerate(tree.parent) if parent == -1)
    return f"""<mujoco><compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
        <option gravity="{numbers(tree.gravity)}"/><worldbody>{bodies}</worldbody></mujoco>"""
