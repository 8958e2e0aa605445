"""What is concluded from errors, orders and times: every rule with a row just inside and one just outside."""

import numpy as np
import pytest
from speed_rows import known_rows, row

from compare.engines import Method
from compare.experiments.speed import accuracy, advice
from compare.judge.check import Result

RK4 = Method("tmt", "rk4", 4, "rk4")
BESIDE = "smallest error of MuJoCo's RK4, beside that of tmt's rk4"
STOPPED = "smallest error of mujoco's RK4, where smaller steps gain nothing"


def judged(check, rows, *arguments):
    """(quantity, passed) of each check that is made of rows."""
    result = Result("speed", rows=rows)
    check(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


def runs(engine, method, errors):
    """A row for each error, from coarse to fine."""
    return [row(engine, method, error, 64 << k) for k, error in enumerate(errors)]


@pytest.mark.parametrize("ours, theirs, verdict", [
    (1e-3, 1e-3 + 63e-10, True), (1e-3, 1e-3 + 65e-10, False), (1e-3, 1e-3 - 65e-10, False), (None, 1e-3, False),
    (0.0999, 0.2, False), (0.1001, 0.2, None), (None, None, None),
])  # fmt: skip
def test_the_same_scheme_makes_the_same_error(ours, theirs, verdict):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs), row("tmt", "rk4", 1.0, 128)]
    found = judged(accuracy.check_same_schemes, rows, {"bent, free": 1e-10}, {"bent, free": {"RK4": "rk4"}})
    assert found == ({} if verdict is None else {"the same error as tmt's rk4": verdict})


@pytest.mark.parametrize("theirs, ours, left, found", [
    # errors that have stopped are of the size of rounding
    ([1e-6, 1e-14, 2e-14], [1e-6, 1e-14], 1e-14 / 63, {STOPPED: True, BESIDE: True}),
    ([1e-6, 1e-14, 2e-14], [1e-6, 1e-14], 1e-14 / 65, {STOPPED: False, BESIDE: True}),
    # MuJoCo comes as near as tmt
    ([2e-9 + 63e-14], [1e-9], 1e-14, {BESIDE: True}), ([2e-9 + 65e-14], [1e-9], 1e-14, {BESIDE: False}),
    ([None], [1e-9], 1e-14, {BESIDE: False}), ([63e-14], [None], 1e-14, {BESIDE: True}),
    ([65e-14], [None], 1e-14, {BESIDE: False}),
    # where tmt has a step as coarse, and one of them ends
    ([1e-3, 1e-5], [], 1e-16, {}), ([None, None], [None, None, 1e-9], 1e-16, {}),
    # where MuJoCo's steps end before its errors stop, tmt's are no finer
    ([1e-6, 1.99e-7], [1e-6, 1e-7, 1e-8], 1e-20, {BESIDE: True}),
    ([1e-6, 2.01e-7], [1e-6, 1e-7, 1e-8], 1e-20, {BESIDE: False}),
    ([1e-6, 1.99e-7, 1e-6], [1e-6, 1e-7, 1e-8], 1e-20, {STOPPED: False, BESIDE: False}),
])  # fmt: skip
def test_smallest_errors(theirs, ours, left, found):
    rows = runs("mujoco", "RK4", theirs) + runs("tmt", "rk4", ours)
    assert judged(accuracy.check_smallest_errors, rows, {"bent, free": left}) == found


@pytest.mark.parametrize("found, work, best, last, ends", [
    (0.71e-14, 121, 1e-14, 100, True), (0.69e-14, 121, 1e-14, 100, False), (0.71e-14, 119, 1e-14, 100, False),
    (29e-15, 200, 29e-15, 100, True), (31e-15, 200, 31e-15, 100, False), (np.nan, 200, 1e-15, 100, True),
])  # fmt: skip
def test_a_series_ends_where_a_run_gains_nothing(found, work, best, last, ends):
    assert accuracy.gained_nothing(found, work, best, last, 1e-15) is ends


def test_the_true_error_is_that_of_rk4_with_the_coarsest_steps():
    rows = [
        row("tmt", "rk4", 1.5),
        row("mujoco", "RK4", None),
        row("tmt", "rk4", 1e-3, 128),
        row("tmt", "dopri8", 1e-6),
    ]
    assert accuracy.true_error(rows, {"bent, free": 64}) == {"bent, free": (1.5, None)}


