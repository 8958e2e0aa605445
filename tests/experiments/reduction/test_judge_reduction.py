"""Reduction: its rules just inside and just outside, motions that are known exactly, and whose number stands where."""

import numpy as np
import pytest
from edited import XML, setup_of

from compare.experiments.followed import Deviation
from compare.experiments.reduction import exact_motion, needs, sub_blocks, times
from compare.experiments.reduction.records import Model, ReductionResult, SubsetRow
from compare.judge.scale import EPS
from compare.robots.arm import ARM
from compare.robots.case import Coordinates


def verdicts(check, *arguments):
    result = ReductionResult("reduction", tables={"reduction_subsets": []})
    check(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


@pytest.mark.parametrize("apart, passes", [(63.0, True), (65.0, False), (np.nan, False), (np.inf, False)])
def test_sub_blocks_agree_within_64_eps(apart, passes):
    scale = np.array([2.0, 1e-3, 5.0])
    off = np.array([0.0, apart * EPS * 1e-3, 0.0])  # in the state with the small scale
    row = SubsetRow(locked="beta", quantity="Mbar", parties="reduced, TMT to MuJoCo", unit="kg m2")
    found = verdicts(sub_blocks.check_blocks, "beta locked", row, off, scale)
    assert found == {"Mbar, reduced, TMT to MuJoCo": passes}


@pytest.mark.parametrize("apart, width, required, within, long_enough", [
    (0.99e-9, 1e-9, 5.0, True, True), (1.01e-9, 1e-9, 5.0, False, True), (np.nan, 1e-9, 5.0, False, True),
    (1e-300, 0.0, 5.0, False, True), (0.0, 0.99e-3, 5.0, True, True),
    (1.0, 1.01e-3, 3.0, True, True),  # too wide from 4 s on: then nothing is judged there
    (0.0, 1.01e-3, 3.01, True, False),
])  # fmt: skip
def test_the_smallest_model_is_judged_while_the_band_is_narrow(apart, width, required, within, long_enough):
    t = np.arange(6.0)
    off, band = np.zeros((6, 4)), np.full((6, 4), 1e-9)
    off[4, 1], band[4, 1] = apart, width
    deviation = Deviation(Coordinates(("alpha", "gamma")), t, off, band)
    found = verdicts(needs.check_smaller, "zero, free", deviation, required)
    assert found == {"smallest model to whole": within, "time judged": long_enough}


ORDERS = {4.149: True, 4.151: False, 3.851: True, 3.849: False}
FALLING = [([2.0**order * 1e-8, 1e-8, 9e-12, 8e-12], [passes]) for order, passes in ORDERS.items()]


@pytest.mark.parametrize("errors, passed", [  # each of half the step of the last; those below 1e-11 rad are rounding
    *FALLING, ([2.0**4 * 1.1e-11, 1.1e-11, 9e-12, 8e-12], [True]),  # just above rounding
    ([1.0, 0.9, 2.0**4 * 1e-9, 1e-9, 9e-12], [True]), ([1.0, 2.0**-4, 0.9e-9, 0.8e-9, 9e-12], [False]),  # the finest count
    ([2.0**4 * 1e-9, 1e-9, 9e-12, 1.1e-11, 2e-11], [True]),  # rounding that grows is no error of the method
    ([2e-11, 9e-12, 1e-13, 2e-11], []), ([1e-3, np.nan, np.nan], [False]),  # hidden by rounding; a run that ends
])  # fmt: skip
def test_errors_fall_at_the_order_of_the_method(errors, passed):
    dt = [0.1 / 2**k for k in range(len(errors))]
    found = verdicts(exact_motion.check_falling, "swing", dt, {"tmt": errors})
    assert list(found.values()) == passed


def swings(model, **scene) -> ReductionResult:
    result = ReductionResult("reduction")
    cases = [ARM.case("mine", locked=("alpha", "beta"), **scene)] if scene else ARM.cases
    for case in filter(exact_motion.is_pendulum, cases):
        exact_motion.compare_swing(result, setup_of(model), case)
    return result


def test_both_engines_meet_the_elliptic_function_and_a_heavier_arm_does_not():
    checks = swings(XML.replace('mass="1.5"', 'mass="1.50001"')).checks
    passed = {check.scene: check.passed for check in checks}
    assert passed == {"elbow swing, RK4, TMT": True, "elbow swing, RK4, MuJoCo": False}


@pytest.mark.parametrize("scene", [
    {"posture": "zero", "speed": (0, 0, 2000)},  # it turns over
    {"posture": (0, 0, 89)},  # it hardly moves
    {"posture": (90, 90, 0)},  # the forearm turns about a vertical
    {"posture": "zero", "damping": 0.1},
])  # fmt: skip
def test_a_pendulum_that_shows_nothing_is_left_out(mujoco, scene):
    result = swings(mujoco, **scene)
    assert result.checks == [] and result.swings == {}


def test_the_table_has_the_times_of_each_engine_and_the_largest_gain():
    """Of a scene with a smaller model and of one that needs no run."""
    cases, seconds = {case.name: case for case in ARM.cases}, {}
    free, held = cases["zero, free"], cases["bent, held"]
    planar = cases["elbow swing"]  # stands for the smaller model
    for engine, steps, whole, small in (("tmt", 1024, 300e-9, 100e-9), ("mujoco", 128, 6000e-9, 4000e-9)):
        for case, of, taken in ((free, free, whole), (held, held, whole), (free, planar, small)):
            seconds[case.name, of.joints, engine] = steps * taken
    of_scenes = (free, free), (free, planar), (held, held), (held, None)
    models = [Model(scene.name, case) for scene, case in of_scenes]
    result = ReductionResult("reduction", models=models, apart={(free.name, "tmt"): 1e-12})
    times.add_rows(result, ARM, seconds)
    rows = {(row.scene, row.nv, row.engine): row for row in result.rows}
    for engine, whole, small in (("tmt", 300.0, 100.0), ("mujoco", 6000.0, 4000.0)):
        of_whole, of_small = rows[free.name, 3, engine], rows[free.name, 1, engine]
        assert (of_whole.ns_per_step, of_whole.speedup) == pytest.approx((whole, 1.0))
        assert (of_small.ns_per_step, of_small.speedup) == pytest.approx((small, whole / small))
        assert rows[held.name, 0, engine].ns_per_step is None
    assert [rows[free.name, nv, "tmt"].max_difference for nv in (1, 3)] == [1e-12, None]

    assert times.largest_gain(result.rows, 3) is rows[free.name, 1, "tmt"]
