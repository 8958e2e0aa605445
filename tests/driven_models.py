"""MJCF of random robots with actuators of every law, or on servos: for truth/test_servos.py and truth/test_driven.py."""

import xml.etree.ElementTree as ET

import numpy as np
from models import random_tree

TRANSMISSIONS = ("joint", "jointinparent", "ball", "tendon", "spatial", "site", "refsite", "slidercrank")
SWITCHED_OFF = 2  # the group of actuators that the files disable


def numbers(values) -> str:
    return " ".join(map(repr, np.atleast_1d(np.asarray(values, float)).tolist()))


def laws(rng) -> dict[str, tuple[str, dict]]:
    """The tag and the attributes of an actuator of each law, by its name."""

    def some(low, high, size=None):
        return numbers(rng.uniform(low, high, size))

    terms = [rng.uniform(-1, 1), rng.uniform(-9, 1), rng.uniform(-1, 1)]
    bias = {"biastype": "affine", "biasprm": numbers(terms)}
    affine = {"gaintype": "affine", "gainprm": numbers([rng.uniform(1, 5), *rng.uniform(-3, 3, 2)])} | bias
    return {
        "motor": ("motor", {}), "position": ("position", {"kp": some(5, 50), "kv": some(0, 5)}),
        "velocity": ("velocity", {"kv": some(0, 5)}), "damper": ("damper", {"kv": some(0, 5), "ctrlrange": "0 2"}),
        "general": ("general", {"gainprm": some(1, 5)} | bias), "affine": ("general", affine),
        "intvelocity": ("intvelocity", {"kp": some(5, 50), "kv": some(0, 2), "actrange": "-3 3"}),
        "cylinder": ("cylinder", {"area": some(0.5, 2), "timeconst": some(0.1, 1), "bias": some(-1, 1, 3)}),
        "filter": ("general", affine | {"dyntype": "filter", "dynprm": some(0.01, 0.1)}),
        "filterexact": ("general", affine | {"dyntype": "filterexact", "dynprm": some(0.01, 0.1)}),
    }  # fmt: skip


def robot(rng, text: str, flags: dict | None) -> tuple[ET.Element, list[str]]:
    """A random tree without contacts, some bodies lighter than they are or falling upwards; and a site in each body."""
    root, sites = ET.fromstring(text), []
    stages_off = {"contact": "disable", "constraint": "disable"}
    ET.SubElement(root.find("option"), "flag", stages_off | (flags or {}))
    for body in root.iter("body"):
        sites.append(f"site of {body.get('name')}")
        place = {"pos": numbers(rng.uniform(-0.3, 0.3, 3)), "euler": numbers(rng.uniform(-1, 1, 3))}
        body.insert(0, ET.Element("site", name=sites[-1], **place))
        if rng.random() < 0.5:
            body.set("gravcomp", str(rng.choice([0.3, 1.0, 1.7])))
    return root, sites


def add_tendons(rng, root, joints: list, sites: list, stiffness: float, damping: float, dead: float) -> None:
    """A fixed tendon across two joints and a rope between two sites, with springs, dead bands and dampers."""
    tendons = ET.SubElement(root, "tendon")
    given = {"stiffness": numbers(stiffness), "damping": numbers(damping)}
    given["springlength"] = numbers([0.1, 0.1 + dead])
    across = ET.SubElement(tendons, "fixed", name="across", **given)
    rope = ET.SubElement(tendons, "spatial", name="rope", **given)
    for joint in rng.choice(joints, 2, replace=False):
        ET.SubElement(across, "joint", joint=str(joint), coef=numbers(rng.normal()))
    for site in rng.choice(sites, 2, replace=False):
        ET.SubElement(rope, "site", site=str(site))


