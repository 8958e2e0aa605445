"""The largest stable step under servos as runs show it, beside what is known of it without a run."""

import numpy as np
import pytest
from models import PATHS
from servo_models import FILTERED, FLOATING, FORK, INERTIA, acting_of, hinge, posture_of

from compare.experiments.stability.servos import observed
from compare.experiments.stability.servos.observed import (
    alternating,
    grows_in_runs,
    hardly_grows,
    measured_speeds,
    run_parts,
    sizes_in_a_run,
)


def limit_of(source, integrator, base=None):
    at, reading = posture_of(source)
    return observed.limit(acting_of(at, reading, base), at, integrator)


def of_euler(kp, explicit, implicit=0.0):
    """4 I + 2 dt (implicit - explicit) - dt^2 kp = 0."""
    off = implicit - explicit
    return (off + np.sqrt(off**2 + 4.0 * INERTIA * kp)) / kp


@pytest.mark.parametrize("kp, kv, damping", [
    (20.0, 0.0, 0.0),  # it swings and nothing damps it
    (20.0, 0.4, 0.0), (20.0, 50.0, 0.0),  # far too large
    (20.0, 1.0, 2.0),
    (20.0, 40.0, 39.0),  # explicit and implicit damping nearly cancel: above the limit it hardly grows_in_runs
])  # fmt: skip
def test_the_limit_of_one_hinge_is_that_of_the_formula(kp, kv, damping):
    source = hinge(kp, kv, joint=f'damping="{damping}"')
    kind, dt = limit_of(source, "Euler")
    assert kind == "finite" and dt == pytest.approx(of_euler(kp, kv, damping), rel=2e-3)
    kind, dt = limit_of(source, "implicitfast")
    expected = of_euler(kp, 0.0, kv + damping)
    assert (kind, dt) == ("none", None) if expected > 5.0 else dt == pytest.approx(expected, rel=2e-3)


def test_what_has_no_limit_up_to_five_seconds_has_none():
    assert limit_of(hinge(20.0, 1.0), "discrete") == ("none", None)
    nearly = 4.0 * INERTIA / 4.9**2
    kind, dt = limit_of(hinge(nearly), "Euler")
    assert kind == "finite" and dt == pytest.approx(4.9, rel=2e-3)
    assert limit_of(hinge(4.0 * INERTIA / 5.1**2), "Euler") == ("none", None)


@pytest.mark.parametrize("kind, integrator, times", [
    ("filter", "implicitfast", 2.0), ("filter", "RK4", 2.785), ("filterexact", "RK4", 2.785),
])  # fmt: skip
def test_a_filter_that_is_too_fast_for_the_step_is_seen(kind, integrator, times):
    source = hinge(actuator=FILTERED.format(kind=kind, constant=1e-4))
    found, dt = limit_of(source, integrator)
    assert found == "finite" and dt == pytest.approx(times * 1e-4, rel=2e-3)


def test_a_filter_that_is_exact_has_no_limit_of_its_own():
    source = hinge(actuator=FILTERED.format(kind="filterexact", constant=1e-4))
    assert limit_of(source, "Euler")[1] == pytest.approx(of_euler(20.0, 2.0), rel=2e-3)


@pytest.mark.parametrize("source, base, integrator", [
    (FORK.format(kv=60), None, "Euler"), (FORK.format(kv=60), None, "implicitfast"),  # fingers alike, against each other
    (FORK.format(kv=60), None, "RK4"),
    (FLOATING, None, "Euler"), (FLOATING, None, "implicitfast"), (FLOATING, "locked", "Euler"),
    (PATHS["arm7"], None, "Euler"), (PATHS["gripper"], None, "implicit"), (PATHS["mixed"], None, "RK4"),
])  # fmt: skip
def test_runs_show_the_predicted_limit(source, base, integrator):
    at, reading = posture_of(source)
    acting = acting_of(at, reading, base)
    predicted = at.small(base or at.bases[0]).limit(integrator)
    assert predicted.limit == "finite"
    assert not grows_in_runs(acting, at, integrator, 0.997 * predicted.dt)
    assert grows_in_runs(acting, at, integrator, 1.003 * predicted.dt)


def test_a_base_that_drifts_is_no_growth():
    at, reading = posture_of(FLOATING)
    acting = acting_of(at, reading)
    assert not set(measured_speeds(acting, at)) & set(at.base) and measured_speeds(acting, at)
    start = next(run_parts(acting, at, "implicitfast", 1e-3, 400))
    assert 0.1 < np.linalg.norm(start, axis=1).max() < 3.0
    assert not grows_in_runs(acting, at, "implicitfast", 1e-3)


def test_what_changes_its_sign_is_told_from_swings():
    n = np.arange(500)
    assert alternating(((-1.0) ** n)[:, None]) == pytest.approx(1.0, rel=1e-6)
    assert alternating(np.cos(0.1 * n)[:, None]) < 1e-5
    assert alternating(np.array([(-1.0) ** n, 0.0 * n]).T * 3.0) == pytest.approx(3.0, rel=1e-6)


@pytest.mark.parametrize("turning, growing", [
    (0.1 * 1.001 ** np.arange(8), True),
    (0.1 * 1.0005 ** np.arange(8), False),  # by too little in all
    (0.1 * np.array([9.0, 5.0, 1.0, 1.001, 1.002, 1.003, 1.004, 1.005]), True),  # what decays first does not count
    (0.1 * np.array([1.0, 1.0, 1.0, 1.001, 1.002, 1.0021, 1.003, 1.004]), False),  # not evenly
    (1.1e-5 * 1.001 ** np.arange(8), True), (0.9e-5 * 1.001 ** np.arange(8), False),
])  # fmt: skip
def test_hardly_growing_is_told_by_evenness(turning, growing):
    assert hardly_grows(turning) is growing


def test_rounding_that_seems_to_grow_is_asked_again_with_a_larger_deviation():
    at, reading = posture_of(hinge(20.0, 40.0, joint='damping="39"'))
    acting = acting_of(at, reading)
    dt = 1.005 * of_euler(20.0, 40.0, 39.0)
    once, again = (sizes_in_a_run(acting, at, "Euler", dt, 4000, times)[1] for times in (1.0, 30.0))
    assert hardly_grows(once) and hardly_grows(again) and again == pytest.approx(once, rel=1e-3)
    assert grows_in_runs(acting, at, "Euler", dt)
