"""Reduction of robots of files: every kind of joint locked in both engines, and runs compared in movements."""

import dataclasses

import numpy as np
import pytest
from models import PATHS, chain, random_tree

import tmt
from compare.engines.mujoco import engine, read
from compare.experiments import reduction
from compare.experiments.reduction import cost, exact_motion, needs, sub_blocks, times
from compare.judge.check import Result
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup, engines
from compare.truth.pendulum import pendulum, swing
from compare.truth.smallest import Needed, needed


def setup_of(source, size="small"):
    """A robot of a file, its engines, and few states."""
    reading = read(source)
    return getattr(Setup, size)(robot_of(reading, "robot.xml"), engines(engine(reading)))


@pytest.fixture(scope="module")
def gripper():
    return setup_of(PATHS["gripper"])


@pytest.fixture(scope="module")
def free_body():
    return setup_of(PATHS["free_body"])


def blocks(setup):
    result = Result("reduction")
    sub_blocks.compare_blocks(result, setup, angles=1)
    return result


def test_slides_are_locked_alike(gripper):
    result = blocks(gripper)
    assert len(result.checks) == (2**4 - 2) * 6 and all(check.passed for check in result.checks)
    assert {check.unit for check in result.checks} == {"kg m2, kg m or kg", "N m or N"}


def test_each_part_of_a_free_joint_is_locked_alike(free_body):
    result = blocks(free_body)
    assert {"stone turn locked", "stone x and stone turn locked"} <= {check.scene for check in result.checks}
    assert all(check.passed for check in result.checks)


def test_of_many_joints_some_subsets_are_locked_and_that_is_said():
    setup = setup_of(random_tree(3))
    result = blocks(setup)
    assert 6 <= len({check.scene for check in result.checks}) <= 8 and all(check.passed for check in result.checks)
    assert "Not all sets of joints are locked in turn, but 6, 1 in 6 of" in result.notes[0]
    assert all(row["operations_whole"] is None for row in result.tables["reduction_subsets"])


def test_of_hundreds_of_joints_none_is_locked_and_that_is_said():
    result = blocks(setup_of(chain(60)))
    assert not result.checks and "No joints are locked" in result.notes[0]


def test_a_wrong_lock_of_a_ball_is_seen():
    """Locked at its reference, whatever the case asks for."""
    setup = setup_of(PATHS["pendulum_ball"])
    known = setup.engines["mujoco"]

    class Forgetful(type(known)):
        def of(self, case):
            return super().of(case.changed(posture=()) if case.locked else case)

    assert all(check.passed for check in blocks(setup).checks)
    wrong = Forgetful(known.model, known.joints, known.bodies, known.source, known.bare, methods=known.methods)
    checks = blocks(dataclasses.replace(setup, engines={**setup.engines, "mujoco": wrong})).checks
    assert {check.scene for check in checks if not check.passed} == {"upper locked", "lower locked"}


def test_a_far_anchor_is_in_the_scale():
    """Terms that cancel are as large as the distance to the anchor, whatever the bias is."""
    body = '<inertial pos="0.1 0.02 0.03" mass="1" diaginertia="0.01 0.02 0.025"/>'
    setup = setup_of(
        f'<mujoco><worldbody><body pos="0 0 0.1"><joint axis="0 1 0" pos="1e4 0 0"/>{body}<body pos="0 0 0.1">'
        f'<joint axis="0 1 0"/>{body}</body></body></worldbody></mujoco>'
    )
    assert all(check.passed and check.over_tolerance < 0.1 for check in blocks(setup).checks)


def test_a_joint_at_its_reference_is_locked_there():
    tree = read(PATHS["mixed"]).tree
    held = sub_blocks.at_zero(tree, tree.hinge_names[:-1])
    assert set(tree.lock(held).hinge_names) == {tree.hinge_names[-1]}
    assert all(len(np.atleast_1d(value)) in (1, 4) for value in held.values())


def test_a_held_posture_with_springs_needs_nothing(gripper):
    held = next(case for case in gripper.robot.cases if case.is_held)
    assert held.tree.has_springs and needed(held).stays == held.joints
    rigid = held.changed(torque=tuple(tmt.gravity_balance(held.posture, held.whole)))  # without what the springs need
    assert needed(rigid).stays == ()


def test_accelerations_have_the_unit_of_their_joint(gripper, free_body):
    (let_go, *_) = (case for case in gripper.robot.cases if not case.is_held)
    why = needed(let_go).moves
    assert why["left"].split()[3:5] == ["4.5", "m/s2"] and "rad/s2" in why["wrist"]
    thrown = next(case for case in free_body.robot.cases if case.name.endswith("thrown"))
    assert needed(thrown).moves["stone turn"] == "stone turn has a speed at the start"


def test_a_body_that_falls_does_not_turn_and_a_smaller_case_keeps_its_places(free_body):
    case = next(case for case in free_body.robot.cases if case.name.endswith("let go"))
    smaller = case.changed(locked=("stone x", "stone turn"))
    assert needs.free_places(case, smaller) == [1, 2, 8, 9]


def test_the_held_posture_of_a_file_is_judged_in_movements(free_body):
    case = next(case for case in free_body.robot.cases if case.is_held)
    result = Result("reduction", curves={"needs": {}, "apart": {}, "swings": {}})
    needs.of_case(result, case, free_body, ("RK4",))
    assert [check.quantity for check in result.checks] == ["smallest model to whole", "time judged"] * 2
    assert all(check.passed for check in result.checks)


