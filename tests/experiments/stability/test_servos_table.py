"""Step limits under a robot's own servos in `stability`: tables, checks, what a run of each size does."""

from dataclasses import replace

import numpy as np
import pytest
from models import PATHS
from servo_models import FLOATING, posture_of

from compare.engines.mujoco import reading
from compare.engines.mujoco.flags import INTEGRATORS
from compare.experiments import stability
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
SWING = """<mujoco><option timestep="{dt}"/><worldbody><body><joint name="swing" axis="0 1 0" damping="0.01"/>
  <geom type="sphere" size="0.1" pos="0 0 -0.5" mass="2"/></body></worldbody>
  <actuator><position name="servo" joint="swing" kp="50" kv="{kv}"/></actuator></mujoco>"""


def read(source, make=Setup.quick, **more):
    found = reading.read(source)
    robot = robot_of(found, "robot.xml")
    return make(robot, engines(reading.engine(found)), reading=found, **more)


def done(setup):
    """What is said, and the result."""
    result = Result("stability")
    return servos.add(result, setup, servos.begin(setup)), result


@pytest.fixture(scope="module")
def gripper():
    return done(read(PATHS["gripper"]))


def test_tables_have_their_columns_and_a_row_for_each_posture_base_and_integrator(gripper):
    rows, full = gripper[1].tables["step_limits"], gripper[1].tables["full_model"]
    assert all(tuple(row) == LIMITS for row in rows) and all(tuple(row) == FULL for row in full)
    places = [(row["posture"], row["base"], row["integrator"]) for row in rows]
    assert places == [(p, "fixed", i) for p in ("open", "closed", "qpos0", "middle") for i in INTEGRATORS]
    assert [(row["posture"], row["integrator"]) for row in full] == [
        (p, i) for p in ("open", "closed", "qpos0", "middle") for i in ("Euler", "implicitfast")
    ]
    assert all(row["predicted_stable"] and row["calm"] for row in full)
    euler = rows[0]
    assert (euler["limit"], euler["limiting_joint"], euler["mode_kind"]) == ("finite", "wrist", "real")
    assert euler["stable_at_file_dt"] is True and euler["observed_dt_s"] == pytest.approx(
        euler["predicted_dt_s"], rel=5e-3
    )
    assert euler["observed_dt_s"] != euler["predicted_dt_s"]  # found without it
    assert 0.0 < euler["step_response_error"] < 0.1


def test_a_quick_run_observes_the_files_own_integrator_and_euler_at_one_posture(gripper):
    said, result = gripper
    seen = {(row["posture"], row["integrator"]) for row in result.tables["step_limits"] if row["observed_dt_s"]}
    assert seen == {("open", "Euler"), ("open", "implicitfast")} and "step response" not in result.curves
    assert said[0] == result.top[0] and "2 of 16 limits were looked for" in " ".join(said)
    assert result.checks and all(check.passed for check in result.checks)
    assert sum(check.quantity == AT_OWN_STEP for check in result.checks) == 4


def test_all_observes_at_the_first_posture_with_a_limit_and_stability_alone_at_each():
    for alone, places in ((False, {"qpos0"}), (True, {"qpos0", "up"})):
        key = '</actuator><keyframe><key name="up" qpos="1"/></keyframe></mujoco>'
        setup = read(SWING.format(dt=0.002, kv=4).replace("</actuator></mujoco>", key), Setup.small, alone=alone)
        names = [one.name for one, *_ in servos.begin(setup)["tried"]]
        # every integrator at the first, the file's, which is Euler, at the other
        assert (len(names), set(names)) == (len(INTEGRATORS) + alone, places | {"up"} if alone else {"up"})


@pytest.mark.parametrize("kv, stable", [(2.0, True), (800.0, False)])
def test_a_file_that_is_not_stable_at_its_own_step_fails_a_check_that_compares_nothing(kv, stable):
    said, result = done(read(SWING.format(dt=0.002, kv=kv)))
    failed = [check for check in result.checks if not check.passed]
    assert [(check.quantity, check.scene) for check in failed] == [(AT_OWN_STEP, "qpos0")] * (not stable)
    assert said[0].startswith(
        "Stable" if stable else "Not stable at its own 2 ms under Euler, MuJoCo's default (limit 1."
    )
    assert stable == ("What would make 2 ms at qpos0 stable" not in " ".join(said))
    (row,) = (row for row in result.tables["full_model"] if row["integrator"] == "Euler")
    assert row["predicted_stable"] is stable


