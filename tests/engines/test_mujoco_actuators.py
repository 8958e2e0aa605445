"""What drives a file's robot, read from its compiled model, and runs under it, of each law the same in both engines."""

import mujoco
import numpy as np
import pytest
from helpers.edited import setup_of_file
from helpers.files import TENDON, TWO, mjcf
from models import PATHS

import tmt
from compare.engines.mujoco import read
from compare.engines.tmt import Tmt

SITES = TWO.replace("<geom", '<site name="s" pos="0.1 0 0"/><geom', 1)
MUSCLE_LAW = 'gainprm="{0}" biasprm="{0}"'.format("0.75 1.05 -1 200 0.5 1.6 1.5 1.3 1.2")
LEFT_OUT = (
    '<muscle joint="k" lengthrange="0 1"/>', f'<general joint="k" gaintype="muscle" biastype="muscle" {MUSCLE_LAW}/>',
    '<general joint="k" dyntype="muscle" biastype="affine" biasprm="0 -5 0"/>', '<general joint="k" dyntype="user"/>',
    '<adhesion body="b" ctrlrange="0 1" gain="2"/>',
    '<position joint="k" kp="3" delay="0.02" nsample="3"/>', '<general joint="k" damping="1 2"/>',
    '<general tendon="t" damping="1"/>', '<pid joint="k" kp="3" ki="1"/>',
    '<orientation site="s" refsite="s" kp="1"/>',
)  # fmt: skip
KEYS = '<keyframe><key name="plain" qpos="0.1 0"/><key name="home" qpos="0.2 0" {}/></keyframe>'
LIMITED = '<position joint="j" kp="5" ctrlrange="-0.1 0.1"/><motor joint="k" ctrlrange="-0.7 0.7"/>'
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
    "a DC motor": ('<dcmotor joint="a" motorconst="0.7" resistance="0.5"/><position joint="b" kp="30"/>', 'ctrl="2 0.1"', 2),
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


def controller_of(text, posture="", q=(0.0, 0.0), **targets):
    return read(text).drive.controller(posture, np.array(q), **targets)


@pytest.mark.parametrize("text", LEFT_OUT)
def test_what_has_no_affine_law_is_left_out_by_name_and_the_rest_is_done(text):
    more = text.replace(" ", ' name="x" ', 1)
    found = controller_of(text_of('<position name="p" joint="j" kp="5"/>' + more, content=SITES))
    assert found.left_out == ("x",) and found.controls[1] is None
    assert found.controls[0] == 0.0 and found.position_gain.tolist() == [[5.0, 0.0], [0.0, 0.0]]


@pytest.mark.parametrize("actuators, key, expected", [
    (PLAIN, 'ctrl="0.5 0.25"', (0.5, 0.25)), (PLAIN, 'ctrl="0 0"', (0.0, 0.0)), (PLAIN, "", (0.2, 0.0)),
    (KEPT, 'ctrl="0.9 0.8" act="0.3 0.2"', (0.3, 0.8)),  # an integrator's activation, a filter's control
    (KEPT, 'act="0.3 0.2"', (0.3, 0.0)), (LIMITED, 'ctrl="0.5 9"', (0.1, 0.7)),
])  # fmt: skip
def test_controls_are_those_that_a_keyframe_states_else_servos_hold_the_posture(actuators, key, expected):
    text = text_of(actuators, keys=KEYS.format(key))
    assert controller_of(text, "home", (0.2, 0.0)).controls == pytest.approx(expected)
    if actuators != LIMITED:
        assert controller_of(text, "plain", (0.1, 0.0)).controls == pytest.approx((0.1, 0.0))


SERVOS = {  # actuators, of which the first is a servo; g0, g1, b0, b1, b2 of it and its moment
    "position": ('<position joint="k" kp="50" kv="4" gear="-2"/>', (50.0, 0.0, 0.0, -50.0, -4.0), (0.0, -2.0)),
    "tendon": ('<general tendon="t" gainprm="30" biastype="affine" biasprm="1 -20 0"/>',
               (30.0, 0.0, 1.0, -20.0, 0.0), (1.0, 2.0)),
    "affine gain": ('<general joint="j" gaintype="affine" gainprm="20 3" biastype="affine" biasprm="0.3 -20 -3"/>',
                    (20.0, 3.0, 0.3, -20.0, -3.0), (1.0, 0.0)),
}  # fmt: skip


@pytest.mark.parametrize("name", SERVOS)
def test_a_servo_has_the_gains_of_its_law_and_is_without_force_at_its_moved_target(name):
    actuator, (g0, g1, b0, b1, b2), moment = SERVOS[name]
    J, q, by = np.array(moment), np.array([0.3, -0.4]), np.array([0.1, 0.02])
    for targets in (0.0, by):
        found = controller_of(text_of(actuator), "", q, targets=targets)
        (u,), length = found.controls, J @ q + np.abs(J) @ np.broadcast_to(targets, 2)
        assert (g0 + g1 * length) * u + b0 + b1 * length == pytest.approx(0.0, abs=1e-12)
        assert found.position_gain == pytest.approx(np.outer(J, J) * -(g1 * u + b1))
        assert found.speed_gain == pytest.approx(np.outer(J, J) * -b2)
        assert found.torque == pytest.approx(J * (g0 * u + b0))


@pytest.mark.parametrize("actuator, takes_part", [
    ('<position joint="j" kp="5"/>', True), ('<position joint="j" kp="5" group="2"/>', False),  # which is disabled
    ('<general joint="j" gainprm="5" biastype="affine" biasprm="0 5 -1"/>', False),  # it pushes away
    ('<motor site="s" gear="0.1 0.7 0.3 0 0 0"/>', False), ('<velocity joint="j" kv="5"/>', True),
    ('<motor joint="j"/>', True), ('<damper joint="j" kv="3" ctrlrange="0 1"/>', True),
])  # fmt: skip
def test_which_actuators_take_part(actuator, takes_part):
    content = '<site name="s" pos="0.1 0 0"/><geom'.join(TWO.rsplit("<geom", 1))
    text = text_of(actuator.replace(" ", ' name="a" ', 1), content=content)
    text = text.replace("<mujoco>", '<mujoco><option actuatorgroupdisable="2"/>', 1)
    found = controller_of(text)
    assert (found.controls != (None,)) == takes_part == (found.left_out == ())
    assert takes_part or not np.any([found.torque, *found.position_gain, *found.speed_gain])


@pytest.mark.parametrize("actuator, feeds_back", [
    ('<motor joint="j"/>', False), ('<position joint="j" kp="5"/>', True), ('<velocity joint="j" kv="5"/>', True),
    ('<damper joint="j" kv="3" ctrlrange="0 1"/>', True), ("", False),
])  # fmt: skip
def test_a_drive_feeds_back_if_a_force_depends_on_the_state(actuator, feeds_back):
    assert read(text_of(actuator)).drive.feeds_back is feeds_back


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
    gains = reading.drive.controller("", np.zeros(2))
    assert gains.position_gain == pytest.approx(2.0 * np.outer([5.0, 10.0], [5.0, 10.0]))
    assert tmt.mass_matrix(reading.tree, np.zeros(2)) == pytest.approx(mass_matrix(model))


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
