"""Which step of a file is stable: what is judged and said, and the tables and figures of a run."""

from dataclasses import replace

import pytest
from helpers.edited import setup_of_file

from compare.core.check import AT_OWN_STEP, AT_REQUESTED_STEP
from compare.core.text import say, screen
from compare.engines.mujoco import read
from compare.engines.mujoco.names import INTEGRATORS
from compare.experiments import stability
from compare.experiments.options import StabilityOptions
from compare.experiments.setup import Setup
from compare.experiments.stability import of_file
from compare.robots.scene_file import SceneError
from compare.stability.answer import StepLimitRow

TURNING = """<mujoco><option timestep="{dt}"/><worldbody><body><joint name="turn" axis="0 0 1"/>
  <inertial pos="0 0 0" mass="1" diaginertia="0.05 0.05 0.05"/></body></worldbody><actuator>{actuator}</actuator>
  <keyframe><key name="home" qpos="0.1"/><key name="spin" qvel="3"/></keyframe></mujoco>"""
SERVO, MOTOR = '<position joint="turn" kp="20" kv="5"/>', '<motor joint="turn"/>'
LIMIT = (-5.0 + (25.0 + 4.0 * 0.05 * 20.0) ** 0.5) / 20.0  # s, of Euler: 19.3 ms


def found_of(actuator=SERVO, own_dt=0.002, size=Setup.quick, alone=False, text=TURNING, **asked):
    setup = setup_of_file(text.format(dt=own_dt, actuator=actuator), size, options=StabilityOptions(**asked))
    return stability.rows(replace(setup, alone=alone))


def said(result, kind):
    return [say(text) for text in result.top if text.kind == kind]


@pytest.fixture(scope="module")
def full():
    """A run alone: all integrators, at all postures."""
    return found_of(size=Setup.small, alone=True)


def row(up_to=0.01, fails=0.0106, stable=True, posture="p", **more):
    usual = {"judged_by": "rest", "outcome": "holds", "by_itself": "rests", "unit": "rad/s"}
    usual["survived_rad_per_s"] = 0.1
    return StepLimitRow(
        posture=posture, integrator="Euler", push_rad_per_s=0.1, stable_up_to_s=up_to, fails_at_s=fails,
        stable_at_file_dt=stable, file_dt_s=0.002, file_integrator="Euler", moves_first="knee", run_s=3.0, fine_dt_s=2.5e-4,
        **usual | more,
    )  # fmt: skip


def test_a_quick_run_has_the_files_integrator_and_the_default_and_a_full_one_all(full):
    quick = found_of()
    rows = quick.tables["step_limits"]
    assert [(row.posture, row.integrator) for row in rows] == [("home", "Euler")]
    names = [(row.posture, row.integrator) for row in full.tables["step_limits"]]
    assert names == [*(("home", name) for name in INTEGRATORS), ("spin", "Euler")]
    tried = full.tables["stability_runs"]
    assert {row.push_rad_per_s for row in tried if row.posture == "home"} >= {0.03, 0.1, 0.3}
    rows = [replace(row, outcome="moves") if row.integrator == "RK4" else row for row in tried]
    of_none = replace(full, tables=full.tables | {"stability_runs": rows})  # RK4 survives no push
    drawn = [draw() for found in (of_none, quick) for draw in stability.figures(found, None)]
    (name, fig, _), (of_quick, *_) = drawn
    assert {text.get_text() for text in fig.legends[0].texts} == set(INTEGRATORS)
    assert name == of_quick == "stability_steps"


@pytest.mark.parametrize("dt, asked, quantity, passes", [
    (0.002, {}, AT_OWN_STEP, True), (1.05 * LIMIT, {}, AT_OWN_STEP, False),
    (0.002, {"dt": 1.05 * LIMIT, "integrator": "Euler"}, AT_REQUESTED_STEP, False),
    (1.05 * LIMIT, {"dt": 0.01, "integrator": "Euler"}, AT_REQUESTED_STEP, True),
    (0.002, {"control_period": 0.01}, of_file.AT_PERIOD, True), (0.002, {"control_period": 0.05}, of_file.AT_PERIOD, False),
    (0.002, {"control_period": 0.01, "kp": 5.0}, of_file.AT_PERIOD, None),  # it has no motor
])  # fmt: skip
def test_the_step_that_is_asked_for_is_judged(dt, asked, quantity, passes):
    (check,) = found_of(own_dt=dt, **asked).checks
    assert (check.quantity, check.passed if check.judged else None) == (quantity, passes)


@pytest.mark.parametrize("actuator, asked, servos", [
    (SERVO, {"kp": 5.0}, True), ('<intvelocity joint="turn" kp="0" actrange="-1 1"/>', {"kp": 5.0}, False), (MOTOR, {}, False)
])  # fmt: skip
def test_why_no_program_can_command_it_is_said_once_for_all_postures(actuator, asked, servos):
    (check,) = found_of(actuator, alone=True, control_period=0.01, **asked).checks
    assert not check.judged and ("without --kp" in check.note) == servos


def test_the_posture_that_is_asked_for_is_the_start():
    home, other = (found_of(**asked).tables["step_limits"][0] for asked in ({}, {"posture": "spin"}))
    assert home.by_itself == "rests" and other.by_itself == "in motion" and other.posture == "spin"


