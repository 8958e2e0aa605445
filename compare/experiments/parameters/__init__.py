"""The compiled model compared with the stated numbers, or with those of a solution as MuJoCo compiled it."""

from collections.abc import Iterator, Sequence
from functools import partial

import numpy as np

import tmt

from ...core.check import Result
from ...core.finding import Finding
from ...engines.mujoco.inventory import LEFT_OUT, MODELLED
from ...engines.mujoco.parameters import STATED_FLAGS, lengths, parameters
from ...judge.scale import EPS, FACTOR
from ...robots import Robot
from ...robots.case import Coordinates
from ...robots.joint_map import places_of
from .. import Experiment
from ..setup import Setup
from . import file
from .numbers import ABSENT, OF_BODIES, UNITS, cause, check_forces, compare_number, rows_of, unit_of

EXPERIMENT = Experiment(order=10, serves_own=False, states_causes=True)
# numbers of the whole file; the others are of bodies and joints
OF_WORLD = (*STATED_FLAGS, "gravity", "density", "viscosity", "other mass", "tendon armature", *ABSENT)
WHOLE_NUMBERS = (*STATED_FLAGS, "order", "parent", "limited", "contact pairs")
AT_TIMES = (
    "limited",
    "contact pairs",
)  # these act at some states only: causes come after those that always act
MAY_DIFFER = (
    "contact",
    "limit",
    "clamp",
    "actuator",
)  # the equations of motion without them do not depend on these


def numbers_of(tree: tmt.Tree, joints: Sequence[int], bodies: Sequence[int]) -> dict:
    """The numbers of a Tree by quantity: arrays per joint, speed, position or body, or one. joints, bodies: in this order."""
    (anchors, *_), places = places_of(tree), [tree.coordinates.joints[j] for j in joints]
    positions = [i for place in places for i in range(place.q.start, place.q.stop)]
    speeds = [i for place in places for i in range(place.qd.start, place.qd.stop)]
    numbers = {-1: -1} | {j: i for i, j in enumerate(joints)}
    is_sprung = np.repeat(
        [tree.stiffness[j] > 0.0 for j in joints], [place.q.stop - place.q.start for place in places]
    )
    return {
        "parent": np.array([numbers[tree.parent[j]] for j in joints]),
        "axis": np.array(tree.axis)[speeds],
        "anchor": anchors[joints],
        "ref": np.array(tree.reference)[joints],
        "damping": np.array(tree.damping)[speeds],
        "armature": np.array(tree.armature)[speeds],
        "stiffness": np.array(tree.stiffness)[joints],
        "rest": np.array(tree.rest)[positions] * is_sprung,
        "mass": np.array(tree.mass)[bodies],
        "com": np.array(tree.com)[bodies],
        "inertia": np.array(tree.inertia)[bodies],
        "gravity": np.array(tree.gravity),
    }


def stated(tree: tmt.Tree) -> dict:
    """The quantities of `parameters` by the stated numbers of hinges, arrays per hinge, per body, or one; the others are 0."""
    numbers = numbers_of(tree, range(len(tree.joint_names)), range(len(tree.body_names)))
    del numbers["rest"]
    return dict.fromkeys(STATED_FLAGS, 1.0) | {"order": range(len(tree.joint_names))} | numbers


def owners(tree: tmt.Tree, quantity: str) -> tuple[str, ...]:
    """The names of the bodies, joints, speeds or positions that have a quantity, or "world"."""
    if quantity in OF_WORLD:
        return ("world",)
    if quantity in ("axis", "damping", "armature", "rest"):
        coordinates = Coordinates(tree.joint_names, tree.kind)
        return coordinates.positions if quantity == "rest" else coordinates.speeds
    return tree.body_names if quantity in OF_BODIES else tree.joint_names


