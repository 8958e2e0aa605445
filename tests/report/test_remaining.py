"""How long a run takes still: from the last run of the same kind, corrected by what is seen."""

import json

import pytest

from compare.experiments import EXPERIMENTS
from compare.process.clock import Clock
from compare.report.remaining import AFTER_FULL, AFTER_QUICK, END, START, Remaining, in_words, plan, same_kind

PLAN = {START: 10.0, "a": 20.0, "b": 60.0, END: 100.0}


class Stopped(Clock):
    """A clock that stands still."""

    elapsed = 0.0


def remaining(elapsed, under_way="", **ended):
    clock = Stopped()
    clock.elapsed, clock.ended, clock.under_way = elapsed, ended, under_way
    return Remaining(clock, ["a", "b"], PLAN)


def test_an_estimate_begins_with_what_is_planned_and_is_what_is_left_of_it():
    assert remaining(0.0).seconds == 100.0
    assert remaining(7.0).seconds == 93.0
    assert remaining(25.0, start=10.0, a=20.0).seconds == 75.0
    assert remaining(99.0, start=10.0, a=20.0, b=60.0).seconds == 1.0


def test_it_is_scaled_by_what_the_ended_tasks_took_here():
    twice = remaining(120.0, start=20.0, a=40.0, b=120.0).seconds
    assert twice == pytest.approx(40.0 * 130.0 / 70.0)  # almost twice of what is planned: 80
    assert remaining(30.0, start=5.0, a=10.0, b=30.0).seconds == pytest.approx(40.0 * 40.0 / 70.0)
    assert remaining(20.0, start=20.0).seconds < 2.0 * 90.0  # a first short task says less than a long one


def test_a_task_that_takes_longer_than_it_should_leaves_what_comes_after_it():
    assert remaining(500.0, start=10.0, a=20.0).seconds == 40.0  # b is late; figures come
    assert remaining(500.0, start=10.0, a=20.0, b=60.0).seconds is None  # nothing is known of the last


def test_how_far_in_words():
    assert remaining(0.0).words() == ["about 100 s left"]
    assert remaining(10.0, "a", start=10.0).words() == ["1 of 2", "a", "about 90 s left"]
    assert remaining(500.0, "b", start=10.0, a=20.0).words() == ["2 of 2", "b", "about 40 s left"]
    assert remaining(10.0, "b", start=10.0).words()[:2] == ["1 of 2", "b"]  # in whatever order they are made
    assert remaining(500.0, start=10.0, a=20.0, b=60.0).words() == []


@pytest.mark.parametrize("seconds, text", [
    (0.2, "1 s"), (7.6, "8 s"), (9.9, "10 s"), (12.0, "10 s"), (33.0, "35 s"), (117.0, "115 s"), (118.0, "2 min"),
    (200.0, "3 min"),
])  # fmt: skip
def test_a_duration_is_as_rough_as_an_estimate(seconds, text):
    assert in_words(seconds) == text


@pytest.mark.parametrize("one, other, same", [
    ("python -m compare all", "python -m compare all --out here", True),
    ("python -m compare all --out=there --quick", "python -m compare --quick all --out 'a b'", True),
    ("python -m compare all", "python -m compare all --quick", False),
    ("python -m compare all --mjcf a.xml", "python -m compare all --mjcf b.xml", False),
    ("python -m compare mass", "python -m compare all", False),
])  # fmt: skip
def test_what_is_of_the_same_kind(one, other, same):
    assert same_kind(one, other) == same


def report(folder, **origin):
    (folder / "results.json").write_text(json.dumps({"provenance": origin}))
    return folder


def test_the_last_run_of_the_same_kind_is_what_is_planned(tmp_path):
    out, command = (
        report(tmp_path, command="python -m compare all", ended_after_s=PLAN),
        "python -m compare all --out there",
    )
    assert plan(["a", "b"], False, command, out) == PLAN
    assert plan([*EXPERIMENTS], True, command + " --quick", out) == AFTER_QUICK
    assert plan([*EXPERIMENTS], False, command, tmp_path / "none") == AFTER_FULL


@pytest.mark.parametrize(
    "ended",
    [
        None,
        [],
        {},
        {"a": 1.0},
        {END: "x"},
        {END: 0.0},
        {END: float("nan")},
        {"a": float("nan"), END: 1.0},
        {"a": 2.0, END: 1.0},
        {"a": -1.0, END: 1.0},
        {END: float("inf")},
    ],
)
def test_a_report_that_cannot_be_read_plans_nothing(tmp_path, ended):
    out = report(tmp_path, command="python -m compare all", ended_after_s=ended)
    assert plan([*EXPERIMENTS], False, "python -m compare all", out) == AFTER_FULL
    for command in (None, 1, "an 'open quote"):
        report(tmp_path, command=command, ended_after_s=PLAN)
        assert plan([*EXPERIMENTS], False, "python -m compare all", tmp_path) == AFTER_FULL
    (tmp_path / "results.json").write_text("{")
    assert plan([*EXPERIMENTS], False, "python -m compare all", tmp_path) == AFTER_FULL


def test_of_some_experiments_their_share_is_planned(tmp_path):
    for whole, quick in ((AFTER_FULL, False), (AFTER_QUICK, True)):
        order = sorted(whole, key=whole.get)
        assert set(whole) == {START, *EXPERIMENTS, END} and order[0] == START and order[-1] == END
        before = {name: whole[order[order.index(name) - 1]] for name in ("speed", END)}
        alone = plan(["speed"], quick, "python -m compare speed", tmp_path)
        assert list(alone) == [START, "speed", END]
        assert alone["speed"] - alone[START] == pytest.approx(whole["speed"] - before["speed"])
        assert alone[END] - alone["speed"] == pytest.approx(whole[END] - before[END])
