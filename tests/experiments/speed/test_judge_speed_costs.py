"""What an evaluation costs, times of rows, and others beside tmt: timed where they take part, else a reason."""

import time
from dataclasses import replace

import pytest
from speed_rows import NS, row

import tmt
from compare.engines import Method, Setting
from compare.experiment import Setup
from compare.experiments import speed
from compare.experiments.speed import evaluations, peers, times
from compare.experiments.speed.evaluations import EACH, FORWARD, MJ_STEP, RK4_STEP, WHOLE
from compare.experiments.speed.peers import ABA, BATCH, COMPILED
from compare.judge.check import Result
from compare.robots.arm import ARM

OF_RK4 = ("mujoco", "RK4", 4), ("tmt", "rk4", 4)


def test_a_row_gets_the_least_of_its_times():
    rows = [row("tmt", "rk4", 1.0), row("mujoco", "RK4", 1.0)]
    assert times.fill_in(rows, [[3e-3, 2e-3, 5e-3], [0.4]]) == [pytest.approx(1.5)]
    assert [r["seconds"] for r in rows] == [2e-3, 0.4]
    assert "50.0%" in times.spread_in_words([1.5])[0] and len(times.spread_in_words([])) == 1


def test_what_is_timed_in_part_counts_as_the_whole(setup, monkeypatch):
    for engine, steps, timed in (("mujoco", 4096, 4096), ("mujoco", 131072, 4096), ("tmt", 131072, 131072)):
        part = times.timed_part(Method(engine, "RK4", "rk4", 4), Setting(5.0, steps))
        assert part.steps == timed and part.duration / part.steps == 5.0 / steps and part.every
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
    ns = {(FORWARD, EACH, 1000, 1): 30.0, (FORWARD, WHOLE, 1, 1): 1400.0}
    rows = evaluations.evaluation_rows(ns, {(FORWARD, EACH): 60})
    assert [(r["implementation"], r["ns_per_state"], r["operations_per_ns"]) for r in rows] == [
        (WHOLE, 1400.0, None), (EACH, 30.0, 2.0)]  # fmt: skip


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


def test_the_ratios_of_what_an_evaluation_costs():
    (_, forward, step, *_) = evaluations.costs_in_words(NS, (50e-6, 10e-6, 64), (488, 133), "arm")
    for part in ("1000 ns", "500 ns", "50.0 ns", "(20 times less; than the same work 10", "(40 times less; 20 times less)",
                 "10.0 (of 1,000 states) ns a state (100 times less)"):  # fmt: skip
        assert part in forward, part
    assert "4000 ns" in step and "(20 times less)" in step
    slower = NS | {(RK4_STEP, MJ_STEP, 1, 1): 100.0}
    assert "(2.0 times more)" in " ".join(evaluations.costs_in_words(slower, (1, 1, 64), None, "arm"))
    without = {key: value for key, value in NS.items() if not key[1].startswith("MuJoCo")}
    assert "a reason" in " ".join(evaluations.costs_in_words(without, (1, 1, 64), None, "arm", "a reason"))


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


# others beside tmt


@pytest.fixture
def states(rng):
    return list(rng.uniform(-2.0, 2.0, (3, 40, 3)))


class Off:
    """A Pinocchio of other numbers at the last state, by so much."""

    def __init__(self, by):
        self.by, self.tree = by, ARM.tree

    def acceleration(self, q, v, tau):
        found = tmt.literal.acceleration(q, v, tau)
        found[-1] *= 1.0 + self.by
        return found


def test_accelerations_that_differ_by_more_than_rounding_are_not_timed(states):
    assert peers.difference(Off(0.0), states) == 0.0
    assert peers.differs_in_words(0.999) is None and "1.1" in peers.differs_in_words(1.1)
    assert peers.differs_in_words(peers.difference(Off(1e-6), states))


def test_who_is_not_here_has_a_reason_and_no_time(engines, states, monkeypatch):
    for module in ("pinocchio", "heyoka", "mujoco.batch"):
        monkeypatch.setattr(f"compare.engines.{module}.find_spec", lambda name: None)
    nobody = peers.Peers(Setup.small(ARM, engines), states)
    assert list(nobody.of_one_state([part[0] for part in states])) == [] and nobody.of_many_states(states) == {}
    assert set(nobody.absent) == {(FORWARD, COMPILED), (FORWARD, ABA), (FORWARD, BATCH)}
    assert len(peers.peers_in_words(NS, {1000: 10.0}, nobody)) == 3
    rows = evaluations.evaluation_rows({}, absent=nobody.absent)
    assert [row["why_not"] for row in rows] == list(nobody.absent.values())
    assert all(row["ns_per_state"] is row["states"] is None for row in rows)
