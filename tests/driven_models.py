"""MJCF of random robots with actuators of every law and transmission, tendons, gravity compensation and ranges."""

import xml.etree.ElementTree as ET

import numpy as np
from models import random_tree

TRANSMISSIONS = ("joint", "jointinparent", "ball", "tendon", "spatial", "site", "refsite", "slidercrank")
LAWS = (
    "motor",
    "position",
    "velocity",
    "damper",
    "general",
    "affine",
    "intvelocity",
    "cylinder",
    "filter",
    "filterexact",
)
SWITCHED_OFF = 2  # the group of actuators that the files disable


def numbers(values) -> str:
    return " ".join(map(repr, np.atleast_1d(np.asarray(values, float)).tolist()))


def law(rng, kind: str) -> tuple[str, dict]:
    """The tag and the attributes of an actuator of a law."""

    def some(low, high, size=None):
        return numbers(rng.uniform(low, high, size))

    affine = {
        "gaintype": "affine",
        "gainprm": numbers([rng.uniform(1, 5), *rng.uniform(-3, 3, 2)]),
        "biastype": "affine",
        "biasprm": numbers([rng.uniform(-1, 1), rng.uniform(-9, 1), rng.uniform(-1, 1)]),
    }
    if kind in ("affine", "filter", "filterexact"):
        own = {} if kind == "affine" else {"dyntype": kind, "dynprm": some(0.01, 0.1)}
        return "general", affine | own
    if kind == "general":
        return kind, {"gainprm": some(1, 5), "biastype": "affine", "biasprm": affine["biasprm"]}
    return kind, {
        "motor": {},
        "position": {"kp": some(5, 50), "kv": some(0, 5)},
        "velocity": {"kv": some(0, 5)},
        "damper": {"kv": some(0, 5), "ctrlrange": "0 2"},
        "intvelocity": {"kp": some(5, 50), "kv": some(0, 2), "actrange": "-3 3"},
        "cylinder": {"area": some(0.5, 2), "timeconst": some(0.1, 1), "bias": some(-1, 1, 3)},
    }[kind]


def with_drive(seed: int, transmissions=TRANSMISSIONS, joints: int = 6, flags: dict | None = None) -> str:
    """A random robot with an actuator of every law, each at a random place of one of the transmissions.

    Some have ranges of controls and forces, some are in a group that is disabled; some joints have ranges of the sum of their
    actuators and gravity compensation by them; some bodies are lighter than they are, or fall upwards.
    """
    rng = np.random.default_rng(seed)
    root = ET.fromstring(random_tree(seed, joints=joints))
    option = root.find("option")
    option.set("actuatorgroupdisable", str(SWITCHED_OFF))
    ET.SubElement(option, "flag", {"contact": "disable", "constraint": "disable"} | (flags or {}))
    sites = []
    for body in root.iter("body"):
        sites.append(f"site of {body.get('name')}")
        body.insert(0, ET.Element("site", name=sites[-1], pos=numbers(rng.uniform(-0.3, 0.3, 3)),
                                  euler=numbers(rng.uniform(-1, 1, 3))))  # fmt: skip
        if rng.random() < 0.5:
            body.set("gravcomp", str(rng.choice([0.3, 1.0, 1.7])))
    every = [*root.iter("joint"), *root.iter("freejoint")]
    single = [one for one in every if one.get("type", "hinge") in ("hinge", "slide") and one.tag == "joint"]
    turning = [one.get("name") for one in every if one not in single]
    for joint in single:
        if rng.random() < 0.3:
            joint.set("actuatorfrcrange", numbers([-rng.uniform(0, 3), rng.uniform(0, 3)]))
            joint.set("actuatorgravcomp", str(rng.random() < 0.5).lower())
    names = [joint.get("name") for joint in single]
    tendons = ET.SubElement(root, "tendon")
    for name in ("across", "along"):
        fixed = ET.SubElement(tendons, "fixed", name=name, **spring(rng))
        for joint in rng.choice(names, min(3, len(names)), replace=False):
            ET.SubElement(fixed, "joint", joint=str(joint), coef=numbers(rng.normal()))
    for name in ("rope", "wire"):
        spatial = ET.SubElement(tendons, "spatial", name=name, **spring(rng))
        for site in rng.choice(sites, 2, replace=False):
            ET.SubElement(spatial, "site", site=str(site))
    actuators = ET.SubElement(root, "actuator")
    for kind in LAWS:
        tag, given = law(rng, kind)
        where = str(rng.choice(transmissions))
        gear, two = rng.uniform(-2, 2), list(map(str, rng.choice(sites, 2, replace=False)))
        place = {
            "joint": {"joint": str(rng.choice(names))},
            "jointinparent": {"jointinparent": str(rng.choice(names))},
            "ball": {str(rng.choice(["joint", "jointinparent"])): str(rng.choice(turning))} if turning else {},
            "tendon": {"tendon": str(rng.choice(["across", "along"]))},
            "spatial": {"tendon": str(rng.choice(["rope", "wire"]))},
            "site": {"site": two[0]},
            "refsite": {"site": two[0], "refsite": two[1]},
            "slidercrank": {"cranksite": two[0], "slidersite": two[1], "cranklength": "2.5"},
        }[where]
        if not place:
            continue
        if where in ("ball", "site", "refsite"):
            gear = rng.uniform(-2, 2, 6)
        if kind != "damper" and rng.random() < 0.3:
            given |= {"ctrllimited": "true", "ctrlrange": numbers([-rng.uniform(0, 1), rng.uniform(0, 1)])}
        if rng.random() < 0.3:
            given |= {"forcelimited": "true", "forcerange": numbers([-rng.uniform(0, 6), rng.uniform(0, 6)])}
        if rng.random() < 0.2:
            given |= {"group": str(SWITCHED_OFF - 1 + rng.integers(2))}
        ET.SubElement(actuators, tag, name=kind, gear=numbers(gear), **place, **given)
    return ET.tostring(root, encoding="unicode")


