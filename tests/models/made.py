"""MJCF texts made from a seed: chains of hinges, and trees with every kind of joint. Users: whoever imports `models`."""

import xml.etree.ElementTree as ET

import numpy as np

KINDS = ("hinge", "slide", "ball", "free")
RANGES = {"armature": (0.005, 0.05), "damping": (0.05, 0.5), "stiffness": (1, 20), "ref": (-0.8, 0.8)}
# two joints in one body, in this order, that no posture makes singular
PAIRS = {("hinge", "hinge"), ("slide", "hinge"), ("hinge", "slide"), ("slide", "slide"), ("slide", "ball")}


def chain(n: int, seed: int = 0) -> str:
    """n bodies one on another, each on one hinge, "joint1" to "joint<n>", with nothing but masses, hinges and gravity.

    No axis is a coordinate axis. Its first joints are those of a shorter chain of the same seed.
    """
    rng = np.random.default_rng(seed)
    root, body = empty_model(f"chain {n}, seed {seed}")
    for number in range(1, n + 1):
        place = [*rng.uniform(-0.1, 0.1, 2), 0.2 if number > 1 else 0.0]
        body = turned_body(body, f"body{number}", rng, place)
        add_element(body, "joint", name=f"joint{number}", axis=oblique_axis(rng))
    return mjcf_of(root)


def random_tree(seed: int, kinds=KINDS, joints: int = 8) -> str:
    """A branched tree of so many joints, of each of the kinds at least one (a free joint counts as one).

    Turned bodies, anchors off the origins, two joints in some bodies, bodies fixed to others, and one to the world.
    Hinges and slides: some with armature, damping, a spring with springref, ref away from zero; balls: with armature,
    damping, stiffness. A free joint stands at the top only, beside further ones if `kinds` has nothing else.
    """
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
        first = add_joint(body, name("joint"), kind, rng)
        if drawn and (kind, drawn[-1]) in PAIRS and rng.random() < 0.6:
            add_joint(body, name("joint"), drawn.pop(), rng, across=first)
        bodies.append(body)
        if rng.random() < 0.25:
            bodies.append(turned_body(body, name("fixed"), rng))
    return mjcf_of(root)


def with_features(text: str, seed: int) -> str:
    """A text of random_tree with contacts, limits, friction, actuators, ties, springs of tendons, frames and options too."""
    rng, root = np.random.default_rng(seed), ET.fromstring(text)
    add_element(root, "compiler", angle="radian", eulerseq=rng.choice(["XYZ", "zyx"]), autolimits="true")
    option = add_element(root, "option", gravity=rng.uniform(-9, 9, 3), density=rng.choice([0, 1000]))
    option.set("integrator", rng.choice(["Euler", "RK4", "implicitfast"]))
    add_element(option, "flag", **{rng.choice(["limit", "contact", "warmstart"]): "disable"})
    for body in [*root.iter("body")]:
        body.set("gravcomp", str(rng.choice([0, 0.5])))
        add_element(body, "geom", type="box", size=rng.uniform(0.05, 0.2, 3), euler=rng.uniform(-3, 3, 3))
        for child in [child for child in body if child.tag == "body" and rng.random() < 0.3]:
            frame = add_element(body, "frame", pos=rng.uniform(-0.3, 0.3, 3), euler=rng.uniform(-3, 3, 3))
            body.remove(child)
            frame.append(child)
    actuators, ties, tendons = (ET.SubElement(root, tag) for tag in ("actuator", "equality", "tendon"))
    for joint in [joint for joint in root.iter("joint") if joint.get("type") != "ball"]:
        joint.set("range", "-0.5 0.7")
        joint.set("frictionloss", str(rng.choice([0, 0.1])))
        kinds = {"motor": {}, "position": {"kp": 9, "kv": 2}, "general": {"armature": 0.1, "gear": 3}}
        kind = str(rng.choice([*kinds]))
        add_element(actuators, kind, joint=joint.get("name"), **kinds[kind])
        add_element(ties, "joint", joint1=joint.get("name"))
        fixed = add_element(tendons, "fixed", stiffness=3, damping=0.5)
        add_element(fixed, "joint", joint=joint.get("name"), coef=2)
    return mjcf_of(root)


def add_joint(body, name: str, kind: str, rng, across=None):
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
    for what, ends in RANGES.items():
        if (what != "ref" or kind != "ball") and rng.random() < 0.5:
            values[what] = rng.uniform(*ends)
            if what == "stiffness" and kind != "ball":
                values["springref"] = rng.uniform(-0.5, 0.5)
    add_element(body, "joint", name=name, type=kind, **values)
    return axis


def empty_model(name: str) -> tuple[ET.Element, ET.Element]:
    """An empty model, and its world."""
    root = ET.Element("mujoco", model=name)
    add_element(root, "compiler", angle="radian")
    add_element(root, "option", timestep=0.002, gravity=[0, 0, -9.81])
    return root, add_element(root, "worldbody")


def turned_body(parent: ET.Element, name: str, rng, pos=None) -> ET.Element:
    """A turned body with a mass; its inertia is a full tensor, or a diagonal one in a turned frame."""
    place = rng.uniform(-0.3, 0.3, 3) if pos is None else pos
    body = add_element(parent, "body", name=name, pos=place, quat=random_turn(rng))
    mass = rng.uniform(0.5, 2.0)
    # from three second moments, so that some body can have the tensor
    second = mass * rng.uniform(0.002, 0.01, 3)
    moments = second.sum() - second
    inertial = {"pos": rng.uniform(-0.15, 0.15, 3), "mass": mass}
    if rng.random() < 0.5:
        axes = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        full = axes @ np.diag(moments) @ axes.T
        add_element(body, "inertial", **inertial, fullinertia=full[[0, 1, 2, 0, 0, 1], [0, 1, 2, 1, 2, 2]])
    else:
        add_element(body, "inertial", **inertial, diaginertia=moments, quat=random_turn(rng))
    return body


def oblique_axis(rng) -> np.ndarray:
    """A direction at an angle to every coordinate axis, not of length 1."""
    return rng.choice([-1, 1], 3) * rng.uniform(0.3, 1, 3)


def random_turn(rng) -> np.ndarray:
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


def add_element(parent: ET.Element, tag: str, **values) -> ET.Element:
    """An element in another; numbers are written with four decimals."""
    texts = {}
    for key, value in values.items():
        numbers = [value] if isinstance(value, str) else np.atleast_1d(value)
        texts[key] = " ".join(x if isinstance(x, str) else f"{round(float(x), 4) + 0.0:g}" for x in numbers)
    return ET.SubElement(parent, tag, texts)


def mjcf_of(root: ET.Element) -> str:
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
