"""The error of a step response beside the exact one."""

from dataclasses import replace

import numpy as np
import pytest
from models import PATHS
from servo_models import FLOATING, FORK, INERTIA, acting_of, hinge, posture_of

from compare.experiments.stability.servos import response


def errors(source, integrator, dts, base=None):
    at, reading = posture_of(source)
    acting = acting_of(at, reading, base)
    return [response.response_error(acting, at, base or at.bases[0], integrator, dt) for dt in dts]


@pytest.mark.parametrize("source, base", [
    (hinge(20.0, 1.0), None), (FORK.format(kv=5), None), (FLOATING, None), (FLOATING, "locked"), (PATHS["gripper"], None),
])  # fmt: skip
def test_errors_fall_with_the_order_of_the_method(source, base):
    coarse, fine = errors(source, "implicitfast", (1e-3, 5e-4), base)
    assert coarse / fine == pytest.approx(2.0, rel=0.1) and 1e-6 < fine < 0.1
    coarse, fine = errors(source, "RK4", (1.6e-3, 8e-4), base)
    assert coarse / fine == pytest.approx(16.0, rel=0.4) and fine < 1e-3
    assert errors(source, "RK4", (1e-4,), base)[0] < 1e-7  # the exact response is that of MuJoCo


def test_the_exact_response_of_one_hinge_is_the_known_one():
    at, _ = posture_of(hinge(20.0, 0.0))
    jump = response.jump_of(at)
    assert jump == pytest.approx([1.0])
    found = response.exact_response(at, "fixed", jump, 0.01, 20)
    times = 0.01 * np.arange(1, 21)
    assert found[:-1, 0] == pytest.approx(1.0 - np.cos(np.sqrt(20.0 / INERTIA) * times), abs=1e-9)
    assert found[-1, 0] == pytest.approx(1.0)


def test_a_wrong_stiffness_is_an_error_that_no_step_removes():
    at, reading = posture_of(hinge(20.0, 1.0))
    acting = acting_of(at, reading)
    right = response.response_error(acting, at, "fixed", "RK4", 1e-4)
    whole = at.whole
    object.__setattr__(at, "__dict__", at.__dict__ | {"whole": replace(whole, K=1.02 * whole.K)})
    assert right < 1e-7 < 1e-3 < response.response_error(acting, at, "fixed", "RK4", 1e-4)


def test_without_a_servo_or_without_numbers_there_is_no_error():
    assert errors(hinge(actuator='<motor name="m" joint="turn"/>', joint='stiffness="20"'), "Euler", (1e-3,)) == [None]
    assert errors(hinge(20.0, 50.0), "Euler", (2e-3,)) != [None]
    assert errors(hinge(20.0, 500.0), "Euler", (2e-3,)) == [None]


def test_a_step_beyond_the_response_is_one_step():
    assert errors(hinge(20.0, 200.0), "implicitfast", (0.5,))[0] < 1.0


def test_a_curve_goes_from_below_the_files_step_to_the_limit():
    at, reading = posture_of(hinge(20.0, 1.0))
    found = response.curve(acting_of(at, reading), at, "fixed", "Euler", 0.002, 0.08)
    dts, off = np.array(found).T
    assert dts[0] == pytest.approx(0.002 / 16.0) and dts[-1] == pytest.approx(0.08)
    assert (np.diff(dts) > 0.0).all() and off[-1] > off[0]
    longest = response.curve(acting_of(at, reading), at, "fixed", "discrete", 0.002, None)
    assert longest[-1][0] == pytest.approx(response.LASTS)
