"""Step limits under a robot's own servos in `stability`: tables, checks, what a run of each size does."""

from dataclasses import replace

import pytest
from models import PATHS
from servo_models import FLOATING, posture_of

from compare.engines.mujoco import reading
from compare.engines.mujoco.flags import INTEGRATORS
from compare.experiments.stability import servos
from compare.experiments.stability.servos import figures_step, predicted
from compare.judge.check import AT_OWN_STEP, Result
from compare.robots.arm import ARM
from compare.robots.file import robot_of
from compare.setup import Setup, engines

LIMITS = (
    "posture", "base", "integrator", "limit", "predicted_dt_s", "observed_dt_s", "file_dt_s", "file_integrator",
    "stable_at_file_dt", "limiting_joint", "mode_per_s", "mode_kind", "step_response_error",
)  # fmt: skip
FULL = ("posture", "integrator", "dt_s", "rms_speed", "warnings", "resets", "predicted_stable", "calm")
SERVO = '<position name="servo" joint="swing" kp="50" kv="4"/>'
SWING = """<mujoco><option timestep="0.002" integrator="{integrator}"/><worldbody><body>
  <joint name="swing" axis="0 1 0" damping="0.01"/><geom type="sphere" size="0.1" pos="{com}" mass="2"/></body></worldbody>
  <actuator>{servo}</actuator><keyframe>{key}</keyframe></mujoco>"""
UP = '<key name="up" qpos="1"/>'


def swing(servo=SERVO, key="", integrator="Euler", com="0 0 -0.5"):
    return SWING.format(servo=servo, key=key, integrator=integrator, com=com)


def read(source, make=Setup.quick, **more):
    found = reading.read(source)
    robot = robot_of(found, "robot.xml")
    return make(robot, engines(reading.engine(found)), reading=found, **more)


def done(setup):
    """What is said, and the result."""
    result = Result("stability")
    return servos.add(result, setup, servos.begin(setup)), result


def at_qpos0(source=None):
    setup = read(source or swing())
    return setup, predicted.predicted_at(setup.robot, "qpos0", setup.reading)


def test_a_quick_run_has_every_limit_and_observes_the_files_own_integrator_and_euler_at_one_posture():
    said, result = done(read(swing(SERVO.replace('"4"', '"10"'), UP, "implicitfast")))
    rows, full = result.tables["step_limits"], result.tables["full_model"]
    assert all(tuple(row) == LIMITS for row in rows) and all(tuple(row) == FULL for row in full)
    places = [(row["posture"], row["base"], row["integrator"]) for row in rows]
    assert places == [(posture, "fixed", name) for posture in ("up", "qpos0") for name in INTEGRATORS]
    assert [row["integrator"] for row in full] == 2 * ["Euler", "implicitfast"] and all(row["calm"] for row in full)
    seen = {(row["posture"], row["integrator"]) for row in rows if row["observed_dt_s"]}
    assert ("up", "Euler") in seen <= {("up", "Euler"), ("up", "implicitfast")}
    euler = rows[0]
    assert (euler["limit"], euler["limiting_joint"], euler["stable_at_file_dt"]) == ("finite", "swing", True)
    assert euler["observed_dt_s"] == pytest.approx(euler["predicted_dt_s"], rel=5e-3)
    assert euler["observed_dt_s"] != euler["predicted_dt_s"] and 0.0 < euler["step_response_error"] < 0.1
    assert result.checks and all(check.passed for check in result.checks)
    assert sum(check.quantity == AT_OWN_STEP for check in result.checks) == 2 and said[0] == result.top[0]


@pytest.mark.slow
def test_a_full_run_observes_every_integrator_and_draws_curves():
    _, result = done(read(swing(), Setup.small))
    assert set(result.curves["step response"]["lines"]) == {*INTEGRATORS}
    assert all(check.passed for check in result.checks) and figures_step.draw_step_response(result, None)


@pytest.mark.parametrize("alone", [False, True])
def test_all_observes_at_the_first_posture_with_a_limit_and_stability_alone_at_each(alone):
    setup = read(swing(key=UP), Setup.small, alone=alone)
    names = [one.name for one, *_ in servos.begin(setup)["tried"]]
    # every integrator at the first, the file's, which is Euler, at the other
    assert names == ["up"] * len(INTEGRATORS) + ["qpos0"] * alone


