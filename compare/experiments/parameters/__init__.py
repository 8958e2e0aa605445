"""The compiled model read back beside the stated numbers."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

import tmt

from ...engines.mujoco.parameters import STATED_FLAGS, options, parameters
from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.case import Coordinates
from .. import Experiment
from ..setup import Setup
from . import file, solution
from .first_screen import headline as headline

EXPERIMENT = Experiment(order=10, serves_own=False)
NOT_HAD = ("contact pairs", "damping beyond linear", "stiffness beyond linear", "actuator damping", "actuator armature")
# numbers of the whole file, and those of bodies; the others are of joints
OF_ALL = (*STATED_FLAGS, "gravity", "density", "viscosity", "other mass", "tendon armature", *NOT_HAD)
OF_BODIES = ("mass", "com", "inertia", "gravcomp")
QUANTITIES = dict.fromkeys((*STATED_FLAGS, "order", "parent", "axis", "limited", "gravcomp", *NOT_HAD), "") | {
    "ref": "rad", "anchor": "m", "damping": "N m s/rad", "armature": "kg m2", "frictionloss": "N m", "stiffness": "N m/rad",
    "mass": "kg", "com": "m", "inertia": "kg m2", "rest": "rad", "gravity": "m/s2", "density": "kg/m3", "viscosity": "Pa s",
    "other mass": "kg", "tendon armature": "kg m2", "actuator armature": "kg m2",
}  # fmt: skip
OF_SLIDES = {"ref": "m", "rest": "m", "damping": "N s/m", "armature": "kg", "stiffness": "N/m", "frictionloss": "N"}
# that are so or not, a place, or a count
WHOLE_NUMBERS = (*STATED_FLAGS, "order", "parent", "limited", "contact pairs")
OPTIONS = (*STATED_FLAGS, "order", "parent", "ref", "density", "viscosity", "contact pairs")  # causes of rank 1
AT_TIMES = ("limited", "contact pairs")  # what acts at some states only comes after what always acts
EXPLAINED = {  # forces, by the quantities that say why they act
    "springs, fluid and tendons": ("stiffness", "density", "viscosity", "gravcomp", *NOT_HAD[1:4]),
    "actuators": (),
    "constraints and contacts": ("limited", "frictionloss", "contact pairs"),
}


def claim(robot: Robot) -> str:
    """What is claimed of any robot."""
    if robot.stated_in:
        return solution.CLAIM_OF_SOLUTION.format(robot.stated_in)
    if robot.is_read:
        return file.CLAIM
    return (
        "The MJCF file, as MuJoCo compiled it, has the stated masses, centres of mass, inertia tensors (turned back into body "
        "axes, R diag R'), hinge axes, anchors, order, zero and gravity, and nothing that the method does not have: no "
        "armature, friction, springs, limits or further masses, and at random states no force of springs, fluid, tendons, "
        "actuators (without control signals and activations), constraints or contacts."
    )


def tolerance(robot: Robot) -> str:
    """By what the claim is judged."""
    if robot.stated_in:
        return solution.TOLERANCE_OF_SOLUTION
    if robot.is_read:
        return file.TOLERANCE
    return (
        "64 eps x the largest entry of the quantity (the compiler stores each number once; turning the inertia to its "
        "principal axes and back costs a few roundings; MuJoCo 3.10 turns a fullinertia only to about 1e-8). What must be "
        "absent must be exactly 0. The model is read in the file's own configuration, so that a `ref` is seen as that alone."
    )


def stated(tree: tmt.Tree) -> dict:
    """The same quantities as `parameters` of MuJoCo's model, from the stated numbers: arrays per hinge, per body, or one."""
    n, m = len(tree.hinge_names), len(tree.body_names)
    anchors = []
    for parent, offset in zip(tree.parent, tree.offset):
        anchors.append(np.array(offset) + (anchors[parent] if parent >= 0 else 0.0))
    absent = {"ref": n, "armature": n, "frictionloss": n, "stiffness": n, "limited": n, "gravcomp": m}
    absent |= dict.fromkeys(("density", "viscosity", "other mass", "tendon armature", *NOT_HAD), 1)
    return {name: np.zeros(count) for name, count in absent.items()} | {
        **dict.fromkeys(STATED_FLAGS, 1.0),
        "axis": tree.axis,
        "anchor": anchors,
        "damping": tree.damping,
        "order": range(n),
        "parent": tree.parent,
        "mass": tree.mass,
        "com": tree.com,
        "inertia": tree.inertia,
        "gravity": tree.gravity,
    }


def owners(tree: tmt.Tree, quantity: str) -> tuple[str, ...]:
    """The names of what has a quantity: the world, the bodies or the joints."""
    if quantity in OF_ALL:
        return ("world",)
    if quantity in ("axis", "damping", "armature", "rest"):
        coordinates = Coordinates(tree.hinge_names, tree.kind)
        return coordinates.positions if quantity == "rest" else coordinates.speeds
    return tree.body_names if quantity in OF_BODIES else tree.hinge_names


