"""Runs, derivatives and starts of a file against plain MuJoCo."""

import mujoco
import numpy as np
import pytest
from models import PATHS

from compare.engines.mujoco.names import INTEGRATORS
from compare.engines.mujoco.stepper import Stepper

HINGE = """<mujoco><option timestep="0.01"/><worldbody><body><joint name="j" axis="0 0 1"/>
  <inertial pos="0 0 0" mass="1" diaginertia="1 1 1"/></body></worldbody>
  <actuator>{}</actuator><keyframe>{}</keyframe></mujoco>"""
STATE = mujoco.mjtState.mjSTATE_INTEGRATION


def plain(name, dt, integrator):
    """A model and data of MuJoCo at its first keyframe, pushed."""
    model = mujoco.MjModel.from_xml_path(str(PATHS[name]))
    model.opt.timestep, model.opt.integrator = dt, INTEGRATORS[integrator]
    model.opt.disableflags |= mujoco.mjtDisableBit.mjDSBL_AUTORESET
    data = mujoco.MjData(model)
    if model.nkey:
        mujoco.mj_resetDataKeyframe(model, data, 0)
    data.qvel += 0.1 * np.sign(np.random.default_rng(3).normal(size=model.nv))
    return model, data


def state_of(model, data):
    state = np.zeros(mujoco.mj_stateSize(model, STATE))
    mujoco.mj_getState(model, data, state, STATE)
    return state


def ends_of(data, steps):
    """Positions and speeds after each step of plain MuJoCo."""
    path = []
    for _ in range(steps):
        mujoco.mj_step(data.model, data)
        path.append(np.r_[data.qpos, data.qvel])
    return np.array(path)


@pytest.mark.parametrize("name", ["quadruped", "gripper", "mixed", "loop"])
@pytest.mark.parametrize("integrator", ["Euler", "implicitfast", "RK4"])
def test_runs_are_those_of_mj_step_bit_by_bit_in_one_roll_in_two_and_watched(name, integrator):
    model, data = plain(name, 0.004, integrator)
    stepper, start = Stepper(model, 0.004, integrator), state_of(model, data)
    other = start.copy()
    other[stepper.places["qvel"]] *= -0.5
    exact = ends_of(data, 60)
    whole, first = stepper.roll([start, other], 60), stepper.roll([start, other], 23)
    second = stepper.roll(first.states, 37)
    assert np.array_equal(np.hstack([whole.q[0], whole.v[0]]), exact) and not np.array_equal(*whole.q)
    assert np.array_equal(np.concatenate([first.v, second.v], axis=1), whole.v)
    assert np.array_equal(second.states, whole.states)
    assert np.array_equal(whole.states[0], state_of(model, data))
    watched = [np.r_[d.qpos, d.qvel] for d in stepper.watch(start, 60)]
    assert np.array_equal(watched, exact)


def test_inputs_of_a_roll_are_those_of_a_program_in_plain_steps():
    model, data = plain("quadruped", 0.002, "implicitfast")
    stepper, start = Stepper(model, 0.002, "implicitfast"), state_of(model, data)
    inputs = data.ctrl + 0.2 * np.random.default_rng(1).normal(size=(20, model.nu))
    data.qfrc_applied[6:] = 0.3
    start[stepper.places["qfrc_applied"]] = data.qfrc_applied
    path = []
    for row in inputs:
        data.ctrl[:] = row
        mujoco.mj_step(model, data)
        path.append(data.qpos.copy())
    rolled = stepper.roll(start, 20, inputs)
    assert np.array_equal(rolled.q[0], path)
    assert np.array_equal([d.qpos.copy() for d in stepper.watch(start, 20, inputs)], path)


def test_a_run_ends_before_the_step_with_a_bad_number_and_stays_ended():
    pushing = '<general joint="j" biastype="affine" biasprm="0 1e6 0"/>'
    text = HINGE.format(pushing, '<key name="k" qpos="1"/>')
    stepper = Stepper(mujoco.MjModel.from_xml_string(text), 1.0, "Euler")
    start, speed, count = stepper.start("k", controls=[0.0]), 0.0, 0
    q = 1.0
    while abs(1e6 * q) <= 1e10:  # the acceleration that MuJoCo refuses, of a semi-implicit step of 1 s
        speed += 1e6 * q
        q, count = q + speed, count + 1
    assert 0 < count < 5
    rolled = stepper.roll([start, stepper.start()], 8)
    assert len(list(stepper.watch(start, 8))) == count and np.isfinite(rolled.q[1]).all()
    assert np.isfinite(rolled.q[0, :count]).all() and np.isnan(rolled.q[0, count:]).all()
    again = stepper.roll(rolled.states, 3).q
    assert np.isnan(again[0]).all() and np.isfinite(again[1]).all()


