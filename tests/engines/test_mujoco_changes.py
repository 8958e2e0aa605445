"""Changes of a model, by what they do to forces, against plain MuJoCo and closed forms."""

import mujoco
import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco import changes

HINGE = """<mujoco><option timestep="0.01"/><worldbody><body><joint name="j" axis="0 0 1"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
  <actuator>{}</actuator><keyframe>{}</keyframe></mujoco>"""
BALL = """<mujoco><option timestep="0.002" {option}/><worldbody><geom name="floor" type="plane" size="1 1 1" {floor}/>
  <body pos="0 0 0.1"><freejoint/><geom name="ball" size="0.1" {floor}/></body></worldbody>
  <contact>{pair}</contact></mujoco>"""


def forces(model, q, v, u):
    data = mujoco.MjData(model)
    data.qpos[:], data.qvel[:], data.ctrl[:] = q, v, u
    mujoco.mj_forward(model, data)
    return float(data.qfrc_actuator[0])


@pytest.mark.parametrize("actuator, exact", [
    ('<position joint="j" kp="20" kv="3"/>', lambda q, v, u, kv: 20.0 * (u - q) - 3.0 * kv * v),
    ('<velocity joint="j" kv="3"/>', lambda q, v, u, kv: 3.0 * kv * (u - v)),
    ('<damper joint="j" kv="3" ctrlrange="0 1"/>', lambda q, v, u, kv: -3.0 * kv * u * v),
    ('<general joint="j" gainprm="2" biastype="affine" biasprm="0 0 -3"/>', lambda q, v, u, kv: 2.0 * u - 3.0 * kv * v),
    ('<intvelocity joint="j" kp="20" kv="3" actrange="-1 1"/>', lambda q, v, u, kv: -20.0 * q - 3.0 * kv * v),
])  # fmt: skip
def test_kv_of_every_servo_and_damper_changes_and_its_target_does_not(actuator, exact):
    model = mujoco.MjModel.from_xml_string(HINGE.format(actuator, ""))
    for factor in (1.0, 0.25):
        found = model if factor == 1.0 else changes.with_kv(model, factor)
        assert forces(found, 0.2, 0.7, 0.5) == pytest.approx(exact(0.2, 0.7, 0.5, factor))
    assert forces(model, 0.2, 0.7, 0.5) == pytest.approx(exact(0.2, 0.7, 0.5, 1.0))  # as it was
    motor = mujoco.MjModel.from_xml_string(HINGE.format('<motor joint="j"/>', ""))
    assert changes.with_kv(motor, 0.25) is None


FACTOR = 5.0
NO_CONTACT = 'contype="0" conaffinity="0"'
CONTACTS = {  # option, geoms, pair; whether there is a time constant to change
    "of geoms": ("", 'solref="0.01 1"', "", True),
    "of a pair": ("", NO_CONTACT, '<pair geom1="ball" geom2="floor" solref="0.01 1"/>', True),
    "of the options": ('o_solref="0.01 1"><flag override="enable"/></option><option', "", "", True),
    "by stiffness and damping": ("", 'solref="-1000 -50"', "", False),
}


@pytest.mark.parametrize("kind", CONTACTS)
def test_slower_contacts_are_slower_wherever_their_time_is_stated(kind):
    option, floor, pair, has_time = CONTACTS[kind]
    model = mujoco.MjModel.from_xml_string(BALL.format(option=option, floor=floor, pair=pair))
    slower = changes.with_slower_contacts(model, FACTOR)
    assert (slower is not None) == has_time
    if slower is not None:
        stiffness = []
        for found in (model, slower):
            data = mujoco.MjData(found)
            data.qpos[2] = 0.095
            mujoco.mj_forward(found, data)
            stiffness.append(data.efc_KBIP[0, 0])
        assert stiffness[0] == pytest.approx(FACTOR**2 * stiffness[1])


def test_masses_that_are_stated_as_compiled_do_not_change_with_what_else_there_is():
    rods = "".join(f'<body name="{name}"><joint/><geom size="0.{r}"/></body>' for name, r in zip("ab", "12"))
    text = f'<mujoco><compiler settotalmass="3"/><worldbody>{rods}</worldbody></mujoco>'
    spec = mujoco.MjSpec.from_string(text)
    model = spec.compile()
    changes.state_as_compiled(spec, model, range(model.nbody))
    spec.delete(spec.body("b"))
    alone = spec.compile()
    assert alone.body("a").mass == model.body("a").mass < 1.0
    assert np.allclose(alone.body("a").inertia, model.body("a").inertia, rtol=1e-15)


def test_changes_are_of_a_copy_and_of_what_they_name():
    model = mujoco.MjModel.from_xml_path(str(PATHS["quadruped"]))
    full, heavier_full = np.zeros((2, model.nv, model.nv))
    heavier = changes.with_armature(model, 0.1)
    for found, M in ((model, full), (heavier, heavier_full)):
        data = mujoco.MjData(found)
        mujoco.mj_forward(found, data)
        mujoco.mj_fullM(found, data, M)
    assert heavier_full - full == pytest.approx(np.diag([0.0] * 6 + [0.1] * (model.nv - 6)), abs=1e-12)
    assert changes.with_iterations(model, 5000).opt.iterations == 5000
    assert changes.with_iterations(model, 1) is None
    fixed = mujoco.MjModel.from_xml_string(HINGE.format("", ""))  # its inertia never changes
    data, M = mujoco.MjData(changes.with_armature(fixed, 0.5)), np.zeros((1, 1))
    mujoco.mj_forward(data.model, data)
    mujoco.mj_fullM(data.model, data, M)
    assert M[0, 0] == pytest.approx(1.5)


@pytest.mark.parametrize("actuator, gains, exact", [
    ('<position joint="j" kp="20" kv="3"/>', {}, lambda q, v: 20.0 * (0.5 - q) - 3.0 * v),
    ('<position joint="j" kp="20" ctrlrange="-0.1 0.1"/>', {}, lambda q, v: 20.0 * (0.1 - q)),
    ('<damper joint="j" kv="3" ctrlrange="0 1"/>', {}, lambda q, v: -1.5 * v),
    ('<motor joint="j"/>', {"kp": 7.0, "kv": 2.0}, lambda q, v: 7.0 * (0.1 - q) - 2.0 * v),
    ('<motor joint="j"/>', {"kp": 0.0, "kv": 2.0}, lambda q, v: -2.0 * v),
    ('<motor joint="j"/>', {"kv": 2.0}, lambda q, v: -2.0 * v),
    ('<motor joint="j"/>', {}, None), ('<position joint="j" kp="20" kv="3"/>', {"kp": 7.0}, None),
])  # fmt: skip
def test_a_program_has_the_law_of_the_servos_that_it_replaces_or_the_gains_given(actuator, gains, exact):
    model = mujoco.MjModel.from_xml_string(HINGE.format(actuator, ""))
    found = changes.program(model, np.array([0.5]), np.array([0.1]), **gains)
    assert (found is None) == (exact is None)
    if found is not None:
        data = mujoco.MjData(found.model)
        data.qpos[:], data.qvel[:] = 0.2, 0.7
        mujoco.mj_step1(found.model, data)
        controls = found.controls(data)
        assert controls == pytest.approx([exact(0.2, 0.7)])
        assert forces(found.model, 0.2, 0.7, controls) == pytest.approx(exact(0.2, 0.7))