def test_of_postures_that_are_not_stable_the_one_with_the_least_limit_is_looked_at():
    setup = read(SWING.format(dt=0.002, kv=800))
    one = predicted.predicted_at(setup.robot, "qpos0", setup.reading)
    limit = one.limits["fixed", "Euler"]
    three = [
        one._replace(limits=one.limits | {("fixed", "Euler"): limit._replace(dt=dt)}) for dt in (1.9e-3, 1e-3, 1.5e-3)
    ]
    assert servos.least_at(three, "Euler", 2e-3) is three[1]
    assert servos.least_at(three[:1], "Euler", 1.8e-3) is None


def test_a_figure_has_the_files_own_point_and_says_its_number():
    _, result = done(read(SWING.format(dt=0.002, kv=4), Setup.small))
    name, fig, caption = figures_step.draw_step_response(result, None)
    ax = fig.axes[0]
    (own,) = (line for line in ax.lines if line.get_marker() == "*")
    row = next(row for row in result.tables["step_limits"] if row["integrator"] == "Euler")
    assert own.get_xydata().tolist() == [[0.002, row["step_response_error"]]]
    percent = float(f"{100 * row['step_response_error']:.2g}")
    assert f"{percent:g} % off" in caption
    assert ax.get_xscale() == ax.get_yscale() == "log" and name == "stability_step_response"


def test_without_actuators_there_is_nothing_new(engines):
    assert servos.begin(Setup.quick(ARM, engines)) is None
    assert servos.begin(read(PATHS["free_body"])) is None
    assert "servos" not in stability.claim(ARM) + stability.tolerance(ARM)
    assert "servos" in stability.claim(read(PATHS["gripper"]).robot)


def test_the_activation_of_an_actuator_that_is_left_out_is_not_compared():
    servo = '<position name="servo" joint="swing" kp="50" kv="4"/>'
    limits = []
    for more in ("", '<muscle joint="swing" lengthrange="0.1 1"/>'):
        setup = read(SWING.format(dt=0.002, kv=4).replace(servo, servo + more))
        said, result = done(setup)
        limits.append([row["predicted_dt_s"] for row in result.tables["step_limits"]])
        growth = [check for check in result.checks if check.quantity.startswith("growth of a step")]
        assert growth and all(check.passed for check in growth)
    assert limits[0] == limits[1] and "a law of the kind muscle" in " ".join(said)


def test_motors_alone_are_called_neither_stable_nor_not():
    source = SWING.format(dt=0.002, kv=4).replace(
        'position name="servo" joint="swing" kp="50" kv="4"', 'motor joint="swing"'
    )
    said, result = done(read(source))
    assert said[0] == "No actuator feeds back: there is no servo that its own 2 ms could make unstable."
    assert not any(check.quantity == AT_OWN_STEP for check in result.checks)
    assert {row["stable_at_file_dt"] for row in result.tables["step_limits"]} == {None}
    assert not any("not stable" in text or "What would make" in text for text in said)


def test_a_saddle_has_a_rate_and_neither_a_joint_that_limits_nor_an_answer():
    setup = read(SWING.format(dt=0.002, kv=0).replace('kp="50"', 'kp="1"').replace("0 0 -0.5", "0 0 0.5"))
    rows = predicted.limit_rows([predicted.predicted_at(setup.robot, "qpos0", setup.reading)], 0.002, "Euler")
    for row in rows:
        assert (row["limit"], row["limiting_joint"], row["stable_at_file_dt"]) == ("saddle", None, None)
        assert row["mode_per_s"] > 1.0


def test_runs_have_the_base_the_weight_and_the_cuts_of_the_rest():
    at, found = posture_of(FLOATING)
    locked, free = (predicted.acting_at(found, at, base) for base in ("locked", "free"))
    assert (locked.locked, free.locked) == (tuple(at.base), ()) and not (locked.model.opt.gravity.any())
    servo = '<position name="s" joint="swing" kp="1000" forcerange="-1 1"/>'
    source = SWING.format(dt=0.002, kv=0).replace("0 0 -0.5", "0.5 0 0")
    at, found = posture_of(source.replace('<position name="servo" joint="swing" kp="50" kv="0"/>', servo))
    assert at.moved > 1.0 and predicted.acting_at(found, at, "fixed").model.actuator_biasprm[0, 0] == pytest.approx(
        -1.0
    )


