"""Steps under servos in runs: the largest stable one, the error of a step response, what lifts a limit, the full model."""

import numpy as np
import pytest
from models import PATHS
from servo_models import FILTERED, FLOATING, FORK, INERTIA, acting_of, hinge, posture_of

from compare.experiments.stability.servos import full_model, observed, response
from compare.experiments.stability.servos.lifting import lifts, rounded
from compare.experiments.stability.servos.observed import grows_in_runs, hardly_grows


def limit_of(source, integrator):
    at, reading = posture_of(source)
    return observed.limit(acting_of(at, reading), at, integrator)


def of_euler(kp, explicit, implicit=0.0):
    """4 I + 2 dt (implicit - explicit) - dt^2 kp = 0."""
    off = implicit - explicit
    return (off + np.sqrt(off**2 + 4.0 * INERTIA * kp)) / kp


@pytest.mark.parametrize("source, integrator, expected", [
    (hinge(20.0, 50.0), "Euler", of_euler(20.0, 50.0)),
    # explicit and implicit damping nearly cancel: above the limit it hardly grows
    (hinge(20.0, 40.0, joint='damping="39"'), "Euler", of_euler(20.0, 40.0, 39.0)),
    (hinge(20.0), "implicitfast", of_euler(20.0, 0.0)),  # it swings and nothing damps it
    (hinge(4.0 * INERTIA / 4.9**2), "Euler", 4.9), (hinge(4.0 * INERTIA / 5.1**2), "Euler", None),  # sought up to 5 s
    # a filter that is too fast for the step is seen, unless it is exact
    (hinge(actuator=FILTERED.format(kind="filter", constant=1e-4)), "implicitfast", 2e-4),
    (hinge(actuator=FILTERED.format(kind="filterexact", constant=1e-4)), "Euler", of_euler(20.0, 2.0)),
])  # fmt: skip
def test_the_limit_of_one_hinge_is_that_of_the_formula(source, integrator, expected):
    found = limit_of(source, integrator)
    assert found == (("finite", pytest.approx(expected, rel=2e-3)) if expected else ("none", None))


@pytest.mark.parametrize("source, base, integrator", [
    (FORK.format(kv=60), None, "Euler"),  # fingers alike, against each other
    (FLOATING, None, "implicitfast"), (FLOATING, "locked", "Euler"), (PATHS["mixed"], None, "RK4"),
])  # fmt: skip
def test_runs_show_the_predicted_limit(source, base, integrator):
    at, reading = posture_of(source)
    acting, predicted = acting_of(at, reading, base), at.small(base or at.bases[0]).limit(integrator)
    assert predicted.limit == "finite"
    grows = [grows_in_runs(acting, at, integrator, share * predicted.dt) for share in (0.997, 1.003)]
    assert grows == [False, True]


@pytest.mark.parametrize("turning, growing", [
    (0.1 * 1.001 ** np.arange(8), True),
    (0.1 * 1.0005 ** np.arange(8), False),  # by too little in all
    (0.1 * np.array([9.0, 5.0, 1.0, 1.001, 1.002, 1.003, 1.004, 1.005]), True),  # what decays first does not count
    (0.1 * np.array([1.0, 1.0, 1.0, 1.001, 1.002, 1.0021, 1.003, 1.004]), False),  # not evenly
    (1.1e-5 * 1.001 ** np.arange(8), True), (0.9e-5 * 1.001 ** np.arange(8), False),
])  # fmt: skip
def test_hardly_growing_is_told_by_evenness(turning, growing):
    assert hardly_grows(turning) is growing


# the error of a step response


def errors(source, integrator, dts, base=None):
    at, reading = posture_of(source)
    acting = acting_of(at, reading, base)
    return [response.response_error(acting, at, base or at.bases[0], integrator, dt) for dt in dts]


@pytest.mark.parametrize("source, base", [(FORK.format(kv=5), None), (FLOATING, "locked")])
def test_errors_fall_with_the_order_of_the_method(source, base):
    coarse, fine = errors(source, "implicitfast", (1e-3, 5e-4), base)
    assert coarse / fine == pytest.approx(2.0, rel=0.1) and 1e-6 < fine < 0.1
    coarse, fine, finest = errors(source, "RK4", (1.6e-3, 8e-4, 1e-4), base)
    assert coarse / fine == pytest.approx(16.0, rel=0.4)
    assert finest < 1e-7  # the exact response is that of MuJoCo


