"""The run of the whole file at its own step: what diverges or moves on by its step alone fails, whatever drives the robot."""

import numpy as np
import pytest
from edited import setup_of_file
from servo_models import posture_of

from compare.engines.mujoco import reading
from compare.engines.mujoco.linear import WholeRun
from compare.engines.mujoco.names import INTEGRATORS
from compare.experiments import stability
from compare.experiments.setup import Setup
from compare.experiments.stability import own_run
from compare.experiments.stability.servos.predicted import acting_at, predicted_at

HINGE = """<mujoco><option timestep="0.005" integrator="{integrator}" {option}/><worldbody><body>
  <joint name="swing" axis="0 1 0" {joint}/><inertial pos="0 0 -0.1" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/>
  <geom type="box" size="0.1 0.05 0.001" pos="0.1 0 0" mass="0"/></body></worldbody>
  <actuator>{actuator}</actuator><keyframe>{key}</keyframe></mujoco>"""
FREE = """<mujoco><worldbody><body><freejoint/><geom size="0.1" mass="1"/><site name="t"/></body></worldbody>
  <actuator><motor site="t" gear="0 0 1 0 0 0"/></actuator><keyframe><key name="go" ctrl="{}"/></keyframe></mujoco>"""
SPARSE = """<mujoco><option jacobian="sparse"/><worldbody>
  <body><joint name="a"/><geom size="0.1"/></body><body><joint name="b"/><geom size="0.1"/></body></worldbody>
  <equality><joint joint1="a"/><joint joint1="a" joint2="b"/></equality>
  <actuator><position joint="b" kp="50" kv="1"/></actuator></mujoco>"""
WELDED = """<mujoco><worldbody><body name="a"><joint name="lift" type="slide"/><geom size="0.1"/></body>
  <body name="b" pos="1 0 0"><freejoint/><geom size="0.1"/></body></worldbody><equality><weld body1="a" body2="b"/></equality>
  <actuator><position joint="lift" kp="50"/></actuator></mujoco>"""
STIFF = '<position joint="swing" kp="0.2" kv="1"/>'
SATURATED = '<position joint="swing" kp="5" kv="0.01" forcerange="-0.1 0.1"/>'


def hinge(joint="", integrator="Euler", actuator="", option="", key='<key name="aside" qpos="0.5"/>'):
    return HINGE.format(joint=joint, integrator=integrator, actuator=actuator, option=option, key=key)


@pytest.mark.parametrize("source, outcome", [
    (hinge('damping="2"', "RK4"), "worse"), (hinge('damping="0.05"'), "calm"),
    (hinge('stiffness="400"', "implicitfast"), "worse"), (hinge(), "alike"),  # nothing brakes a pendulum
    (hinge(actuator=STIFF), "worse"), (hinge('frictionloss="0.2"', actuator=STIFF, key=""), "calm"),
    (hinge(actuator='<dcmotor joint="swing" motorconst="0.8" resistance="0.2"/>'), "worse"),
    (hinge(actuator='<motor joint="swing" damping="3"/>', integrator="RK4"), "worse"),
    (hinge(option='density="1000" viscosity="80"'), "worse"),
    (hinge(option='density="1000" viscosity="80"', integrator="implicit", key=""), "calm"),
    (hinge(actuator='<general joint="swing" biastype="affine" biasprm="0 0 1"/>', key=""), "fails"),  # at any step
    (FREE.format(9.81), "calm"), (FREE.format(0), "alike"),  # it hovers, and falls
])  # fmt: skip
def test_what_moves_on_by_its_step_alone_is_not_stable(source, outcome):
    found = reading.read(source)
    run = own_run.own_run(next(iter(found.keyframes), ""), found.dt, found.integrator, found)
    assert run.outcome == outcome


