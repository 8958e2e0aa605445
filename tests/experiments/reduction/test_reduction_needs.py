"""Subsets of locked joints, and runs of a case beside those of the smallest model that has its motion."""

import numpy as np
import pytest

import tmt
from compare import experiment
from compare.engines.mujoco import Mujoco
from compare.experiments.reduction import needs, sub_blocks
from compare.experiments.reduction.times import operations
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.truth.smallest import needed, reduced

SUBSETS = (("alpha",), ("beta",), ("gamma",), ("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma"))


def test_every_subset_agrees_and_a_wrong_lock_is_seen(mujoco):
    class Deleted(Mujoco):
        """Joints that are only deleted stay at zero."""

        def of(self, case):
            return mujoco.of(case.changed(posture=()) if case.locked else case)

    wrong = Deleted(mujoco.model, mujoco.joints, mujoco.bodies, mujoco.source)
    results = []
    for engine in (mujoco, wrong):
        results.append(Result("reduction"))
        sub_blocks.compare_blocks(results[-1], experiment.Setup.small(ARM, experiment.engines(engine)), angles=2)
    right, deleted = (result.checks for result in results)
    assert len(right) == 6 * 2 * 3 and all(check.passed for check in right)
    failed = {check.scene for check in deleted if not check.passed}
    assert failed == {f"{' and '.join(locked)} locked" for locked in SUBSETS}


def test_subsets_of_many_joints_are_each_alone_and_some_at_random():
    assert sub_blocks.subsets(ARM.joints) == list(SUBSETS)
    assert len(sub_blocks.subsets("abcdef")) == 2**6 - 2
    for joints in ("abcdefg", "abcdefghijkl"):
        many = sub_blocks.subsets(joints)
        assert len(set(many)) == len(many) == len(joints) + 20 and sorted(many, key=len) == many
        assert many[: len(joints)] == [(name,) for name in joints]
        assert all(2 <= len(names) < len(joints) for names in many[len(joints) :])


def test_a_smaller_tree_is_less_code():
    swing = next(case for case in ARM.cases if len(case.joints) == 1)
    whole, planar, elbow = (operations(tree) for tree in (tmt.ARM, tmt.ARM.lock({"beta": 0.0}), swing.tree))
    assert whole > 2 * planar > 4 * elbow > 0


def test_the_planar_arm_moves_as_the_whole_one(engines):
    case, setup = ARM.cases[0], experiment.Setup.small(ARM, engines)
    result = Result("reduction", curves={"apart": {}})
    smaller = reduced(case)
    assert smaller.joints == ("alpha", "gamma")
    needs.compare_smaller(result, case, smaller, setup, "RK4")
    assert len(result.checks) == 6 and all(check.passed for check in result.checks)
    # a planar arm that starts elsewhere is another motion
    needs.compare_smaller(result, case, smaller.changed(posture=(0, 0, 1e-6)), setup, "RK4")
    assert {check.quantity for check in result.checks if not check.passed} == {"smallest model to whole"}


OWN = {"damping": 0.1, "duration": 0.5, "dt": 1 / 64, "judged": 0.0, "tags": ("own",)}


@pytest.mark.parametrize(
    "scene, smallest, says",
    [
        ({"posture": (20, 0, 40), "torque": (0.5, 0, 0.25)}, ["alpha gamma"], "own: alpha and gamma. Beta never moves"),
        ({"posture": (30, 0, 0), "locked": ("alpha",)}, ["gamma"], "own: gamma (alpha declared locked). Beta never moves"),
        ({"posture": (30, 20, 60), "torque": "hold", "locked": ("gamma",)}, ["none"], "own: no hinge and no integrator."),
        ({"posture": (10, 20, 30), "torque": (0, 1, 0), "locked": ("beta",)}, ["alpha gamma"], "own: all 2 hinges (beta"),
        ({"posture": "hanging", "speed": (0, 1e-3, 0)}, [], "own: all 3 hinges. Beta has a speed at the start"),
    ],
)  # fmt: skip
def test_a_users_own_scene_needs_what_it_needs(engines, scene, smallest, says):
    """Locked joints at angles, torques in N m, damping; a motion that is small is no failure."""
    case, setup = ARM.case("own", **OWN | scene), experiment.Setup.small(ARM, engines)
    result = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}})
    (_, whole), *smaller = needs.of_case(result, case, setup)
    assert result.notes[0].startswith(says) and all(check.passed for check in result.checks), result.checks
    assert not any(check.quantity == "movement" for check in result.checks)
    assert whole.joints == ARM.joints
    assert [" ".join(model.joints) if model else "none" for _, model in smaller] == smallest


def test_joints_that_never_move_are_said_in_the_plural():
    case = ARM.case("own", posture=(0, 0, 40))
    need = needed(case)._replace(stays=("left_hip", "knee"))
    words = needs.need_in_words(case, need)
    assert "Left_hip and knee never move: at their start and at rest their accelerations fold to 0" in words


def test_a_run_is_of_the_scheme_in_both_engines(engines):
    case, setup = ARM.case("short", posture="bent", duration=0.25, dt=1 / 64), experiment.Setup.small(ARM, engines)
    for integrator, scheme in (("Euler", "semi_implicit_euler"), ("RK4", "rk4")):
        paths = needs.states_of_run(case, setup, integrator)
        path = tmt.simulate(*case.start, case.tau, 1 / 1024, 256, scheme)
        assert np.array_equal(paths["tmt"], np.concatenate([path.q, path.qd], axis=1))
        assert np.abs(paths["mujoco"] - paths["tmt"]).max() < 1e-12
