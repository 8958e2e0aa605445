"""MJCF texts made from a seed: a chain of hinges with tilted axes, and trees with every kind of joint."""

import xml.etree.ElementTree as ET

import numpy as np

KINDS = ("hinge", "slide", "ball", "free")

# two joints in one body, in this order, that no posture makes singular
PAIRS = {("hinge", "hinge"), ("slide", "hinge"), ("hinge", "slide"), ("slide", "slide"), ("slide", "ball")}


def chain(n: int, seed: int = 0) -> str:
    """MJCF of n bodies one on another, each on one hinge, "joint1" to "joint<n>", whose axis is no coordinate axis.

    Nothing but masses, hinges and gravity: no armature, damping, spring, limit or actuator.
    """
    rng = np.random.default_rng(seed)
    root, body = _model(f"chain {n}, seed {seed}")
    for number in range(1, n + 1):
        body = _body(body, f"body{number}", rng, pos=[*rng.uniform(-0.1, 0.1, 2), 0.2 if number > 1 else 0.0])
        _add(body, "joint", name=f"joint{number}", axis=_direction(rng))
    return _text(root)


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

    root, world = _model(f"random tree, seed {seed}")
    bodies = [_body(world, "fixed1", rng)] if rng.random() < 0.5 else []
    number = {"body": 0, "joint": 0, "fixed": len(bodies)}

    def name(what: str) -> str:
        number[what] += 1
        return f"{what}{number[what]}"

    while drawn:
        kind = drawn.pop()
        grown = bodies and kind != "free"
        body = _body(bodies[rng.integers(len(bodies))] if grown else world, name("body"), rng)
        first = _joint(body, name("joint"), kind, rng)
        if drawn and (kind, drawn[-1]) in PAIRS and rng.random() < 0.6:
            _joint(body, name("joint"), drawn.pop(), rng, across=first)
        bodies.append(body)
        if rng.random() < 0.25:
            bodies.append(_body(body, name("fixed"), rng))
    return _text(root)


def _model(name: str) -> tuple[ET.Element, ET.Element]:
    """An empty model, and its world."""
    root = ET.Element("mujoco", model=name)
    _add(root, "compiler", angle="radian")
    _add(root, "option", timestep=0.002, gravity=[0, 0, -9.81])
    return root, _add(root, "worldbody")


def _body(parent, name: str, rng, pos=None):
    """A turned body with a mass; its inertia is a full tensor, or a diagonal one in a turned frame."""
    body = _add(parent, "body", name=name, pos=rng.uniform(-0.3, 0.3, 3) if pos is None else pos, quat=_quaternion(rng))
    mass = rng.uniform(0.5, 2.0)
    # from three second moments, so that some body can have the tensor
    second = mass * rng.uniform(0.002, 0.01, 3)
    moments = second.sum() - second
    inertial = {"pos": rng.uniform(-0.15, 0.15, 3), "mass": mass}
    if rng.random() < 0.5:
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        full = axes @ np.diag(moments) @ axes.T
        _add(body, "inertial", **inertial, fullinertia=full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    else:
        _add(body, "inertial", **inertial, diaginertia=moments, quat=_quaternion(rng))
    return body


def _joint(body, name: str, kind: str, rng, across=None):
    """A joint in a body, and its axis (none of a ball or free joint); `across`: the axis to be at a right angle to."""
    if kind == "free":
        _add(body, "freejoint", name=name)
        return None
    axis = None if kind == "ball" else _direction(rng)
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
    _add(body, "joint", name=name, type=kind, **values)
    return axis


def _direction(rng) -> np.ndarray:
    """A direction at an angle to every coordinate axis."""
    return rng.choice([-1, 1], 3) * rng.uniform(0.3, 1, 3)


def _quaternion(rng) -> np.ndarray:
    """A turn of any size; MuJoCo normalises it."""
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


def _add(parent, tag: str, **values) -> ET.Element:
    """An element in another; numbers are written with four decimals."""
    texts = {}
    for key, value in values.items():
        numbers = [value] if isinstance(value, str) else np.atleast_1d(value)
        texts[key] = " ".join(x if isinstance(x, str) else f"{round(float(x), 4) + 0.0:g}" for x in numbers)
    return ET.SubElement(parent, tag, texts)


def _text(root) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
