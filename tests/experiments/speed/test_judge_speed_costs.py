"""What an evaluation costs, times of rows, and which aims are met."""

import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import pytest
from speed_rows import NS, row

from compare.engines import Method, Setting
from compare.experiments import speed
from compare.experiments.speed import evaluations, targets, times
from compare.experiments.speed.evaluations import (
    CALLED,
    EACH,
    EQUAL,
    FORWARD,
    IN_LANES,
    MJ_STEP,
    RK4_STEP,
    WAITING,
    WHOLE,
    WHOLE_CALLED,
    called_in_words,
)  # fmt: skip
from compare.experiments.speed.ways import of_many_states
from compare.judge.check import Result
from compare.robots.arm import ARM
from tmt import answers
from tmt.compiled.cores import cores

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
    for part in ("Forward dynamics of the arm: mj_forward takes 1000 ns", "same work 500 ns", "the kernel 50.0 ns",
                 "(20 times less; than the same work 10",
                 "25.0 ns where they are independent (40 times less; 20 times less)",
                 "lanes 10.0 (of 1,000 states) ns a state (100 times less)",
                 "mj_step 4000 ns, the kernel 200 ns (20 times less)", "64 steps takes 50 us, its loop alone 10 us",
                 "literal method has 488 operations, that of the composite form 133"):  # fmt: skip
        assert part in words, part
    slower = NS | {(RK4_STEP, MJ_STEP, 1, 1): 100.0}
    assert "(2.0 times more)" in " ".join(evaluations.costs_in_words(slower, (1, 1, 64), (1, 1), "arm"))
    without = {key: value for key, value in NS.items() if not key[1].startswith("MuJoCo")}
    told = evaluations.costs_in_words(without, (1, 1, 64), (1, 1), "arm", "MuJoCo's library was not found")
    assert "MuJoCo's library was not found: its calls were not timed in compiled loops." in told


def aims(ratio, lanes=300.0, vectors="some processor, AVX-512"):
    """Which aims are met, and what is said, where tmt takes so many times what the aims allow."""
    result = Result("speed")
    ns = {(FORWARD, WHOLE, 1, 1): 4000.0, (FORWARD, EQUAL, 1, 1): 1200.0, (RK4_STEP, MJ_STEP, 1, 1): 2000.0,
          (FORWARD, WAITING, 1, 1): 100.0 * ratio, (FORWARD, EACH, 1000, 1): 100.0 * ratio,
          (RK4_STEP, EACH, 1, 1): 100.0 * ratio, (FORWARD, IN_LANES, 1000, 1): 4000.0 / lanes}  # fmt: skip
    result.tables["evaluations"] = evaluations.evaluation_rows(ns)
    result.tables["what_should_i_use"] = [{"scene": s, "target_rad": t, "ratio": r / ratio} for s, t, r in (
        ("bent, free", 1e-6, 50), ("zero, free", 1e-9, 200), ("zero, free", 1e-12, 500), ("bent, damped", 1e-6, 1))]  # fmt: skip
    result.rows = [row("heyoka", "Taylor", 1e-10, seconds=1e-3), row("tmt", "dopri8", 1e-10, seconds=1e-3 * ratio)]
    found = targets.targets(result, {"bent, free": 1e-15}, vectors, ARM.aims)
    return {t["what"]: t["met"] for t in found}, targets.aims_in_words(found)


def test_an_aim_is_met_at_its_ratio_and_missed_below():
    met, words = aims(0.999)
    assert len(met) == 10 and all(met.values()) and words == ["Of 10 aims for speed 10 are met."]
    missed, words = aims(1.001, lanes=299.0)
    assert len(missed) == 10 and not any(missed.values())
    assert words[0].startswith("Of 10 aims for speed 0 are met; missed: forward dynamics, each evaluation waits")
    assert "bent, free, 1e-06 rad: MuJoCo's cheapest over tmt's: 50 of 50" in words[0]
    lanes = "forward dynamics: mj_forward over lanes of 1,000 states"
    assert [aims(1, n, "AVX2")[0][lanes] for n in (121, 119)] == [True, False]


def test_aims_of_scenes_are_the_robots_own():
    result = Result("speed", tables={"evaluations": [], "what_should_i_use": [
        {"scene": "bent, free", "target_rad": 1e-6, "ratio": 60.0}]})  # fmt: skip
    assert not any("bent" in line["what"] for line in targets.targets(result, {}, "", {}))
    (line,) = (line for line in targets.targets(result, {}, "", {("bent, free", 1e-6): 70}) if "bent" in line["what"])
    assert line["aim"] == 70 and line["reached"] == 60.0 and not line["met"]


def test_what_calls_from_python_take_is_said_as_it_was_timed():
    one, many, whole = ((FORWARD, CALLED, 1, 1), (FORWARD, CALLED, 1000, 2), (FORWARD, WHOLE_CALLED, 1, 1))
    assert called_in_words({}) == called_in_words({whole: 1.0}) == []
    start = "Called from Python, tmt.acceleration, once compiled code answers, takes"
    assert called_in_words({one: 2345.6}) == [f"{start} 2.3 us for one state."]
    assert called_in_words({one: 3000.0, whole: 1740.0, many: 21.04}) == [
        f"{start} 3.0 us for one state (mj_forward 1.7 us); of 1,000 states in one call 21.0 ns a state."
    ]


def test_of_many_states_that_code_is_timed_which_answers_in_the_end(rng, monkeypatch):
    monkeypatch.setattr(answers, "_known", {})
    known = answers.remembered(ARM.tree)
    known.get_loops()
    with ThreadPoolExecutor(1) as pool:
        runs = of_many_states(ARM.tree, rng.uniform(-2.0, 2.0, (3, 40, 3)), pool)
        assert not known.lanes
        runs[FORWARD, CALLED, 40, cores()]()
    assert FORWARD in known.lanes


def test_nothing_is_timed_before_all_else_has_ended(setup, monkeypatch):
    class TimedError(Exception):
        pass

    def take_times(runs, setup):
        log.append("timed")
        raise TimedError

    log, setup = [], replace(setup, quiet=lambda: log.append("quiet"))
    monkeypatch.setattr(speed, "take_times", take_times)
    monkeypatch.setattr(speed.growth, "chains_of", lambda setup: log.append("made"))
    monkeypatch.setattr(speed.evaluations, "made_ways", lambda setup: log.append("made"))
    with pytest.raises(TimedError):
        speed.add_times(Result("speed"), setup, {"a": []})
    assert log == ["made", "made", "quiet", "timed"]
