"""What is concluded from errors, orders and times: every rule with a row just inside and one just outside."""

from functools import partial

import numpy as np
import pytest
from judged import BOTH
from speed_rows import RK4, SCHEMES, known_rows, row

from compare.engines import Method
from compare.experiments.speed import accuracy, advice
from compare.judge.check import Result

BENT = {"bent, free": 64}
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


same_schemes = partial(judged, accuracy.check_same_schemes)
smallest_errors = partial(judged, accuracy.check_smallest_errors)


@pytest.mark.parametrize("ours, theirs, verdict", [
    (1e-3, 1e-3 + 63e-10, True), (1e-3, 1e-3 + 65e-10, False), (1e-3, 1e-3 - 65e-10, False), (1e-3, None, False),
    (None, 1e-3, False), (0.0999, 0.2, False), (0.2, 0.0999, False), (0.1001, 0.2, None), (None, None, None),
])  # fmt: skip
def test_the_same_scheme_makes_the_same_error(ours, theirs, verdict):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs), row("tmt", "rk4", 1.0, 128)]
    found = same_schemes(rows, {"bent, free": 1e-10}, {"bent, free": SCHEMES})
    assert found == ({} if verdict is None else {"the same error as tmt's rk4": verdict})


@pytest.mark.parametrize("left, passes", [(1e-14 / 63, True), (1e-14 / 65, False)])
def test_errors_that_have_stopped_are_of_the_size_of_rounding(left, passes):
    rows = runs("mujoco", "RK4", [1e-6, 1e-14, 2e-14]) + runs("tmt", "rk4", [1e-6, 1e-14])
    assert smallest_errors(rows, {"bent, free": left}) == {STOPPED: passes, BESIDE: True}


@pytest.mark.parametrize(
    "ours, theirs, passes",
    [(1e-9, 2e-9 + 63e-14, True), (1e-9, 2e-9 + 65e-14, False), (1e-9, None, False), (None, 63e-14, True), (None, 65e-14, False)],
)  # fmt: skip
def test_mujoco_comes_as_near_as_tmt(ours, theirs, passes):
    rows = [row("tmt", "rk4", ours), row("mujoco", "RK4", theirs)]
    assert smallest_errors(rows, {"bent, free": 1e-14}) == {BESIDE: passes}


@pytest.mark.parametrize("theirs, ours, found", [
    ([1e-3, 1e-5], [], {}),
    ([1e-3, 1e-5], [None, None], {BESIDE: False}),
    ([None, None], [None, None, 1e-9], {}),  # tmt's steps that are finer than MuJoCo's do not count
    ([None, None], [1e-9, 1e-10, 1e-11], {BESIDE: False}),
])  # fmt: skip
def test_mujoco_is_compared_where_tmt_has_a_step_as_coarse_and_one_ends(theirs, ours, found):
    rows = runs("mujoco", "RK4", theirs) + runs("tmt", "rk4", ours)
    assert smallest_errors(rows, {"bent, free": 1e-16}) == found


@BOTH
def test_where_mujocos_steps_end_before_its_errors_stop_tmts_are_no_finer(share, passes):
    ours, theirs = runs("tmt", "rk4", [1e-6, 1e-7, 1e-8]), [1e-6, share * 2e-7]
    assert smallest_errors(runs("mujoco", "RK4", theirs) + ours, {"bent, free": 1e-20})[BESIDE] is passes
    # where finer steps have gained nothing, more of them would not have either
    assert not smallest_errors(runs("mujoco", "RK4", [*theirs, 1e-6]) + ours, {"bent, free": 1e-20})[BESIDE]


@pytest.mark.parametrize("found, work, best, last, ends", [
    (0.71e-14, 121, 1e-14, 100, True), (0.69e-14, 121, 1e-14, 100, False), (0.71e-14, 119, 1e-14, 100, False),
    (29e-15, 200, 29e-15, 100, True), (31e-15, 200, 31e-15, 100, False), (np.nan, 200, 1e-15, 100, True),
])  # fmt: skip
def test_a_series_ends_where_a_run_gains_nothing(found, work, best, last, ends):
    assert accuracy.gained_nothing(found, work, best, last, 1e-15) is ends