def test_a_closed_form_that_is_off_is_seen_by_the_eigenvalues():
    setup = read(SWING.format(dt=0.002, kv=4))
    one = predicted.predicted_at(setup.robot, "qpos0", setup.reading)
    small, limit = one.at.small("fixed"), one.limits["fixed", "Euler"]
    assert predicted.forms_apart(small, "Euler", limit) < 1e-8
    for off in (1e-5, 0.1):
        assert predicted.forms_apart(small, "Euler", limit._replace(dt=(1 + off) * limit.dt)) == pytest.approx(
            off, rel=1e-3
        )


def test_a_step_that_is_not_mujocos_is_seen_by_its_radius():
    found = reading.read(SWING.format(dt=0.002, kv=4))
    one = predicted.predicted_at(robot_of(found, "robot.xml"), "qpos0", found)
    small, acting = one.at.small("fixed"), predicted.acting_at(found, one.at, "fixed")
    dt = one.limits["fixed", "Euler"].dt
    assert predicted.radius_apart(acting, one.at, small, "Euler", dt) < 1e-6
    # above the limit the factor of a stiffness that is 1 % too large is farther off than below it
    assert predicted.radius_apart(acting, one.at, replace(small, K=1.01 * small.K), "Euler", dt) > 1e-3


# tolerances and rules: just inside, just outside


def row(**more):
    return dict.fromkeys(LIMITS) | {
        "posture": "p", "base": "fixed", "integrator": "Euler", "limit": "finite", "predicted_dt_s": 0.1, "file_dt_s": 0.1,
        "file_integrator": "Euler", "limiting_joint": "j",
    } | more  # fmt: skip


@pytest.mark.parametrize("seen, kind, passed", [
    (0.100999, "finite", True), (0.10101, "finite", False), (0.099001, "finite", True), (0.09899, "finite", False),
    (None, "none", False), (None, "always", False),
])  # fmt: skip
def test_an_observed_limit_is_within_a_hundredth(result, seen, kind, passed):
    servos.check_observed(result, row(observed_dt_s=seen), kind, False)
    assert [check.passed for check in result.checks] == [passed]


@pytest.mark.parametrize("predicted_dt, checks", [(0.99e-7, 0), (1.01e-7, 1)])
def test_a_limit_below_the_shortest_step_that_is_tried_is_not_compared(result, predicted_dt, checks):
    servos.check_observed(result, row(predicted_dt_s=predicted_dt), "always", False)
    assert [check.passed for check in result.checks] == [False] * checks


def test_no_limit_is_no_check_where_runs_show_none_and_a_failed_one_where_they_do(result):
    none = row(limit="none", predicted_dt_s=None)
    servos.check_observed(result, none, "none", False)
    assert not result.checks
    servos.check_observed(result, none | {"observed_dt_s": 1.0}, "finite", True)
    assert not result.checks[0].passed and result.checks[0].scene == "p, fixed base, Euler"


@pytest.mark.parametrize("apart, beside, passed", [
    (0.99e-6, 0.99e-4, [True, True]), (1.01e-6, 1.01e-4, [False, False]), (None, None, []), (np.inf, np.nan, [False, False]),
])  # fmt: skip
def test_forms_of_a_limit_and_growth_of_a_step(result, apart, beside, passed):
    one = predicted.predicted_at(
        read(SWING.format(dt=0.002, kv=4)).robot, "qpos0", reading.read(SWING.format(dt=0.002, kv=4))
    )
    servos.check_steps(result, one, [predicted.Steps("fixed", "Euler", apart, beside)])
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("more, passed", [
    ({}, [True]), ({"file_dt_s": 0.1001}, [False]), ({"base": "locked"}, []), ({"integrator": "RK4"}, []),
    ({"limit": "none", "predicted_dt_s": None}, [True]), ({"limit": "saddle", "predicted_dt_s": None}, []),
])  # fmt: skip
def test_a_step_is_stable_up_to_its_limit_where_one_counts(result, more, passed):
    servos.check_own_step(result, [row(**more)])
    assert [check.passed for check in result.checks] == passed
