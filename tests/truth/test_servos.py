"""Forces at rest under any drive, and their derivatives, beside those of MuJoCo."""

from functools import lru_cache

import mujoco
import numpy as np
import pytest
from driven_models import TRANSMISSIONS, with_drive

from compare.engines.mujoco import read
from compare.engines.mujoco.acting import Acting
from compare.engines.mujoco.actuators import control_of
from compare.robots.file import robot_of
from compare.truth.servos import Driven

# of the largest force; of the largest derivative, by central differences of NUDGE
ROUNDING, DIFFERENCED, NUDGE = 1e-12, 1e-6, 1e-5

ARM = """<mujoco><compiler angle="radian"/>
<option gravity="0 0 {gravity}"><flag contact="disable" constraint="disable"/></option>
<worldbody><body {body}><joint name="a" axis="0 1 0" {joint}/><geom size="0.1" pos="0.3 0 0"/><site name="s" pos="0.3 0 0"/>
<body pos="0.3 0 0" {body}><joint name="b" axis="0 1 0"/><geom size="0.1" pos="0.2 0.1 0"/></body></body></worldbody>
<tendon><fixed name="t" {tendon}><joint joint="a" coef="1"/><joint joint="b" coef="2"/></fixed></tendon>
<actuator>{actuators}</actuator></mujoco>"""


def arm(actuators='<motor joint="a"/>', body="", joint="", tendon="", gravity=-9.81):
    return ARM.format(actuators=actuators, body=body, joint=joint, tendon=tendon, gravity=gravity)


@lru_cache(maxsize=64)
def driven_of(text):
    """The Driven of a text, and MuJoCo's model as the file has it."""
    reading = read(text)
    robot = robot_of(reading, "robot.xml")
    return Driven(robot.tree, robot.drive, Acting(reading.model, robot.drive).along), reading.model


def of_mujoco(driven, model, q, qd, u):
    """The sum of all forces that MuJoCo has, (nv,)."""
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:] = q, qd
    for i, one in enumerate(driven.drive.actuators):
        place, inputs = control_of(model, i)
        data.ctrl[place : place + inputs] = u[i]
        if one.dynamics != "none":
            data.act[model.actuator_actadr[i]] = u[i]
    mujoco.mj_forward(model, data)
    return data.qfrc_actuator + data.qfrc_passive - data.qfrc_bias


def assert_the_same(text, rng, q=None, u=None):
    """Forces to rounding, and K and D beside central differences of MuJoCo's forces."""
    driven, model = driven_of(text)
    n, every = model.nv, driven.drive.actuators
    q = driven.coordinates.move(model.qpos0, rng.uniform(-0.6, 0.6, n)) if q is None else q
    u = rng.uniform(-1.0, 1.0, len(every)) if u is None else u
    u = np.array([one.clamped(x) for one, x in zip(every, u)])
    force, size = driven.forces(q, u)
    assert np.abs(force - of_mujoco(driven, model, q, np.zeros(n), u)).max() <= ROUNDING * max(1.0, size)
    K, D = np.zeros((2, n, n))
    for k, step in enumerate(NUDGE * np.eye(n)):
        steps, move = (-step, step), driven.coordinates.move
        by_q = [of_mujoco(driven, model, move(q, change), 0.0, u) for change in steps]
        by_qd = [of_mujoco(driven, model, q, change, u) for change in steps]
        K[:, k], D[:, k] = ((low - high) / (2.0 * NUDGE) for low, high in (by_q, by_qd))
    slopes = driven.slopes(q, u)
    for ours, theirs in ((slopes.K, K), (slopes.D, D)):
        assert np.abs(ours - theirs).max() <= DIFFERENCED * max(1.0, np.abs(theirs).max())
    return driven, slopes, driven.cut(q, u)


@pytest.mark.parametrize("transmission", TRANSMISSIONS)
def test_every_law_at_every_transmission_has_the_forces_of_mujoco_and_their_derivatives(transmission, rng):
    assert_the_same(with_drive(1, (transmission,)), rng)


@pytest.mark.parametrize("stage", ["gravity", "spring", "damper", "actuation", "clampctrl"])
def test_what_a_flag_switches_off_is_off(stage, rng):
    assert_the_same(with_drive(3, flags={stage: "disable"}), rng)


CUT = {  # a drive whose ranges cut at the posture (0.3, -0.4) under controls of 1, and the forces that are cut
    "a force": (arm('<position joint="a" kp="30" kv="2" forcerange="-5 5"/>'), {0: 5.0}),
    "no force": (arm('<position joint="a" kp="30" kv="2" forcerange="-21.001 21.001"/>'), {}),  # just inside
    "by the joint": (arm('<position joint="a" kp="30" gear="-2"/>', joint='actuatorfrcrange="-20 9"'), {0: 10.0}),
}  # fmt: skip


@pytest.mark.parametrize("text, forces", CUT.values(), ids=CUT)
def test_what_a_range_cuts_has_neither_stiffness_nor_damping(text, forces, rng):
    u = np.ones(text.count("<motor") + text.count("<position"))
    _, _, cut = assert_the_same(text, rng, np.array([0.3, -0.4]), u)
    assert cut == pytest.approx(forces)


def test_a_rest_is_found_from_a_posture_that_is_none():
    driven, model = driven_of(arm('<position joint="a" kp="300"/><position joint="b" kp="300"/>'))
    q, left = driven.at_rest(np.zeros(2), np.zeros(2))
    assert left == 0.0 and 0.01 < np.abs(q).max() < 0.5
    assert np.abs(of_mujoco(driven, model, q, np.zeros(2), np.zeros(2))).max() < 1e-9
    assert driven.at_rest(q, np.zeros(2))[0] == pytest.approx(q, abs=1e-12)


@pytest.mark.parametrize("most, left", [(19.61, 0.01), (19.63, 0.0)])
def test_a_servo_that_is_too_weak_for_its_range_finds_no_rest(most, left):
    """Of 2 kg, 19.62 N."""
    body = '<body><joint name="a" type="slide" axis="0 0 1"/><geom size="0.1" mass="2"/></body>'
    servo = f'<position joint="a" kp="100" forcerange="-{most} {most}"/>'
    driven, _ = driven_of(f"<mujoco><worldbody>{body}</worldbody><actuator>{servo}</actuator></mujoco>")
    assert driven.at_rest(np.zeros(1), np.zeros(1))[1] == pytest.approx(left)


def test_what_only_rounding_leaves_is_a_rest():
    """At the targets of servos whose gains are no numbers in binary; and straight up."""
    servo = '<general joint="{}" gainprm="0.7" biastype="affine" biasprm="0.1 -0.3 0"/>'
    driven, _ = driven_of(arm(servo.format("a") + servo.format("b"), gravity=0.0))
    q = np.array([0.1, 0.7])
    u = np.array([actuator.target(angle) for actuator, angle in zip(driven.drive.actuators, q)])
    assert driven.at_rest(q, u)[1] == 0.0
    rod = '<body euler="0.3 0 0"><joint axis="0 1 0" ref="0.1"/><geom size="0.1" pos="0.1 0 0.7"/></body>'
    driven, _ = driven_of(f'<mujoco><compiler angle="radian"/><worldbody>{rod}</worldbody></mujoco>')
    assert driven.at_rest(np.array([0.1 - np.arctan(0.1 / 0.7)]), np.zeros(0))[1] == 0.0