def test_a_step_that_fails_is_said_with_what_helps():
    result = found_of(own_dt=1.4 * LIMIT, size=Setup.small)
    (answer,) = said(result, "answer")
    assert answer.startswith("Not stable") and "home" in answer and "(turn)" in answer
    (helps,) = said(result, "remedies")
    assert "implicitfast" in helps and "kv" in helps and "armature" in helps
    stable = found_of()
    assert not said(stable, "remedies") and said(stable, "answer")[0].startswith("Stable: 2 ms with Euler")


def test_the_table_of_a_run_alone_has_a_line_for_each_integrator_and_few_lines_in_all(full):
    lines = [line for text in full.top for line in screen(text)]
    first = [line.split()[0] for line in lines if line.startswith(" ")]
    assert len(lines) <= 12 and first[1:] == list(INTEGRATORS)


@pytest.mark.parametrize("more, words", [
    ({}, "Stable"), ({"stable": False, "outcome": "moves", "end_speed_file_rad_per_s": 0.8}, "shakes at 0.8 rad/s"),
    ({"stable": False, "outcome": "diverges"}, "diverges"), ({"stable": False, "outcome": "elsewhere"}, "elsewhere"),
    ({"stable": False, "up_to": None, "outcome": "grows"}, "None is, down to 0.25 ms"),
    ({"up_to": 0.2, "fails": None}, "up to 200 ms"), ({"stable": None, "judged_by": ""}, "Not judged"),
    ({"stable": None, "judged_by": "falls"}, "Not judged"),
])  # fmt: skip
def test_each_outcome_has_its_answer(result, more, words):
    of_file.tell(result, "answer", row=row(**more), rows=[], others=[])
    assert words in say(result.top[0])


@pytest.mark.parametrize("by_itself, words", [
    ("rests", "no push"), ("in motion", "in motion"), ("moves on", "1.8 rad/s"),
])  # fmt: skip
def test_what_the_robot_does_by_itself_is_said(result, by_itself, words):
    of_file.tell_of_row(result, row(judged_by="divergence", by_itself=by_itself, unpushed_rad_per_s=1.8))
    assert words in say(result.top[0])


@pytest.mark.parametrize("up_to, fails, stable, passes", [
    (0.0020001, 0.0021, True, True), (0.0019, 0.002, False, False), (None, 0.0005, False, False), (0.2, None, True, True),
    (None, None, None, None),
])  # fmt: skip
def test_a_check_of_each_posture(result, up_to, fails, stable, passes):
    judged_by = "rest" if stable is not None else ""
    of_file.check(result, row(up_to, fails, stable, judged_by=judged_by), AT_OWN_STEP)
    (check,) = result.checks
    assert (check.passed if check.judged else None) is passes


def test_other_postures_are_told_and_the_headline_is_of_the_posture_of_the_table(result):
    rows = [row(), row(0.001, 0.00106, False, posture="crouch"), row(0.2, None, posture="sit")]
    of_file.tell(result, "others", rows=rows[1:], unstable=rows[1:2])
    (text,) = said(result, "others")
    assert "sit over 200 ms" in text and "not stable: crouch (1 ms)" in text
    result.tables["step_limits"] = rows
    first = of_file.headline(result)
    assert first.values["row"] is rows[0] and f'from "{rows[0].posture}"' in say(first)
    result.tables["step_limits"] = [replace(rows[0], stable_at_file_dt=None)]
    assert of_file.headline(result) is None


@pytest.mark.parametrize("other, first, words", [
    ("", "Stable: 2 ms with Euler", ""), ("crouch", 'Stable from "p", not from "crouch": 2 ms', ', not from "crouch"'),
    ("sit", 'Stable from "p", not judged from "sit": 2 ms', ', not judged from "sit"'),
])  # fmt: skip
def test_the_first_line_names_postures_at_which_the_step_is_not_stable(result, other, first, words):
    """The exit status is that of all postures."""
    changes = {
        "crouch": row(0.001, 0.00106, False, posture="crouch"),
        "sit": row(None, None, None, posture="sit"),
    }
    rows = [changes.get(other, row(posture="lies")), row(posture="stand")]
    of_file.tell(result, "answer", row=row(), rows=[], others=rows)
    assert say(result.top[0]).startswith(first)
    result.tables["step_limits"] = [row(), *rows]
    assert say(of_file.headline(result)).endswith(f'from "p"{words}')


def test_the_longest_step_within_an_error_is_told(result):
    near = [row(within_error_s=0.004), replace(row(within_error_s=0.009), integrator="RK4")]
    of_file.tell(result, "within", rows=near, error=0.01)
    of_file.tell(result, "within", rows=[row()], error=1e-9)
    first, second = said(result, "within")
    assert "9 ms with RK4" in first and "Euler: 4 ms" in first and "No stable step" in second


@pytest.mark.parametrize("dt, is_refused", [(None, False), (1e-3, False), (1.1e-5, False), (0.9e-5, True)])
def test_recorded_controls_may_be_as_long_as_100_000_steps_that_are_asked_for(tmp_path, dt, is_refused):
    path = tmp_path / "long.csv"
    path.write_text("time,push\n0,0\n1,0.1\n")
    reading = read(TURNING.format(dt=0.002, actuator=MOTOR.replace("<motor", '<motor name="push"')))
    options = StabilityOptions(controls=str(path), dt=dt)
    if is_refused:
        with pytest.raises(SceneError, match=r"steps of 0\.009 ms"):
            options.validated(reading, "turning")
    else:
        assert options.validated(reading, "turning").recorded["push"].tolist() == [0.0, 0.1]
