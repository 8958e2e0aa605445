"""Which joints a case needs: those that its motion moves, decided on expressions and with 50 digits."""

import dataclasses

import numpy as np
import pytest
from trees import one_body

import tmt
from compare.robots.arm import ARM
from compare.truth.smallest import needed

KNOWN = {"zero, free": ("beta",), "ball catch, held": ARM.joints, "bent, held": ARM.joints}
SCENES = {  # what is not needed, and the scene
    "in its plane": (("beta",), {"posture": (20, 0, 40), "speed": (30, 0, -50)}),
    "out of it by 1e-6 deg": ((), {"posture": (20, 1e-6, 40)}),
    "sin of the double nearest to pi is not 0": ((), {"posture": (20, 180, 40)}),
    "plane of a locked alpha": (("beta",), {"posture": (30, 0, 0), "locked": ("alpha",)}),
    "at rest without gravity": (ARM.joints, {"posture": "bent", "gravity": False}),
    "the rounded torque does not hold": (("beta",), {"posture": "zero", "torque": (-2.20725, 0, -2.20725)}),
}


def test_what_is_not_needed():
    for case in ARM.cases:
        assert needed(case).stays == KNOWN.get(case.name, ()), case.name


@pytest.mark.parametrize("stays, scene", SCENES.values(), ids=SCENES)
def test_what_is_not_needed_in_a_scene(stays, scene):
    assert needed(ARM.case("a scene", **scene)).stays == stays


def test_what_stays_by_numbers_that_cancel():
    """A round top on crossed hinges: alpha and gamma never move, since c (I s) - s (I c) is 0."""
    inertia, names = np.diag([0.01, 0.01, 0.002]), tmt.ARM.joint_names
    tree = one_body(np.eye(3)[[1, 0, 2]], (), (0.0, 0.0, -0.2), inertia, joint_names=names)
    robot = dataclasses.replace(ARM, name="top", tree=tree)
    found = needed(robot.case("top", posture=(0, 30, 40)))
    assert set(found.moves) == {"beta"} and found.stays == ("alpha", "gamma")