@pytest.mark.skipif(mujoco.mj_version() < 4_000_000, reason="MuJoCo 3.10 ends the program there")
def test_a_warning_of_another_kind_does_not_end_a_run():
    """Of 300 contacts in too small a memory MuJoCo leaves some out, warns, and goes on; its rollout does not."""
    ball = '<geom size="0.1" pos="0 0 {}" contype="1" conaffinity="2"/>'
    geoms = "".join(ball.format(0.001 * k) for k in range(30))
    floor = '<geom type="plane" size="1 1 1" contype="2" conaffinity="1"/>' * 10
    text = f"""<mujoco><size memory="100K"/><worldbody>{floor}<body pos="0 0 0.05"><freejoint/>{geoms}</body>
      </worldbody></mujoco>"""
    model = mujoco.MjModel.from_xml_string(text)
    data = mujoco.MjData(model)
    exact = ends_of(data, 10)
    assert data.warning.number.any()
    stepper = Stepper(model, model.opt.timestep, "Euler")
    rolled = stepper.roll(stepper.start(), 10)
    assert np.array_equal(rolled.q[0], exact[:, : model.nq])


@pytest.mark.parametrize("by", ["ctrl", "qfrc_applied"])
@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_a_step_has_the_derivative_of_the_closed_form(integrator, by):
    """One hinge of 1 kg m2 on a servo: qdd = k (u - q) - c qd + tau; Euler's step, and Taylor's to order 4."""
    k, c, dt = 30.0, 2.0, 0.02
    servo = mujoco.MjModel.from_xml_string(HINGE.format(f'<position joint="j" kp="{k}" kv="{c}"/>', ""))
    stepper = Stepper(servo, dt, integrator)
    F, G = np.array([[0.0, 1.0], [-k, -c]]), np.array([[0.0], [k if by == "ctrl" else 1.0]])
    terms = [np.eye(2), dt * F, dt**2 / 2 * F @ F, dt**3 / 6 * F @ F @ F, dt**4 / 24 * F @ F @ F @ F]
    A, integral = sum(terms), dt * (np.eye(2) + dt / 2 * F + dt**2 / 6 * F @ F + dt**3 / 24 * F @ F @ F)
    B = integral @ G
    if integrator == "Euler":
        speed = np.array([[-dt * k, 1.0 - dt * c]])
        A, B = np.vstack([[1.0, 0.0] + dt * speed, speed]), np.vstack([dt**2 * G[1], dt * G[1]])
    for centred in (True, False):
        found = stepper.derivative(stepper.start(q=[0.3], controls=[0.1]), 1e-6, centred, by)
        assert np.allclose(found[0], A, atol=1e-9) and np.allclose(found[1], B, atol=1e-9)


@pytest.mark.parametrize("integrator", ["Euler", "RK4"])
def test_differences_are_those_of_plain_steps_from_states_beside_one_or_two(integrator):
    """With an eps so large that both are far apart."""
    model, data = plain("gripper", 0.004, integrator)
    start, eps = state_of(model, data), 0.05

    def after(by):
        mujoco.mj_setState(model, data, start, STATE)
        data.qpos[0] += by
        mujoco.mj_step(model, data)
        return np.r_[data.qpos, data.qvel]

    ahead, here, behind = after(eps), after(0.0), after(-eps)
    stepper = Stepper(model, 0.004, integrator)
    for centred, exact in ((True, (ahead - behind) / (2.0 * eps)), (False, (ahead - here) / eps)):
        A, _ = stepper.derivative(start, eps, centred)
        assert np.allclose(A[: len(exact), 0], exact, atol=1e-10)


@pytest.mark.parametrize("name", ["quadruped", "mixed"])
def test_steps_from_states_beside_give_what_mjd_transition_fd_gives(name):
    """With quaternions, contacts and speeds: tangents are those from one end to the other, in the axes there."""
    model, data = plain(name, 0.004, "Euler")
    start, A = state_of(model, data), np.zeros((2 * model.nv + model.na,) * 2)
    mujoco.mjd_transitionFD(model, data, 1e-6, True, A, None, None, None)
    stepper = Stepper(model, 0.004, "Euler")
    assert np.array_equal(stepper.derivative(start, 1e-6)[0], A)
    ends = [[stepper.after(start, sign * 1e-6 * by) for sign in (-1.0, 1.0)] for by in np.eye(len(A))]
    columns = [stepper.deviation(*pair) / 2e-6 for pair in ends]
    assert np.allclose(np.transpose(columns), A, atol=1e-9)


