"""A robot that is read from a file: postures, scenes, and the damping and steps that are chosen for it."""

from dataclasses import replace

import numpy as np
import pytest
from helpers.judged import BOTH
from helpers.servo_models import INERTIA, hinge
from models import PATHS, chain, random_tree

import tmt
from compare.engines.mujoco import engine, read
from compare.experiments.speed.settings import scenes_of as scenes_of_speed
from compare.robots import Feature, file
from compare.robots.coordinates import free_joints
from compare.robots.file import COARSER, DURATION, SERVOS_ACT, RobotFile, robot_of, scenes_from

FOREARM = tmt.ARM.lock({"alpha": 0.0, "beta": 0.0})
ONE = replace(FOREARM, gravity=(0.0, 0.0, 0.0))  # one hinge, its inertia 0.0527 kg m2
ONLY = (Feature("hinge", ("one",), "modelled", ""),)


def file_of(tree, **changes):
    ranges, zero = (None,) * len(tree.kind), np.array(tree.zero)
    return replace(RobotFile("", None, tree, ONLY, {}, zero, ranges, "Euler", 0.002, None), **changes)


def test_postures_are_the_keyframes_qpos0_and_the_middle_and_no_two_are_equal():
    arm, ranges = tmt.ARM, ((-1.0, 2.0), None, (0.0, 1.0))
    keys = {"home": np.array([0.1, 0.2, 0.3]), "again": np.array([0.1, 0.2, 0.3]), "middle": np.zeros(3)}
    robot = robot_of(file_of(arm, keyframes=keys, ranges=ranges), "my.xml")
    # the key called middle is zero, as qpos0 is; the middle of the ranges keeps its name
    assert list(robot.poses) == ["home", "key middle", "middle"]
    np.testing.assert_array_equal(robot.posture("middle"), [0.5, 0.0, 0.5])
    assert {scene.posture for scene in robot.scenes} == {"home"}
    ranged = robot_of(file_of(arm, ranges=ranges), "my.xml")
    assert list(ranged.poses) == ["qpos0", "middle"] and ranged.scenes[0].posture == "middle"
    alone = robot_of(file_of(arm), "my.xml")
    assert list(alone.poses) == ["qpos0"] and alone.scenes[0].posture == "qpos0" and alone.is_read
    reading = read(PATHS["pendulum_ball"])  # quaternions of one turn are one posture
    turned = replace(reading, keyframes={"turned": -reading.qpos0})
    ranged = replace(reading, keyframes={}, ranges=((0.0, 1.0),) * 2)  # a ball's range is not of q
    assert [[*robot_of(one, "p.xml").poses] for one in (turned, ranged)] == [["turned"], ["qpos0"]]


@pytest.mark.parametrize("name", [*PATHS, 0, 1])
def test_both_engines_start_every_scene_alike(name):
    reading = read(PATHS[name] if name in PATHS else random_tree(name))
    robot, mujoco = robot_of(reading, "robot.xml"), engine(reading)
    assert all("own" in scene.tags and scene.judged == 0.0 for scene in robot.scenes)
    for case in robot.cases:
        ours = tmt.acceleration(case.tree, *case.start, case.tau)
        theirs = mujoco.of(case).acceleration(*case.start, case.tau)
        assert np.abs(ours - theirs).max() <= 1e-9 * (1.0 + np.abs(ours).max())
        assert np.abs(ours).max() < 1e-6 or not case.is_held
    thrown = [scene for scene in robot.scenes if scene.name.endswith("thrown")]
    assert bool(thrown) == any(feature.feature == "free" for feature in robot.features)
    assert not any("full only" in scene.tags for scene in thrown)
    regular = [scene.name for scene in robot.scenes if "regular" in scene.tags]
    assert regular == [scene.name for scene in (thrown or robot.scenes) if "speed" in scene.tags][:1]
    # a fall in which nothing else moves shows no error of a method
    moving = [scene.name for scene in scenes_of_speed(robot)]
    falls = name in ("free_body", "quadruped", "humanoid29_free")
    assert name not in PATHS or (f"{robot.scenes[0].posture}, let go" in moving) != falls


