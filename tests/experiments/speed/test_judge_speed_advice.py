"""What to use, why an error is not reached, and the orders that are measured."""

import numpy as np
import pytest
from speed_rows import RK4, known_rows, row

from compare.experiments.speed import advice
from compare.judge.check import Result


@pytest.mark.parametrize(
    "order, measured, passes",
    [(4, 4.149, True), (4, 4.151, False), (4, 3.851, True), (4, 3.849, False), (1, 1.151, False), (8, 7.01, True),
     (8, 6.99, False), (8, 12.0, True), (4, np.nan, False)],
)  # fmt: skip
def test_the_order_is_measured_within_its_margin(order, measured, passes):
    result = Result("speed")
    advice.check_order(result, "bent, free, tmt rk4", order, measured)
    assert [check.passed for check in result.checks] == [passes]


def shown(errors, complete=True):
    """The orders that are measured of runs with these errors, and which checks pass."""
    rows = [row("tmt", "rk4", e, 64 << k) for k, e in enumerate(errors)]
    result = Result("speed", rows=rows)
    table = advice.orders(result, ["bent, free"], [RK4], complete)
    return [line["measured_order"] for line in table], [check.passed for check in result.checks]


def test_an_order_is_measured_where_errors_fall_regularly():
    assert shown([0.29, 2.9e-2, 2.9e-2 / 16]) == ([pytest.approx(4.0)], [True, True])
    assert shown([3.1e-2, 2.9e-2 / 16]) == ([], [False])  # one error only is below 3e-2 rad
    assert shown([3.1e-2, 2.9e-2 / 16], complete=False) == ([], [])
    assert shown([0.29, 16 * 2.1e-12, 2.1e-12]) == ([pytest.approx(4.0)], [True, True])
    assert shown([0.29, 16 * 1.9e-12, 1.9e-12]) == ([], [False])
    assert shown([2.9e-2, 2.8e-2, 2.8e-2 / 16]) == ([pytest.approx(4.0)], [True, True])  # the finest two count
    assert shown([2.9e-2, 2.9e-2 / 16, 2.8e-2 / 16])[1] == [False, True]


def test_an_order_need_not_show_where_the_coarsest_steps_are_near_rounding():
    """Half of them would make an error below 2e-12 rad, and that is no error that falls with the order."""
    assert shown([16 * 1.99e-12, 1e-13]) == ([], [])
    assert shown([16 * 2.01e-12, 1e-13]) == ([], [False])
    assert shown([np.nan, 16 * 1.99e-12, 1e-13]) == ([], [False])  # the coarsest has diverged
    assert shown([]) == ([], [False])  # it did not run


def test_the_advice_names_the_cheapest_of_each_engine_with_its_time():
    table = {line["target_rad"]: line for line in advice.advice(known_rows(), ["bent, free"], {"bent, free": 1e-16})}
    line = table[1e-3]
    assert (line["mujoco"], line["tmt"], line["of_all"]) == (
        "mujoco RK4, 256 steps", "tmt dopri8, 64 steps", "scipy DOP853, 500 steps")  # fmt: skip
    times = [line[f"{engine}_ms"] for engine in ("mujoco", "tmt", "of_all")]
    assert times == pytest.approx([80.0, 2.0, 0.1]) and line["mujoco_evaluations"] == 1024
    assert (line["ratio"], line["kernel_part"], line["method_part"]) == pytest.approx((40.0, 20.0, 2.0))
    assert line["integrator_part"] == pytest.approx(1.0) and line["why_not"] is None
    assert (
        table[1e-12]["mujoco"] is None
        and "MuJoCo's least error is 3.1e-07 rad: its steps end" in table[1e-12]["why_not"]
    )


@pytest.mark.parametrize(
    "errors, left, says",
    [
        ([1.0, 0.5], 1e-16, "its steps end before"),
        ([1.0, 29e-14, 1.0], 1e-14, "rounding, of the size of 1e-14 rad, takes over"),
        ([1.0, 31e-14, 1.0], 1e-14, "finer steps come no nearer"),
    ],
)
def test_why_an_error_is_not_reached(errors, left, says):
    rows = [row("mujoco", "RK4", e, 64 << k) for k, e in enumerate(errors)]
    words = advice.why_not(rows, None, None, left)
    assert f"MuJoCo's least error is {min(errors):.1e} rad: " in words and says in words
    assert words.endswith("tmt has no run that did not diverge")
