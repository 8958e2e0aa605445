"""Where a report comes from, and how long a run takes still: from the last run of its kind, corrected by what is seen."""

import json
import tomllib

import pytest
from runs import ROOT

from compare.experiments import EXPERIMENTS
from compare.process.clock import Clock
from compare.report.provenance import provenance
from compare.report.remaining import AFTER_FULL, AFTER_QUICK, END, START, Remaining, plan
from compare.robots.arm import ARM
from compare.version import OURS, installed, of_checkout

PLAN = {START: 10.0, "a": 20.0, "b": 60.0, END: 100.0}


class Stopped(Clock):
    """A clock that stands still."""

    elapsed = 0.0


@pytest.mark.parametrize("elapsed, ended, seconds", [
    (7.0, {}, 93.0), (25.0, {START: 10.0, "a": 20.0}, 75.0),
    (120.0, {START: 20.0, "a": 40.0, "b": 120.0}, 40.0 * 130.0 / 70.0),  # a slow machine: almost twice of the planned 40
    (30.0, {START: 5.0, "a": 10.0, "b": 30.0}, 40.0 * 40.0 / 70.0),
    (500.0, {START: 10.0, "a": 20.0}, 40.0),  # b is late; what comes after it is left
    (500.0, {START: 10.0, "a": 20.0, "b": 60.0}, None),  # nothing is known of the last
])  # fmt: skip
def test_an_estimate_is_what_is_left_of_the_plan_scaled_by_what_was_seen(elapsed, ended, seconds):
    clock = Stopped()
    clock.elapsed, clock.ended, clock.under_way = elapsed, ended, "a"
    left = Remaining(clock, ["a", "b"], PLAN)
    assert left.seconds == pytest.approx(seconds) and len(left.words()) == (3 if seconds else 2)


@pytest.mark.parametrize("last, command, ended, is_used", [
    ("compare all", "compare all --out here", PLAN, True),
    ("compare all --out=there --quick", "compare --quick all --out 'a b'", PLAN, True),
    ("compare all", "compare all --quick", PLAN, False),
    ("an 'open quote", "compare all", PLAN, False),
    ("compare all", "compare all", None, False), ("compare all", "compare all", {END: "x"}, False),
    ("compare all", "compare all", {"a": 2.0, END: 1.0}, False), ("compare all", "compare all", {END: float("nan")}, False),
])  # fmt: skip
def test_the_last_run_of_the_same_kind_is_what_is_planned(tmp_path, last, command, ended, is_used):
    (tmp_path / "results.json").write_text(json.dumps({"provenance": {"command": last, "ended_after_s": ended}}))
    quick = "--quick" in command
    expected = ended if is_used else AFTER_QUICK if quick else AFTER_FULL
    assert plan([*EXPERIMENTS], quick, command, tmp_path) == expected


def test_the_version_is_that_of_the_checkout_that_runs(tmp_path):
    stated = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]["version"]
    assert provenance("c", ARM.mjcf, "arm.xml", 1)[OURS] == stated == of_checkout(ROOT)
    assert of_checkout(tmp_path) is None and installed("no-such-package") is None
    (tmp_path / "pyproject.toml").write_text('[project]\nname = "other"\nversion = "1"')  # around the package
    assert of_checkout(tmp_path) is None
