"""The numbers of a file and those of a solution, both as MuJoCo compiled them."""

from collections.abc import Sequence

import numpy as np

import tmt

from ...engines.mujoco.inventory import MODELLED
from ...judge.check import Result
from ...judge.scale import EPS, FACTOR
from ..setup import Setup
from .numbers import cause

MAY_DIFFER = "contact", "limit", "clamp", "actuator"  # the equations of motion without them do not depend on these


def compared_numbers(setup: Setup) -> tuple[dict, dict]:
    """The numbers of the solution, and those of the file in the same order."""
    tree, reading = setup.robot.tree, setup.reading
    joints = [reading.tree.hinge_names.index(name) for name in tree.hinge_names]
    bodies = [reading.bodies.index(body) for body in setup.engines["mujoco"].bodies]
    return numbers_of(tree, range(len(joints)), range(len(bodies))), numbers_of(reading.tree, joints, bodies)


def numbers_of(tree: tmt.Tree, joints: Sequence[int], bodies: Sequence[int]) -> dict:
    """The numbers of a Tree by quantity: arrays per joint, speed, position or body, or one. joints, bodies: in this order."""
    anchors = []
    for parent, offset in zip(tree.parent, tree.offset):
        anchors.append(np.array(offset) + (anchors[parent] if parent >= 0 else 0.0))
    places = tree.coordinates.joints
    positions, speeds = (
        [i for j in joints for i in range(places[j][of].start, places[j][of].stop)] for of in (1, 2)
    )  # fmt: skip
    numbers = {-1: -1} | {j: i for i, j in enumerate(joints)}
    is_sprung = [bool(k) for k, (_, at, _) in zip(tree.stiffness, places) for _ in range(at.start, at.stop)]
    return {
        "parent": np.array([numbers[tree.parent[j]] for j in joints]),
        "axis": np.array(tree.axis)[speeds],
        "anchor": np.array(anchors)[joints],
        "ref": np.array(tree.reference)[joints],
        "damping": np.array(tree.damping)[speeds],
        "armature": np.array(tree.armature)[speeds],
        "stiffness": np.array(tree.stiffness)[joints],
        "rest": (np.array(tree.rest) * is_sprung)[positions],
        "mass": np.array(tree.mass)[bodies],
        "com": np.array(tree.com)[bodies],
        "inertia": np.array(tree.inertia)[bodies],
        "gravity": np.array(tree.gravity),
    }


def compare_features(result: Result, setup: Setup) -> list[dict]:
    """Checks of features that the equations do not have: their count and numbers; the causes where they differ."""
    robot, causes = setup.robot, []
    ours, theirs = ({f.feature: f for f in features} for features in (robot.features, robot.features_stated))
    for name, feature in (theirs | ours).items():
        if feature.treatment == MODELLED or name in MAY_DIFFER:
            continue
        stated, compiled = (float(features[name].count if name in features else 0) for features in (theirs, ours))
        result.check("file", f"{name}, how many", compiled, stated, "", rule="equal")
        text = f"{name}: {stated:g} in {robot.stated_in}, {compiled:g} in this file" if stated != compiled else ""
        a, b = (np.array(features[name].numbers if name in features else ()) for features in (theirs, ours))
        if not text and (len(a) or len(b)):
            difference = np.abs(a - b) if len(a) == len(b) else np.array([np.inf])
            allowed = FACTOR * EPS * np.abs(a).max(initial=0.0)
            if not result.check("file", f"{name}, its numbers", difference.max(), allowed, "").passed:
                k = int(np.argmax(difference))
                values = f": stated {a[k]:.9g}, compiled {b[k]:.9g}" if len(a) == len(b) else ""
                text = f"{name}: not the numbers of {robot.stated_in}{values}"
        if text:
            causes.append(cause(2, name, stated, compiled, text, 1.0, name))
    return causes
