"""What is concluded from errors, orders and times, every rule with a row just inside and one just outside; what is timed."""

import time
from dataclasses import replace

import numpy as np
import pytest

from compare.core.check import Result
from compare.engines import Method, Setting
from compare.experiments import speed
from compare.experiments.speed import accuracy, advice, evaluations, runs

RK4 = Method("tmt", "rk4", 4, "rk4")
COMPARED = "smallest error of MuJoCo's RK4, compared with tmt's rk4"
STOPPED = "smallest error of mujoco's RK4, where smaller steps gain nothing"


def row(engine, method, error, steps=64, seconds=1e-3, **more):
    """A row of speed: diverged where the error is None."""
    return {
        "scene": "bent, free", "engine": engine, "method": method, "dt_s": 5.0 / steps, "tolerance": None, "steps": steps,
        "evaluations": 4 * steps, "seconds": seconds, "error_rad": error, "worst_error_rad": error, "energy_error_J": error,
        "diverged": error is None, "why_not": None, "early": error,
    } | more  # fmt: skip


def known_rows():
    """MuJoCo's RK4 20 times slower than tmt's; of its integrators Euler is never as near; dopri8 needs fewest steps."""
    rows = [row("scipy", "DOP853", 1e-9, 500, 1e-4), row("mujoco", "implicit", None, 64, 1e-9)]
    for k in range(5):
        steps, error = 64 << k, 2e-2 / 16**k
        rows += [
            row("mujoco", "RK4", error, steps, 20e-3 * 2**k),
            row("tmt", "rk4", error, steps, 1e-3 * 2**k),
        ]
        rows += [row("mujoco", "Euler", 0.5 / 2**k, steps, 4e-3 * 2**k)]
        rows += [row("tmt", "dopri8", error**2, steps, 2e-3 * 2**k)]
    return rows


def judged(check, rows, *arguments):
    """(quantity, passed) of each check that is made of rows."""
    result = Result("speed", rows=rows)
    check(result, *arguments)
    return {check.quantity: check.passed for check in result.checks}


def rows_of(engine, method, errors):
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
    ([1e-6, 1e-14, 2e-14], [1e-6, 1e-14], 1e-14 / 63, {STOPPED: True, COMPARED: True}),
    ([1e-6, 1e-14, 2e-14], [1e-6, 1e-14], 1e-14 / 65, {STOPPED: False, COMPARED: True}),
    # MuJoCo comes as near as tmt
    ([2e-9 + 63e-14], [1e-9], 1e-14, {COMPARED: True}), ([2e-9 + 65e-14], [1e-9], 1e-14, {COMPARED: False}),
    ([None], [1e-9], 1e-14, {COMPARED: False}), ([63e-14], [None], 1e-14, {COMPARED: True}),
    ([65e-14], [None], 1e-14, {COMPARED: False}),
    # where tmt has a step as coarse, and one of them ends
    ([1e-3, 1e-5], [], 1e-16, {}), ([None, None], [None, None, 1e-9], 1e-16, {}),
    # where MuJoCo's steps end before its errors stop, tmt's are no finer
    ([1e-6, 1.99e-7], [1e-6, 1e-7, 1e-8], 1e-20, {COMPARED: True}),
    ([1e-6, 2.01e-7], [1e-6, 1e-7, 1e-8], 1e-20, {COMPARED: False}),
    ([1e-6, 1.99e-7, 1e-6], [1e-6, 1e-7, 1e-8], 1e-20, {STOPPED: False, COMPARED: False}),
])  # fmt: skip
def test_smallest_errors(theirs, ours, left, found):
    rows = rows_of("mujoco", "RK4", theirs) + rows_of("tmt", "rk4", ours)
    assert judged(accuracy.check_smallest_errors, rows, {"bent, free": left}) == found


@pytest.mark.parametrize("found, work, best, last, ends", [
    (0.71e-14, 121, 1e-14, 100, True), (0.69e-14, 121, 1e-14, 100, False), (0.71e-14, 119, 1e-14, 100, False),
    (29e-15, 200, 29e-15, 100, True), (31e-15, 200, 31e-15, 100, False), (np.nan, 200, 1e-15, 100, True),
])  # fmt: skip
def test_a_series_ends_where_a_run_gains_nothing(found, work, best, last, ends):
    assert accuracy.gained_nothing(found, work, best, last, 1e-15) is ends


@pytest.mark.parametrize(
    "order, measured, passes",
    [(4, 4.149, True), (4, 4.151, False), (4, 3.851, True), (4, 3.849, False), (8, 7.01, True), (8, 6.99, False),
     (8, 12.0, True), (4, np.nan, False)],
)  # fmt: skip
def test_the_order_is_measured_within_its_margin(order, measured, passes):
    result = Result("speed")
    accuracy.check_order(result, "bent, free, tmt rk4", order, measured)
    assert [check.passed for check in result.checks] == [passes]


@pytest.mark.parametrize("errors, measured, passed", [
    ([0.29, 2.9e-2, 2.9e-2 / 16], [4.0], [True]),
    ([3.1e-2, 2.9e-2 / 16], [], []),  # one error only is below 3e-2 rad
    ([0.29, 16 * 2.1e-12, 2.1e-12], [4.0], [True]), ([0.29, 16 * 1.9e-12, 1.9e-12], [], []),
    ([2.9e-2, 2.8e-2, 2.8e-2 / 16], [4.0], [True]),  # the finest two count
])  # fmt: skip
def test_an_order_is_measured_where_errors_fall_regularly(errors, measured, passed):
    result = Result("speed", rows=rows_of("tmt", "rk4", errors), curves={"floors": {"bent, free": 1e-16}})
    table = accuracy.check_orders(result, ["bent, free"], [RK4])
    assert [line["measured_order"] for line in table] == pytest.approx(measured)
    assert [check.passed for check in result.checks] == passed