def with_drive(seed: int, transmissions=TRANSMISSIONS, flags: dict | None = None) -> str:
    """A random robot with an actuator of every law somewhere, some with ranges, some in a disabled group."""
    rng = np.random.default_rng(seed)
    root, sites = robot(rng, random_tree(seed, joints=6), flags)
    root.find("option").set("actuatorgroupdisable", str(SWITCHED_OFF))
    every = [*root.iter("joint"), *root.iter("freejoint")]
    single = [one for one in every if one.get("type", "hinge") in ("hinge", "slide") and one.tag == "joint"]
    turning = [one.get("name") for one in every if one not in single]
    names = [joint.get("name") for joint in single]
    add_tendons(rng, root, names, sites, rng.uniform(0, 20), rng.uniform(0, 3), rng.uniform(0, 0.5))
    actuators = ET.SubElement(root, "actuator")
    for kind, (tag, given) in laws(rng).items():
        where = str(rng.choice(transmissions))
        two = list(map(str, rng.choice(sites, 2, replace=False)))
        place = {
            "joint": {"joint": str(rng.choice(names))}, "jointinparent": {"jointinparent": str(rng.choice(names))},
            "ball": {str(rng.choice(["joint", "jointinparent"])): str(rng.choice(turning))},
            "tendon": {"tendon": "across"}, "spatial": {"tendon": "rope"},
            "site": {"site": two[0]}, "refsite": {"site": two[0], "refsite": two[1]},
            "slidercrank": {"cranksite": two[0], "slidersite": two[1], "cranklength": "2.5"},
        }[where]  # fmt: skip
        gear = rng.uniform(-2, 2, 6 if where in ("ball", "site", "refsite") else 1)
        if kind != "damper" and rng.random() < 0.3:
            given |= {"ctrllimited": "true", "ctrlrange": numbers([-rng.uniform(0, 1), rng.uniform(0, 1)])}
        if rng.random() < 0.3:
            given |= {"forcelimited": "true", "forcerange": numbers([-rng.uniform(0, 6), rng.uniform(0, 6)])}
        if rng.random() < 0.2:
            given |= {"group": str(SWITCHED_OFF - 1 + rng.integers(2))}
        ET.SubElement(actuators, tag, name=kind, gear=numbers(gear), **place, **given)
    return ET.tostring(root, encoding="unicode")


def with_servos(seed: int, floats: bool = False, flags: dict | None = None) -> str:
    """A random robot whose joints are all held by position servos, soft and stiff, kv none to far too large."""
    rng = np.random.default_rng(seed)
    kinds = ("hinge", "slide", "ball", *["free"] * floats)
    root, sites = robot(rng, random_tree(seed, kinds, joints=5), flags)
    actuators, names = ET.Element("actuator"), []
    for joint in root.iter("joint"):
        kp, kind = 10.0 ** rng.uniform(1.5, 3.5), joint.get("type")
        kv = kp / 100 * rng.choice([0, 0.5, 5, 50, 500])
        for gear in ("1 0 0", "0 1 0", "0 0 1") if kind == "ball" else (str(rng.choice([1, 1, 3, -2])),):
            gains = {"kp": numbers(kp), "kv": numbers(kv), "gear": gear}
            ET.SubElement(actuators, "position", joint=joint.get("name"), **gains)
        names += [joint.get("name")] * (kind != "ball")
    add_tendons(rng, root, names, sites, 30.0, 3.0, 0.0)
    kp, kv = 10 ** rng.uniform(1, 3), rng.choice([0, 5, 50])
    ET.SubElement(actuators, "position", tendon="across", kp=numbers(kp), kv=numbers(kv), gear="2")
    ET.SubElement(actuators, "position", tendon="rope", kp="30", kv="1")
    ET.SubElement(actuators, "motor", joint=names[0])
    ET.SubElement(actuators, "velocity", joint=names[-1], kv=str(rng.choice([0.5, 5, 50])))
    bias = {"gaintype": "affine", "gainprm": "3 -2 -1", "biastype": "affine", "biasprm": "0 -3 -.2"}
    ET.SubElement(actuators, "general", joint=names[0], dyntype="filter", dynprm="6", **bias)
    root.append(actuators)
    return ET.tostring(root, encoding="unicode")