@pytest.mark.parametrize("own, finer, worse", [
    (0.99e-3, 1e-9, False), (1.01e-3, 1e-9, True), (1.01e-3, 1.02e-4, False), (9.9, 1.0, False), (10.1, 1.0, True),
    (np.nan, 1.0, True),
])  # fmt: skip
def test_ten_times_the_speed_at_the_finer_step(own, finer, worse):
    runs = [WholeRun(np.full(4, speed), None) for speed in (own, finer)]
    assert own_run.is_worse(*runs) is worse
    # a motion that goes on is bounded by its fastest part
    fast = runs[1]._replace(speeds=np.array([100.0, 1.0, 1.0, finer]))
    assert own_run.is_worse(runs[0], fast) is (worse and (finer < 1e-3 or own != 10.1))
    assert not own_run.is_worse(runs[0], runs[1]._replace(failed_at=1.0))


@pytest.fixture
def quick(monkeypatch):
    """The result of a quick run, without runs without servos, which take long."""
    monkeypatch.setattr(stability, "MOST_SPEEDS", 0)
    return lambda source, **more: stability.rows(setup_of_file(source, Setup.quick, **more))


def test_a_file_without_actuators_is_asked_and_so_is_a_requested_step(quick):
    failed, source = {}, hinge('damping="2"', "RK4", key="")
    for step in (None, (1e-4, "RK4"), (0.005, "Euler"), (0.004, "RK4")):
        failed[step] = [check.quantity for check in quick(source, step=step).checks if check.failed]
    assert failed[None] == failed[1e-4, "RK4"] == failed[0.005, "Euler"] == [own_run.AT_OWN]
    assert failed[0.004, "RK4"] == [own_run.AT_OWN, own_run.AT_REQUESTED]


def test_the_first_six_keyframes_are_run(quick):
    keys = "".join(f'<key name="k{i}" qpos="{i / 10}"/>' for i in range(7))
    rows = quick(hinge('damping="0.05"', key=keys)).tables["own_run"]
    assert sorted(row.start for row in rows) == [f"k{i}" for i in range(own_run.MOST_STARTS)]


@pytest.mark.parametrize("source, why", [
    (hinge(option='viscosity="1"', actuator=STIFF), "not_judged"), (WELDED, "tied"),
    (hinge('range="0 1" limited="true"', actuator=STIFF, key='<key qpos="0" ctrl="-0.5"/>'), "out_of_range"),
])  # fmt: skip
def test_what_is_not_modelled_has_no_limit(quick, source, why):
    result = quick(source)
    assert {row.limit for row in result.tables["step_limits"] if row.posture != "middle"} == {why}


def test_adhesion_acts_in_contacts_alone_and_hides_no_limit(quick):
    grip = f'{STIFF}<adhesion body="grip" ctrlrange="0 1" gain="2"/>'
    result = quick(hinge(actuator=grip).replace("<body>", '<body name="grip">'))
    assert "not_judged" not in {row.limit for row in result.tables["step_limits"]}


def test_a_servo_at_its_range_lets_a_keyframe_rest_beside_it():
    key = '<key name="home" qpos="0.05" ctrl="0"/>'
    at, found = posture_of(hinge(actuator=SATURATED, option='gravity="0 0 0"', key=key))
    assert at.q == pytest.approx([0.0], abs=1e-9) and predicted_at(at.robot, "home", found).known


def test_constraints_of_a_sparse_jacobian_and_a_pickled_model():
    at, found = posture_of(SPARSE)
    dense, _ = posture_of(SPARSE.replace("sparse", "dense"))
    assert np.array_equal(*(one.rows(one.q, 1e-3, "Euler").jacobian for one in (at, dense)))
    assert "data" not in acting_at(found, at).__getstate__()  # with a plugin it ends a process that reads it


def test_a_robot_of_many_speeds_has_its_servo_limits_alone(quick):
    result = quick(hinge(actuator=STIFF))
    assert result.tables.keys() == {"own_run", "step_limits"} and not result.rows
    aside = [row for row in result.tables["step_limits"] if row.posture == "aside"]
    calm = {row.integrator: row.full_model_calm for row in aside}
    assert calm == dict.fromkeys(INTEGRATORS) | {"Euler": False}
    assert [finding.kind for finding in result.top] == ["own_run", "step", "large"]
