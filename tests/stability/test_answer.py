"""What is asked of a file beside its step: other postures, programs, recorded controls, remedies; the API."""

import mujoco
import numpy as np
import pytest
from helpers.pushed_models import INERTIA, KP, KV, LIMIT, compiled, end_speed, hinge, sphere, walker

import compare
from compare.engines.mujoco.reading import read
from compare.stability import remedies
from compare.stability.answer import Question, StepLimitRow, answer, worst_step
from compare.stability.motion import posture_of, postures_of

MOTOR = '<motor joint="turn"/>'
STILL = '<mujoco><worldbody><geom size="0.1"/></worldbody></mujoco>'


def euler(text, **more):
    """The row of Euler's integrator."""
    return compare.step_limits(text, integrators=["Euler"], **more)["Euler"]


def asked(text, **more):
    reading = read(text)
    question = Question(reading.dt, reading.integrator, [reading.integrator], helped=True)._replace(**more)
    return answer(reading, postures_of(reading)[0], question)


def diverges(text, steps, kp, kv, delay=0):
    """Whether a plain loop of a program that commands a motor diverges after a push."""
    model = compiled(text)
    data, force = mujoco.MjData(model), []
    data.qvel[:] = 0.1
    for step in range(round(4.0 / model.opt.timestep)):
        if step % steps == 0:
            force.append(-kp * data.qpos[0] - kv * data.qvel[0])
        read_at = (step - delay) // steps
        data.ctrl[:] = force[read_at] if read_at >= 0 else 0.0
        mujoco.mj_step(model, data)
        if not abs(data.qvel[0]) < 100.0:
            return True
    return bool(abs(data.qvel[0]) > 0.05)


@pytest.mark.parametrize("delay", [0.0, 0.004])
def test_the_longest_period_of_a_program_is_that_of_a_plain_loop(delay):
    text = hinge(MOTOR)
    row = euler(text, control_period=0.01, delay=delay, kp=KP, kv=KV)
    up_to, fails, late = (round(time / 0.002) for time in (row.stable_up_to_s, row.fails_at_s, delay))
    assert not diverges(text, up_to, KP, KV, late) and diverges(text, fails, KP, KV, late)
    assert row.of == "period"


def test_the_files_servos_in_a_program_are_the_same_law():
    of_file = euler(hinge(), control_period=0.01)
    of_motor = euler(hinge(MOTOR), control_period=0.01, kp=KP, kv=KV)
    assert of_file.stable_up_to_s == of_motor.stable_up_to_s and of_file.controls == "program"


def test_a_damper_is_a_program_and_the_limit_of_its_period_is_two_over_its_rate():
    row = euler(hinge(MOTOR), control_period=0.01, kp=0.0, kv=5.0)
    assert row.stable_up_to_s <= 2.0 * INERTIA / 5.0 <= row.fails_at_s


def test_where_no_period_or_every_one_is_stable_that_is_said():
    none = euler(hinge(MOTOR), control_period=0.01, delay=0.3, kp=400.0, kv=0.1)
    assert none.stable_up_to_s is None and none.stable_at_file_dt is False
    every = compare.step_limits(hinge(MOTOR), control_period=0.01, kp=0.0, kv=1e-3, integrators=["Euler"])
    assert every[0].fails_at_s is None and every[0].stable_at_file_dt and "over 500 ms" in str(every)


@pytest.mark.parametrize("stiffness, ms", [(980.0, [10.0]), (5000.0, [5.0]), (1e6, [])])
def test_a_shorter_step_in_the_same_period_is_a_remedy(stiffness, ms):
    """A stiff spring beside the motor: a semi-implicit step holds below 2 / sqrt(stiffness / inertia)."""
    of_mass = f'<inertial pos="0 0 0" mass="1" diaginertia="{INERTIA} {INERTIA} {INERTIA}"/>'
    spring = f'<body><joint axis="0 0 1" stiffness="{stiffness}" damping="0.5"/>{of_mass}</body>'
    text = hinge(MOTOR, dt=0.02).replace("</worldbody>", f"{spring}</worldbody>")
    found = asked(text, control_period=0.04, kp=5.0, kv=0.5)
    assert found.rows[0].stable_at_file_dt is False
    assert [(remedy.change, remedy.number) for remedy in found.remedies] == [("timestep", dt) for dt in ms]
    limits = [2e3 / np.sqrt(stiffness / INERTIA) > 20.0 / parts for parts in (1, 2, 4, 10)]
    assert limits.index(True) == (2, 4).index(20.0 / ms[0]) + 1 if ms else not any(limits)


