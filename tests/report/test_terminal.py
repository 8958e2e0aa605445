"""What a user sees on a terminal, wide or narrow, clever or dumb, with any name of a file."""

import json
import os
import re
import shutil

import pytest
from runs import ROOT, compare, in_shell

from compare.report.terminal import Terminal
from compare.robots.arm import ARM

OLD = "LC_ALL=C PYTHONUTF8=0 PYTHONCOERCECLOCALE=0"


@pytest.mark.slow
@pytest.mark.parametrize("line, model, out, heard", [
    ("PYTHONIOENCODING=ascii compare published --quick --mjcf Käfer.xml --out Öl | head -1; exit ${PIPESTATUS[0]}",
     "Käfer.xml", "Öl", 1),
    (f"{OLD} compare mass --quick --mjcf $'\\xff.xml' --out $'\\xfe' >/dev/full 2>&1", "\\xff.xml", b"\xfe", 0),
    ("compare mass --quick --mjcf Käfer.xml --out closed <&- >&- 2>&-", "Käfer.xml", "closed", 0),
])  # fmt: skip
def test_any_name_of_a_file_in_any_locale_and_any_reader(tmp_path, line, model, out, heard):
    for name in ("Käfer.xml", b"\xff.xml"):
        shutil.copy(ARM.mjcf, tmp_path / os.fsdecode(name))
    run, report = in_shell(line, tmp_path), tmp_path / os.fsdecode(out)
    assert (run.returncode, run.stderr, len(run.stdout.splitlines())) == (0, "", heard)
    results = json.loads((report / "results.json").read_text(encoding="utf-8"))
    assert results["passed"] and results["provenance"]["model"] == model
    assert all(model in (report / file).read_text(encoding="utf-8") for file in ("report.md", "index.html"))


@pytest.mark.parametrize("columns, line", [(80, "9 of 11, speed: timing"), (26, "9 of 11, speed: t...")])
def test_the_line_of_progress_fits(columns, line):
    terminal = Terminal()
    terminal.err.columns = lambda: columns
    terminal.how_far = lambda: ["9 of 11", "speed"]
    terminal.show("speed: timing")
    assert terminal.line() == line and len(line) <= columns - 6


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
    assert run.returncode == 2 and ROOT.as_posix() not in line
    assert re.search(r"RuntimeError: two lines \(compare/report/terminal.py:\d+\)$", line)
