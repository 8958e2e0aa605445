"""Reduction of the arm's scenes: the joints that each needs."""

import numpy as np
import pytest
from helpers.edited import setup_of

import tmt
from compare.engines.mujoco.source import Source
from compare.experiments import reduction
from compare.experiments.reduction.scene import scene_of_case
from compare.experiments.reduction.search import lockable
from compare.robots.arm import ARM


def stays(case) -> set[str]:
    scene = scene_of_case(case, Source(ARM.mjcf))
    return {row.joint for row in lockable(scene, 1e-3).rows if not row.why_needed}


KNOWN = {"bent, held": {*ARM.joints}, "ball catch, held": {*ARM.joints}, "zero, free": {"beta"}}


def test_what_is_not_needed(mujoco):
    result = reduction.rows(setup_of(mujoco))
    assert [str(check) for check in result.checks if not check.passed] == []
    for case in ARM.cases_of_torque:
        rows = [row for row in result.tables["reduction_joints"] if row.scene == case.name]
        assert {row.joint for row in rows} == {*case.joints}
        assert {row.joint for row in rows if not row.why_needed} == KNOWN.get(case.name, set()), case.name
    assert {check.scene.partition(", locked")[0] for check in result.checks} == {*KNOWN}


@pytest.mark.parametrize("known, scene", [
    (set(), {"posture": (10, 20, 60)}),
    ({"beta"}, {"posture": (30, 0, 10)}),  # the plane of the upper arm and the forearm is vertical
    ({"alpha"}, {"posture": (0, 0, 0), "locked": ("beta",), "gravity": False, "speed": (0, 0, 0)}),
    (set(), {"posture": "zero", "speed": (0, 10, 0)}),
    ({"alpha", "beta", "gamma"}, {"posture": "zero", "gravity": False}),
])  # fmt: skip
def test_what_is_not_needed_in_a_scene(known, scene):
    found = stays(ARM.case("a scene", **scene))
    assert found == known or (scene.get("locked") and found == {"alpha", "gamma"})


def test_a_damped_scene_and_one_without_gravity_run_as_stated():
    """The forearm alone, thrown without gravity: its speed decays with damping over inertia, by plain arithmetic."""
    case = ARM.case("thrown", posture="zero", speed=(0, 0, 90), locked=("alpha", "beta"), gravity=False, damping=0.1,
                    duration=0.78125)  # fmt: skip
    (path,) = scene_of_case(case, Source(ARM.mjcf)).paths
    rates = -np.diff(np.log(path.v[:, 0])) / 0.078125
    inertia = float(tmt.mass_matrix(case.tree, case.q)[0, 0])
    assert rates == pytest.approx(0.1 / inertia, rel=1e-3)