def spring(rng) -> dict:
    """A spring with a dead band and a damper, or neither."""
    if rng.random() < 0.4:
        return {}
    low = rng.uniform(0.0, 0.5)
    return {
        "stiffness": numbers(rng.uniform(0, 20)),
        "damping": numbers(rng.uniform(0, 3)),
        "springlength": numbers([low, low + rng.uniform(0, 0.5)]),
    }


def with_servos(seed: int, floats: bool = False, joints: int = 5, flags: dict | None = None) -> str:
    """A random robot whose joints are all held by position servos, soft and stiff, with kv none to far too large.

    Beside them a fixed and a spatial tendon with springs, dampers and servos, a motor, a velocity servo and a filter.
    """
    rng = np.random.default_rng(seed)
    kinds = ("hinge", "slide", "ball", "free") if floats else ("hinge", "slide", "ball")
    root = ET.fromstring(random_tree(seed, kinds, joints))
    ET.SubElement(root.find("option"), "flag", {"contact": "disable", "constraint": "disable"} | (flags or {}))
    sites, names = [], []
    for body in root.iter("body"):
        sites.append(f"site of {body.get('name')}")
        body.insert(0, ET.Element("site", name=sites[-1], pos=numbers(rng.uniform(-0.3, 0.3, 3))))
        if rng.random() < 0.4:
            body.set("gravcomp", str(rng.choice([0.3, 1.0, 1.7])))
    actuators = ET.Element("actuator")
    for joint in root.iter("joint"):
        kind, kp = joint.get("type", "hinge"), 10.0 ** rng.uniform(1.5, 3.5)
        if kind == "free":
            continue
        servo = {
            "joint": joint.get("name"),
            "kp": numbers(kp),
            "kv": numbers(kp / 100 * rng.choice([0, 0.5, 5, 50, 500])),
        }
        if kind == "ball":
            for gear in ("1 0 0", "0 1 0", "0 0 1"):
                ET.SubElement(actuators, "position", gear=gear, **servo)
        else:
            names.append(joint.get("name"))
            ET.SubElement(actuators, "position", gear=str(rng.choice([1, 1, 3, -2])), **servo)
    tendons = ET.SubElement(root, "tendon")
    fixed = ET.SubElement(tendons, "fixed", name="across", stiffness="30", damping="3", springlength="0.1")
    for joint in rng.choice(names, 2, replace=False):
        ET.SubElement(fixed, "joint", joint=str(joint), coef=numbers(rng.normal()))
    spatial = ET.SubElement(tendons, "spatial", name="rope", stiffness="30", damping="1", springlength="0.1")
    for site in rng.choice(sites, 2, replace=False):
        ET.SubElement(spatial, "site", site=str(site))
    ET.SubElement(actuators, "position", tendon="across", kp=numbers(10 ** rng.uniform(1, 3)),
                  kv=str(rng.choice([0, 5, 50])), gear="2")  # fmt: skip
    ET.SubElement(actuators, "position", tendon="rope", kp="30", kv="1")
    ET.SubElement(actuators, "motor", joint=names[0])
    ET.SubElement(actuators, "velocity", joint=names[-1], kv=str(rng.choice([0.5, 5, 50])))
    ET.SubElement(actuators, "general", joint=names[0], dyntype="filter", dynprm="6",
                  gainprm="3 -2 -1", gaintype="affine", biastype="affine", biasprm="0 -3 -.2")  # fmt: skip
    root.append(actuators)
    return ET.tostring(root, encoding="unicode")