@pytest.mark.parametrize("measured, floor, checked", [
    ([4.298, 4.149], 1e-16, True), ([4.302, 4.151], 1e-16, False),  # where it has settled
    ([4.0, 4.0], 1.29e-8, True), ([4.0, 4.0], 1.31e-8, False),  # 30 times as far as rounding
    ([4.0], 1e-16, False),  # seen once
])  # fmt: skip
def test_an_order_of_a_file_is_checked_where_it_has_settled(measured, floor, checked):
    rows = rows_of("tmt", "rk4", 1e-4 / 2.0 ** np.cumsum([0.0, *measured]))
    result = Result("speed", rows=rows, curves={"floors": {"bent, free": floor}, "of_file": True})
    table = accuracy.check_orders(result, ["bent, free"], [RK4])
    assert bool(table) is bool(result.checks) is checked


def test_the_advice_names_the_cheapest_of_each_engine_with_its_time():
    table = {line["target_rad"]: line for line in advice.advice(known_rows(), ["bent, free"])}
    line = table[1e-3]
    assert (line["mujoco"], line["tmt"], line["of_all"]) == (
        "mujoco RK4, 256 steps", "tmt dopri8, 64 steps", "scipy DOP853, 500 steps")  # fmt: skip
    times = [line[f"{engine}_ms"] for engine in ("mujoco", "tmt", "of_all")]
    assert times == pytest.approx([80.0, 2.0, 0.1]) and line["mujoco_evaluations"] == 1024
    assert (line["ratio"], line["kernel_part"], line["method_part"]) == pytest.approx((40.0, 20.0, 2.0))
    assert line["integrator_part"] == pytest.approx(1.0)
    assert table[1e-12]["mujoco"] == "none" and table[1e-12]["mujoco_ms"] is None


def test_the_gain_is_that_of_the_integrator_times_that_of_the_kernel_times_that_of_the_method():
    settings = (
        ("mujoco", "RK4", 8e-3),
        ("mujoco", "Euler", 2e-3),
        ("tmt", "rk4", 4e-3),
        ("tmt", "dopri8", 1e-3),
    )
    line = advice.advice([row(*of, 1e-4, 64, seconds) for *of, seconds in settings], ["bent, free"])[0]
    parts = [line[f"{part}_part"] for part in ("integrator", "kernel", "method")]
    assert parts == pytest.approx([0.25, 2.0, 4.0]) and line["ratio"] == pytest.approx(np.prod(parts))
    adaptive = {"engine": "tmt", "method": "dopri8_adaptive", "dt_s": None, "steps": 17, "tolerance": 1e-9}
    assert "1e-09" in advice.setting(adaptive) and "17" not in advice.setting(adaptive)


def test_operations_per_nanosecond_are_those_of_a_state_over_its_time(setup, monkeypatch):
    key = evaluations.FORWARD, evaluations.EACH, 10_000, 1
    made = evaluations.Evaluations({key: lambda count: None}, {})
    monkeypatch.setattr(evaluations.timing, "in_turns", lambda calls, rounds: [[2e-3, 1e-3]])
    (found,) = evaluations.costs(setup, made)
    assert found["ns_per_state"] == pytest.approx(25.0)  # four calls of 10,000 states in a millisecond
    assert found["operations_per_ns"] == pytest.approx(found["operations"] / 25.0)


def test_a_row_gets_the_least_of_its_times(setup, monkeypatch):
    rows = [row("tmt", "rk4", 1.0), row("mujoco", "RK4", 1.0)]
    monkeypatch.setattr(runs.timing, "in_turns", lambda calls, rounds: [[3e-3, 2e-3, 5e-3], [0.2]])
    runs.take_times(rows, [(None, 1.0), (None, 2.0)], setup)
    assert [r["seconds"] for r in rows] == [2e-3, 0.4]


def test_what_is_timed_in_part_counts_as_the_whole(setup, monkeypatch):
    now, case, theirs = [0.0], setup.robot.cases[0], Method("mujoco", "RK4", 4, "rk4")
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    rows = [{"run": (case, method, Setting(5.0, 16384)), "steps": 16384} for method in (theirs, RK4)]

    def call():
        now[0] += 0.5

    ready = [(call, longer) for _, longer in runs.prepared(rows, setup)]
    runs.take_times(rows, ready, setup)
    assert [r["seconds"] for r in rows] == pytest.approx([16.0, 0.5])
    assert [r["timed_steps"] for r in rows] == [512, 16384]


def test_what_is_called_is_followed_once_after_all_else_has_ended(setup, monkeypatch):
    log, setup, case = [], replace(setup, quiet=lambda: log.append("quiet")), setup.robot.cases[0]
    known, called = [row("tmt", "rk4", 1.0)], [row("scipy", "RK45", 1.0, 64, s) for s in (0.014, 0.016)]
    monkeypatch.setattr(speed, "rows_of_scene", lambda *given: log.append(given[-1]) or called)
    monkeypatch.setattr(speed, "prepared", lambda rows, setup: rows)
    taken = lambda rows, runs, setup: log.append(rows == runs == [known[0], called[0]])  # noqa: E731
    monkeypatch.setattr(speed, "take_times", taken)
    monkeypatch.setattr(speed.evaluations, "compiled_evaluations", lambda setup: log.append("made"))
    of = {case.name: known}
    speed.add_times(setup, [case], {case.name: None}, {case.name: 0.0}, of)
    assert log == ["made", "quiet", "called", True] and of[case.name][1:] == called
