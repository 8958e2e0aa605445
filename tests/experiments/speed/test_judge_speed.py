"""What is concluded from errors, orders and times, every rule with a row just inside and one just outside; what is timed."""

from types import SimpleNamespace

import numpy as np
import pytest

from compare.core.rows import Row
from compare.core.text import say
from compare.engines import Method, Setting
from compare.experiments.speed import conclusions, evaluations, runs
from compare.experiments.speed.runs import Run, SceneRuns, SpeedResult, SpeedRow

SCHEMES = {"RK4": "rk4", "implicit": "implicit", "Euler": "semi_implicit_euler"}
COMPARED = "smallest error of MuJoCo's RK4, compared with tmt's rk4"
STOPPED = "smallest error of mujoco's RK4, where smaller steps gain nothing"


def run_of(engine, method, error, steps=64, seconds=1e-3) -> Run:
    """A run: diverged where the error is None."""
    numbers = dict.fromkeys(("error", "worst_error", "energy_error"), error) | {"seconds": seconds}
    row = SpeedRow("bent, free", engine, method, 5.0 / steps, None, steps, steps, 4 * steps, **numbers)
    row.diverged = error is None
    return Run(Method(engine, method, 4, SCHEMES.get(method, method)), Setting(5.0, steps), error, row)


def series(engine, method, errors) -> list[Run]:
    """A run for each error, from coarse to fine."""
    return [run_of(engine, method, error, 64 << k) for k, error in enumerate(errors)]


def scene_of(found, floor, is_read=False) -> SceneRuns:
    case = SimpleNamespace(name="bent, free", robot=SimpleNamespace(is_read=is_read))
    return SceneRuns(case, None, floor, found)


def judged(check, found, floor) -> dict[str, bool]:
    result = SpeedResult("speed")
    check(result, scene_of(found, floor))
    return {check.quantity: check.passed for check in result.checks}


def advised(found) -> list[Row]:
    rows = [run.row for run in found]
    return conclusions.advice(SpeedResult("speed", rows=rows, floors={"bent, free": 1e-16}))


@pytest.mark.parametrize("ours, theirs, verdict", [
    (1e-3, 1e-3 + 63e-10, True), (1e-3, 1e-3 + 65e-10, False), (1e-3, 1e-3 - 65e-10, False), (None, 1e-3, False),
    (0.0999, 0.2, False), (0.1001, 0.2, None), (None, None, None),
])  # fmt: skip
def test_the_same_scheme_makes_the_same_error(ours, theirs, verdict):
    found = [run_of("tmt", "rk4", ours), run_of("mujoco", "RK4", theirs), run_of("tmt", "rk4", 1.0, 128)]
    expected = {} if verdict is None else {"the same error as tmt's rk4": verdict}
    assert judged(conclusions.check_same_schemes, found, 1e-10) == expected


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
    measured = series("mujoco", "RK4", theirs) + series("tmt", "rk4", ours)
    assert judged(conclusions.check_smallest_errors, measured, left) == found


def falling(*orders) -> list[float]:
    return [*(1e-4 / 2.0 ** np.cumsum([0.0, *orders]))]


@pytest.mark.parametrize("errors, measured, floor, is_read", [
    ([0.29, 2.9e-2, 2.9e-2 / 16], [4.0], 1e-16, False),
    ([3.1e-2, 2.9e-2 / 16], [], 1e-16, False),  # one error only is below 3e-2 rad
    ([0.29, 16 * 2.1e-12, 2.1e-12], [4.0], 1e-16, False), ([0.29, 16 * 1.9e-12, 1.9e-12], [], 1e-16, False),
    ([2.9e-2, 2.8e-2, 2.8e-2 / 16], [4.0], 1e-16, False),  # the finest two count
    # of a file
    (falling(4.298, 4.149), [4.149], 1e-16, True), (falling(4.302, 4.151), [], 1e-16, True),  # where it has settled
    (falling(4.0, 4.0), [4.0], 1.29e-8, True), (falling(4.0, 4.0), [], 1.31e-8, True),  # 30 times as far as rounding
    (falling(4.0), [], 1e-16, True),  # seen once
])  # fmt: skip
def test_an_order_is_measured_where_errors_fall_regularly(errors, measured, floor, is_read):
    result, scene = SpeedResult("speed"), scene_of(series("tmt", "rk4", errors), floor, is_read)
    assert conclusions.check_orders(result, [scene], ["mujoco"]) == []
    table = conclusions.check_orders(result, [scene], ["tmt"])
    assert [row.measured_order for row in table] == pytest.approx(measured)
    assert [check.passed for check in result.checks] == [True] * len(measured)