@pytest.mark.parametrize("before, shift, free", [(-1, 0.0, [1]), (0, 0.0, [1]), (-1, 0.1, [])])
def test_three_slides_and_a_ball_in_one_place_are_free(before, shift, free):
    tree = tmt.Tree(
        [*"hxyzb"], (-1, before, 1, 2, 3), [(0, 0, 0)] * 2 + [(shift, 0, 0)] + [(0, 0, 0)] * 2,
        [(0, 1, 0), *np.eye(3), *np.eye(3)], [0.0] * 7, ("arm", "stone"), (0, 4), (1.0, 1.0), [(0.1, 0, 0)] * 2,
        [np.eye(3)] * 2, (0, 0, 0), ("hinge", "slide", "slide", "slide", "ball"),
    )  # fmt: skip
    assert free_joints(tree) == free


def test_a_free_body_is_thrown_up_and_tumbles():
    scenes = {scene.name: scene for scene in robot_of(read(PATHS["free_body"]), "s.xml").scenes}
    assert scenes["qpos0, thrown"].speed == (0.0, 0.0, 2.0, 120.0, 60.0, -90.0)


def test_what_rests_where_it_is_let_go_is_set_going():
    still = replace(tmt.ARM, gravity=(0.0, 0.0, 0.0))
    names = [scene.name for scene in robot_of(file_of(still), "my.xml").scenes]
    assert names == ["qpos0, set going", "qpos0, set going, damped"]
    zero = np.zeros(3)
    fastest = np.abs(tmt.acceleration(replace(still, gravity=(0.0, 0.0, -1.0)), zero, zero, zero)).max()
    for share, found in ((0.99, "set going"), (1.01, "let go")):  # of what is seen to move
        tree = replace(still, gravity=(0.0, 0.0, -share * 1e-6 / fastest))
        assert scenes_from(tree, "qpos0", zero, 0.002, None)[-1].name == f"qpos0, {found}, damped"


@pytest.mark.parametrize("sign, how", [(1.0, "set going"), (-1.0, "held")])
def test_what_a_spring_holds_rests(sign, how):
    """The forearm, whose weight is the spring's torque k (q - rest), or is beside it."""
    rest = sign * tmt.gravity_balance(FOREARM, np.zeros(1)) / 2.0
    spring = replace(FOREARM, stiffness=(2.0,), rest=rest)
    assert scenes_from(spring, "qpos0", np.zeros(1), 0.002, None)[0].name == f"qpos0, {how}"


@BOTH
def test_methods_are_compared_with_servos_that_8192_steps_follow(share, passes):
    kp = share * INERTIA * (8192 / SERVOS_ACT) ** 2
    scenes = {scene.name: scene.tags for scene in robot_of(read(hinge(kp)), "servo.xml").scenes}
    assert ("speed" in scenes["qpos0, step of the servos"]) is passes


def test_steps_are_four_of_the_files_own_and_no_longer_than_the_fastest_rate():
    inertia = float(tmt.mass_matrix(ONE, np.zeros(1))[0, 0])
    inverse = np.array([[1.0 / inertia]])

    def count(dt, rate=0.0, swing=0.0, added=()):
        tree = replace(ONE, damping=(rate * inertia,), stiffness=(swing**2 * inertia,))
        return file.coarsest(tree, inverse, dt, added)

    assert count(1.0) == 64 and count(DURATION / 64 / COARSER) == 64
    assert count(0.99 * DURATION / 64 / COARSER) == 128 and count(1e-9) == 8192
    assert count(1.0, rate=63.9) == 64 and count(1.0, rate=64.9) == 128
    assert count(1.0, swing=63.9) == 64 and count(1.0, swing=64.9) == 128
    assert count(1.0, rate=40.0, added=(30.0 * inertia,)) == 128
    # each step of n joints has a Jacobian of (2 n)^2 entries
    for joints, steps in ((4, 8192), (40, 128)):
        assert file.coarsest(read(chain(joints)).tree, np.eye(joints), 1e-9) == steps
