"""Runs of MuJoCo: how they end, the order of the Tree; its minimal calls in compiled loops and derivatives of steps."""

import mujoco as plain
import numpy as np
import pytest
from helpers.crane import crane

import tmt
from compare.engines import GRID, Setting
from compare.engines.mujoco import engine, parse, read, runs
from compare.engines.mujoco.parameters import parameters
from compare.experiments.parameters import stated_of_hinges
from compare.robots.arm import ARM
from compare.robots.file import robot_of


def test_a_run_of_a_robot_in_another_order_than_its_file_is_that_of_tmt(tmp_path, rng):
    """And so are what MuJoCo says of its own steps, and the numbers that it compiled."""
    robot = crane(tmp_path)
    case = robot.case("damped", damping=0.2)
    dynamics, (q, v, tau), dt = parse(robot.mjcf, robot.tree).of(case), rng.uniform(-1.0, 1.0, (3, 4)), 0.01
    ours, motion = tmt.simulate(case.tree, q, v, tau, dt, 5, "rk4"), dynamics.run(q, v, tau, dt, 5, "RK4")
    assert np.allclose(motion.q, ours.q, atol=1e-11) and np.allclose(motion.v, ours.qd, atol=1e-10)
    compiled, stated = parameters(dynamics), stated_of_hinges(case.tree)
    for name in compiled.keys() & stated.keys():
        assert np.allclose(compiled[name], stated[name], atol=1e-14), name


FIXED_AND_MOVING = """
<mujoco><worldbody>
<body name="post" pos="5 0 0"><geom size=".1" mass="7"/><body name="flag" pos="0 1 0"><joint axis="1 2 0" pos=".1 0 0"/>
  <geom size=".1" mass="2"/><body pos="0 .3 .2"><geom size=".2" mass="1"/></body></body></body>
<body name="target" mocap="true" pos="0 0 2"><geom size=".1" mass="11"/><body pos="0 0 1"><geom size=".1" mass="3"/></body>
  <body name="on target" pos="1 0 0"><joint axis="0 1 0"/><geom size=".1" mass="2.5" pos="0 0 .2"/></body></body>
<body name="loose" pos="0 -2 0"><freejoint/><geom type="box" size=".1 .2 .3" mass="4" pos=".1 0 0"/></body>
</worldbody></mujoco>"""


def test_what_is_fixed_to_the_world_or_to_a_mocap_body_is_no_part_of_the_centre_of_mass(rng):
    """Bodies by their names, and the momentum of each from MuJoCo's velocities of bodies, xipos, ximat and inertia."""
    found, model = read(FIXED_AND_MOVING), plain.MjModel.from_xml_string(FIXED_AND_MOVING)
    dynamics, data = engine(found).of(robot_of(found, "a place").case()), plain.MjData(model)
    first = model.body("flag").id
    moving = [first, first + 1, model.body("on target").id, model.body("loose").id]
    q, v = data.qpos + rng.uniform(-0.5, 0.5, model.nq), rng.uniform(-1.0, 1.0, model.nv)
    plain.mj_normalizeQuat(model, q)
    data.qpos[:], data.qvel[:] = q, v
    plain.mj_forward(model, data)
    mass, places = model.body_mass[moving], data.xipos[moving]
    com = mass @ places / mass.sum()
    linear, angular = np.zeros((2, 3))
    for body, m, place in zip(moving, mass, places):
        velocity = np.zeros(6)
        plain.mj_objectVelocity(model, data, plain.mjtObj.mjOBJ_BODY, body, velocity, 0)
        R = data.ximat[body].reshape(3, 3)
        linear += m * velocity[3:]
        angular += m * np.cross(place - com, velocity[3:])
        angular += R @ (model.body_inertia[body] * (R.T @ velocity[:3]))
    expected = np.concatenate([linear, angular])
    assert np.allclose(dynamics.com(q), com, atol=1e-13)
    assert np.allclose(dynamics.com_jacobian(q) @ v, linear / mass.sum(), atol=1e-13)
    assert np.allclose(dynamics.centroidal_momentum_matrix(q) @ v, expected, atol=1e-12)


