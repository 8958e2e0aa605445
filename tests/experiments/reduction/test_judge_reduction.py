"""The checks of reduction: every rule with numbers just inside and just outside."""

import numpy as np
import pytest

from compare.case import Coordinates
from compare.engines.mujoco import additions
from compare.experiments.reduction import cost, exact_motion, needs, sub_blocks
from compare.judge.check import Result
from compare.judge.scale import EPS

FLOOR = additions.ON_FLOOR


def verdicts(check, *arguments):
    """Whether each check that is made passes, by the name of its quantity."""
    result = Result("reduction", curves={"apart": {}}, tables={"reduction_subsets": []})
    check(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


@pytest.mark.parametrize("apart, passes", [(63.0, True), (65.0, False), (np.nan, False), (np.inf, False)])
def test_sub_blocks_agree_within_64_eps(apart, passes):
    scale = np.array([2.0, 1e-3, 5.0])
    off = np.array([0.0, apart * EPS * 1e-3, 0.0])  # in the state with the small scale
    found = verdicts(sub_blocks.check_blocks, ("beta",), "Mbar", "reduced, TMT to MuJoCo", off, scale, {})
    assert found == {"Mbar, reduced, TMT to MuJoCo": passes}


@pytest.mark.parametrize(
    "apart, width, required, within, long_enough",
    [
        (0.99e-9, 1e-9, 5.0, True, True),
        (1.01e-9, 1e-9, 5.0, False, True),
        (np.nan, 1e-9, 5.0, False, True),
        (1e-300, 0.0, 5.0, False, True),
        (0.0, 0.99e-3, 5.0, True, True),
        (1.0, 1.01e-3, 3.0, True, True),  # too wide from 4 s on: then nothing is judged there
        (0.0, 1.01e-3, 3.01, True, False),
    ],
)
def test_the_smallest_model_is_judged_while_the_band_is_narrow(apart, width, required, within, long_enough):
    t = np.arange(6.0)
    off, band = np.zeros((6, 4)), np.full((6, 4), 1e-9)
    off[4, 1], band[4, 1] = apart, width
    found = verdicts(needs.check_smaller, "zero, free", Coordinates(("alpha", "gamma")), t, off, band, required)
    assert found == {"smallest model to whole": within, "time judged": long_enough}


@pytest.mark.parametrize("off, passes", [(63.0, True), (65.0, False)])
def test_the_elliptic_function_is_right_to_64_eps(off, passes):
    assert list(verdicts(exact_motion.check_function, "swing", off * EPS * 33.0, 33.0).values()) == [passes]


# errors, each of half the step of the last; those below 1e-11 rad are rounding
FALLING = {
    "order 4.149": ([2.0**8.298 * 1e-8, 2.0**4.149 * 1e-8, 1e-8, 9e-12, 8e-12], [True]),
    "order 4.151": ([2.0**8.302 * 1e-8, 2.0**4.151 * 1e-8, 1e-8, 9e-12, 8e-12], [False]),
    "order 3.851": ([2.0**7.702 * 1e-8, 2.0**3.851 * 1e-8, 1e-8, 9e-12, 8e-12], [True]),
    "order 3.849": ([2.0**7.698 * 1e-8, 2.0**3.849 * 1e-8, 1e-8, 9e-12, 8e-12], [False]),
    "just above rounding": ([2.0**8 * 1.1e-11, 2.0**4 * 1.1e-11, 1.1e-11, 9e-12, 8e-12], [True]),
    "of the finest steps": ([1.0, 0.9, 2.0**4 * 1e-9, 1e-9, 9e-12], [True]),
    "not of the coarsest": ([1.0, 2.0**-4, 0.9e-9, 0.8e-9, 9e-12], [False]),
    "rounding that grows is no error of the method": ([2.0**4 * 1e-9, 1e-9, 9e-12, 1.1e-11, 2e-11], [True]),
    "hidden by rounding": ([2e-11, 9e-12, 1e-13, 2e-11], []),
    "a run that ends": ([1e-3, np.nan, np.nan], [False]),
}


@pytest.mark.parametrize("errors, passed", FALLING.values(), ids=FALLING)
def test_errors_fall_at_the_order_of_the_method(errors, passed):
    found = verdicts(exact_motion.check_falling, "swing", {("tmt", "RK4"): errors}, {"RK4": 4})
    assert list(found.values()) == passed


@pytest.mark.parametrize("power, passes", [(2.149, True), (2.151, False), (1.851, True), (1.849, False)])
def test_the_distance_from_the_modes_falls_with_the_amplitude_squared(power, passes):
    found = verdicts(exact_motion.check_modes, "hanging", {"mujoco": [1e-2, 2.0**power * 1e-3, 1e-3]})
    assert list(found.values()) == [passes]


@pytest.mark.parametrize(
    "differing, pushed, motor, floor",
    [
        ([FLOOR], [FLOOR], True, True),
        ([], [FLOOR], True, False),
        (["a motor"], [], False, True),
        ([FLOOR], [], True, False),
    ],
)
def test_what_exerts_no_force_leaves_the_bits_and_what_is_pushed_does_not(differing, pushed, motor, floor):
    names = additions.MINIMAL, additions.AGAIN, "a motor", FLOOR
    rows = [{"added": name, "integrator": "RK4", "same_bits": name not in differing} for name in names]
    found = verdicts(cost.check_bits, "bent, free", rows, {(name, "RK4") for name in pushed})
    of_floor = f"another motion with {FLOOR}" if pushed else f"the same bits with {FLOOR}"
    assert found == {"the same bits with a motor": motor, of_floor: floor}
