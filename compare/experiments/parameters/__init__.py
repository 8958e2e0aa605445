"""The compiled model compared with the stated numbers."""

from collections.abc import Iterator
from functools import partial

import numpy as np

import tmt

from ...engines.mujoco.parameters import STATED_FLAGS, parameters
from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.case import Coordinates
from .. import Experiment
from ..setup import Setup
from . import file, solution
from .first_screen import headline as headline
from .numbers import ABSENT, check_forces, compare_number, rows_of

EXPERIMENT = Experiment(order=10, serves_own=False)
# numbers of the whole file, and those of bodies; the others are of joints
OF_WORLD = (*STATED_FLAGS, "gravity", "density", "viscosity", "other mass", "tendon armature", *ABSENT)
OF_BODIES = ("mass", "com", "inertia", "gravcomp")
UNITS = dict.fromkeys((*STATED_FLAGS, "order", "parent", "axis", "limited", "gravcomp", *ABSENT), "") | {
    "ref": "rad", "anchor": "m", "damping": "N m s/rad", "armature": "kg m2", "frictionloss": "N m", "stiffness": "N m/rad",
    "mass": "kg", "com": "m", "inertia": "kg m2", "rest": "rad", "gravity": "m/s2", "density": "kg/m3", "viscosity": "Pa s",
    "other mass": "kg", "tendon armature": "kg m2", "actuator armature": "kg m2",
}  # fmt: skip
UNITS_OF_SLIDES = {
    "ref": "m",
    "rest": "m",
    "damping": "N s/m",
    "armature": "kg",
    "stiffness": "N/m",
    "frictionloss": "N",
}
WHOLE_NUMBERS = (*STATED_FLAGS, "order", "parent", "limited", "contact pairs")
AT_TIMES = ("limited", "contact pairs")  # these act at some states only: causes come after those that always act


def stated(tree: tmt.Tree) -> dict:
    """The quantities of `parameters` of MuJoCo's model from the stated numbers of hinges: arrays per hinge, per body, or one."""
    n, m = len(tree.hinge_names), len(tree.body_names)
    absent = {"frictionloss": n, "limited": n, "gravcomp": m}
    absent |= dict.fromkeys(("density", "viscosity", "other mass", "tendon armature", *ABSENT), 1)
    numbers = solution.numbers_of(tree, range(n), range(m))
    del numbers["rest"]
    zeros = {name: np.zeros(count) for name, count in absent.items()}
    return zeros | dict.fromkeys(STATED_FLAGS, 1.0) | {"order": range(n)} | numbers


def owners(tree: tmt.Tree, quantity: str) -> tuple[str, ...]:
    """The names of the bodies, joints, speeds or positions that have a quantity, or "world"."""
    if quantity in OF_WORLD:
        return ("world",)
    if quantity in ("axis", "damping", "armature", "rest"):
        coordinates = Coordinates(tree.hinge_names, tree.kind)
        return coordinates.positions if quantity == "rest" else coordinates.speeds
    return tree.body_names if quantity in OF_BODIES else tree.hinge_names


def rows(setup: Setup) -> Result:
    """One row for each number; one check for each quantity of each joint or body; the causes that follow."""
    robot = setup.robot
    if not robot.is_stated:
        return file.rows_of_file(setup)
    result = Result("parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit"])
    tree, dynamics, causes = robot.tree, setup.compared()["mujoco"], []
    if robot.stated_in:
        stated_numbers, compiled = solution.compared_numbers(setup)
    else:
        stated_numbers, compiled = stated(tree), parameters(dynamics)
    for quantity in (name for name in UNITS if name in stated_numbers):
        numbers = np.asarray(stated_numbers[quantity], dtype=float)
        values = np.asarray(compiled[quantity], dtype=float)
        names = owners(tree, quantity)
        is_whole = quantity in WHOLE_NUMBERS and not (quantity == "ref" and robot.stated_in)
        for owner, a, b in zip(names, numbers.reshape(len(names), -1), values.reshape(len(names), -1)):
            size, unit = np.abs(numbers if robot.stated_in else a).max(), unit_of(tree, owner, quantity)
            words, tolerance = words_of_numbers(tree, quantity), FACTOR * EPS * size
            causes += compare_number(result, owner, quantity, a, b, unit, tolerance, is_whole, words)
            result.rows += rows_of(owner, quantity, a, b, unit)
    if robot.stated_in:
        causes += solution.compare_features(result, setup)
        check_forces(result, setup)
        file.add_inventory(result, robot.features)
    else:
        causes += check_forces(result, setup, causes)
    result.curves["causes"] = sorted(causes, key=lambda c: (c["rank"], c["quantity"] in AT_TIMES, -c["size"]))
    return result


def unit_of(tree: tmt.Tree, owner: str, quantity: str) -> str:
    is_slide = dict(zip(tree.hinge_names, tree.kind)).get(owner) == "slide" and quantity not in OF_BODIES
    return UNITS_OF_SLIDES.get(quantity, UNITS[quantity]) if is_slide else UNITS[quantity]


def words_of_numbers(tree: tmt.Tree, quantity: str) -> dict[int, str]:
    """Words for numbers that are flags or indices."""
    if quantity == "parent":
        return dict(enumerate(("the world", *tree.hinge_names), start=-1))
    return {0: "disable", 1: "enable"} if quantity.startswith("flag ") else {}


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from ..figures_sketch import draw_sketch  # matplotlib is for the process that draws

    yield partial(draw_sketch, robot)
