"""What would lift the limit of a step, and what the full model does."""

import numpy as np
import pytest
from servo_models import FILTERED, FORK, INERTIA, acting_of, hinge, posture_of

from compare.engines.mujoco.flags import INTEGRATORS
from compare.experiments.stability.servos import full_model
from compare.experiments.stability.servos.lifting import lifts, rounded


def lifts_of(source, integrator, dt):
    at, reading = posture_of(source)
    found = lifts(acting_of(at, reading), at, at.bases[0], integrator, dt)
    return {one.names[0] if one.kind == "integrator" else one.kind: one for one in found}


@pytest.mark.parametrize("joint", ["", 'armature="0.01"'])  # armature is told with what the joint has
def test_one_hinge_is_lifted_by_the_numbers_of_the_formula(joint):
    kp, dt, inertia = 20.0, 0.02, INERTIA + 0.01 * bool(joint)
    found = lifts_of(hinge(kp, 30.0, joint=joint), "Euler", dt)
    assert all(one.tried and (one.limit.dt or np.inf) >= dt for one in found.values())
    assert found["implicitfast"].factor > 100.0
    assert "discrete" not in INTEGRATORS or found["discrete"].factor is None
    # 4 I > 2 dt kv + dt^2 kp
    most = (4.0 * inertia - dt**2 * kp) / (2.0 * dt)
    assert found["kv"].names == ("servo",) and 0.9 * most < found["kv"].values[0] < most
    least = (2.0 * dt * 30.0 + dt**2 * kp) / 4.0 - INERTIA
    assert found["armature"].names == ("turn",) and least < found["armature"].values[0] < 1.1 * least


def test_what_does_not_help_is_not_proposed():
    # without any kv the stiffness alone is too much for the step
    found = lifts_of(hinge(2000.0, 5.0), "Euler", 0.03)
    assert "kv" not in found and found["armature"].tried
    # a filter is as fast as it is
    found = lifts_of(hinge(actuator=FILTERED.format(kind="filter", constant=1e-3)), "Euler", 2.5e-3)
    assert list(found) == ["RK4"] and found["RK4"].tried


def test_within_the_limit_only_integrators_are_told():
    found = lifts_of(hinge(20.0, 1.0), "Euler", 0.002)
    assert "implicitfast" in found and not {"kv", "armature"} & set(found)


def test_all_that_is_needed_is_named_and_no_more():
    found = lifts_of(FORK.format(kv=5), "Euler", 0.05)
    assert set(found["armature"].names) >= {"left", "right"} and found["armature"].tried
    # the tendon's kv alone is too large: its actuator is named
    found = lifts_of(FORK.format(kv=60), "Euler", 0.01)
    assert found["kv"].names == ("grip",) and found["kv"].tried and found["kv"].values[0] < 60.0


def test_a_servo_of_speed_is_changed_as_one_number():
    servo = '<velocity name="v" joint="turn" kv="30"/>'
    found = lifts_of(hinge(actuator=servo, joint='stiffness="20"'), "Euler", 0.02)
    assert found["kv"].tried and found["kv"].values[0] < 5.0


@pytest.mark.parametrize("value, way, expected", [
    (0.2199, np.floor, 0.21), (0.2101, np.ceil, 0.22), (0.21, np.floor, 0.21), (1234.0, np.floor, 1200.0), (0.0, np.ceil, 0.0),
    (0.099999, np.ceil, 0.1),
])  # fmt: skip
def test_numbers_are_rounded_to_the_safe_side(value, way, expected):
    assert rounded(value, way) == pytest.approx(expected, rel=1e-12)


def test_rows_of_the_full_model_say_what_it_does():
    servo, key = '<position name="s" joint="turn" kp="20" kv="300" forcerange="-1 1"/>', 'qpos="0.01" ctrl="0"'
    source = hinge(actuator=servo, joint="{}").replace(
        "</mujoco>", f'<keyframe><key name="off" {key}/></keyframe></mujoco>'
    )
    for joint, calm in (("", False), ('frictionloss="5"', True)):  # friction calms what is unstable
        at, reading = posture_of(source.format(joint))
        rows = full_model.rows(reading.model, at, 0.002, {"Euler": False, "implicitfast": True})
        found = [(row["posture"], row["integrator"], row["dt_s"], row["predicted_stable"]) for row in rows]
        assert found == [("off", "Euler", 0.002, False), ("off", "implicitfast", 0.002, True)]
        shaken, still = rows
        assert shaken["calm"] is calm and (shaken["rms_speed"] < 0.01) is calm and still["rms_speed"] < 0.01
        assert shaken["warnings"] == shaken["resets"] == 0


def test_what_is_unstable_and_rests_exactly_does_not_pass_for_calm():
    at, reading = posture_of(hinge(20.0, 300.0))
    assert at.moved == 0.0
    rows = full_model.rows(reading.model, at, 0.002, {"Euler": False, "implicitfast": True})
    assert [row["calm"] for row in rows] == [False, True]