def test_a_step_after_which_mujoco_warns_is_taken_and_the_last_of_its_loop():
    """A control that is no number counts as 0; the loop goes no further, a watched run does."""
    motor = HINGE.format('<motor joint="j"/>', "")
    stepper = Stepper(mujoco.MjModel.from_xml_string(motor), 0.01, "Euler")
    controls = np.array([[1.0], [2.0], [np.nan], [3.0], [4.0]])
    watched = [d.qpos.copy() for d in stepper.watch(stepper.start(), 5, controls)]
    path = stepper.loop(stepper.start(), 5, controls)()
    assert len(watched) == 5 and stepper.taken(path) == 3
    assert np.array_equal(path[:3, 1:2], watched[:3]) and (path[3:, 0] == path[2, 0]).all()


def test_differences_are_one_sided_at_the_end_of_a_range():
    """A muscle's activation is never below 0, a control never above its range."""
    muscle = '<muscle joint="j" ctrlrange="0 1" lengthrange="0 1"/><motor joint="j" ctrlrange="-1 1"/>'
    stepper = Stepper(mujoco.MjModel.from_xml_string(HINGE.format(muscle, "")), 0.01, "Euler")
    start = stepper.start(controls=[0.0, 1.0])
    A, B = stepper.derivative(start, 1e-6)
    assert np.isfinite(A).all() and A[2, 2] == pytest.approx(1.0 - 0.01 / (0.04 / 0.5), rel=1e-3)  # off at 0
    assert B[1, 1] == pytest.approx(0.01)


SERVO = '<position joint="j" kp="20" kv="1" {}/>'
INTEGRATOR = '<intvelocity joint="j" kp="9" actrange="-1 1"/>'
STARTS = {  # actuators, what the keyframe states; the control and the activation at the start
    "stated": (SERVO, 'ctrl="0.7"', 0.7, None),
    "a servo holds the posture": (SERVO, "", 0.4, None),
    "within its range": (SERVO.format('ctrlrange="-0.2 0.2"'), "", 0.2, None),
    "by its law": ('<general joint="j" gainprm="2" biastype="affine" biasprm="1 -20 -1"/>', "", 3.5, None),
    "a filter": (SERVO.format('timeconst="0.1"'), "", 0.4, 0.4),
    "a filter that is stated": (SERVO.format('timeconst="0.1"'), 'ctrl="0.7" act="0.2"', 0.7, 0.2),
    "an integrator": (INTEGRATOR, "", 0.0, 0.4),
    "an integrator that is stated": (INTEGRATOR, 'act="0.1"', 0.0, 0.1),
    "a motor": ('<motor joint="j"/>', "", 0.0, None),
    "a velocity servo": ('<velocity joint="j" kv="2"/>', "", 0.0, None),
    "a muscle": ('<muscle joint="j" ctrlrange="0 1" lengthrange="0 1"/>', "", 0.0, 0.0),
}


@pytest.mark.parametrize("kind", STARTS)
def test_a_start_has_the_controls_of_its_keyframe_else_servos_hold_the_posture(kind):
    actuators, stated, control, activation = STARTS[kind]
    key = f'<key name="k" qpos="0.4" qvel="2" {stated}/>'
    model = mujoco.MjModel.from_xml_string(HINGE.format(actuators.replace("{}", ""), key))
    stepper = Stepper(model, 0.01, "Euler")
    for start in (stepper.start("k"), *([] if stated else [stepper.start(q=[0.4], v=[2.0])])):
        assert start[stepper.places["qpos"]] == 0.4 and start[stepper.places["qvel"]] == 2.0
        assert start[stepper.places["ctrl"]] == pytest.approx(control)
        if activation is not None:
            assert start[stepper.places["act"]] == pytest.approx(activation)
    assert stepper.start("k", q=[0.1])[stepper.places["qvel"]] == 0.0
    assert stepper.start("k", controls=[0.05])[stepper.places["ctrl"]] == 0.05
    with pytest.raises(KeyError):
        stepper.start("no such")


def test_what_has_fallen_asleep_moves_when_it_is_pushed():
    """A state does not say what sleeps: beside the same file that never sleeps."""
    text = """<mujoco><option><flag sleep="{}"/></option><worldbody><geom type="plane" size="5 5 1"/>
    <body pos="0 0 0.1"><freejoint/><geom type="box" size="0.1 0.1 0.1"/></body></worldbody></mujoco>"""
    runs = []
    for sleeps in ("enable", "disable"):
        model = mujoco.MjModel.from_xml_string(text.format(sleeps))
        stepper = Stepper(model, 0.002, "Euler")
        state = stepper.roll(stepper.start(), 1500).states
        state[:, stepper.places["qvel"]] += 0.01
        runs.append(stepper.roll(state, 50).q)
    assert np.array_equal(*runs) and np.ptp(runs[0][0, :, 0]) > 0.0
