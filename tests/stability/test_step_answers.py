"""The answer for a file: rows of step limits, for reports and for scripts, and the step from the posture itself."""

import mujoco
import numpy as np
import pytest
from small import HOLDING, INERTIA, LEG, STANDING, hinge, two

import compare
from compare.engines.mujoco.reading import read
from compare.experiments.stability import own_run
from compare.stability.answer import Asked, StepLimitRow, answers
from compare.stability.place import Posture, posture_of, postures_of
from compare.stability.start import StartRuns

KEYS = '<keyframe><key name="low" qpos="0.3 -0.2"/><key qpos="0 0"/></keyframe>'
FOOT = STANDING.format(cone="elliptic", condim=3)
ROW = {"posture": "p", "base": "fixed", "surroundings": "free", "integrator": "Euler", "limit": "finite", "predicted_dt": 0.01,
       "file_dt": 0.002, "file_integrator": "Euler", "stable_at_file_dt": True}  # fmt: skip


def test_a_script_sweeps_the_gains_of_a_compiled_model():
    """4 I - 2 dt kv - dt^2 kp = 0."""
    model = mujoco.MjModel.from_xml_string(hinge(20.0, 1.0))
    for kv in (1.0, 3.0, 10.0):
        model.actuator_biasprm[:, 2] = -kv
        (row,) = compare.step_limits(model, integrators=["Euler"])
        exact = (-kv + np.sqrt(kv**2 + 4.0 * INERTIA * 20.0)) / 20.0
        assert (row.limit, row.limiting_joint, row.surroundings) == ("finite", "turn", "free")
        assert row.predicted_dt == pytest.approx(exact, rel=3e-3)
        assert row.stable_at_file_dt is bool(exact > 0.002) and row.largest_push is None
    assert mujoco.MjModel.from_xml_string(hinge()).opt.timestep == model.opt.timestep == 0.002


def test_rows_tell_of_the_robot_in_contact_and_in_the_air():
    light = LEG.replace("<option", '<option gravity="0 0 -5"')
    rows = compare.step_limits(light, integrators=("Euler", "implicitfast"))
    assert [(row.surroundings, row.integrator) for row in rows] == [
        (where, name) for where in ("contact", "air") for name in ("Euler", "implicitfast")
    ]
    assert {row.base for row in rows} == {"free"} and not {row.limit for row in rows} & {"no_rest", "moving"}
    euler = rows[0]
    assert euler.apart == pytest.approx(0.0, abs=1e-8) and euler.moved > 1e-3 and euler.creep < 1e-9
    fast, _ = compare.step_limits(FOOT, integrators=["implicitfast"], dt=1e-3)
    assert (fast.limiting_joint, fast.limiting_contact, fast.file_dt) == ("z", "floor on foot", 1e-3)
    assert fast.creep > 1e-6 and fast.creeping_joint


@pytest.mark.parametrize("asked, q", [
    ("low", ()), ("qpos0", ()), ("10,-20", np.radians([10, -20])), ((10, -20), np.radians([10, -20])),
])  # fmt: skip
def test_a_posture_is_a_name_or_numbers(asked, q):
    reading = read(two(HOLDING + KEYS))
    found = posture_of(asked, reading)
    assert found.q == pytest.approx(tuple(q)) and found.key == ("low" if asked == "low" else "")
    assert postures_of(reading)[0].name == "low"


@pytest.mark.parametrize("asked", ["lo", "10", "10,x", "1,2,3", (1.0,)])
def test_a_wrong_posture_is_one_line(asked):
    with pytest.raises(
        ValueError, match=r"posture .* is not one of this file: expected low, .*2 numbers"
    ) as caught:
        compare.step_limits(two(HOLDING + KEYS), posture=asked)
    assert "\n" not in str(caught.value)


NEAR, OFF = {"observed_dt": 0.0097, "failing_dt": 0.0103}, {"observed_dt": 0.0094, "failing_dt": 0.0103}
NONE = {"limit": "none", "predicted_dt": None}


@pytest.mark.parametrize("more, longest, by_runs", [
    ({}, 0.01, False), (NEAR, 0.01, False), (OFF, (0.0094 * 0.0103) ** 0.5, True),
    ({"observed_dt": 0.0097, "failing_dt": 0.0106}, (0.0097 * 0.0106) ** 0.5, True), ({"failing_dt": 0.001}, 0.0, True),
    ({"observed_dt": 0.2}, np.inf, True), (NONE, np.inf, False), (NONE | {"observed_dt": 0.2}, np.inf, False),
    (NONE | {"observed_dt": 0.02, "failing_dt": 0.02}, 0.02, True), (NONE | {"limit": "below"}, 0.0, False),
    (NONE | {"limit": "below", "observed_dt": 0.02, "failing_dt": 0.02}, 0.02, True), (NONE | {"limit": "saddle"}, 0.0, False),
    (NONE | {"limit": "moving", "observed_dt": 0.02, "failing_dt": 0.02}, 0.02, True),
])  # fmt: skip
def test_runs_have_the_last_word(more, longest, by_runs):
    row = StepLimitRow(**ROW | more)
    assert (row.longest, row.decided_by_runs) == (pytest.approx(longest), by_runs)
    assert row.is_known is (row.limit != "saddle")