def test_the_longest_step_within_an_error_is_no_longer_than_the_stable_one():
    """A trunk on legs: the usual patterns of signs hold at a longer step, further ones do not."""
    row = euler(walker(50), error=1.0)
    assert row.within_error_s == row.stable_up_to_s


def test_what_does_not_move_has_no_answer():
    with pytest.raises(ValueError, match="no joint"):
        compare.step_limits(STILL)


def test_the_seventh_keyframe_is_a_posture_and_so_are_numbers():
    keys = "".join(f'<key name="k{i}" qpos="{i / 10}"/>' for i in range(9))
    reading = read(hinge(keys=keys))
    assert [posture.name for posture in postures_of(reading)] == [f"k{i}" for i in range(9)]
    assert posture_of("k8", reading).key == "k8"
    assert posture_of("90", reading).q == (pytest.approx(np.pi / 2),)
    assert euler(hinge(keys=keys), posture="k7").posture == "k7"
    with pytest.raises(ValueError, match="k8, qpos0, or 1 numbers"):
        posture_of("k9", reading)


def test_recorded_controls_are_a_motion_that_is_judged_by_its_speed():
    times = np.linspace(0.0, 1.0, 51)
    controls = {"time": times, "servo": 0.5 * np.sin(6.0 * times)}
    row = euler(hinge(), controls=controls)
    assert row.controls == "record" and row.by_itself == "in motion" and row.run_s == 1.0
    assert row.stable_at_file_dt and row.stable_up_to_s < 1.2 * LIMIT and row.end_speed_fine_rad_per_s > 0.5
    assert not euler(hinge(dt=1.3 * LIMIT), controls=controls).stable_at_file_dt


def test_remedies_hold_in_plain_runs():
    text = hinge(dt=2.0 * LIMIT)
    found = {remedy.change: remedy for remedy in asked(text).remedies}
    assert set(found) == {"less_kv", "armature"}
    for change, least in (("less_kv", 1.5), ("armature", 1e-3)):
        assert found[change].number > least and found[change].speed < 0.05
    for kv, more, holds in (
        (KV / found["less_kv"].number, 0.0, True), (KV, found["armature"].number, True),
        (KV / found["less_kv"].number * 1.6, 0.0, False), (KV, found["armature"].number / 1.6, False),
    ):  # fmt: skip
        inertia, dt = INERTIA + more, 2.0 * LIMIT
        limit = (-kv + (kv**2 + 4.0 * inertia * KP) ** 0.5) / KP
        assert (dt < 1.05 * limit) is holds


@pytest.mark.parametrize("actuator", [
    '<velocity joint="turn" kv="60"/>', '<damper joint="turn" kv="60" ctrlrange="0 1"/>',
    '<position joint="turn" kp="5" kv="60"/>',
])  # fmt: skip
def test_speed_gains_of_every_kind_of_servo_are_reduced(actuator, monkeypatch):
    monkeypatch.setattr(remedies, "STRENGTHS", {"less_kv": remedies.STRENGTHS["less_kv"]})
    keys = '<key name="on" ctrl="1"/>' if "damper" in actuator else ""
    found = asked(hinge(actuator, dt=0.004, keys=keys))
    assert not found.own.stable_at_file_dt and "less_kv" in [remedy.change for remedy in found.remedies]


def test_more_iterations_are_tried_with_the_time_of_a_step(monkeypatch):
    """The walker moves with one iteration, and stands with two, in plain runs, too."""
    monkeypatch.setattr(remedies, "STRENGTHS", {})
    (given,) = [remedy for remedy in asked(walker(1)).remedies if remedy.change == "iterations"]
    assert given.number == 2.0 and min(given.times) > 0.0
    ends = [end_speed(walker(count), 0.005, "implicitfast", 0.1) for count in (1, 2)]
    assert not ends[0] < 0.1 and ends[1] < 0.05
    assert not any(remedy.change == "iterations" for remedy in asked(hinge()).remedies)


def test_what_stops_a_creep_is_tried():
    text = sphere(impratio=3.0, pull=2.0, condim=3, x="")
    found, pyramidal = asked(text), asked(text.replace('cone="elliptic"', ""))
    stops = {stop.change: stop.speed for stop in found.stops}
    assert stops["impratio"] == pytest.approx(found.own.creep_rad_per_s * 3.0 / 100.0, rel=0.05)
    assert pyramidal.own.creep_rad_per_s > 1e-4
    assert pyramidal.stops[0].change == "noslip" and pyramidal.stops[0].speed < 1e-6
    assert not asked(hinge()).stops


