"""Timing: in turns, the least of several calls, and what is not counted."""

import time

import pytest

from compare.judge import timing


def test_the_clock_reports_what_a_call_takes(monkeypatch):
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    lasts = {
        "a": [3.9e-3, 3e-3, 2e-3, 6e-3],
        "b": [0.2],
        "c": [0.018, 0.013],
    }  # the first of a is not counted
    left = {name: list(taken) for name, taken in lasts.items()}

    def call(name):
        now[0] += left[name].pop(0)

    runs = {name: lambda name=name: call(name) for name in lasts}
    assert timing.fastest(runs, 3) == {"a": pytest.approx(2e-3), "b": pytest.approx(0.2), "c": pytest.approx(0.013)}
    assert left == {"a": [], "b": [], "c": []}


def test_what_is_compared_is_timed_in_turns():
    order = []
    times = timing.in_turns([lambda: order.append("a"), lambda: order.append("b")], 3)
    assert order == ["a", "b"] * 4 and [len(t) for t in times] == [3, 3]