def rows(setup: Setup) -> Result:
    """One row for each number; one check for each quantity of each hinge or body; the causes that follow."""
    robot = setup.robot
    if not robot.is_stated:
        return file.rows_of_file(setup)
    result = Result("parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit"])
    tree, dynamics = robot.tree, setup.compared()["mujoco"]
    if robot.stated_in:
        expected_of, compiled = solution.compared_numbers(setup)
    else:
        expected_of, compiled = stated(tree), parameters(dynamics)
    causes = []
    for quantity in (name for name in QUANTITIES if name in expected_of):
        expected = np.asarray(expected_of[quantity], dtype=float)
        found = np.asarray(compiled[quantity], dtype=float)
        names = owners(tree, quantity)
        for owner, e, f in zip(names, expected.reshape(len(names), -1), found.reshape(len(names), -1)):
            size = np.abs(expected if robot.stated_in else e).max()
            off, tolerance, unit = np.abs(e - f), FACTOR * EPS * size, unit_of_number(tree, owner, quantity)
            whole = quantity in WHOLE_NUMBERS and not (quantity == "ref" and robot.stated_in)
            value, bound, rule = (f[0], e[0], "equal") if whole else (off.max(), tolerance, "at most")
            result.check(owner, quantity, value, bound, unit, rounding=not whole, rule=rule)
            for k, (a, b) in enumerate(zip(e, f)):
                about = {"of": owner, "quantity": quantity, "component": component(k, len(e))}
                result.rows.append(about | {"stated": a, "compiled": b, "difference": b - a, "unit": unit})
            causes += causes_in(tree, owner, quantity, e, f, off, tolerance)
    if robot.stated_in:
        causes += solution.compare_features(result, setup)
        file.check_forces(result, setup)
        result.tables["inventory"] = file.inventory(robot.features)
        result.notes = file.treatments_in_words(robot.features)
    else:
        causes += causes_of_other_forces(result, setup, causes)
    for option, value in options(setup.engines["mujoco"], dynamics).items():
        result.rows.append({"of": "file", "quantity": option, "component": "", "compiled": value, "unit": ""})
    result.curves["causes"] = sorted(causes, key=lambda c: (c["rank"], c["quantity"] in AT_TIMES, -c["size"]))
    return result


def causes_of_other_forces(result: Result, setup: Setup, known: Sequence[dict]) -> list[dict]:
    """Checks that nothing else acts; the causes of what does, where none of those that are known says why."""
    sample, causes = setup.random, []
    for source, force in setup.compared()["mujoco"].other_forces(sample.q, sample.qd).items():
        most = float(np.abs(force).max())
        check = result.check(sample.name, f"no forces of {source}", most, 0.0, "N m")
        if not check.passed and not any(cause["quantity"] in EXPLAINED[source] for cause in known):
            place = f"forces of {source}"
            text = f"{place}: none stated, up to {most:.3g} N m found"
            about = {"rank": 2, "place": place, "stated": 0.0, "found": most, "text": text}
            causes.append(about | {"size": np.inf, "quantity": place})
    return causes


def unit_of_number(tree: tmt.Tree, owner: str, quantity: str) -> str:
    """The unit of a quantity, of a slide its own."""
    of_slide = dict(zip(tree.hinge_names, tree.kind)).get(owner) == "slide" and quantity not in OF_BODIES
    return OF_SLIDES.get(quantity, QUANTITIES[quantity]) if of_slide else QUANTITIES[quantity]


def causes_in(
    tree: tmt.Tree, owner: str, quantity: str, stated: np.ndarray, found: np.ndarray, off: np.ndarray, tolerance: float
) -> list[dict]:
    """The causes in one quantity of one hinge or body: each number that is off by more than the tolerance.

    Rank 1: an option, or a convention of a hinge (its order, its sign, its zero); 2: one number.
    """
    flipped = quantity == "axis" and bool(np.abs(stated + found).max() <= tolerance)
    rank = 1 if flipped or quantity in OPTIONS else 2
    of = "" if owner == "world" else f" of {owner}"
    causes = []
    for k, (a, b, difference) in enumerate(zip(stated, found, off)):
        if not difference <= tolerance:
            place = " ".join(filter(None, (quantity, component(k, len(stated))))) + of
            share = difference / tolerance if tolerance else np.inf
            unit = unit_of_number(tree, owner, quantity)
            causes.append(cause(tree, rank, quantity, unit, place, a, b, share, " (the opposite sign)" * flipped))
    return causes


def cause(
    tree: tmt.Tree,
    rank: int,
    quantity: str,
    unit: str,
    place: str,
    stated: float,
    found: float,
    size: float,
    remark: str,
) -> dict:
    """A cause with its sentence; size: its difference over its tolerance."""
    if quantity.startswith("flag "):
        values = ["enable" if number else "disable" for number in (stated, found)]
    elif quantity == "parent":
        values = [("the world", *tree.hinge_names)[int(number) + 1] for number in (stated, found)]
    else:
        values = [f"{number:.7g} {unit}".rstrip() for number in (stated, found)]
        if values[0] == values[1]:
            values = [f"{float(number)!r} {unit}".rstrip() for number in (stated, found)]
    text = "{}: stated {}, compiled {}".format(place, *values) + remark
    found = float(found) if np.isfinite(found) else None
    about = {"rank": rank, "place": place, "stated": float(stated), "found": found, "text": text}
    return about | {"size": float(size), "quantity": quantity}


def component(k: int, count: int) -> str:
    """The k-th of 1, 3 or 9 components by name."""
    if count == 1:
        return ""
    return "xyz"[k] if count == 3 else "xyz"[k // 3] + "xyz"[k % 3]


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from ..figures_sketch import draw_sketch  # matplotlib is for the process that draws

    yield partial(draw_sketch, robot)
