"""The checks of reduction: every rule with numbers just inside and just outside."""

import numpy as np
import pytest

from compare import experiment
from compare.case import Coordinates
from compare.engines.mujoco import additions, parse
from compare.experiments import reduction
from compare.experiments.reduction import cost, exact_motion, needs, sub_blocks
from compare.judge.check import Result
from compare.judge.run import check_movement, deviation
from compare.judge.scale import EPS
from compare.robots.arm import ARM

FLOOR = additions.ON_FLOOR


def verdicts(check, *arguments, **curves):
    """(quantity, passed) of each check that is made."""
    result = Result("reduction", curves={"apart": {}} | curves, tables={"reduction_subsets": []})
    check(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


@pytest.mark.parametrize("apart, passes", [(63.0, True), (65.0, False), (np.nan, False), (np.inf, False)])
def test_sub_blocks_agree_within_64_eps(apart, passes):
    scale = np.array([2.0, 1e-3, 5.0])
    off = np.array([0.0, apart * EPS * 1e-3, 0.0])  # in the state with the small scale
    found = verdicts(sub_blocks.check_blocks, ("beta",), "Mbar", "reduced, TMT to MuJoCo", off, scale, {})
    assert found == {"Mbar, reduced, TMT to MuJoCo": passes}


@pytest.mark.filterwarnings("ignore:All-NaN")
@pytest.mark.parametrize("moved, passes", [(0.1001, True), (0.0999, False), (np.nan, False)])
def test_a_free_run_moves(moved, passes):
    q = np.array([[0.3, 1.0], [0.3, 1.0 - moved], [0.35, 1.0]]) if np.isfinite(moved) else np.full((3, 2), np.nan)
    with np.errstate(invalid="ignore"):
        assert verdicts(check_movement, "zero, free", deviation(q, q[0])) == {"movement": passes}


@pytest.mark.parametrize(
    "apart, width, required, within, long_enough",
    [
        (0.99e-9, 1e-9, 5.0, True, True),
        (1.01e-9, 1e-9, 5.0, False, True),
        (np.nan, 1e-9, 5.0, False, True),
        (0.0, 0.0, 5.0, True, True),
        (1e-300, 0.0, 5.0, False, True),
        (0.0, 0.99e-3, 5.0, True, True),
        (0.0, 1.01e-3, 3.0, True, True),  # too wide from 4 s on
        (1.0, 1.01e-3, 3.0, True, True),  # then nothing is judged there
        (0.0, 1.01e-3, 3.01, True, False),
        (0.0, np.inf, 5.0, True, False),
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
    found = verdicts(exact_motion.check_function, "elbow swing", off * EPS * 33.0, 33.0)
    assert found == {"elliptic function, scipy to 50 digits": passes}


@pytest.mark.parametrize(
    "order, clear, passes",
    [(4.149, 1e-8, True), (4.151, 1e-8, False), (3.851, 1e-8, True), (3.849, 1e-8, False), (4.1, 1.1e-11, True),
     (0.0, 1.0, False)],
)  # fmt: skip
def test_errors_fall_at_the_order_of_the_method(order, clear, passes):
    values = [2.0 ** (2 * order) * clear, 2.0**order * clear, clear, 9e-12, 8e-12]  # the last two are rounding
    errors = {("tmt", "RK4"): values if order else [1.0] * 5}
    found = verdicts(exact_motion.check_falling, "elbow swing", errors, {"RK4": 4})
    assert found == {"order of the error against the elliptic function, from 4": passes}


def order_passes(*values):
    found = verdicts(exact_motion.check_falling, "elbow swing", {("tmt", "RK4"): list(values)}, {"RK4": 4})
    return list(found.values())


def test_the_order_is_that_of_the_finest_steps_above_rounding():
    assert order_passes(1.0, 0.9, 2.0**4 * 1e-9, 1e-9, 9e-12) == [True]
    assert order_passes(1.0, 2.0**-4, 0.9e-9, 0.8e-9, 9e-12) == [False]
    assert order_passes(2.0**4 * 1e-9, 1e-9, 9e-12, 1.1e-11, 2e-11) == [
        True
    ]  # rounding that grows is no error of the method


def test_an_order_that_rounding_hides_is_not_measured_and_a_run_without_an_end_fails():
    assert order_passes(2e-11, 9e-12, 1e-13, 2e-11) == [] and order_passes(9e-12, 1e-13) == []
    assert order_passes(1e-3, np.nan, np.nan) == [False] and order_passes(*[np.inf] * 5) == [False]


@pytest.mark.parametrize("power, passes", [(2.149, True), (2.151, False), (1.851, True), (1.849, False), (0.0, False)])
def test_the_distance_from_the_modes_falls_with_the_amplitude_squared(power, passes):
    found = verdicts(exact_motion.check_modes, "hanging", {"mujoco": [1e-2, 2.0**power * 1e-3, 1e-3]})
    assert list(found.values()) == [passes]


def test_what_exerts_no_force_leaves_the_bits_and_what_is_pushed_does_not():
    names = {"minimal": additions.MINIMAL, "again": additions.AGAIN, "motor": "a motor", "floor": FLOOR}

    def judged(pushed=(FLOOR,), **same):
        rows = [{"added": name, "integrator": "RK4", "same_bits": same.get(key, True)} for key, name in names.items()]
        return verdicts(cost.check_bits, "bent, free", rows, {(name, "RK4") for name in pushed})

    motor, floor = "the same bits with a motor", f"another motion with {FLOOR}"
    assert judged(floor=False) == {motor: True, floor: True}
    assert judged() == {motor: True, floor: False}
    assert judged(motor=False, floor=False) == {motor: False, floor: True}
    untouched = f"the same bits with {FLOOR}"
    assert judged((), floor=False) == {motor: True, untouched: False} and judged(()) == {motor: True, untouched: True}


def test_a_model_whose_joints_cannot_be_locked_is_a_failed_check():
    """A tendon runs over the hinges: it cannot go with one of them."""
    tendon = '<tendon><fixed><joint joint="alpha" coef="1"/><joint joint="gamma" coef="1"/></fixed></tendon></mujoco>'
    text = ARM.mjcf.read_text(encoding="utf-8").replace("</mujoco>", tendon)
    setup = experiment.Setup.small(ARM, experiment.engines(parse(text, ARM.tree)))
    (failed,) = [check for check in reduction.rows(setup, timed=False).checks if not check.passed]
    assert failed.quantity == "models whose hinges can be locked" and failed.value == 0 and failed.note
