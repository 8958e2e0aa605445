"""Joints that are locked in both engines, and what each scene needs: of the arm, and of robots with joints of other kinds."""

import pytest
from models import PATHS, chain

import tmt
from compare import experiment
from compare.engines.mujoco import Mujoco, engine, read
from compare.experiments import reduction
from compare.experiments.reduction import needs, sub_blocks, times
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup, engines
from compare.truth.smallest import needed, reduced

SUBSETS = [("alpha",), ("beta",), ("gamma",), ("alpha", "beta"), ("alpha", "gamma"), ("beta", "gamma")]


def setup_of(source) -> Setup:
    """A robot of a file, its engines, and few states."""
    reading = read(source)
    return Setup.small(robot_of(reading, "robot.xml"), engines(engine(reading)))


def empty() -> Result:
    return Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}})


def blocks(setup, angles=1) -> Result:
    result = Result("reduction")
    sub_blocks.compare_blocks(result, setup, angles)
    return result


def failed(result) -> list[str]:
    return [str(check) for check in result.checks if not check.passed]


# locked joints


def test_every_subset_agrees_and_a_wrong_lock_is_seen(mujoco):
    class Deleted(Mujoco):
        """Joints that are only deleted stay at zero."""

        def of(self, case):
            return mujoco.of(case.changed(posture=()) if case.locked else case)

    wrong = Deleted(mujoco.model, mujoco.joints, mujoco.bodies, mujoco.source)
    right, deleted = (blocks(Setup.small(ARM, experiment.engines(engine)), 2) for engine in (mujoco, wrong))
    assert len(right.checks) == 6 * 2 * 3 and failed(right) == []
    expected = {f"{' and '.join(locked)} locked" for locked in SUBSETS}
    assert {check.scene for check in deleted.checks if not check.passed} == expected


@pytest.mark.parametrize(
    "model, joints, scenes",
    [
        ("gripper", 4, ()),
        ("free_body", 4, ("stone turn locked", "stone x and stone turn locked")),
        ("pendulum_ball", 2, ()),
    ],
)
def test_slides_balls_and_each_part_of_a_free_joint_are_locked_alike(model, joints, scenes):
    of_blocks = blocks(setup_of(PATHS[model]))
    assert len(of_blocks.checks) == (2**joints - 2) * 6 and failed(of_blocks) == []
    assert {*scenes} <= {check.scene for check in of_blocks.checks}


def test_subsets_of_many_joints_are_each_alone_and_some_at_random():
    assert sub_blocks.subsets(ARM.joints) == SUBSETS and len(sub_blocks.subsets("abcdef")) == 2**6 - 2
    many = sub_blocks.subsets("abcdefghijkl")
    assert len(set(many)) == len(many) == 12 + 20 and many[:12] == [(name,) for name in "abcdefghijkl"]
    assert sorted(many, key=len) == many and all(2 <= len(names) < 12 for names in many[12:])
    of_many = blocks(setup_of(chain(7)))
    assert len({check.scene for check in of_many.checks}) == 5 and failed(of_many) == []  # 1 in 6 of 27
    assert not blocks(setup_of(chain(60))).checks


def test_a_joint_of_a_file_that_cannot_be_taken_out_is_no_failure():
    text = (
        '<mujoco><worldbody><body><freejoint align="true"/><geom size="0.1" pos="0.05 0 0"/>'
        '<body pos="0 0 1"><joint name="a" axis="0 1 0"/><geom size="0.1 0.2 0.3" type="box" pos="0.1 0.2 0"/></body>'
        "</body></worldbody></mujoco>"
    )
    result = reduction.rows(setup_of(text), timed=False)
    assert any("aligned" in note for note in result.notes) and failed(result) == []


# what a scene needs


def test_the_planar_arm_moves_as_the_whole_one(engines):
    case, setup, result = ARM.cases[0], Setup.small(ARM, engines), empty()
    smaller = reduced(case)
    assert smaller.joints == ("alpha", "gamma") and times.operations(tmt.ARM) > 2 * times.operations(smaller.tree) > 0
    needs.compare_smaller(result, case, smaller, setup, "RK4")
    assert len(result.checks) == 6 and failed(result) == []
    # a planar arm that starts elsewhere is another motion
    needs.compare_smaller(result, case, smaller.changed(posture=(0, 0, 1e-6)), setup, "RK4")
    assert {check.quantity for check in result.checks if not check.passed} == {"smallest model to whole"}


OWN = {"damping": 0.1, "duration": 0.5, "dt": 1 / 64, "judged": 0.0, "tags": ("own",)}


@pytest.mark.parametrize(
    "scene, smallest",
    [
        ({"posture": (30, 20, 60), "torque": "hold", "locked": ("gamma",)}, ["none"]),
        ({"posture": (10, 20, 30), "torque": (0, 1, 0), "locked": ("beta",)}, ["alpha gamma"]),
        ({"posture": "hanging", "speed": (0, 1e-3, 0)}, []),
    ],
)
def test_a_users_own_scene_needs_what_it_needs(engines, scene, smallest):
    """Locked joints at angles, torques in N m, damping; a motion that is small is no failure."""
    case, result = ARM.case("own", **OWN | scene), empty()
    (_, whole), *smaller = needs.of_case(result, case, Setup.small(ARM, engines))
    assert failed(result) == [] and not any(check.quantity == "movement" for check in result.checks)
    assert whole.joints == ARM.joints
    assert [" ".join(model.joints) if model else "none" for _, model in smaller] == smallest


def test_a_robot_that_falls_does_not_bend():
    """Its accelerations are 0 with 50 digits of the very numbers of the file: a sum of masses in doubles would bend it."""
    case = next(case for case in setup_of(PATHS["quadruped"]).robot.cases if case.name == "stand, let go")
    need = needed(case)
    assert set(need.moves) == {"root z"} and len(need.undecided) == 15
    assert [row["found"] for row in needs.joint_rows(case, need)].count("not decided") == 15
