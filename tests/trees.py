"""Random trees and their MJCF, so that the method is tested on more than one arm."""

from dataclasses import replace

import numpy as np

from tmt import Tree


def random_tree(rng, bodies=4, damping=0.0) -> Tree:
    """Bodies with one to three hinges each, branched, off-axis, with products of inertia."""
    parent, offset, axis, body_hinge, inertias = [], [], [], [], []
    for b in range(bodies):
        before = -1 if b == 0 else int(rng.choice([-1, *body_hinge]))
        for _ in range(rng.integers(1, 4)):
            parent.append(before)
            before = len(parent) - 1
            offset.append(rng.uniform(-0.4, 0.4, 3))
            axis.append(rng.normal(size=3))
        body_hinge.append(before)
        inertias.append(possible_tensor(rng))
    n = len(parent)
    return Tree(
        hinge_names=[f"hinge{i}" for i in range(n)],
        parent=parent,
        offset=offset,
        axis=axis,
        damping=rng.uniform(0.0, 1.0, n) * damping,
        **random_bodies(rng, body_hinge, inertias),
    )


def tree_of_kinds(rng, bodies=4, along_axes=False, kinds=("hinge", "slide", "ball", "free")) -> Tree:
    """Bodies on joints of all these kinds, branched, off-axis, with armature, springs, damping, references away from zero.

    along_axes: the axes are coordinate axes, which have length 1 exactly in any number of digits. The first body has the first
    joint that is asked for at random, the others one or two; "free" (three slides and a ball) is only the first body's.
    """

    def frame():
        if along_axes:  # in a body not twice the same
            return np.eye(3)[np.roll([0, 1, 2], len(axis))]
        turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
        return turned * np.linalg.det(turned)

    parent, offset, axis, kind, body_hinge, inertias = [], [], [], [], [], []
    for b in range(bodies):
        before = -1 if b == 0 else int(rng.choice([-1, *body_hinge]))
        others = [name for name in kinds if name != "free"]
        chosen = ["free"] if "free" in kinds and b == 0 else list(rng.choice(others, rng.integers(1, 3)))
        chosen = (
            chosen if chosen[1:] != ["ball"] or chosen[0] != "ball" else ["slide", "ball"]
        )  # two in one body are singular
        for name in ["slide", "slide", "slide", "ball"] if chosen == ["free"] else chosen:
            parent.append(before)
            before = len(parent) - 1
            offset.append(rng.uniform(-0.4, 0.4, 3) * (chosen != ["free"]))
            kind.append(str(name))
            axis += list(frame() if name == "ball" else frame()[:1])
            if chosen == ["free"] and name == "slide":
                axis[-1] = np.eye(3)[len(axis) - 1]
        body_hinge.append(before)
        inertias.append(possible_tensor(rng))
    n, nv = len(parent), len(axis)
    rest = [x for name in kind for x in (unit_quaternion(rng) if name == "ball" else [rng.uniform(-0.5, 0.5)])]
    return Tree(
        hinge_names=[f"{name}{i}" for i, name in enumerate(kind)],
        parent=parent,
        offset=offset,
        axis=axis,
        damping=rng.uniform(0.0, 0.5, nv),
        **random_bodies(rng, body_hinge, inertias),
        kind=kind,
        armature=rng.uniform(0.0, 0.1, nv) * rng.integers(0, 2, nv),
        stiffness=rng.uniform(0.0, 3.0, n) * rng.integers(0, 2, n),
        rest=rest,
        reference=[0.0 if name == "ball" else rng.uniform(-0.5, 0.5) for name in kind],
    )


def small_tree() -> Tree:
    """A hinge and a ball on a slide, with springs, damping and a controller."""
    rng = np.random.default_rng(48)
    tree = tree_of_kinds(rng, bodies=3, kinds=("hinge", "slide", "ball"))
    flat = [kind != "ball" for kind, _, by in tree.coordinates.joints for _ in range(by.start, by.stop)]
    gains = (np.eye(len(flat)) + 0.2 * rng.normal(size=(2, len(flat), len(flat)))) * np.outer(flat, flat)
    return replace(tree, stiffness=(1.0, 2.0, 3.0), position_gain=gains[0], speed_gain=gains[1])


def large_tree() -> Tree:
    """20 speeds, with every kind of joint, on a free body without springs."""
    tree = tree_of_kinds(np.random.default_rng(16), bodies=6)
    return replace(tree, stiffness=[0.0] * 4 + list(tree.stiffness[4:]))


