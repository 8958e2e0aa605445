"""The command that tests the judge: its edits apply to the sources as they are, and it sees which ones no test notices."""

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
from mutations.__main__ import main
from mutations.edit import DoesNotApply, Edit, applied
from mutations.edits import EDITS
from runs import posix

PROJECT = Path(__file__).resolve().parent.parent


def test_every_edit_applies_and_says_what_it_breaks():
    lost = []
    for edit in EDITS:
        try:
            place = applied(PROJECT, edit)
            assert place.after != place.before
        except DoesNotApply as error:
            lost.append(str(error))
    assert lost == [] and all(edit.breaks for edit in EDITS)
    assert len({edit.name for edit in EDITS}) == len(EDITS)


JUDGE = """WIDTH = 0.5


class Check:
    def passed(self, value, tolerance=1.0):
        return (abs( value )
                <= tolerance)  # the rule
"""
TEST = """from compare.rules import Check


def test_it():
    assert Check().passed(0.5) and not Check().passed(1.5)
"""


@pytest.fixture
def toy(tmp_path, monkeypatch):
    """A project of one judge and its test."""
    monkeypatch.setenv("TMT_CACHE", str(tmp_path / "compiled"))
    monkeypatch.setenv("PYTEST_DISABLE_PLUGIN_AUTOLOAD", "1")  # as fast as may be
    monkeypatch.setenv("PYTEST_PLUGINS", "xdist.plugin")
    for name, text in (("compare/rules.py", JUDGE), ("tests/test_toy.py", TEST)):
        path = tmp_path / "toy" / name
        path.parent.mkdir(parents=True)
        path.write_text(text)
    return tmp_path / "toy"


def test_one_edit_is_caught_and_one_survives(toy, capfd):
    edits = [
        Edit("rules", "Check.passed", "abs(_1) <= tolerance", "True or _1", "always passes"),
        Edit("moved", "WIDTH", "0.5", "5", "wide"),
    ]
    assert main(["--jobs", "1"], toy, edits) == 1
    out = capfd.readouterr().out
    assert "always passes: caught by tests/test_toy.py::test_it" in out and "wide: SURVIVED" in out
    assert "-WIDTH = 0.5\n+WIDTH = 5" in out
    assert (toy / "compare/rules.py").read_text() == JUDGE
    for wrong in (Edit("rules", "WIDTH", "0.6", "5", ""), Edit("rules", "Check.failed", "1.0", "5", "")):
        assert main([], toy, [wrong]) == 2


PROGRAM = """
import sys
sys.path.insert(0, {tests!r})
from pathlib import Path
from mutations.__main__ import main
from mutations.edit import Edit
edits = [Edit("rules", "WIDTH", "0.5", "5", "wide")]
sys.exit(main([], Path({toy!r}), edits))
"""
LONG = """import os, subprocess, time


def test_long():
    child = subprocess.Popen(["sleep", "60"], start_new_session=True)
    open({asleep!r}, "w").write(f"{{os.getpid()}} {{child.pid}}\\n")
    time.sleep(60)
"""


def runs(pid) -> bool:
    """Whether a process is there and has not ended, as one that nobody waits for has."""
    try:
        return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


@pytest.mark.slow
@posix
@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_an_interrupt_ends_it_and_leaves_nothing(toy, tmp_path, number):
    asleep, scratch = tmp_path / "asleep", tmp_path / "scratch"
    (toy / "tests/test_long.py").write_text(LONG.format(asleep=str(asleep)))
    scratch.mkdir()
    program = PROGRAM.format(tests=str(PROJECT / "tests"), toy=str(toy))
    environment = os.environ | {"TMPDIR": str(scratch)}
    run = subprocess.Popen([sys.executable, "-c", program], env=environment, stdout=subprocess.PIPE, text=True)
    while not (asleep.exists() and asleep.read_text().endswith("\n")):
        assert run.poll() is None
        time.sleep(0.02)
    run.send_signal(number)
    assert run.communicate(timeout=30)[0].strip() == "interrupted" and run.returncode == 2
    assert not any(map(runs, asleep.read_text().split())) and list(scratch.iterdir()) == []
