"""Steps under a robot's own servos: what is judged and said, what runs show, what lifts a limit, tables of a run."""

from dataclasses import replace

import numpy as np
import pytest
from edited import setup_of_file
from models import PATHS
from servo_models import FILTERED, FLOATING, FORK, INERTIA, hinge, posture_of

from compare.core.check import AT_OWN_STEP
from compare.engines.mujoco.names import INTEGRATORS
from compare.experiments.setup import Setup
from compare.experiments.stability import servos
from compare.experiments.stability.servos import figures_step, observed, predicted, response
from compare.experiments.stability.servos.findings import verdict
from compare.experiments.stability.servos.lifting import lifts
from compare.experiments.stability.servos.observed import grows_in_runs
from compare.experiments.stability.servos.predicted import acting_at
from compare.experiments.stability.tables import StabilityResult, StepLimitRow
from compare.robots.arm import ARM

SERVO = '<position name="servo" joint="swing" kp="50" kv="4"/>'
SWING = """<mujoco><option timestep="0.002" integrator="{integrator}"/><worldbody><body>
  <joint name="swing" axis="0 1 0" damping="0.01"/><geom type="sphere" size="0.1" pos="{com}" mass="2"/></body></worldbody>
  <actuator>{servo}</actuator><keyframe>{key}</keyframe></mujoco>"""
UP = '<key name="up" qpos="1"/>'
NONE = {"limit": "none", "predicted_dt": None}


def swing(servo=SERVO, key="", integrator="Euler", com="0 0 -0.5"):
    return SWING.format(servo=servo, key=key, integrator=integrator, com=com)


def row(**more):
    usual = {
        "posture": "p", "base": "fixed", "integrator": "Euler", "limit": "finite", "predicted_dt": 0.1, "file_dt": 0.1,
        "file_integrator": "Euler", "limiting_joint": "joint7", "stable_at_file_dt": None, "mode": None, "mode_kind": None,
    }  # fmt: skip
    return StepLimitRow(**usual | more)


@pytest.mark.parametrize("more, kind, passed", [
    ({"observed_dt": 0.100999}, "finite", [True]), ({"observed_dt": 0.10101}, "finite", [False]),
    ({"observed_dt": 0.099001}, "finite", [True]), ({"observed_dt": 0.09899}, "finite", [False]),
    ({}, "none", [False]), ({}, "always", [False]), (NONE, "none", []), (NONE | {"observed_dt": 1.0}, "finite", [False]),
    # below the shortest step that is tried nothing is compared
    ({"predicted_dt": 0.99e-7}, "always", []), ({"predicted_dt": 1.01e-7}, "always", [False]),
])  # fmt: skip
def test_an_observed_limit_is_within_a_hundredth(result, more, kind, passed):
    servos.check_observed(result, row(**more), kind)
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("apart, passes", [(0.99e-4, True), (1.01e-4, False), (np.nan, False)])
def test_the_spectral_radius_near_a_limit(result, apart, passes):
    servos.check_radii(result, "p", {"Euler": apart})
    assert [check.passed for check in result.checks] == [passes]


@pytest.mark.parametrize("more, passed", [
    ({}, [True]), ({"file_dt": 0.1001}, [False]), ({"integrator": "RK4"}, []), (NONE, [True]),
    ({"limit": "saddle", "predicted_dt": None}, []),
])  # fmt: skip
def test_a_step_is_stable_up_to_its_limit_where_one_counts(result, more, passed):
    servos.check_step(result, [row(**more)], "stable at its own step")
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("stable, changed, answer", [
    ([True, True], {}, (True, [])), ([True, False], {}, (False, ["q"])), ([False, False], {}, (False, [])),
    ([True, True], {"limit": "saddle"}, (True, ["q"])),
])  # fmt: skip
def test_the_answer_for_the_files_step(stable, changed, answer):
    rows = [row(stable_at_file_dt=stable[0], **changed), row(posture="q", stable_at_file_dt=stable[1])]
    found = verdict(rows, "Euler")
    assert (found["stable"], found["postures"]) == answer
    assert verdict(rows, "RK4") == {"stable": None}


def of_euler(kp, explicit, implicit=0.0):
    """4 I + 2 dt (implicit - explicit) - dt^2 kp = 0."""
    off = implicit - explicit
    return (off + np.sqrt(off**2 + 4.0 * INERTIA * kp)) / kp


