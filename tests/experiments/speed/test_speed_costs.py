"""What an evaluation costs and times of rows; others beside tmt, timed where they agree; figures have these numbers."""

import time
from dataclasses import replace

import numpy as np
import pytest
from matplotlib.colors import to_hex
from speed_rows import NS, known_rows, row

import tmt
from compare.engines import Method, Setting
from compare.experiment import Setup
from compare.experiments import speed
from compare.experiments.speed import (
    advice,
    evaluations,
    figures_evaluations,
    figures_panels,
    figures_times,
    peers,
    times,
)
from compare.experiments.speed.evaluations import FORWARD, MJ_STEP, RK4_STEP, WHOLE
from compare.judge.check import Result
from compare.robots.arm import ARM

OF_RK4 = ("mujoco", "RK4", 4), ("tmt", "rk4", 4)
MUJOCOS, OURS = "#e69f00", "#0072b2"  # colours


def test_a_row_gets_the_least_of_its_times():
    rows = [row("tmt", "rk4", 1.0), row("mujoco", "RK4", 1.0)]
    assert times.fill_in(rows, [[3e-3, 2e-3, 5e-3], [0.4]]) == [pytest.approx(1.5)]
    assert [r["seconds"] for r in rows] == [2e-3, 0.4]


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


@pytest.mark.parametrize("lasts, many", [(1e-6, 1000), (1e-9, evaluations.MOST_CALLS)])
def test_the_same_is_done_a_millisecond_long_but_not_for_ever(lasts, many, monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])

    def loop(count):
        now[0] += lasts * count

    assert evaluations.counted(loop)[1] == pytest.approx(many, abs=1)


def test_the_ratios_of_what_an_evaluation_costs():
    said = " ".join(evaluations.costs_in_words(NS, (50e-6, 10e-6, 64), (488, 133), "arm"))
    assert all(part in said for part in ("(20 times less", "same work 10", "(40 times less; 20", "(100 times less)"))
    slower = NS | {(RK4_STEP, MJ_STEP, 1, 1): 100.0}
    assert "(2.0 times more)" in " ".join(evaluations.costs_in_words(slower, (1, 1, 64), None, "arm"))


def test_nothing_is_timed_before_all_else_has_ended(setup, monkeypatch):
    log, setup = [], replace(setup, quiet=lambda: log.append("quiet"))
    monkeypatch.setattr(speed, "take_times", lambda runs, setup: log.append("timed") or [])
    monkeypatch.setattr(speed.evaluations, "made_ways", lambda setup: log.append("made"))
    monkeypatch.setattr(speed.evaluations, "costs", lambda setup, ways: ([], []))
    speed.add_times(Result("speed", curves={"floors": {}}), setup, {"a": []})
    assert log == ["made", "quiet", "timed"]


# others beside tmt


class Off:
    """A Pinocchio of other numbers at the last state, by so much."""

    def __init__(self, by):
        self.by, self.tree = by, ARM.tree

    def acceleration(self, q, v, tau):
        found = tmt.literal.acceleration(q, v, tau)
        found[-1] *= 1.0 + self.by
        return found


def test_accelerations_that_differ_by_more_than_rounding_are_not_timed(rng):
    states = list(rng.uniform(-2.0, 2.0, (3, 40, 3)))
    assert peers.difference(Off(0.0), states) == 0.0
    assert peers.differs_in_words(0.999) is None and peers.differs_in_words(1.1)
    assert peers.differs_in_words(peers.difference(Off(1e-6), states))


def test_who_is_not_here_has_a_reason_and_no_time(engines, rng, monkeypatch):
    for module in ("pinocchio", "heyoka", "mujoco.batch"):
        monkeypatch.setattr(f"compare.engines.{module}.find_spec", lambda name: None)
    states = list(rng.uniform(-2.0, 2.0, (3, 40, 3)))
    nobody = peers.Peers(Setup.small(ARM, engines), states)
    assert list(nobody.of_one_state([part[0] for part in states])) == [] and nobody.of_many_states(states) == {}
    rows = evaluations.evaluation_rows({}, absent=nobody.absent)
    assert len(rows) == 3 and all(row["why_not"] and row["ns_per_state"] is row["states"] is None for row in rows)


# figures


def test_the_fewest_evaluations_are_those_of_the_coarsest_step_that_is_near_enough():
    result = Result("speed", rows=known_rows())
    assert "rk4 needs 1024, dopri8 256" in figures_panels.fewest(result, "bent, free", 1e-3)


def test_the_figures_draw_the_numbers_of_each_engine():
    result = Result("speed", rows=known_rows(), curves={"floors": {"bent, free": 1e-15}, "regular": "bent, free"})
    result.tables["what_should_i_use"] = advice.advice(result.rows, ["bent, free"], {"bent, free": 1e-15})
    result.tables["evaluations"] = evaluations.evaluation_rows(NS)
    absent = {"engine": "own", "method": "RK4, Heun", "scene": "bent, free", "why_not": "own is not here"}
    result.rows.append(dict.fromkeys(result.rows[0]) | absent)
    _, fig, caption = figures_times.draw_times(result, "bent, free")
    lines = {(to_hex(line.get_color()), tuple(np.round(line.get_ydata(), 9))) for line in fig.axes[0].get_lines()}
    assert (MUJOCOS, (20.0, 40.0, 80.0, 160.0, 320.0)) in lines and (OURS, (1.0, 2.0, 4.0, 8.0, 16.0)) in lines
    assert "20 times as long for 1e-02" in caption and "40 times as long for 1e-03 rad" in caption
    for figure in (figures_panels.draw_evaluations(result)[1], figures_panels.draw_energy(result)[1]):
        data = {line.get_label(): line for line in figure.axes[0].get_lines()}
        assert to_hex(data["MuJoCo: RK4"].get_color()) == MUJOCOS and to_hex(data["tmt: rk4"].get_color()) == OURS
    assert np.allclose(data["MuJoCo: RK4"].get_ydata(), [20.0, 40.0, 80.0, 160.0, 320.0])
    ax = figures_evaluations.draw_cost(result, "arm")[1].axes[0]
    names = [label.get_text() for label in ax.get_yticklabels()]
    bars = {name: (bar.get_width(), to_hex(bar.get_facecolor())) for name, bar in zip(names, ax.patches)}
    assert bars["MuJoCo, mj_forward, 1 state"] == (1000.0, MUJOCOS)
    assert bars["compiled, side by side, 1,000 states"] == (10.0, OURS)
