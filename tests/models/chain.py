"""A chain of any number of hinges as MJCF text, made from a seed: what the growth of costs with the joints is measured on."""

import xml.etree.ElementTree as ET

import numpy as np


def chain(n: int, seed: int = 0) -> str:
    """MJCF of n bodies one on another, each on one hinge, "joint1" to "joint<n>", whose axis is no coordinate axis.

    Nothing but masses, hinges and gravity: no armature, damping, spring, limit or actuator. Its first joints are those of a
    shorter chain of the same seed.
    """
    rng = np.random.default_rng(seed)
    root, body = empty_model(f"chain {n}, seed {seed}")
    for number in range(1, n + 1):
        body = turned_body(body, f"body{number}", rng, pos=[*rng.uniform(-0.1, 0.1, 2), 0.2 if number > 1 else 0.0])
        add_element(body, "joint", name=f"joint{number}", axis=oblique_axis(rng))
    return mjcf_of(root)


def empty_model(name: str) -> tuple[ET.Element, ET.Element]:
    """An empty model, and its world."""
    root = ET.Element("mujoco", model=name)
    add_element(root, "compiler", angle="radian")
    add_element(root, "option", timestep=0.002, gravity=[0, 0, -9.81])
    return root, add_element(root, "worldbody")


def turned_body(parent: ET.Element, name: str, rng: np.random.Generator, pos=None) -> ET.Element:
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


def oblique_axis(rng: np.random.Generator) -> np.ndarray:
    """A direction at an angle to every coordinate axis, not of length 1."""
    return rng.choice([-1, 1], 3) * rng.uniform(0.3, 1, 3)


def random_turn(rng: np.random.Generator) -> np.ndarray:
    """The quaternion of a turn of any size."""
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
    """The MJCF of a model."""
    ET.indent(root)
    return ET.tostring(root, encoding="unicode") + "\n"