def test_momentum_of_bodies_high_above_the_world_is_rounded_by_what_is_between_them():
    """Three in a row: the one in the middle is at the common centre of mass, and has none by its speeds along axes."""
    body = '<body pos="{} -0.4 10.1"><freejoint/><geom size=".1" mass="14"/></body>'
    found = read(f"<mujoco><worldbody>{''.join(map(body.format, (0.6, 0.0, 0.3)))}</worldbody></mujoco>")
    momentum = engine(found).of(robot_of(found, "a row").case()).centroidal_momentum_matrix(found.qpos0)
    assert np.abs(momentum[3:, 12:15]).max() < 1e-15 and momentum[5, 1] == pytest.approx(14 * 0.3, abs=1e-14)


@pytest.mark.skipif(runs.library() is None, reason="MuJoCo's library is elsewhere")
def test_a_loop_repeats_its_calls_at_a_state(mujoco, rng):
    dynamics, nothing = mujoco.of(ARM.case()), np.zeros(3)
    for q, v in rng.uniform(-2.0, 2.0, (2, 2, 3)):
        loops = runs.loops(dynamics, q, v, nothing)
        assert not loops["MuJoCo, equal work"](0).any()
        bias, acceleration = loops["MuJoCo, equal work"](1)
        assert np.array_equal(bias, dynamics.bias(q, v))
        assert np.allclose(dynamics.mass_matrix(q) @ acceleration, bias, rtol=1e-12)
        *_, data = loops["MuJoCo, mj_forward"].args
        data.qacc[:] = 0.0
        loops["MuJoCo, mj_forward"](1)
        assert np.allclose(data.qacc, dynamics.acceleration(q, v, nothing), rtol=1e-12)


def test_forces_of_a_fluid_are_those_of_plain_mujoco(rng):
    body = '<geom type="ellipsoid" size=".1 .2 .3" mass="1" pos=".3 0 .1"/></body></worldbody></mujoco>'
    text = f'<mujoco><option density="1000" viscosity="0.5"/><worldbody><body><joint axis="0 1 0" damping="2"/>{body}'
    found, model = read(text), plain.MjModel.from_xml_string(text)
    dynamics = engine(found).of(robot_of(found, "a fin").case())
    dynamics.bare, dynamics.model = False, found.model
    data = plain.MjData(model)
    q, v = rng.uniform(-1.0, 1.0, (2, 5, 1))
    (name, *_), found = dynamics.other_forces(q, v).keys(), [*dynamics.other_forces(q, v).values()]
    for k in range(5):
        data.qpos[:], data.qvel[:] = q[k], v[k]
        plain.mj_forward(model, data)
        assert abs(data.qfrc_fluid[0]) > 1e-3 and found[0][k] == pytest.approx(data.qfrc_fluid, rel=1e-12)
    assert "fluid" in name and not np.any(found[1:])


def test_a_prepared_run_ends_where_time_stands_still(engines):
    """MuJoCo refuses an acceleration beyond 1e10 and takes no more steps: the last state, repeated, is no motion."""
    dynamics, dt = engines["mujoco"].of(ARM.case()), 1.0 / 128
    start = np.array([0.3, 0.2, 0.5]), np.zeros(3), np.full(3, 1e12)
    whole, (run, read) = (
        dynamics.run(*start, dt, GRID, "Euler"),
        dynamics.prepare(*start, Setting(0.5, GRID), "Euler"),
    )
    found = read(run())
    assert np.array_equal(found.q[0], start[0]) and np.isnan([found.q[1:], found.v[1:]]).all()
    assert np.isnan(whole.q[1:]).all() and found.ended == whole.ended and whole.ended.startswith("at t = 0 s")
