"""The largest stable step under servos as runs show it, and the error of a step response, beside what is known exactly."""

from dataclasses import replace

import numpy as np
import pytest
from models import PATHS
from servo_models import FILTERED, FLOATING, FORK, INERTIA, acting_of, hinge, posture_of

from compare.engines.mujoco.flags import INTEGRATORS
from compare.experiments.stability.servos import observed, response
from compare.experiments.stability.servos.observed import grows_in_runs, hardly_grows


def limit_of(source, integrator, base=None):
    at, reading = posture_of(source)
    return observed.limit(acting_of(at, reading, base), at, integrator)


def of_euler(kp, explicit, implicit=0.0):
    """4 I + 2 dt (implicit - explicit) - dt^2 kp = 0."""
    off = implicit - explicit
    return (off + np.sqrt(off**2 + 4.0 * INERTIA * kp)) / kp


@pytest.mark.parametrize("kv, damping", [
    (0.0, 0.0),  # it swings and nothing damps it
    (50.0, 0.0),  # far too large
    (40.0, 39.0),  # explicit and implicit damping nearly cancel: above the limit it hardly grows
])  # fmt: skip
def test_the_limit_of_one_hinge_is_that_of_the_formula(kv, damping):
    source = hinge(20.0, kv, joint=f'damping="{damping}"')
    kind, dt = limit_of(source, "Euler")
    assert kind == "finite" and dt == pytest.approx(of_euler(20.0, kv, damping), rel=2e-3)
    kind, dt = limit_of(source, "implicitfast")
    expected = of_euler(20.0, 0.0, kv + damping)
    assert (kind, dt) == ("none", None) if expected > 5.0 else dt == pytest.approx(expected, rel=2e-3)


def test_what_has_no_limit_up_to_five_seconds_has_none():
    kind, dt = limit_of(hinge(4.0 * INERTIA / 4.9**2), "Euler")
    assert kind == "finite" and dt == pytest.approx(4.9, rel=2e-3)
    assert limit_of(hinge(4.0 * INERTIA / 5.1**2), "Euler") == ("none", None)
    if "discrete" in INTEGRATORS:
        assert limit_of(hinge(20.0, 1.0), "discrete") == ("none", None)


@pytest.mark.parametrize("kind, integrator, expected", [
    ("filter", "implicitfast", 2e-4), ("filterexact", "RK4", 2.785e-4), ("filterexact", "Euler", of_euler(20.0, 2.0)),
])  # fmt: skip
def test_a_filter_that_is_too_fast_for_the_step_is_seen_unless_it_is_exact(kind, integrator, expected):
    found, dt = limit_of(hinge(actuator=FILTERED.format(kind=kind, constant=1e-4)), integrator)
    assert found == "finite" and dt == pytest.approx(expected, rel=2e-3)


@pytest.mark.parametrize("source, base, integrator", [
    (FORK.format(kv=60), None, "Euler"), (FORK.format(kv=60), None, "RK4"),  # fingers alike, against each other
    (FLOATING, None, "implicitfast"), (FLOATING, "locked", "Euler"), (PATHS["gripper"], None, "implicit"),
    (PATHS["mixed"], None, "RK4"),
])  # fmt: skip
def test_runs_show_the_predicted_limit(source, base, integrator):
    at, reading = posture_of(source)
    acting, predicted = acting_of(at, reading, base), at.small(base or at.bases[0]).limit(integrator)
    assert predicted.limit == "finite"
    assert not grows_in_runs(acting, at, integrator, 0.997 * predicted.dt)
    assert grows_in_runs(acting, at, integrator, 1.003 * predicted.dt)


def test_a_base_that_drifts_is_no_growth():
    at, reading = posture_of(FLOATING)
    acting = acting_of(at, reading)
    speeds = observed.measured_speeds(acting, at)
    assert speeds and not set(speeds) & set(at.base)
    start = next(observed.run_parts(acting, at, "implicitfast", 1e-3, 400))
    assert 0.1 < np.linalg.norm(start, axis=1).max() < 3.0
    assert not grows_in_runs(acting, at, "implicitfast", 1e-3)


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


@pytest.mark.parametrize("source, base", [(hinge(20.0, 1.0), None), (FORK.format(kv=5), None), (FLOATING, "locked")])
def test_errors_fall_with_the_order_of_the_method(source, base):
    coarse, fine = errors(source, "implicitfast", (1e-3, 5e-4), base)
    assert coarse / fine == pytest.approx(2.0, rel=0.1) and 1e-6 < fine < 0.1
    coarse, fine, finest = errors(source, "RK4", (1.6e-3, 8e-4, 1e-4), base)
    assert coarse / fine == pytest.approx(16.0, rel=0.4) and fine < 1e-3
    assert finest < 1e-7  # the exact response is that of MuJoCo


def test_the_exact_response_of_one_hinge_is_the_known_one():
    at, _ = posture_of(hinge(20.0, 0.0))
    jump = response.jump_of(at)
    found = response.exact_response(at, "fixed", jump, 0.01, 20)
    times = 0.01 * np.arange(1, 21)
    assert jump == pytest.approx([1.0]) and found[-1, 0] == pytest.approx(1.0)
    assert found[:-1, 0] == pytest.approx(1.0 - np.cos(np.sqrt(20.0 / INERTIA) * times), abs=1e-9)


def test_a_wrong_stiffness_is_an_error_that_no_step_removes():
    at, reading = posture_of(hinge(20.0, 1.0))
    acting, whole = acting_of(at, reading), at.whole
    right = response.response_error(acting, at, "fixed", "RK4", 1e-4)
    object.__setattr__(at, "__dict__", at.__dict__ | {"whole": replace(whole, K=1.02 * whole.K)})
    assert right < 1e-7 < 1e-3 < response.response_error(acting, at, "fixed", "RK4", 1e-4)


def test_without_a_servo_or_without_numbers_there_is_no_error():
    assert errors(hinge(actuator='<motor name="m" joint="turn"/>', joint='stiffness="20"'), "Euler", (1e-3,)) == [None]
    assert errors(hinge(20.0, 500.0), "Euler", (2e-3,)) == [None]
    assert errors(hinge(20.0, 200.0), "implicitfast", (0.5,))[0] < 1.0  # one step is longer than the response


def test_a_curve_goes_from_below_the_files_step_to_the_limit():
    at, reading = posture_of(hinge(20.0, 1.0))
    found = response.curve(acting_of(at, reading), at, "fixed", "Euler", 0.002, 0.08)
    dts, off = np.array(found).T
    assert dts[0] == pytest.approx(0.002 / 16.0) and dts[-1] == pytest.approx(0.08)
    assert (np.diff(dts) > 0.0).all() and off[-1] > off[0]