def test_the_exact_response_of_one_hinge_is_the_known_one():
    at, _ = posture_of(hinge(20.0, 0.0))
    found = response.exact_response(at, "fixed", response.jump_of(at), 0.01, 20)
    times = 0.01 * np.arange(1, 21)
    assert found[-1, 0] == pytest.approx(1.0)
    assert found[:-1, 0] == pytest.approx(1.0 - np.cos(np.sqrt(20.0 / INERTIA) * times), abs=1e-9)


def test_without_a_servo_or_without_numbers_there_is_no_error():
    assert errors(hinge(actuator='<motor name="m" joint="turn"/>', joint='stiffness="20"'), "Euler", (1e-3,)) == [None]
    assert errors(hinge(20.0, 500.0), "Euler", (2e-3,)) == [None]


# what lifts a limit


def lifts_of(source, dt):
    at, reading = posture_of(source)
    found = lifts(acting_of(at, reading), at, at.bases[0], "Euler", dt)
    return {one.names[0] if one.kind == "integrator" else one.kind: one for one in found}


def test_one_hinge_is_lifted_by_the_numbers_of_the_formula():
    kp, dt, inertia = 20.0, 0.02, INERTIA + 0.01
    found = lifts_of(hinge(kp, 30.0, joint='armature="0.01"'), dt)
    assert all(one.tried and (one.limit.dt or np.inf) >= dt for one in found.values())
    assert found["implicitfast"].factor > 100.0
    # 4 I > 2 dt kv + dt^2 kp
    most = (4.0 * inertia - dt**2 * kp) / (2.0 * dt)
    assert found["kv"].names == ("servo",) and 0.9 * most < found["kv"].values[0] < most
    least = (2.0 * dt * 30.0 + dt**2 * kp) / 4.0 - INERTIA  # with what the joint has
    assert found["armature"].names == ("turn",) and least < found["armature"].values[0] < 1.1 * least


def test_what_does_not_help_is_not_proposed():
    # without any kv the stiffness alone is too much for the step
    found = lifts_of(hinge(2000.0, 5.0), 0.03)
    assert "kv" not in found and found["armature"].tried
    # a filter is as fast as it is
    assert list(lifts_of(hinge(actuator=FILTERED.format(kind="filter", constant=1e-3)), 2.5e-3)) == ["RK4"]
    # within the limit
    assert not {"kv", "armature"} & set(lifts_of(hinge(20.0, 1.0), 0.002))


def test_all_that_is_needed_is_named_and_no_more():
    found = lifts_of(FORK.format(kv=5), 0.05)
    assert set(found["armature"].names) >= {"left", "right"} and found["armature"].tried
    # the tendon's kv alone is too large: its actuator is named
    found = lifts_of(FORK.format(kv=60), 0.01)
    assert found["kv"].names == ("grip",) and found["kv"].tried and found["kv"].values[0] < 60.0


@pytest.mark.parametrize(
    "value, way, expected", [(0.2199, np.floor, 0.21), (0.2101, np.ceil, 0.22), (0.0, np.ceil, 0.0)]
)
def test_numbers_are_rounded_to_the_safe_side(value, way, expected):
    assert rounded(value, way) == pytest.approx(expected, rel=1e-12)


# the full model


@pytest.mark.parametrize("joint, start, calm", [
    ("", 'qpos="0.01"', False), ('frictionloss="5"', 'qpos="0.01"', True),  # friction calms what is unstable
    ("", "", False),  # what is unstable and rests exactly does not pass for calm
])  # fmt: skip
def test_rows_of_the_full_model_say_what_it_does(joint, start, calm):
    servo, key = '<position name="s" joint="turn" kp="20" kv="300" forcerange="-1 1"/>', f'<key {start} ctrl="0"/>'
    source = hinge(actuator=servo, joint=joint).replace("</mujoco>", f"<keyframe>{key}</keyframe></mujoco>")
    at, reading = posture_of(source)
    shaken, still = full_model.rows(reading.model, at, 0.002, {"Euler": False, "implicitfast": True})
    assert (shaken["calm"], still["calm"]) == (calm, True) and (shaken["rms_speed"] < 0.01) is calm
    assert (shaken["predicted_stable"], still["predicted_stable"]) == (False, True)
