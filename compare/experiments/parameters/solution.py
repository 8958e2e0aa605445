"""The numbers of a file beside those of a solution, both as MuJoCo compiled them."""

from collections.abc import Sequence

import numpy as np

import tmt

from ...engines.mujoco.inventory import MODELLED
from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ..setup import Setup

MAY_DIFFER = "contact", "limit", "clamp", "actuator"  # of which no equation of motion without them says anything
CLAIM_OF_SOLUTION = (
    "The model as MuJoCo compiled it has the numbers of {}, joint by joint and body by body: parent, axis, anchor, zero, "
    "damping, armature and spring of each joint; mass, centre of mass and inertia tensor of each body; gravity. Of what the "
    "equations do not have, it has as many, and their numbers, in order of size, are those of the solution; geoms that touch, "
    "limits and actuators may be others."
)
TOLERANCE_OF_SOLUTION = (
    "64 eps x the largest entry of the quantity in the solution, of any joint or body. Counts, and forces of what is switched "
    "off: exactly."
)


def compared_numbers(setup: Setup) -> tuple[dict, dict]:
    """The numbers of the solution, and those of the file in the same order: arrays per joint, speed, position or body, or one."""
    tree, reading = setup.robot.tree, setup.reading
    joints = [reading.tree.hinge_names.index(name) for name in tree.hinge_names]
    bodies = [reading.bodies.index(body) for body in setup.engines["mujoco"].bodies]
    return ordered_numbers(tree, range(len(joints)), range(len(bodies))), ordered_numbers(reading.tree, joints, bodies)


def ordered_numbers(tree: tmt.Tree, joints: Sequence[int], bodies: Sequence[int]) -> dict:
    """The numbers of a Tree, by quantity. joints, bodies: in which order."""
    anchors = []
    for parent, offset in zip(tree.parent, tree.offset):
        anchors.append(np.array(offset) + (anchors[parent] if parent >= 0 else 0.0))
    speeds = [v for j in joints for v in range(*tree.coordinates.joints[j][2].indices(tree.coordinates.nv))]
    positions = [i for j in joints for i in range(*tree.coordinates.joints[j][1].indices(tree.coordinates.nq))]
    numbers = {-1: -1} | {j: i for i, j in enumerate(joints)}
    sprung = [
        bool(tree.stiffness[j])
        for j, (_, at, _) in enumerate(tree.coordinates.joints)
        for _ in range(at.start, at.stop)
    ]
    return {
        "parent": np.array([numbers[tree.parent[j]] for j in joints]),
        "axis": np.array(tree.axis)[speeds],
        "anchor": np.array(anchors)[joints],
        "ref": np.array(tree.reference)[joints],
        "damping": np.array(tree.damping)[speeds],
        "armature": np.array(tree.armature)[speeds],
        "stiffness": np.array(tree.stiffness)[joints],
        "rest": (np.array(tree.rest) * sprung)[positions],
        "mass": np.array(tree.mass)[bodies],
        "com": np.array(tree.com)[bodies],
        "inertia": np.array(tree.inertia)[bodies],
        "gravity": np.array(tree.gravity),
    }


def compare_features(result: Result, setup: Setup) -> list[dict]:
    """A check for each thing that the equations do not have, how many there are of it; of those that differ the causes."""
    robot, causes = setup.robot, []
    features = {feature.feature: feature for feature in (*robot.features_stated, *robot.features)}
    stated, found = ({feature.feature: feature for feature in each} for each in (robot.features_stated, robot.features))
    for name in (name for name, feature in features.items() if feature.treatment != MODELLED):
        a, b = (float(known[name].count if name in known else 0) for known in (stated, found))
        if name in MAY_DIFFER:
            continue
        result.check("file", f"{name}, how many", b, a, "", rule="equal")
        text = f"{name}: {a:g} in {robot.stated_in}, {b:g} in this file" if a != b else ""
        ours, theirs = (np.array(known[name].numbers if name in known else ()) for known in (found, stated))
        if not text and (len(ours) or len(theirs)):
            off = np.abs(ours - theirs).max() if len(ours) == len(theirs) else np.inf
            check = result.check(
                "file", f"{name}, its numbers", off, FACTOR * EPS * np.abs(theirs).max(initial=0.0), ""
            )
            if not check.passed:
                k = int(np.argmax(np.abs(ours - theirs))) if len(ours) == len(theirs) else 0
                values = f": {ours[k]:.9g} in place of {theirs[k]:.9g}" if len(ours) == len(theirs) else ""
                text = f"{name}: other numbers than in {robot.stated_in}{values}"
        if text:
            causes.append(
                {"rank": 2, "place": name, "stated": a, "found": b, "text": text, "size": 1.0, "quantity": name}
            )
    return causes