@pytest.mark.parametrize("smooth, held", [(None, False), (0.0098, True), (0.0099, False)])
def test_dry_friction_holds_if_the_limit_is_lower_without_it(smooth, held):
    assert StepLimitRow(**ROW | {"smooth_dt": smooth}).is_held_by_friction is held


def test_a_curve_has_the_growth_of_the_step_of_one_hinge():
    reading = read(hinge(20.0, 5.0))
    asked = Asked(0.002, "Euler", ["Euler"], drawn=True, in_runs=False)
    (found,) = answers(postures_of(reading)[0], reading, asked)
    curve, limit = found.curves["Euler"], found.rows[0].predicted_dt
    assert all((factor > 1.0) == (dt > limit) for dt, factor in curve)
    dt, factor = curve[-1]
    speeds = np.array([[1.0, 0.0], [-20.0 * dt / INERTIA, 1.0 - 5.0 * dt / INERTIA]])
    exact = np.abs(np.linalg.eigvals(np.array([[1.0, dt], [0.0, 1.0]]) @ speeds)).max()
    assert factor == pytest.approx(exact, rel=1e-6) and exact > 1.05
    assert found.cures == []
    (unstable,) = answers(postures_of(reading)[0], reading, Asked(0.03, "Euler", ["Euler"], in_runs=False))
    assert {cure.change for cure in unstable.cures} >= {"less_kv", "more_armature"}
    assert unstable.rows[0].stable_at_file_dt is False


def test_the_limit_without_dry_friction_stands_beside_that_with_it():
    (row,) = compare.step_limits(hinge(20.0, 30.0, 'frictionloss="0.3"'), integrators=["Euler"])
    assert row.smooth_dt == pytest.approx((-30.0 + np.sqrt(900.0 + 4.0 * INERTIA * 20.0)) / 20.0, rel=3e-3)
    assert row.predicted_dt > 4.0 * row.smooth_dt and row.is_held_by_friction


# an inverted pendulum that leans on one of two stops; the deeper it starts in a stop, the more that one throws it
TIPPING = """<mujoco><compiler angle="radian"/><option timestep="{dt}"><flag refsafe="disable"/></option><worldbody><body>
  <joint name="tip" axis="0 1 0" range="-0.5 0.5" solreflimit="0.02 1" damping="0.02"/>
  <geom size="0.1" pos="0 0 0.5" mass="1"/></body></worldbody><keyframe><key name="lean" qpos="{q}"/></keyframe></mujoco>"""
LEAN = Posture("lean", "lean")
GO = 0.01  # s


def starts(q, dt=GO):
    return StartRuns(read(TIPPING.format(dt=dt, q=q)), LEAN, "Euler")


@pytest.mark.parametrize("q, outcome", [(0.55, "calm"), (0.8, "alike"), (1.2, "worse")])
def test_a_run_that_comes_to_rest_elsewhere_is_stable_only_if_a_finer_step_leads_there_too(q, outcome):
    reading = read(TIPPING.format(dt=GO, q=q))
    row = own_run.own_run("lean", reading.dt, reading.integrator, reading)
    assert row.full_model_calm and row.outcome == outcome
    assert row.rests_elsewhere is (outcome != "calm") and not row.has_fallen
    expected = (1.0, "tip") if row.rests_elsewhere else (0.0, "tip")
    assert (row.moved, row.moved_joint) == (pytest.approx(expected[0], abs=0.01), expected[1])


def test_the_longest_step_from_the_posture_itself_is_where_its_runs_change():
    for first in (1e-3, GO):  # from below and from above
        runs = starts(1.2)
        longest = runs.longest(first, 0.017)
        assert 2e-3 < longest < GO and runs.rests(longest) and not runs.rests(GO)
    assert starts(0.55).longest(1e-3, 0.01) is None  # not below the limit
    assert starts(0.8).longest(1e-3, 0.017) is None  # at no step


def test_a_row_has_the_step_from_the_posture_beside_its_limit_where_it_is_lower():
    for q, lower in ((1.2, True), (0.52, False)):
        reading = read(TIPPING.format(dt=1e-3, q=q))
        (row,) = answers(LEAN, reading, Asked(1e-3, "Euler", ["Euler"]), air=False)[0].rows
        assert row.stable_at_file_dt and (row.start_dt is not None) is lower
        assert not lower or row.start_dt < 0.97 * row.longest