def test_the_true_error_is_that_of_rk4_with_the_coarsest_steps():
    rows = [row("tmt", "rk4", 1.5), row("mujoco", "RK4", 1.6), row("tmt", "rk4", 1e-3, 128), row("tmt", "dopri8", 1e-6)]
    rows += [row("tmt", "rk4", 0.02, scene="bent, damped"), row("mujoco", "RK4", None, scene="bent, damped")]
    steps = BENT | {"bent, damped": 64}
    assert accuracy.true_error(rows, steps) == {"bent, free": (1.5, 1.6), "bent, damped": (0.02, None)}
    assert accuracy.true_error(rows, {"bent, free": 128}) == {"bent, free": (1e-3, None)}
    assert accuracy.true_error([], BENT) == {}


def test_a_reference_of_few_digits_is_named(known_reference):
    for apart, count in ((0.99e-14, 1), (1e-14, 2)):
        known = {"bent, free": known_reference._replace(apart=apart)}
        assert len(accuracy.references_in_words(known, {"bent, free": max(1e-14, apart)})) == count
    (in_doubles,) = accuracy.references_in_words(
        {"s": known_reference._replace(apart=3e-13, steps=1024, why="long")}, {"s": 1e-12}
    )
    assert "3e-13 (1024" in in_doubles


# orders


@pytest.mark.parametrize(
    "order, measured, passes",
    [(4, 4.149, True), (4, 4.151, False), (4, 3.851, True), (4, 3.849, False), (1, 1.151, False), (8, 7.01, True),
     (8, 6.99, False), (8, 12.0, True), (4, np.nan, False)],
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
    ([2.9e-2, 2.9e-2 / 16, 2.8e-2 / 16], True, [pytest.approx(0.05, abs=0.01)], [False, True]),
    # with half of the coarsest steps the error would be below 2e-12 rad, where rounding shows
    ([16 * 1.99e-12, 1e-13], True, [], []),
    ([16 * 2.01e-12, 1e-13], True, [], [False]),
    ([np.nan, 16 * 1.99e-12, 1e-13], True, [], [False]),  # the coarsest has diverged
    ([], True, [], [False]),  # it did not run
])  # fmt: skip
def test_an_order_is_measured_where_errors_fall_regularly(errors, complete, measured, passed):
    result = Result("speed", rows=runs("tmt", "rk4", errors))
    table = advice.orders(result, ["bent, free"], [RK4], complete)
    assert [line["measured_order"] for line in table] == pytest.approx(measured) if measured != [] else not table
    assert [check.passed for check in result.checks] == passed


def orders_of_file(errors, floor):
    """The orders that are measured with the robot of a file, whose rounding is known, and the result."""
    result = Result("speed", rows=runs("tmt", "rk4", errors), curves={"floors": {"bent, free": floor}, "of_file": True})
    return advice.orders(result, ["bent, free"], [Method("tmt", "rk4", 4, "rk4")], complete=False), result


def test_no_order_of_a_file_is_measured_near_what_is_known():
    errors = [2.56e-8, 1.6e-9, 1e-10]
    assert orders_of_file(errors, 1e-12)[0] and not orders_of_file(errors, 1e-9)[0]


@pytest.mark.parametrize("change, asked", [(0.149, True), (0.151, False), (None, False)])
def test_an_order_of_a_file_is_asked_where_it_has_settled(change, asked):
    orders = [4.0 + 2.0 * (change or 0.0), 4.0 + (change or 0.0)][change is None :]
    _, result = orders_of_file(1e-4 / 2.0 ** np.cumsum([0.0, *orders]), 1e-16)
    assert bool(result.checks) is asked and any("free, tmt rk4" in note for note in result.notes) is not asked


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
            "tmt": "tmt dopri8_adaptive, tolerance 1e-03", "tmt_dt_s": None, "tmt_ms": 0.05, "scene": "let go"}  # fmt: skip
    other = line | {"target_rad": 1e-6, "mujoco": "mujoco RK4, 9 steps"}
    table = [line, other, line | {"scene": "step"}, dict.fromkeys(line) | {"target_rad": 1e-3, "scene": "far"}]
    (said,) = advice.step_response_in_words(table, ["step"])
    assert said.index("step: mujoco") < said.index("let go: mujoco") < said.index("far: ")
    assert said.count("mujoco implicitfast, 128 steps (dt = 0.00195 s), 0.4 ms") == 2 and "9 steps" not in said
    assert advice.step_response_in_words(table, []) == advice.step_response_in_words(table[:2], ["step"]) == []
