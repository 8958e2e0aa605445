"""MJCF texts made from a seed: trees with every kind of joint."""

import numpy as np

from .chain import add_element, empty_model, mjcf_of, oblique_axis, turned_body

KINDS = ("hinge", "slide", "ball", "free")

# two joints in one body, in this order, that no posture makes singular
PAIRS = {("hinge", "hinge"), ("slide", "hinge"), ("hinge", "slide"), ("slide", "slide"), ("slide", "ball")}


def random_tree(seed: int, kinds=KINDS, joints: int = 8) -> str:
    """MJCF of a branched tree of so many joints, of each of the kinds at least one (a free joint counts as one).

    Turned bodies, anchors off the origins, two joints in some bodies, bodies fixed to others, and one to the world.
    Hinges and slides: some with armature, damping, a spring with springref, ref away from zero; balls: with armature,
    damping, stiffness. A free joint stands at the top only, beside further ones if `kinds` has nothing else.
    ValueError: a kind that is not in KINDS, none at all, or fewer joints than kinds.
    """
    if not kinds or not set(kinds) <= set(KINDS) or joints < len(kinds):
        raise ValueError(f"kinds {kinds!r} and {joints} joints: give some of {KINDS}, and at least one joint of each")
    rng = np.random.default_rng(seed)
    further = [kind for kind in kinds if kind != "free"] or list(kinds)
    drawn = [str(kind) for kind in rng.permutation([*kinds, *rng.choice(further, joints - len(kinds))])]
    # taken from the end; mostly a free joint comes first and carries others
    if rng.random() < 0.7:
        drawn.sort(key="free".__eq__)

    root, world = empty_model(f"random tree, seed {seed}")
    bodies = [turned_body(world, "fixed1", rng)] if rng.random() < 0.5 else []
    number = {"body": 0, "joint": 0, "fixed": len(bodies)}

    def name(what: str) -> str:
        number[what] += 1
        return f"{what}{number[what]}"

    while drawn:
        kind = drawn.pop()
        grown = bodies and kind != "free"
        body = turned_body(bodies[rng.integers(len(bodies))] if grown else world, name("body"), rng)
        first = _joint(body, name("joint"), kind, rng)
        if drawn and (kind, drawn[-1]) in PAIRS and rng.random() < 0.6:
            _joint(body, name("joint"), drawn.pop(), rng, across=first)
        bodies.append(body)
        if rng.random() < 0.25:
            bodies.append(turned_body(body, name("fixed"), rng))
    return mjcf_of(root)


def _joint(body, name: str, kind: str, rng, across=None):
    """A joint in a body, and its axis (none of a ball or free joint); `across`: the axis to be at a right angle to."""
    if kind == "free":
        add_element(body, "freejoint", name=name)
        return None
    axis = None if kind == "ball" else oblique_axis(rng)
    if axis is not None and across is not None:
        axis = np.cross(across, axis)
        axis /= np.linalg.norm(axis)
    values = {"axis": axis} if axis is not None else {}
    if kind != "slide":
        values["pos"] = rng.uniform(-0.1, 0.1, 3)
    if rng.random() < 0.5:
        values["armature"] = rng.uniform(0.005, 0.05)
    if rng.random() < 0.5:
        values["damping"] = rng.uniform(0.05, 0.5)
    if rng.random() < 0.5:
        values["stiffness"] = rng.uniform(1, 20)
        if kind != "ball":
            values["springref"] = rng.uniform(-0.5, 0.5)
    if kind != "ball" and rng.random() < 0.5:
        values["ref"] = rng.uniform(-0.8, 0.8)
    add_element(body, "joint", name=name, type=kind, **values)
    return axis