def rows(setup: Setup) -> Result:
    """One row for each number; one check for each quantity of each joint or body; the causes that follow."""
    robot, reading = setup.robot, setup.reading
    if not robot.is_stated:
        return file.rows_of_file(setup)
    result = Result("parameters", shown=["of", "quantity", "component", "stated", "compiled", "unit"])
    tree, dynamics, causes = robot.tree, setup.compared()["mujoco"], []
    added = lengths(dynamics)
    if robot.stated_in:  # a solution: its joints and bodies are looked up in the file
        joints = [reading.tree.joint_names.index(name) for name in tree.joint_names]
        bodies = [reading.bodies.index(body) for body in setup.engines["mujoco"].bodies]
        numbers_stated = numbers_of(tree, range(len(joints)), range(len(bodies)))
        compiled = numbers_of(reading.tree, joints, bodies)
        reach = max(np.abs(numbers_stated[name]).max() for name in added)  # sums of lengths of the solution
        added = {name: values + reach for name, values in added.items()}
    else:
        numbers_stated, compiled = stated(tree), parameters(dynamics)
    slides = {joint for joint, kind in zip(tree.joint_names, tree.kind) if kind == "slide"}
    for quantity in (name for name in UNITS if name in compiled):
        values = np.asarray(compiled[quantity], dtype=float)
        numbers = np.broadcast_to(np.asarray(numbers_stated.get(quantity, 0.0), dtype=float), values.shape)
        names = owners(tree, quantity)
        is_whole = quantity in WHOLE_NUMBERS
        numbers, values = (each.reshape(len(names), -1) for each in (numbers, values))
        sizes = added.get(quantity, np.abs(numbers).max(axis=1))
        for owner, a, b, size in zip(names, numbers, values, sizes):
            unit, tolerance = unit_of(quantity, owner in slides), FACTOR * EPS * size
            words = (
                dict(enumerate(("the world", *tree.joint_names), start=-1)) if quantity == "parent" else {}
            )
            causes += compare_number(result, owner, quantity, a, b, unit, tolerance, is_whole, words)
            result.rows += rows_of(owner, quantity, a, b, unit)
    if robot.stated_in:
        causes += compare_features(result, robot)
        check_forces(result, setup)
        file.add_inventory(result, robot.features)
    else:
        causes += check_forces(result, setup, causes)
    result.causes = sorted(causes, key=lambda c: (c["rank"], c["quantity"] in AT_TIMES, -c["size"]))
    return result


def compare_features(result: Result, robot: Robot) -> list[dict]:
    """Checks that features without a term in the equations are as many as in the solution; the causes where they are not."""
    ours, theirs = ({f.feature: f for f in features} for features in (robot.features, robot.features_stated))
    causes = []
    for name, feature in (theirs | ours).items():
        if feature.treatment in (MODELLED, LEFT_OUT) or name in MAY_DIFFER:
            continue
        number, compiled = (
            float(features[name].count if name in features else 0) for features in (theirs, ours)
        )
        if not result.check("file", f"{name}, how many", compiled, number, "", rule="equal").passed:
            text = f"{name}: {number:g} in {robot.stated_in}, {compiled:g} in this file"
            causes.append(cause(2, name, number, compiled, text, 1.0, name))
    return causes


def headline(result: Result) -> Finding | None:
    """What is not as stated, and how many numbers are equal to the stated ones to the last bit."""
    stated_rows = [row for row in result.rows if row.get("stated") is not None]
    off = [row["difference"] != 0.0 for row in stated_rows if not row.get("asked_by")]
    changed = sum(bool(row.get("asked_by")) and row["difference"] != 0.0 for row in stated_rows)
    failing = [f"{check.quantity} ({check.scene})" for check in result.checks if check.failed]
    return (
        result.finding("headline", numbers=len(off), off=sum(off), changed=changed, failing=failing)
        if off
        else None
    )


def figures(result: Result, robot: Robot) -> Iterator[partial]:
    from ..figures_sketch import draw_sketch  # matplotlib is for the process that draws

    yield partial(draw_sketch, robot)