def test_a_smaller_push_after_which_the_step_is_longer_is_told():
    """A push of 0.1 rad/s reaches the stiff ends of the range, at 5.2 mrad; one of 0.03 does not."""
    joint = 'limited="true" range="-0.3 0.3" solreflimit="-1e5 -1"'
    found = asked(hinge('<position joint="turn" kp="5" kv="0.2"/>', dt=0.01, joint=joint))
    assert not found.own.stable_at_file_dt and found.smaller[0] == 0.03
    assert found.smaller[1] > 10.0 * found.own.stable_up_to_s


def test_the_object_is_a_table_a_sequence_and_a_frame():
    found = compare.step_limits(hinge(), integrators=["implicitfast", "Euler"])
    assert found["Euler"] is found[1] and [row.integrator for row in found] == ["implicitfast", "Euler"]
    lines = str(found).splitlines()
    assert any(line.split()[:3] == ["Euler", "18", "ms"] for line in lines) and "0.1 rad/s" in lines[-1]
    frame = found.to_frame()
    assert frame.loc[1, "stable_up_to_s"] == found["Euler"].stable_up_to_s
    assert np.isnan(frame.loc[0, "fails_at_s"])
    with pytest.raises(KeyError, match="was not asked"):
        found["RK4"]


@pytest.mark.parametrize("more, named", [
    ({"push": 0.0}, "push"), ({"push": float("nan")}, "push"), ({"integrators": "Euler"}, "sequence"),
    ({"integrators": ["euler"]}, "Euler"), ({"posture": "none"}, "qpos0"), ({"control_period": -1.0}, "control_period"),
    ({"push": "0.1"}, "push is '0.1': expected a number above 0"), ({"delay": 0.05}, "delay is of a program"),
    ({"kv": 1.0}, "kv is of a program"), ({"delay": -0.1, "control_period": 0.01}, "delay is -0.1"),
    ({"controls": {"time": [0.0, 1.0], "none": [0.0, 1.0]}}, "no actuator none"),
    ({"controls": {"time": [0.0, 1.0], "servo": [0.0]}}, "servo has the shape"),
    ({"controls": {"time": [0.0, 1.0], "servo": [0.0, np.nan]}}, "row 2: servo is NaN"),
])  # fmt: skip
def test_what_is_mistaken_is_one_line(more, named):
    with pytest.raises(ValueError, match=named) as error:
        compare.step_limits(hinge(), **more)
    assert "\n" not in str(error.value)


def limit_row(up_to, fails, stable, integrator="Euler"):
    return StepLimitRow(
        posture="p", integrator=integrator, push_rad_per_s=0.1, stable_up_to_s=up_to, fails_at_s=fails, stable_at_file_dt=stable,
        file_dt_s=0.002, file_integrator="Euler",
    )  # fmt: skip


@pytest.mark.parametrize("rows, worst", [
    ([limit_row(0.01, 0.011, True), limit_row(0.004, 0.0042, True)], (True, 0.004)),
    ([limit_row(0.01, 0.011, True), limit_row(0.001, 0.0011, False)], (False, 0.001)),
    ([limit_row(0.2, None, True)], (True, None)), ([limit_row(None, 0.002, False)], (False, 0.0)),
    ([limit_row(0.01, 0.011, True), limit_row(0.001, 0.0011, False, "RK4")], (True, 0.01)),
    ([limit_row(None, None, None)], (None, None)), ([], (None, None)),
])  # fmt: skip
def test_the_worst_posture_of_the_files_integrator_is_that_of_a_fleet(rows, worst):
    assert worst_step(rows) == worst


@pytest.mark.parametrize("share, is_told", [(0.99, True), (1.01, False)])
def test_an_inertia_that_no_body_of_the_mass_has_is_told_where_it_moves_first(share, is_told):
    """A turntable of 20 kg; a ball of osmium, of which a cubic metre has 22,590 kg, has 2/5 m r^2."""
    radius = (3.0 * 20.0 / (4.0 * np.pi * 22_590.0)) ** (1.0 / 3.0)
    ball = 0.4 * 20.0 * radius**2
    text = f"""<mujoco><option timestep="0.002" integrator="Euler"/><worldbody><body><joint name="turn" axis="0 0 1"/>
<inertial pos="0 0 0" mass="20" diaginertia="{ball} {ball} {share * ball}"/></body></worldbody>
<actuator><position joint="turn" kp="5000" kv="900"/></actuator></mujoco>"""
    found = asked(text, helped=False)
    assert found.rows[0].moves_first == "turn" and list(found.light) == ["turn"] * is_told
    if is_told:
        assert found.light["turn"] == pytest.approx((share * ball, 20.0, ball), rel=1e-12)
