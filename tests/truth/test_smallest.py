"""Which joints a case needs: those that its motion moves, decided on expressions and with 50 digits."""

import dataclasses

import numpy as np
import pytest

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


@pytest.mark.parametrize("name", SCENES)
def test_what_is_not_needed_in_a_scene(name):
    stays, scene = SCENES[name]
    assert needed(ARM.case(name, **scene)).stays == stays


def test_what_stays_by_numbers_that_cancel():
    """A round top on crossed hinges: alpha and gamma never move, since c (I s) - s (I c) is 0."""
    body = {"body_names": ("top",), "body_joint": (2,), "mass": (1.0,), "com": ((0.0, 0.0, -0.2),)}
    inertia = (np.diag([0.01, 0.01, 0.002]),)
    axes = {"parent": (-1, 0, 1), "offset": np.zeros((3, 3)), "axis": np.eye(3)[[1, 0, 2]]}
    tree = dataclasses.replace(tmt.ARM, **axes, **body, inertia=inertia)
    robot = dataclasses.replace(ARM, name="top", tree=tree)
    found = needed(robot.case("top", posture=(0, 30, 40)))
    assert set(found.moves) == {"beta"} and found.stays == ("alpha", "gamma")
