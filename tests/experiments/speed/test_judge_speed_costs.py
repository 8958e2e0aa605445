"""What an evaluation costs, and times of rows."""

import time
from dataclasses import replace

import pytest
from speed_rows import NS, row

from compare.engines import Method, Setting
from compare.experiments import speed
from compare.experiments.speed import evaluations, times
from compare.experiments.speed.evaluations import (
    CALLED,
    EACH,
    FORWARD,
    MJ_STEP,
    RK4_STEP,
    WHOLE,
    WHOLE_CALLED,
    called_in_words,
)  # fmt: skip
from compare.judge.check import Result

OF_RK4 = ("mujoco", "RK4", 4), ("tmt", "rk4", 4)


def test_a_row_gets_the_least_of_its_times():
    rows = [row("tmt", "rk4", 1.0), row("mujoco", "RK4", 1.0)]
    assert times.fill_in(rows, [[3e-3, 2e-3, 5e-3], [0.4]]) == [pytest.approx(1.5)]
    assert [r["seconds"] for r in rows] == [2e-3, 0.4]
    (said,), (of_one,) = times.spread_in_words([1.5]), times.spread_in_words([])
    assert "50.0% above the least" in said and "more than 4096 steps is timed over the first 4096" in said
    assert of_one.startswith("Each time is that of one run.") and "4096" in of_one


@pytest.mark.parametrize(
    "engine, steps, timed",
    [("mujoco", 4096, 4096), ("mujoco", 131072, 4096), ("mujoco", 64, 64), ("tmt", 131072, 131072)],
)
def test_a_long_run_of_mujoco_is_timed_over_its_first_steps(engine, steps, timed):
    part = times.timed_part(Method(engine, "RK4", "rk4", 4), Setting(5.0, steps))
    assert part.steps == timed and part.duration / part.steps == 5.0 / steps and part.every


def test_what_is_timed_in_part_counts_as_the_whole(setup, monkeypatch):
    now, case = [0.0], setup.robot.cases[0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    rows = [{"run": (case, Method(*which, "rk4"), Setting(5.0, 16384))} for which in OF_RK4]

    def call():
        now[0] += 0.5

    ready = [(call, longer) for _, longer in times.prepared(rows, setup)]
    assert times.take_times(ready, setup) == [[pytest.approx(2.0)], [pytest.approx(0.5)]]


def test_nanoseconds_of_a_state():
    found = evaluations.per_state({(FORWARD, WHOLE, 1, 1): 100, (RK4_STEP, MJ_STEP, 1, 1): 10}, [[3e-4, 2e-4], [1e-4]])
    assert found == {(FORWARD, WHOLE, 1, 1): pytest.approx(2000.0), (RK4_STEP, MJ_STEP, 1, 1): pytest.approx(10_000.0)}
    assert [(r["quantity"], r["implementation"], r["ns_per_state"]) for r in evaluations.evaluation_rows({
        (FORWARD, EACH, 1000, 1): 30.0, (FORWARD, WHOLE, 1, 1): 1400.0})] == [
        (FORWARD, WHOLE, 1400.0), (FORWARD, EACH, 30.0)]  # fmt: skip


@pytest.mark.parametrize("lasts, many", [(1e-6, 1000), (1e-9, evaluations.MOST_CALLS), (1.0, 1)])
def test_the_same_is_done_a_millisecond_long_but_not_for_ever(lasts, many, monkeypatch):
    now, calls = [0.0], []
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])

    def loop(count):
        calls.append(count)
        now[0] += lasts * count

    run, count = evaluations.counted(loop)
    assert count == pytest.approx(many, abs=1)
    run()
    assert calls[-1] == count


def test_what_an_evaluation_costs_in_words():
    words = " ".join(evaluations.costs_in_words(NS, (50e-6, 10e-6, 64), (488, 133), "arm"))
    for part in ("Forward dynamics of the arm: mj_forward takes 1000 ns", "same work 500 ns", "tmt's compiled code 50.0 ns",
                 "(20 times less; than the same work 10",
                 "25.0 ns where they are independent (40 times less; 20 times less)",
                 "side by side 10.0 (of 1,000 states) ns a state (100 times less)",
                 "mj_step 4000 ns, tmt 200 ns (20 times less)", "64 steps takes 50 us, its loop alone 10 us",
                 "literal method has 488 operations, the form that is compiled 133"):  # fmt: skip
        assert part in words, part
    slower = NS | {(RK4_STEP, MJ_STEP, 1, 1): 100.0}
    assert "(2.0 times more)" in " ".join(evaluations.costs_in_words(slower, (1, 1, 64), (1, 1), "arm"))
    without = {key: value for key, value in NS.items() if not key[1].startswith("MuJoCo")}
    told = evaluations.costs_in_words(without, (1, 1, 64), (1, 1), "arm", "MuJoCo's library was not found")
    assert "MuJoCo's library was not found: its calls were not timed in compiled loops." in told


def test_what_calls_from_python_take_is_said_as_it_was_timed():
    one, many, whole = ((FORWARD, CALLED, 1, 1), (FORWARD, CALLED, 1000, 2), (FORWARD, WHOLE_CALLED, 1, 1))
    assert called_in_words({}) == called_in_words({whole: 1.0}) == []
    start = "Called from Python, tmt.acceleration, once compiled code answers, takes"
    assert called_in_words({one: 2345.6}) == [f"{start} 2.3 us for one state."]
    assert called_in_words({one: 3000.0, whole: 1740.0, many: 21.04}) == [
        f"{start} 3.0 us for one state (mj_forward 1.7 us); of 1,000 states in one call 21.0 ns a state."
    ]


def test_nothing_is_timed_before_all_else_has_ended(setup, monkeypatch):
    class TimedError(Exception):
        pass

    def take_times(runs, setup):
        log.append("timed")
        raise TimedError

    log, setup = [], replace(setup, quiet=lambda: log.append("quiet"))
    monkeypatch.setattr(speed, "take_times", take_times)
    monkeypatch.setattr(speed.evaluations, "made_ways", lambda setup: log.append("made"))
    with pytest.raises(TimedError):
        speed.add_times(Result("speed"), setup, {"a": []})
    assert log == ["made", "quiet", "timed"]