@pytest.mark.parametrize("source, integrator, expected", [
    (hinge(20.0, 50.0), "Euler", of_euler(20.0, 50.0)),
    (hinge(20.0), "implicitfast", of_euler(20.0, 0.0)),  # it swings and nothing damps it
    (hinge(4.0 * INERTIA / 4.9**2), "Euler", 4.9), (hinge(4.0 * INERTIA / 5.1**2), "Euler", None),  # sought up to 5 s
    # a filter that is too fast for the step is seen, unless it is exact
    (hinge(actuator=FILTERED.format(kind="filter", constant=1e-4)), "implicitfast", 2e-4),
    (hinge(actuator=FILTERED.format(kind="filterexact", constant=1e-4)), "Euler", of_euler(20.0, 2.0)),
])  # fmt: skip
def test_the_limit_of_one_hinge_is_that_of_the_formula(source, integrator, expected):
    at, reading = posture_of(source)
    found = observed.limit(at, integrator, reading)
    assert found == (("finite", pytest.approx(expected, rel=2e-3)) if expected else ("none", None))


@pytest.mark.parametrize("source, integrator", [
    (FORK.format(kv=60), "Euler"),  # fingers alike, against each other
    (FLOATING, "implicitfast"), (PATHS["mixed"], "RK4"),
])  # fmt: skip
def test_runs_show_the_predicted_limit(source, integrator):
    at, reading = posture_of(source)
    acting, predicted = acting_at(reading, at), at.small.limit(integrator)
    assert predicted.limit == "finite"
    grows = [grows_in_runs(acting, at, integrator, share * predicted.dt) for share in (0.997, 1.003)]
    assert grows == [False, True]


@pytest.mark.parametrize("source", [FORK.format(kv=5), FLOATING], ids=["fork", "floating"])
def test_errors_fall_with_the_order_of_the_method(source):
    at, reading = posture_of(source)
    coarse, fine = (response.response_error(at, "implicitfast", reading, dt) for dt in (1e-3, 5e-4))
    assert coarse / fine == pytest.approx(2.0, rel=0.1) and 1e-6 < fine < 0.1
    coarse, fine, finest = (response.response_error(at, "RK4", reading, dt) for dt in (1.6e-3, 8e-4, 1e-4))
    assert coarse / fine == pytest.approx(16.0, rel=0.4)
    assert finest < 1e-7  # the exact response is that of MuJoCo


def test_the_exact_response_of_one_hinge_is_the_known_one():
    at, _ = posture_of(hinge(20.0, 0.0))
    found, end = response.exact_response(at, response.jump_of(at)[1], 0.01, 20)
    swing = 1.0 - np.cos(np.sqrt(20.0 / INERTIA) * 0.01 * np.arange(1, 21))
    assert [*found[:, 0], *end] == pytest.approx([*swing, 1.0], abs=1e-9)


def lifts_of(source, dt):
    at, reading = posture_of(source)
    return lifts(at, "Euler", replace(reading, dt=dt))


def test_one_hinge_is_lifted_by_the_numbers_of_the_formula():
    kp, dt, inertia = 20.0, 0.02, INERTIA + 0.01
    found = lifts_of(hinge(kp, 30.0, joint='armature="0.01"'), dt)
    assert {"implicit", "discrete"} <= {*found["integrators"]}
    # 4 I > 2 dt kv + dt^2 kp
    most = (4.0 * inertia - dt**2 * kp) / (2.0 * dt)
    ((name, value, _),) = found["kv"]
    assert name == "servo" and 0.9 * most < value < most
    least = (2.0 * dt * 30.0 + dt**2 * kp) / 4.0 - INERTIA  # with what the joint has
    ((name, value, unit),) = found["armature"]
    assert (name, unit) == ("turn", "rad") and least < value < 1.1 * least


def test_what_is_above_the_cap_or_below_the_floor_is_named():
    found = lifts_of(FORK.format(kv=5), 0.05)
    assert {name for name, *_ in found["armature"]} >= {"left", "right"}
    # the tendon's kv alone is too large: its actuator is named
    ((name, value, _),) = lifts_of(FORK.format(kv=60), 0.01)["kv"]
    assert name == "grip" and value < 60.0
    # without any kv the stiffness alone is too much for the step
    assert not lifts_of(hinge(2000.0, 5.0), 0.03)["kv"]


def done(source):
    setup = setup_of_file(source, Setup.quick)
    result = StabilityResult("stability")
    servos.add(result, setup, servos.begin(setup))
    return result


