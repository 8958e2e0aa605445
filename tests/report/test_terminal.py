"""What a user sees on a terminal, wide or narrow, clever or dumb, with any name of a file; how long a run takes still."""

import json
import os
import re

import pytest
from runs import ROOT, compare, in_shell
from small_runs import runs_on_terminals, terminal_folders

from compare.experiments import EXPERIMENTS
from compare.process.clock import Clock
from compare.report.remaining import AFTER_FULL, AFTER_QUICK, END, START, Remaining, plan
from compare.report.terminal import Terminal


@pytest.fixture(scope="module")
def runs(shared, common):
    """Runs of the arm and of a heavy one in a shell, and their two folders."""
    plain, umlauts = terminal_folders(common)
    return shared(runs_on_terminals, plain, umlauts) | {"plain": plain, "umlauts": umlauts}


def results_in(folder):
    return json.loads((folder / "results.json").read_text(encoding="utf-8"))


@pytest.mark.slow
@pytest.mark.parametrize("name, model, out, heard", [
    ("ascii, head", "Käfer.xml", "Öl", 1), ("C", "Käfer.xml", "Öl im C", 5), ("bytes, full", "\\xff.xml", b"\xfe", 0),
])  # fmt: skip
def test_any_name_of_a_file_in_any_locale_and_any_reader(runs, name, model, out, heard):
    run, report = runs[name], runs["umlauts"] / os.fsdecode(out)
    assert (run.returncode, run.stderr, len(run.stdout.splitlines())) == (0, "", heard)
    results = results_in(report)
    assert results["passed"] and results["provenance"]["model"] == model
    for file in ("report.md", "index.html"):
        assert model in (report / file).read_text(encoding="utf-8")
    assert runs["closed"].returncode == 1 and results_in(runs["plain"] / "closed")["passed"] is False  # nobody hears


PARTS = ["4 of 11", "acceleration", "about 35 s left"]


@pytest.mark.parametrize("columns, how_far, text, line", [
    (80, [], "imports", "imports"),
    (80, ["9 of 11", "speed"], "speed: timing", "9 of 11, speed: timing"),
    (51, PARTS, "bias", "4 of 11, acceleration, about 35 s left: bias"),
    (49, PARTS, "bias", "4 of 11, acceleration, about 35 s left: ..."),
    (40, PARTS, "bias", "4 of 11, about 35 s left: bias"),
    (10, PARTS, "bias", "4 of 11, ab..."),
])  # fmt: skip
def test_the_line_of_progress_fits(columns, how_far, text, line):
    terminal = Terminal()
    terminal.err.columns = lambda: columns
    terminal.tell(lambda: how_far)
    terminal.show(text)
    assert terminal.line() == line and len(line) <= max(columns, 20) - 6


def test_a_run_whose_progress_cannot_be_shown_says_a_line_now_and_then(capfd, monkeypatch):
    monkeypatch.setattr("compare.report.terminal.SILENT_FOR", 0.05)
    terminal = Terminal()
    terminal.tell(lambda: ["4 of 11", "mass"])
    with terminal.progress("states"):
        said = ""
        while "4 of 11, mass: states" not in said:  # the test ends by its time limit otherwise
            said += capfd.readouterr().out


@pytest.mark.parametrize("line, status", [
    ("compare speed --help | head -1; exit ${PIPESTATUS[0]}", 0), ("compare >/dev/full", 0), ("compare --quick >&- 2>&-", 2),
])  # fmt: skip
def test_who_does_not_listen_changes_no_status(tmp_path, line, status):
    run = in_shell(line, tmp_path)
    assert run.returncode == status and "Traceback" not in run.stderr


def test_what_nobody_foresaw_is_one_line(tmp_path):
    (tmp_path / "rich.py").write_text("raise RuntimeError('two\\nlines')")  # found first: the current folder
    run = compare("mass", cwd=tmp_path)
    (line,) = run.stderr.splitlines()
    assert run.returncode == 2 and re.search(r"RuntimeError: two lines \(compare/report/terminal.py:\d+\)$", line)
    assert ROOT.as_posix() not in run.stderr


# how long a run takes still: from the last run of its kind, corrected by what is seen

PLAN = {START: 10.0, "a": 20.0, "b": 60.0, END: 100.0}


@pytest.mark.parametrize("elapsed, ended, seconds", [
    (7.0, {}, 93.0), (25.0, {START: 10.0, "a": 20.0}, 75.0),
    (120.0, {START: 20.0, "a": 40.0, "b": 120.0}, 40.0 * 130.0 / 70.0),  # a slow machine: almost twice of the planned 40
    (30.0, {START: 5.0, "a": 10.0, "b": 30.0}, 40.0 * 40.0 / 70.0),
    (500.0, {START: 10.0, "a": 20.0}, 40.0),  # b is late; what comes after it is left
    (500.0, {START: 10.0, "a": 20.0, "b": 60.0}, None),  # nothing is known of the last
])  # fmt: skip
def test_an_estimate_is_what_is_left_of_the_plan_scaled_by_what_was_seen(elapsed, ended, seconds):
    clock = type("Stopped", (Clock,), {"elapsed": elapsed})()
    clock.ended, clock.under_way = ended, "a"
    left = Remaining(clock, ["a", "b"], PLAN)
    assert left.seconds == pytest.approx(seconds) and len(left.words()) == (3 if seconds else 2)


@pytest.mark.parametrize("last, command, ended, is_used", [
    ("compare all", "compare all --out here", PLAN, True),
    ("compare all --out=there --quick", "compare --quick all --out 'a b'", PLAN, True),
    ("compare all", "compare all --quick", PLAN, False),
    ("compare all", "compare all", None, False), ("compare all", "compare all", {"a": 2.0, END: 1.0}, False),
])  # fmt: skip
def test_the_last_run_of_the_same_kind_is_what_is_planned(tmp_path, last, command, ended, is_used):
    (tmp_path / "results.json").write_text(json.dumps({"provenance": {"command": last, "ended_after_s": ended}}))
    quick = "--quick" in command
    expected = ended if is_used else AFTER_QUICK if quick else AFTER_FULL
    assert plan([*EXPERIMENTS], quick, command, tmp_path) == expected
