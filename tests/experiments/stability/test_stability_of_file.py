"""Which step is stable for the robot of a file: what is judged and said, and the tables of a run."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest
from edited import setup_of_file
from servo_models import INERTIA

from compare.core.check import AT_OWN_STEP, AT_REQUESTED_STEP
from compare.core.text import say
from compare.engines.mujoco.names import INTEGRATORS
from compare.experiments import stability
from compare.experiments.setup import Request, Setup
from compare.experiments.stability import figures_stability, of_file
from compare.experiments.stability.of_file import MODES, PUSHED
from compare.stability.answer import StepLimitRow

TURNING = """<mujoco><option timestep="{dt}"/><worldbody><body><joint name="turn" axis="0 0 1"/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody><actuator>{actuator}</actuator>
  <keyframe><key name="home" qpos="0.1"/><key name="spin" qvel="3"/></keyframe></mujoco>"""
SERVO, MOTOR = '<position joint="turn" kp="20" kv="5"/>', '<motor joint="turn"/>'
LIMIT = (-5.0 + (25.0 + 4.0 * INERTIA * 20.0) ** 0.5) / 20.0  # s, of Euler: 17.5 ms


def step_row(**more):
    usual = {
        "posture": "p", "base": "fixed", "surroundings": "contact", "integrator": "Euler", "limit": "finite", "predicted_dt": 0.1,
        "file_dt": 0.1, "file_integrator": "Euler", "stable_at_file_dt": True, "growth": 0.9,
    }  # fmt: skip
    return StepLimitRow(**usual | more)


def judged(result, rows):
    of_file.add_checks(result, rows, AT_OWN_STEP)
    return {(check.quantity, check.scene): check.passed for check in result.checks}


@pytest.mark.parametrize("growth, apart, passes", [
    (0.9, 0.899e-4, True), (0.9, -0.901e-4, False), (3.0, 2.99e-4, True), (3.0, 3.01e-4, False), (0.9, float("nan"), False),
])  # fmt: skip
def test_growth_in_closed_form_within_a_ten_thousandth(result, growth, apart, passes):
    assert judged(result, [step_row(growth=growth, apart=apart)])[MODES, "p, contact, Euler"] is passes


@pytest.mark.parametrize("more, passed", [
    ({"largest_push": 0.1}, True), ({"largest_push": 0.01}, False), ({"largest_push": 0.0, "finer_push": True}, True),
    ({"largest_push": 0.0, "finer_push": False}, False), ({"largest_push": 0.0, "stable_at_file_dt": False}, None), ({}, None),
])  # fmt: skip
def test_a_usual_push_is_survived_if_a_finer_step_survives_it(result, more, passed):
    assert judged(result, [step_row(**more)]).get((PUSHED, "p")) is passed


def test_the_robot_as_it_stands_is_judged_and_in_the_air_only_if_it_stands_nowhere(result):
    air = partial(step_row, surroundings="air", posture="air")
    lost = step_row(limit="no_rest", stable_at_file_dt=None)
    rows = of_file.in_use([air(), step_row(posture="q"), step_row(predicted_dt=0.05)], "Euler")
    assert [row.posture for row in rows] == ["p", "q"]
    assert of_file.in_use([air(), lost], "Euler")[0].posture == "air" and of_file.in_use([air()], "RK4") == []
    saddle = step_row(limit="saddle", stable_at_file_dt=None)
    assert of_file.in_use([air(), saddle], "Euler") == []
    judged(result, [saddle])
    assert [check.judged for check in result.checks] == [False]


def found_of(actuator=SERVO, dt=0.002, size=Setup.quick, **asked):
    setup = setup_of_file(TURNING.format(dt=dt, actuator=actuator), size, request=Request(**asked))
    return stability.rows(setup)


def test_a_quick_run_has_the_files_integrator_and_the_default_and_a_full_one_all():
    result = found_of()
    rows = result.tables["step_limits"]
    assert [(row.posture, row.integrator) for row in rows] == [("home", "Euler")]
    assert rows[0].predicted_dt == pytest.approx(LIMIT, rel=3e-3)
    assert rows[0].observed_dt < LIMIT < rows[0].failing_dt
    assert result.checks and all(check.passed for check in result.checks) and not result.growth
    full = found_of(size=Setup.small)
    names = [row.integrator for row in full.tables["step_limits"]]
    assert names == [name for name in INTEGRATORS if name != "implicit"]
    assert full.growth["free"].keys() >= {"Euler", "RK4"}
    assert figures_stability.draw_growth(full)[0] == "stability_growth"
    assert stability.headline(full).values["row"].integrator == "Euler"


def answers_of(result):
    return [finding for finding in result.top if finding.kind == "answer"]


@pytest.mark.parametrize("more, told", [
    ({"observed_dt": 0.09, "failing_dt": 0.12, "predicted_dt": 0.3}, ["by_derivative"]),
    ({"largest_push": 0.01, "finer_push": True}, ["push"]), ({"largest_push": 0.1, "finer_push": True}, []),
    ({"smooth_dt": 0.09}, ["friction"]), ({"smooth_dt": 0.09, "file_dt": 0.08}, []), ({}, []),
])  # fmt: skip
def test_a_fact_is_told_where_it_matters(more, told):
    kinds = []
    of_file.add_facts(lambda kind, **values: kinds.append(kind), step_row(**more))
    assert kinds == told


def test_a_figure_marks_the_limit_of_runs_beside_that_of_the_derivative(result):
    """The last word and the headline are that of runs, where they are others."""
    rows = [step_row(), step_row(integrator="RK4", observed_dt=0.04, failing_dt=0.042)]
    result.tables["step_limits"] = rows
    result.growth = {"contact": {row.integrator: [(0.01, 0.9), (0.2, 1.2)] for row in rows}}
    (ax,) = figures_stability.draw_growth(result)[1].axes
    marks = [
        (line.get_xdata()[0], line.get_color() == "white") for line in ax.lines if len(line.get_xdata()) == 1
    ]
    assert marks == [(0.1, True), (0.1, True), (pytest.approx(0.041, rel=1e-3), False)]


@pytest.mark.parametrize("more, last", [({}, "100 ms"), ({"start_dt": 0.08}, "80 ms in runs from p itself")])
def test_a_headline_has_the_limit_with_the_last_word_alone(result, more, last):
    result.tables["step_limits"] = [step_row(**more)]
    assert say(stability.headline(result)) == f"stable at 100 ms (limit: {last})"


def test_a_step_beyond_its_limit_fails_and_is_told_what_helps():
    result = found_of(dt=0.02, step=(0.01, "Euler"))
    failed = {check.quantity for check in result.checks if check.failed}
    assert AT_OWN_STEP in failed and AT_REQUESTED_STEP not in failed
    answers = [answer.values for answer in answers_of(result)]
    stable = [(answer["row"].stable_at_file_dt, answer["requested"]) for answer in answers]
    assert stable == [(False, False), (True, True)]
    assert result.top[0] is answers_of(result)[0]
    (cures,) = (finding.values for finding in result.top if finding.kind == "cures")
    assert {cure.change for cure in cures["cures"]} >= {"less_kv", "more_armature"}


@pytest.mark.parametrize("actuator, gains", [(SERVO, {}), (MOTOR, {"kp": 20.0, "kv": 5.0})])
def test_a_program_at_its_own_rate_is_judged(actuator, gains):
    """A period of 20 ms is beyond the limit of 17.5 ms, one of 10 ms is not, and one that is late may be."""
    for period, delay, stable in ((0.02, None, False), (0.01, None, True), (0.01, 0.0185, False)):
        result = found_of(actuator, control_period=period, delay=delay, posture="home", **gains)
        (row,) = result.tables["control"]
        assert (row.period, row.delay, row.servos) == (period, 0.02 if delay else 0.0, 1)  # in whole steps
        assert row.is_stable is stable and row.grows_in_run is not stable
        passed = [check.passed for check in result.checks if "control period" in check.quantity]
        assert passed == [stable, True]
        of_file.add_control(result, replace(row, grows_in_run=stable))  # not as predicted
        assert [check.passed for check in result.checks][-2:] == [stable, False]
        if delay is None:
            assert 0.012 < row.longest_period < 0.02
    result = found_of(MOTOR, control_period=0.02)
    assert "control" not in result.tables
    assert any(not check.judged and "control period" in check.quantity for check in result.checks)


def test_a_motion_is_judged_by_what_its_step_adds():
    (home, spin) = found_of(at_speed=True).tables["motion_stability"]
    assert (home.posture, spin.posture) == ("home", "spin") and home.passed and spin.passed
    fails = found_of(dt=0.025, at_speed=True)
    assert [row.passed for row in fails.tables["motion_stability"]] == [False, False]
    assert sum(check.failed and check.quantity == "growth along its motion" for check in fails.checks) == 2
    worst = max(fails.tables["motion_stability"], key=lambda row: row.rate)
    headline = stability.headline(fails)
    assert headline.values["motion"] is worst and say(headline).startswith(
        "not stable at 25 ms in its motion from "
    )
    assert worst.factor == pytest.approx(
        np.exp(worst.rate)
    ) and f"{worst.factor:.3g} times per second" in say(headline)