def test_a_file_that_is_not_stable_at_its_own_step_fails_a_check_and_is_told_what_helps():
    said, result = done(read(swing(SERVO.replace('"4"', '"800"'))))
    failed = [(check.quantity, check.scene) for check in result.checks if not check.passed]
    assert failed == [(AT_OWN_STEP, "qpos0")] and any("armature" in text for text in said)
    assert [row["predicted_stable"] for row in result.tables["full_model"] if row["integrator"] == "Euler"] == [False]


def test_of_postures_that_are_not_stable_the_one_with_the_least_limit_is_looked_at():
    _, one = at_qpos0(swing(SERVO.replace('"4"', '"800"')))
    limit, place = one.limits["fixed", "Euler"], ("fixed", "Euler")
    three = [one._replace(limits=one.limits | {place: limit._replace(dt=dt)}) for dt in (1.9e-3, 1e-3, 1.5e-3)]
    assert servos.least_at(three, "Euler", 2e-3) is three[1] and servos.least_at(three[:1], "Euler", 1.8e-3) is None


def test_what_is_not_known_to_act_linearly_is_left_out(engines):
    assert servos.begin(Setup.quick(ARM, engines)) is None and servos.begin(read(PATHS["free_body"])) is None
    _, alone = at_qpos0()
    setup, one = at_qpos0(swing(SERVO + '<muscle joint="swing" lengthrange="0.1 1"/>'))
    assert {pair: limit.dt for pair, limit in one.limits.items()} == {
        pair: limit.dt for pair, limit in alone.limits.items()
    }
    assert setup.robot.drive.refused and setup.robot.drive.feeds_back
    # nor is its activation compared
    assert max(found.beside or 0.0 for found in predicted.steps_at(one, setup.reading)) < servos.RADII_WITHIN


def test_motors_alone_are_called_neither_stable_nor_not():
    setup, one = at_qpos0(swing('<motor name="servo" joint="swing"/>'))
    assert not setup.robot.drive.feeds_back
    assert {row["stable_at_file_dt"] for row in predicted.limit_rows([one], 0.002, "Euler")} == {None}


def test_a_saddle_has_a_rate_and_neither_a_joint_that_limits_nor_an_answer():
    _, one = at_qpos0(swing(SERVO.replace('"50" kv="4"', '"1"'), com="0 0 0.5"))
    for row in predicted.limit_rows([one], 0.002, "Euler"):
        assert (row["limit"], row["limiting_joint"], row["stable_at_file_dt"]) == ("saddle", None, None)
        assert row["mode_per_s"] > 1.0


def test_runs_have_the_base_the_weight_and_the_cuts_of_the_rest():
    at, found = posture_of(FLOATING)
    locked, free = (predicted.acting_at(found, at, base) for base in ("locked", "free"))
    assert (locked.locked, free.locked) == (tuple(at.base), ()) and not locked.model.opt.gravity.any()
    at, found = posture_of(swing('<position name="s" joint="swing" kp="1000" forcerange="-1 1"/>', com="0.5 0 0"))
    acting = predicted.acting_at(found, at, "fixed")
    assert at.moved > 1.0 and acting.model.actuator_biasprm[0, 0] == pytest.approx(-1.0)


def test_a_closed_form_or_a_step_that_is_off_is_seen():
    setup, one = at_qpos0()
    small, limit = one.at.small("fixed"), one.limits["fixed", "Euler"]
    assert predicted.forms_apart(small, "Euler", limit) < 1e-8
    for off in (1e-5, 0.1):
        wrong = limit._replace(dt=(1 + off) * limit.dt)
        assert predicted.forms_apart(small, "Euler", wrong) == pytest.approx(off, rel=1e-3)
    acting = predicted.acting_at(setup.reading, one.at, "fixed")
    assert predicted.radius_apart(acting, one.at, small, "Euler", limit.dt) < 1e-6
    # above the limit the factor of a stiffness that is 1 % too large is farther off than below it
    assert predicted.radius_apart(acting, one.at, replace(small, K=1.01 * small.K), "Euler", limit.dt) > 1e-3
