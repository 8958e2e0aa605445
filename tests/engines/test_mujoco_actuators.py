"""What drives a file's robot, read from its compiled model, and runs under it, of each law the same in both engines."""

import mujoco
import numpy as np
import pytest
from edited import setup_of_file
from files import TENDON, TWO, mjcf
from models import PATHS

import tmt
from compare.engines.mujoco import read
from compare.engines.mujoco.step import Step, start_of
from compare.engines.tmt import Tmt

SITES = TWO.replace("<geom", '<site name="s" pos="0.1 0 0"/><geom', 1)
REFUSED = {  # actuator, and a word of why it takes no part
    '<muscle joint="k" lengthrange="0 1"/>': "muscle", '<general joint="k" dyntype="user"/>': "user",
    '<general joint="k" gaintype="user" biastype="user"/>': "user",
    '<dcmotor joint="k" motorconst="0.1" resistance="1"/>': "DC",
    '<adhesion body="b" ctrlrange="0 1" gain="2"/>': "body",
    '<position joint="k" kp="3" delay="0.02" nsample="3"/>': "delay",
    '<general joint="k" damping="1 2"/>': "damping", '<general tendon="t" damping="1"/>': "damping",
    '<pid joint="k" kp="3" ki="1"/>': "pid", '<orientation site="s" refsite="s" kp="1"/>': "so3",
}  # fmt: skip
KEYS = '<keyframe><key name="plain" qpos="0.1 0"/><key name="home" qpos="0.2 0" {}/></keyframe>'
PLAIN = '<position joint="j" kp="5"/><motor joint="k"/>'
KEPT = '<intvelocity joint="j" kp="5" actrange="-1 1"/><general joint="k" dyntype="filter" dynprm="0.1"/>'
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


def text_of(actuators='<motor joint="k"/>', tendon="", content=TWO, keys=""):
    """MJCF text, or a skip where the installed MuJoCo does not have what stands in it."""
    text = mjcf(content, after=TENDON.format(tendon) + f"<actuator>{actuators}</actuator>{keys}")
    try:
        mujoco.MjModel.from_xml_string(text)
    except ValueError as error:
        pytest.skip(f"not in this MuJoCo: {' '.join(str(error).split())}")
    return text


@pytest.mark.parametrize("text", REFUSED)
def test_a_law_that_is_not_known_is_refused_by_name_and_the_rest_is_done(text):
    more = text.replace(" ", ' name="x" ', 1)
    drive = read(text_of('<position name="p" joint="j" kp="5"/>' + more, content=SITES)).drive
    known, other = drive.actuators
    assert (known.name, known.refused) == ("p", "") and REFUSED[text] in other.refused


@pytest.mark.parametrize("actuators, key, expected", [
    (PLAIN, 'ctrl="0.5 0.25"', (0.5, 0.25)), (PLAIN, 'ctrl="0 0"', (0.0, 0.0)), (PLAIN, "", None),
    (KEPT, 'ctrl="0.9 0.8" act="0.3 0.2"', (0.3, 0.8)),  # an integrator's activation, a filter's control
    (KEPT, 'act="0.3 0.2"', (0.3, None)),
])  # fmt: skip
def test_a_keyframe_states_controls_activations_or_neither(actuators, key, expected):
    controls = read(text_of(actuators, keys=KEYS.format(key))).drive.controls
    assert controls.get("home") == expected and "plain" not in controls


@pytest.mark.parametrize("key, activations", [
    ('ctrl="0.5 0.25" act="0.1 0.2"', (0.1, 0.2)), ('ctrl="0.5 0.25"', (0.5, 0.25)),
])  # fmt: skip
def test_a_run_starts_with_the_activations_of_its_keyframe_else_where_the_controls_lead(key, activations):
    filters = "".join(f'<general joint="{joint}" dyntype="filter" dynprm="0.1"/>' for joint in "jk")
    reading = read(text_of(filters, keys=KEYS.format(key)))
    step = Step(reading.model, 1e-3, "Euler")
    step.put(start_of(reading.model, reading.drive, "home", np.zeros(2)))
    assert tuple(step.data.act) == activations and tuple(step.data.ctrl) == (0.5, 0.25)


def mass_matrix(model):
    data, full = mujoco.MjData(model), np.zeros((model.nv, model.nv))
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, full)
    return full


def test_an_actuator_after_one_with_several_outputs_has_its_own_gear():
    before = '<orientation site="s" refsite="s" kp="1"/>'
    motor = '<motor joint="j" gear="3" armature="0.1"/><position tendon="t" kp="2" gear="5"/>'
    text = text_of(before + motor, content=SITES)
    reading, model = read(text), mujoco.MjModel.from_xml_string(text)
    assert [one.moment for one in reading.drive.actuators[1:]] == [(3.0, 0.0), (5.0, 10.0)]
    assert tmt.mass_matrix(np.zeros(2), reading.tree) == pytest.approx(mass_matrix(model))


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


@pytest.mark.parametrize("option, why", [
    ('actuatorgroupdisable="2"', "group 2"), ('actuatorgroupdisable="1"', ""), ("", ""),
])  # fmt: skip
def test_an_actuator_of_a_group_that_the_file_disables_is_off(option, why):
    motor = '<actuator><motor name="a" joint="j" group="2"/></actuator>'
    (actuator,) = read(mjcf(before=f"<option {option}/>", after=motor)).drive.actuators
    assert why in actuator.off and bool(why) is bool(actuator.off)