@pytest.mark.parametrize("off, passes", [(0.99e-9, True), (1.01e-9, False)])
def test_a_movement_off_a_ball_is_named_by_its_axis(free_body, off, passes):
    coordinates, result = free_body.robot.coordinates, Result("reduction")
    apart, width = np.zeros((3, 12)), np.full((3, 12), 1e-9)
    apart[1, 4] = off
    needs.check_smaller(result, "s", coordinates, np.arange(3.0), apart, width, 2.0)
    assert result.checks[0].passed is passes and "stone turn y at t = 1.000 s" in result.checks[0].note
    assert result.checks[0].unit == "rad"


def test_costs_of_a_file_are_measured_with_its_own_step(free_body):
    case = cost.fall_case(free_body.robot)
    assert case.scene.dt == free_body.robot.cases[1].scene.dt and case.steps == cost.FALL_STEPS
    assert times.finer(case) == 1 and times.finer(ARM.cases[0]) == times.FINER_RUNS


def test_what_the_linear_modes_do_not_have_is_not_compared(gripper):
    assert exact_motion.not_linear(gripper.robot.tree) == "it has damping"
    springs = dataclasses.replace(tmt.ARM, stiffness=(1.0, 0.0, 0.0))
    assert "springs" in exact_motion.not_linear(springs) and exact_motion.not_linear(tmt.ARM) is None


def test_a_pendulum_with_armature_and_a_reference_swings_as_the_elliptic_function():
    tree = dataclasses.replace(
        tmt.ARM.lock({"alpha": 0.3, "beta": 0.2}), armature=(0.4,), reference=(0.5,), damping=(0.0,)
    )
    hanging, frequency = pendulum(tree)
    t, q, _ = tmt.simulate([0.7], [0.2], [0.0], 2.0 / 4000, 4000, "rk4", tree)
    assert np.abs(q[:, 0] - swing(t, 0.7, 0.2, hanging, frequency)).max() < 1e-10


def test_a_joint_that_cannot_be_taken_out_is_said_of_a_file():
    text = (
        '<mujoco><worldbody><body><freejoint align="true"/><geom size="0.1" pos="0.05 0 0"/>'
        '<body pos="0 0 1"><joint name="a" axis="0 1 0"/><geom size="0.1 0.2 0.3" type="box" pos="0.1 0.2 0"/></body>'
        "</body></worldbody></mujoco>"
    )
    result = reduction.rows(setup_of(text), timed=False)
    assert any("Nothing is reduced" in note and "aligned" in note for note in result.notes)
    assert all(check.passed for check in result.checks)


@pytest.mark.parametrize("joints, speeds", [((), 0), (("lower",), 3), (("upper", "lower"), 6)])
def test_a_ball_has_three_speeds_in_the_table_of_times(joints, speeds):
    setup = setup_of(PATHS["pendulum_ball"])
    case = next(case for case in setup.robot.cases if not case.is_held)
    locked = tuple(name for name in setup.robot.joints if name not in joints)
    rows = times.time_rows([(case.name, case.changed(locked=locked) if joints else None)], setup, {}, {})
    assert {(row["hinges"], row["nv"]) for row in rows} == {(" ".join(joints) or "none", speeds)}


def test_a_robot_that_falls_does_not_bend():
    """Its accelerations are 0 with 50 digits of the very numbers of the file: a sum of masses in doubles would bend it."""
    setup = setup_of(PATHS["quadruped"])
    case = next(case for case in setup.robot.cases if case.name == "stand, let go")
    need = needed(case)
    assert set(need.moves) == {"root z"} and len(need.undecided) == 15
    words = needs.need_in_words(case, need)
    assert "and 9 more (tables/reduction_joints.csv) it is not decided" in words and "rear" not in words
    rows = needs.joint_rows(case, need)
    assert [row["found"] for row in rows].count("not decided") == 15 and len(rows) == 16


def test_what_takes_too_long_with_50_digits_is_not_decided():
    robot = setup_of(random_tree(3)).robot
    free = next(case for case in robot.cases if not case.is_held and not case.v.any())
    need = needs.not_decided(free)
    assert need == Needed((), {}, robot.joints)
    assert needs.not_decided(free.changed(speed=(1.0,) * robot.coordinates.nv)).undecided == ()


def test_the_claim_has_what_the_scenes_have(gripper):
    """No pendulum, where there is none; movements in their units; and of many joints no runs of a smaller model."""
    assert "physical pendulum" in reduction.claim(ARM) and "same motion" in reduction.claim(ARM)
    assert "physical pendulum" not in reduction.claim(gripper.robot) and "stays" in reduction.claim(gripper.robot)
    assert "rad or m," in reduction.tolerance(gripper.robot) and "0.001 rad," in reduction.tolerance(ARM)
    assert "same motion" not in reduction.claim(setup_of(PATHS["humanoid29"]).robot)
    swing = ARM.case("swing", locked=("alpha", "beta"), posture="zero").scene
    assert "physical pendulum" in reduction.claim(dataclasses.replace(ARM, scenes=(swing,)))
    hangs = dataclasses.replace(swing, posture="hanging")
    assert "physical pendulum" not in reduction.claim(dataclasses.replace(ARM, scenes=(hangs,)))


def test_joints_of_which_nothing_is_decided_make_a_sentence(gripper):
    held = next(case for case in gripper.robot.cases if case.is_held)
    words = needs.need_in_words(held, Needed((), {}, held.joints))
    assert "all 4 joints: of shoulder, wrist, left, right it is not decided" in words