@pytest.mark.parametrize("of_mujoco, of_tmt, failed, higher", [
    (5.0, 5.0, [], ["RK4", "rk4"]), (4.0, 4.0, [], []),
    (5.0, 4.0, ["bent, free, mujoco RK4"], []), (4.0, 5.0, ["bent, free, mujoco RK4"], ["rk4"]),
    (3.0, 3.0, ["bent, free, mujoco RK4", "bent, free, tmt rk4"], []),
])  # fmt: skip
def test_a_higher_order_is_said_and_fails_only_where_tmts_same_scheme_has_another(
    of_mujoco, of_tmt, failed, higher
):
    """As semi-implicit Euler from a state without forces."""
    found = series("mujoco", "RK4", falling(of_mujoco)) + series("tmt", "rk4", falling(of_tmt))
    result = SpeedResult("speed")
    conclusions.check_orders(result, [scene_of(found, 1e-16)], ["mujoco", "tmt"])
    assert [check.scene for check in result.checks if not check.passed] == failed
    said = " ".join(say(note) for note in result.notes)
    assert [row.method for note in result.notes for row in note.values["rows"]] == higher
    assert ("with order 5.00 (stated: 4)" in said) == bool(higher)


def test_the_advice_names_the_cheapest_of_each_engine_with_its_time():
    """MuJoCo's RK4 20 times slower than tmt's; of its integrators Euler is never as near; dopri8 needs fewest steps."""
    found = [run_of("scipy", "DOP853", 1e-9, 500, 1e-4), run_of("mujoco", "implicit", None, 64, 1e-9)]
    for k in range(5):
        steps, error = 64 << k, 2e-2 / 16**k
        found.append(run_of("mujoco", "RK4", error, steps, 20e-3 * 2**k))
        found.append(run_of("tmt", "rk4", error, steps, 1e-3 * 2**k))
        found.append(run_of("mujoco", "Euler", 0.5 / 2**k, steps, 4e-3 * 2**k))
        found.append(run_of("tmt", "dopri8", error**2, steps, 2e-3 * 2**k))
    table = {row.target: row for row in advised(found)}
    row = table[1e-3]
    settings = "mujoco RK4, 256 steps", "tmt dopri8, 64 steps", "scipy DOP853, 500 steps"
    assert (row.mujoco, row.tmt, row.of_all) == settings
    assert (row.mujoco_ms, row.tmt_ms, row.of_all_ms) == pytest.approx((80.0, 2.0, 0.1))
    assert row.mujoco_evaluations == 1024
    parts = row.ratio, row.integrator_part, row.kernel_part, row.method_part
    assert parts == pytest.approx((40.0, 1.0, 20.0, 2.0))
    assert table[1e-12].mujoco == "none" and table[1e-12].mujoco_ms is None


def test_the_gain_is_that_of_the_integrator_times_that_of_the_kernel_times_that_of_the_method():
    timed = ("mujoco", "RK4", 8e-3), ("mujoco", "Euler", 2e-3), ("tmt", "rk4", 4e-3), ("tmt", "dopri8", 1e-3)
    row = advised([run_of(engine, method, 1e-4, 64, seconds) for engine, method, seconds in timed])[0]
    parts = row.integrator_part, row.kernel_part, row.method_part
    assert parts == pytest.approx((0.25, 2.0, 4.0)) and row.ratio == pytest.approx(np.prod(parts))
    adaptive = conclusions.setting("tmt", SpeedRow("s", "tmt", "dopri8_adaptive", None, 1e-9, 17))
    assert "1e-09" in adaptive["tmt"] and "17" not in adaptive["tmt"]


def test_operations_per_nanosecond_are_those_of_a_state_over_its_time(monkeypatch):
    row = evaluations.EvaluationRow(evaluations.FORWARD, evaluations.ONE_BY_ONE, 10_000, operations=133)
    monkeypatch.setattr(evaluations.timing, "in_turns", lambda calls, rounds: [[2e-3, 1e-3]])
    (found,) = evaluations.costs([evaluations.Loop(row, lambda count: None)], 2)
    assert found.ns_per_state == pytest.approx(25.0)  # four calls of 10,000 states in a millisecond
    assert found.operations_per_ns == pytest.approx(133 / 25.0)


def test_a_row_gets_the_least_of_its_times(monkeypatch):
    found = [run_of("tmt", "rk4", 1.0), run_of("mujoco", "RK4", 1.0)]
    monkeypatch.setattr(runs.timing, "in_turns", lambda calls, rounds: [[3e-3, 2e-3, 5e-3], [0.2]])
    runs.take_times(found, [(None, 1.0), (None, 2.0)])
    assert [run.row.seconds for run in found] == [2e-3, 0.4]