def wrist() -> Tree:
    """Three hinges through one point, z y z: Mbar is singular where the second is at zero."""
    return Tree(
        hinge_names=("a", "b", "c"), parent=(-1, 0, 1), offset=np.zeros((3, 3)), axis=((0, 0, 1), (0, 1, 0), (0, 0, 1)),
        damping=(0.0,) * 3, body_names=["hand"], body_hinge=[2], mass=[1.0], com=[(0.1, 0.0, 0.2)],
        inertia=[np.diag([0.01, 0.02, 0.025])], gravity=(0, 0, -9.81),
    )  # fmt: skip


def possible_tensor(rng) -> np.ndarray:
    """A tensor that a body can have: that of six point masses."""
    return sum(np.dot(r, r) * np.eye(3) - np.outer(r, r) for r in rng.uniform(-0.1, 0.1, (6, 3)))


def random_bodies(rng, body_hinge, inertias) -> dict:
    """What a Tree says of bodies on these joints, and gravity."""
    count = len(body_hinge)
    return {
        "body_names": [f"body{b}" for b in range(count)],
        "body_hinge": body_hinge,
        "mass": rng.uniform(0.5, 2.0, count),
        "com": rng.uniform(-0.3, 0.3, (count, 3)),
        "inertia": inertias,
        "gravity": rng.normal(size=3) * 5.0,
    }


def unit_quaternion(rng) -> np.ndarray:
    """A random turn, w first."""
    p = rng.normal(size=4)
    return p / np.linalg.norm(p)


def random_state(rng, tree) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A random q (nq,), and qd and tau (nv,)."""
    q = [
        x
        for name in tree.kind
        for x in (
            unit_quaternion(rng)
            if name == "ball"
            else [rng.uniform(-3.0, 3.0) if name == "hinge" else rng.uniform(-1, 1)]
        )
    ]
    return np.array(q), *rng.uniform(-3.0, 3.0, (2, len(tree.axis)))


def random_states(rng, tree, count) -> list[np.ndarray]:
    """Rows of q (count, nq), qd and tau (count, nv)."""
    return [np.array(rows) for rows in zip(*(random_state(rng, tree) for _ in range(count)))]


def mjcf(tree) -> str:
    """The same tree as MJCF text: one body for each body, its hinges in it."""

    def numbers(values):
        return " ".join(repr(float(v)) for v in values)

    def body(b):
        chain = [tree.body_hinge[b]]
        while tree.parent[chain[0]] >= 0 and tree.parent[chain[0]] not in tree.body_hinge:
            chain.insert(0, tree.parent[chain[0]])
        first = chain[0]
        base = at_end.get(tree.parent[first], np.zeros(3))
        where = np.zeros(3)
        lines = [f'<body pos="{numbers(base + tree.offset[first])}">']
        for i in chain:
            where = where + (tree.offset[i] if i != first else np.zeros(3))
            lines.append(
                f'<joint name="{tree.hinge_names[i]}" type="hinge" pos="{numbers(where)}" '
                f'axis="{numbers(tree.axis[i])}" damping="{tree.damping[i]!r}"/>'
            )
        at_end[chain[-1]] = where
        # principal moments and axes: MuJoCo 3.10 turns a fullinertia only to about 1e-8
        moments, axes = np.linalg.eigh(tree.inertia[b])
        axes[:, 0] *= np.linalg.det(axes)
        com = numbers(where + tree.com[b])
        lines.append(
            f'<inertial pos="{com}" mass="{tree.mass[b]!r}" '
            f'xyaxes="{numbers(axes[:, :2].T.ravel())}" diaginertia="{numbers(moments)}"/>'
        )
        for child in range(len(tree.body_hinge)):
            start = child_root(child)
            if tree.parent[start] == tree.body_hinge[b]:
                lines += body(child)
        return [*lines, "</body>"]

    def child_root(b):
        hinge = tree.body_hinge[b]
        while tree.parent[hinge] >= 0 and tree.parent[hinge] not in tree.body_hinge:
            hinge = tree.parent[hinge]
        return hinge

    at_end = {}
    roots = [b for b in range(len(tree.body_hinge)) if tree.parent[child_root(b)] == -1]
    inside = "\n".join(line for b in roots for line in body(b))
    return f"""<mujoco>
      <compiler angle="radian" inertiafromgeom="false" balanceinertia="false"/>
      <option gravity="{numbers(tree.gravity)}"><flag contact="disable" constraint="disable"/></option>
      <worldbody>{inside}</worldbody>
    </mujoco>"""
