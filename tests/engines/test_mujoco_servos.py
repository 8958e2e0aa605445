"""A robot's own actuators in both engines: the same scheme for every integrator, to rounding, on files and on one of each law."""

import numpy as np
import pytest
from edited import setup_of_file
from models import PATHS

from compare.engines.tmt import Tmt

CLOSE = 1e-13  # of the largest speed, or of 1 rad or m
MODEL = """
<mujoco><compiler angle="radian"/><option timestep="0.002" integrator="implicitfast" solver="PGS" iterations="1"/>
  <worldbody><body><geom size=".1" mass="1" pos="0.1 0 0.2"/>
    <joint name="a" axis="0 1 0" damping="0.3" armature="0.01" ref="0.2" actuatorfrcrange="-0.1 0.1"/>
    <body pos="0 0 .3"><geom size=".1" mass=".5" pos="0 .1 .2"/>
      <joint name="b" axis="1 0 0" stiffness="5" springref="0.3" range="-0.01 0.01"/></body>
    <body pos="0 .3 0"><geom size=".1" mass=".7"/>
      <joint name="c" type="slide" axis="1 0 0"/><joint name="d" type="slide" axis="0 1 0"/></body></body></worldbody>
  <tendon><fixed name="across"><joint joint="b" coef="0.5"/><joint joint="c" coef="-0.7"/></fixed>
    <fixed name="along"><joint joint="c" coef="0.5"/><joint joint="d" coef="-0.7"/></fixed></tendon>
  <actuator>{}</actuator><keyframe><key name="start" qpos="0.1 0.2 0.05 0.02" {}/></keyframe></mujoco>
"""
MUSCLE = '<muscle joint="a" ctrlrange="0 1" lengthrange="0 1"/><position joint="b" kp="30" kv="1"/>'
AFFINE = '<general joint="a" gaintype="affine" gainprm="20 3 -4" biastype="affine" biasprm="0.3 -20 -3"/>'
PUSHING = '<general joint="a" gainprm="20" biastype="affine" biasprm="0 20 -3"/><position joint="b" kp="9"/>'
LAWS = {  # actuators, what the keyframe states, and how many take part
    "gears": ('<position joint="a" kp="50" kv="4" gear="3"/><velocity joint="b" kv="2" gear="-2"/>', 'ctrl="0.3 0.5"', 2),
    "clamps": ('<position joint="a" kp="50" kv="4" ctrlrange="-0.1 0.1" forcerange="-1 1"/>', "", 1),
    "the law in full": (AFFINE, 'ctrl="0.3"', 1), "a muscle beside": (MUSCLE, 'ctrl="0.7 0.1"', 1),
    "a filter": ('<position joint="a" kp="50" kv="4" timeconst="0.03"/><motor joint="c"/>', 'ctrl="0.3 2"', 2),
    "an integrator": ('<intvelocity joint="a" kp="50" kv="4" actrange="-1 1"/>', 'act="0.3"', 1),
    "a damper": ('<damper joint="a" kv="3" ctrlrange="0 1"/><position joint="b" kp="30"/>', 'ctrl="0.7 0.1"', 2),
    "tendons": ('<position tendon="across" kp="50" kv="14"/><position tendon="along" kp="50" kv="14" group="1"/>', "", 2),
    "one that pushes away beside": (PUSHING, "", 1),
}  # fmt: skip


@pytest.mark.parametrize("name", LAWS)
def test_every_law_is_the_same_in_both(name):
    """All integrators on a file: trajectory/test_trajectory_wrong_schemes.py."""
    *content, count = LAWS[name]
    setup = setup_of_file(MODEL.format(*content))
    robot, known = setup.robot, setup.engines["mujoco"]
    case = robot.case("step", posture="start", torque="servos", targets=(3.0, 3.0, 0.02, 0.02))  # deg, m
    assert sum(u is not None for u in case.controller.controls) == count
    integrators = {"discrete", "implicit", "implicitfast"} if name == "tendons" else {"implicitfast"}
    start = case.q, np.random.default_rng(1).normal(size=len(case.v)) * 0.1, case.tau, 1e-3, 20
    for integrator in integrators & known.methods_in(case).keys():
        theirs, ours = known.of(case).run(*start, integrator), Tmt().of(case).run(*start, integrator)
        assert np.abs(theirs.q - ours.q).max() < CLOSE
        assert np.abs(theirs.v - ours.v).max() < CLOSE * np.abs(ours.v).max()


def test_actuators_act_in_their_own_scene_alone():
    setup = setup_of_file(PATHS["gripper"])
    robot, known = setup.robot, setup.engines["mujoco"]
    case = robot.case("servos", posture="open", torque="servos", targets=(6.0, 6.0, 0.02, 0.02))
    plain = robot.case("plain", posture="open")
    assert known.methods_in(plain) == known.methods and Tmt().methods_in(plain).keys() == Tmt().methods.keys()
    assert "implicitfast" in Tmt().methods_in(case) and "implicitfast" not in Tmt().methods
    for one in (plain, case, plain):  # each keeps its own model
        dynamics, ours = known.of(one), Tmt().of(one)
        wanted = case.tau - np.array(case.tree.position_gain) @ case.q if one is case else 0.0
        assert np.allclose(dynamics.other_forces(one.q, one.v)["actuators"], wanted, atol=1e-12)
        assert np.allclose(dynamics.acceleration(*one.start, one.tau), ours.acceleration(*one.start, one.tau))