# orders


@pytest.mark.parametrize(
    "order, measured, passes",
    [(4, 4.149, True), (4, 4.151, False), (4, 3.851, True), (4, 3.849, False), (8, 7.01, True), (8, 6.99, False),
     (8, 12.0, True), (4, np.nan, False)],
)  # fmt: skip
def test_the_order_is_measured_within_its_margin(order, measured, passes):
    result = Result("speed")
    advice.check_order(result, "bent, free, tmt rk4", order, measured)
    assert [check.passed for check in result.checks] == [passes]


@pytest.mark.parametrize("errors, complete, measured, passed", [
    ([0.29, 2.9e-2, 2.9e-2 / 16], True, [4.0], [True, True]),
    ([3.1e-2, 2.9e-2 / 16], True, [], [False]),  # one error only is below 3e-2 rad
    ([3.1e-2, 2.9e-2 / 16], False, [], []),
    ([0.29, 16 * 2.1e-12, 2.1e-12], True, [4.0], [True, True]),
    ([0.29, 16 * 1.9e-12, 1.9e-12], True, [], [False]),
    ([2.9e-2, 2.8e-2, 2.8e-2 / 16], True, [4.0], [True, True]),  # the finest two count
    # with half of the coarsest steps the error would be below 2e-12 rad, where rounding shows
    ([16 * 1.99e-12, 1e-13], True, [], []),
    ([16 * 2.01e-12, 1e-13], True, [], [False]),
    ([], True, [], [False]),  # it did not run
])  # fmt: skip
def test_an_order_is_measured_where_errors_fall_regularly(errors, complete, measured, passed):
    result = Result("speed", rows=runs("tmt", "rk4", errors))
    table = advice.orders(result, ["bent, free"], [RK4], complete)
    assert [line["measured_order"] for line in table] == pytest.approx(measured)
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("orders, floor, asked", [
    ([4.298, 4.149], 1e-16, True), ([4.302, 4.151], 1e-16, False),  # where it has settled
    ([4.0, 4.0], 1.29e-8, True), ([4.0, 4.0], 1.31e-8, False),  # 30 times as far as rounding
    ([4.0], 1e-16, False),  # seen once
])  # fmt: skip
def test_an_order_of_a_file_is_asked_where_it_has_settled(orders, floor, asked):
    rows = runs("tmt", "rk4", 1e-4 / 2.0 ** np.cumsum([0.0, *orders]))
    result = Result("speed", rows=rows, curves={"floors": {"bent, free": floor}, "of_file": True})
    table = advice.orders(result, ["bent, free"], [RK4], complete=False)
    assert bool(table) is bool(result.checks) is asked


# advice


def test_the_advice_names_the_cheapest_of_each_engine_with_its_time():
    table = {line["target_rad"]: line for line in advice.advice(known_rows(), ["bent, free"], {"bent, free": 1e-16})}
    line = table[1e-3]
    assert (line["mujoco"], line["tmt"], line["of_all"]) == (
        "mujoco RK4, 256 steps", "tmt dopri8, 64 steps", "scipy DOP853, 500 steps")  # fmt: skip
    times = [line[f"{engine}_ms"] for engine in ("mujoco", "tmt", "of_all")]
    assert times == pytest.approx([80.0, 2.0, 0.1]) and line["mujoco_evaluations"] == 1024
    assert (line["ratio"], line["kernel_part"], line["method_part"]) == pytest.approx((40.0, 20.0, 2.0))
    assert line["integrator_part"] == pytest.approx(1.0) and line["why_not"] is None
    assert table[1e-12]["mujoco"] is None and "3.1e-07" in table[1e-12]["why_not"]


def test_what_to_use_for_a_step_response_is_of_the_error_asked_for():
    line = {"target_rad": 1e-3, "mujoco": "mujoco implicitfast, 128 steps", "mujoco_dt_s": 1 / 512, "mujoco_ms": 0.4,
            "tmt": None, "scene": "let go"}  # fmt: skip
    table = [line, line | {"target_rad": 1e-6, "mujoco": "mujoco RK4, 9 steps"}, line | {"scene": "step"}]
    (said,) = advice.step_response_in_words(table, ["step"])
    assert said.index("step: mujoco") < said.index("let go: mujoco") and "9 steps" not in said
    assert advice.step_response_in_words(table, []) == []
