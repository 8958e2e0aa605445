"""Timing: in turns, the least of several calls, and what is not counted."""

import time

import pytest

from compare.core import timing


def test_what_is_compared_is_called_in_turns_and_the_first_call_is_not_counted(monkeypatch):
    now, order = [0.0], []
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    # a long call is made less often, until two agree; a very long one once
    left = {"a": [3.9e-3, 0.014, 6e-3, 2e-3], "b": [0.3], "c": [0.013, 0.018], "d": [0.2, 0.1, 0.11]}

    def call(name):
        now[0] += left[name].pop(0)

    found = timing.fastest({name: lambda name=name: call(name) for name in left}, 3)
    assert found == {"a": pytest.approx(2e-3), "b": pytest.approx(0.3), "c": pytest.approx(0.013),
                     "d": pytest.approx(0.1)}  # fmt: skip
    assert not any(left.values())
    times = timing.in_turns([lambda: order.append("d"), lambda: order.append("e")], 3)
    assert order == ["d", "e"] * 4 and [len(t) for t in times] == [3, 3]