def at_qpos0(source=None):
    setup = setup_of_file(source or swing())
    return setup, predicted.predicted_at(setup.robot, "qpos0", setup.reading)


def test_a_quick_run_has_every_limit_and_observes_the_files_own_integrator_and_euler_at_one_posture():
    result = done(swing(SERVO.replace('"4"', '"10"'), UP, "implicitfast"))
    rows = result.tables["step_limits"]
    places = [(row.posture, row.base, row.integrator) for row in rows]
    assert places == [(posture, "fixed", name) for posture in ("up", "qpos0") for name in INTEGRATORS]
    seen = {(row.posture, row.integrator) for row in rows if row.observed_dt}
    assert ("up", "Euler") in seen <= {("up", "Euler"), ("up", "implicitfast")}
    euler = rows[0]
    assert (euler.limit, euler.limiting_joint, euler.stable_at_file_dt) == ("finite", "swing", True)
    assert euler.observed_dt == pytest.approx(euler.predicted_dt, rel=5e-3)
    assert euler.observed_dt != euler.predicted_dt and 0.0 < euler.step_response_error < 0.1
    assert all(check.passed for check in result.checks) and result.top[0].values["own"]["stable"]
    assert sum(check.quantity == AT_OWN_STEP for check in result.checks) == 2


def test_a_full_run_observes_every_integrator_and_draws_curves(result):
    for alone in (True, False):
        setup = setup_of_file(swing(key=UP), alone=alone)
        work = servos.begin(setup)
        # every integrator at the first posture with a limit; `stability` alone the file's, which is Euler, at the other
        assert [one.name for one, *_ in work.observed[0]] == ["up"] * len(INTEGRATORS) + ["qpos0"] * alone
    drawn, curves = work.curves
    assert [name for _, name, _ in drawn] == [*INTEGRATORS]
    work = work._replace(observed=([], ()), curves=(drawn[:1], curves))  # one curve, and no limit is sought
    servos.add(result, setup, work)
    row, (curve,) = result.tables["step_limits"][0], result.step_response.lines.values()
    assert curve[0][0] < 0.002 < curve[-1][0] <= row.predicted_dt < 1.5 * curve[-1][0]
    assert figures_step.draw_step_response(result, None)


def test_a_file_that_is_not_stable_at_its_own_step_fails_a_check_and_is_told_what_helps():
    result = done(swing(SERVO.replace('"4"', '"800"')))
    failed = [(check.quantity, check.scene) for check in result.checks if not check.passed]
    assert result.top[0].values["own"]["stable"] is False and failed == [(AT_OWN_STEP, "qpos0")]
    (changes,) = (note.values for note in result.notes if note.kind == "changes")
    assert [name for name, *_ in changes["armature"]] == ["swing"]


def test_motors_are_neither_stable_nor_not(engines):
    assert servos.begin(Setup.quick(ARM, engines)) is None
    _, one = at_qpos0(swing('<motor name="servo" joint="swing"/>'))
    assert {row.stable_at_file_dt for row in predicted.limit_rows([one], 0.002, "Euler")} == {None}


def test_a_saddle_has_a_rate_and_neither_a_joint_that_limits_nor_an_answer():
    _, one = at_qpos0(swing(SERVO.replace('"50" kv="4"', '"1"'), com="0 0 0.5"))
    for row in predicted.limit_rows([one], 0.002, "Euler"):
        assert (row.limit, row.limiting_joint, row.stable_at_file_dt) == ("saddle", None, None)
        assert row.mode > 1.0


def test_runs_have_the_weight_and_the_cuts_of_the_rest():
    at, found = posture_of(FLOATING)
    assert not predicted.acting_at(found, at).model.opt.gravity.any()
    clamped = '<position name="s" joint="swing" kp="1000" forcerange="-1 1"/>'
    at, found = posture_of(swing(clamped, com="0.5 0 0"))
    assert predicted.acting_at(found, at).model.actuator_biasprm[0, 0] == pytest.approx(-1.0)


def test_a_step_that_is_off_is_seen():
    setup, one = at_qpos0()
    limit, acting = one.limits["Euler"], predicted.acting_at(setup.reading, one.at)
    assert predicted.radius_apart(acting, one.at, "Euler", limit.dt) < 1e-6
    # above the limit the factor of a stiffness that is 1 % too large is farther off than below it
    one.at.__dict__["small"] = replace(one.at.small, K=1.01 * one.at.small.K)
    assert predicted.radius_apart(acting, one.at, "Euler", limit.dt) > 1e-3
