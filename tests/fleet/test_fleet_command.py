"""The command of a fleet, as a user gives it, and as it is ended in the middle."""

import csv
import json
import shutil
import sys

import psutil
import pytest
from helpers import runs
from helpers.in_process import answered
from helpers.toy import soon

from compare.__main__ import main
from compare.core.errors import Refused
from compare.experiments import EXPERIMENTS, TIMED
from compare.fleet.table import FLEET_COLUMNS

NAME = "a b#ü.xml" if sys.getfilesystemencoding() == "utf-8" else "a b#u.xml"  # of a file that agrees
MODELS = runs.ROOT / "tests" / "models"


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A folder with four files, of which one agrees, one differs, one is refused and one is a part."""
    (tmp_path / "m" / "x").mkdir(parents=True)
    shutil.copy(MODELS / "pendulum_ball.xml", tmp_path / "m" / "x" / NAME)
    text = (runs.ROOT / "mjcf" / "arm.xml").read_text(encoding="utf-8").replace('mass="1.9"', 'mass="9"', 1)
    (tmp_path / "m" / "heavy.xml").write_text(text, encoding="utf-8")
    (tmp_path / "m" / "broken.xml").write_text("<mujoco><worldbody>")
    (tmp_path / "m" / "part.xml").write_text("<mujocoinclude/>")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_a_fleet_says_which_file_differs_and_why_and_has_a_tidy_table(folder, capsys):
    assert main(["fleet", "m/**", "--only", "parameters", "--out", "out", "--workers", "1"]) == 1
    shown, err = capsys.readouterr()
    lines = shown.splitlines()
    said = {line.split()[0]: line for line in lines if line.split()[:1] and ".xml:" in line}
    assert err == "" and "out/index.html (" in lines[-1]
    assert " of 3 files" not in shown and "Left out: 1 file" in shown  # progress is for terminals
    assert f"m/x/{NAME}: " in said["self-consistent"] and " %" in said["self-consistent"]
    assert "m/heavy.xml: mass of upper arm: 9 kg in heavy.xml, 1.9 kg" in said["differ"]
    assert "\x1b" not in shown and "\r" not in shown  # nothing moves in a pipe
    with (folder / "out" / "fleet.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == ["differ", "refused", "self-consistent"]
    assert all(tuple(row) == FLEET_COLUMNS for row in rows)
    differs, refused, agrees = rows
    assert float(differs["worst_ratio"]) > 1.0 > float(agrees["worst_ratio"]) >= 0.0
    assert (agrees["joints"], agrees["file_integrator"], agrees["file_dt_s"]) == ("2", "RK4", "0.002")
    assert refused["joints"] == "" and all(len(row["sha256"]) == 64 for row in rows)


@pytest.mark.slow
def test_a_file_has_the_report_that_it_has_alone(folder):
    assert main(["mass", "--quick", "--mjcf", f"m/x/{NAME}", "--out", "alone"]) == 0
    assert main(["fleet", "m/x", "--only", "mass", "--out", "out", "--workers", "1"]) == 0
    one, many = folder / "alone", folder / "out" / "files" / "m" / "x" / NAME
    alone, of_fleet = (json.loads((place / "results.json").read_text()) for place in (one, many))
    assert all(alone[name] == of_fleet[name] for name in ("checks", "causes", "reference", "passed"))
    assert (one / "tables" / "mass.csv").read_bytes() == (many / "tables" / "mass.csv").read_bytes()
    assert {path.name for path in one.iterdir()} <= {path.name for path in many.iterdir()}


@pytest.mark.parametrize("arguments, word", [
    ("--onyl=mass", "did you mean --only?"), ("--reference my.py:", "FILE.xml"), ("--limit nan", "--limit: 'nan'"),
    ("--only speed", "measures times"), ("--dask x --workers 2", "--workers"), ("--timing", "--timing"),
    ("--since nowhere", "--since"), ("--rubric a.toml", "--rubric"),
    ("--out m/part.xml", "m/part.xml"),
])  # fmt: skip
def test_what_cannot_be_carried_out_gets_status_2_and_one_line(arguments, word, folder, capsys):
    status, out, err = answered(["fleet", "m", *arguments.split()], capsys)
    assert (status, out, len(err.splitlines())) == (2, "", 1) and word in err
    assert not (folder / "reports").exists()


@pytest.mark.parametrize("words, asked, left_out", [
    ("--workers 3 --limit 7 --reference model", ("Pool", 3, 7.0, True), ()),
    ("--dask tcp://x:1 --full --reference arm", ("Cluster", "tcp://x:1", 1800.0, False), ()),
    # what asks about one file is for full runs if there is a reference
    ("--workers 1 --reference arm", ("Pool", 1, 1800.0, True), ("engines", "stability", "reduction")),
    ("--workers 1 --only gravity,mass", ("Pool", 1, 1800.0, True), {*EXPERIMENTS} - {"gravity", "mass"}),
])  # fmt: skip
def test_what_is_asked_for_is_what_is_run(words, asked, left_out, folder, monkeypatch, capsys):
    seen = []

    def run(models, given, *_):
        seen.extend((given.is_quick, given.names))
        raise Refused("seen")

    for name in ("Pool", "Cluster"):
        start = lambda self, *given, **more: seen.extend((type(self).__name__, *given))  # noqa: E731
        made = {"__init__": start, "close": lambda self: None}
        monkeypatch.setattr(f"compare.fleet.executors.{name}", type(name, (), made))
    monkeypatch.setattr("compare.fleet.run.Run", run)
    assert main(["fleet", "m", "--out", "asked", *words.split()]) == 2
    names = tuple(name for name in EXPERIMENTS if name not in (*TIMED, *left_out))
    assert tuple(seen) == (*asked, names) and "seen" in capsys.readouterr().err


# ended in the middle: a line, nothing left behind, and the same command goes on from there

FILES = [str(MODELS / f"{name}.xml") for name in ("pendulum_ball", "free_body")]
OPTIONS = ["--only", "parameters", "--out", "out", "--workers", "1"]  # one file after the other
WORDS = ("fleet", *FILES, *OPTIONS)


@pytest.fixture
def temporary(tmp_path, monkeypatch):
    (tmp_path / "temporary").mkdir()
    monkeypatch.setitem(runs.ENVIRONMENT, "TMPDIR", str(tmp_path / "temporary"))
    return tmp_path / "temporary"


def is_left_at_work(temporary):
    folders = (process.info["cwd"] or "" for process in psutil.process_iter(["cwd"]))
    return any(str(temporary) in folder for folder in folders)


def test_the_key_ctrl_c(temporary, tmp_path):
    more = [str(MODELS / f"{name}.xml") for name in ("arm7", "humanoid29")]  # they take longer than the key
    run = runs.on_terminal((*WORDS, *more), 100, "xterm", tmp_path, interrupt_at=b"self-consistent")
    lines = [line for line in runs.readable_lines(run) if line]
    assert run.status == 2 and "interrupted" in lines[-1] and "of 4 files, " in run.output
    assert soon(lambda: not is_left_at_work(temporary) and not list(temporary.iterdir()))
    assert not list((tmp_path / "out").rglob(".new-*"))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL"])
def test_a_signal_and_the_same_command_again(temporary, tmp_path, name):
    def cached():
        paths = (tmp_path / "out" / "files").rglob(".fleet")  # a part is not yet in its place
        return {path: path.stat().st_mtime_ns for path in paths if path.parent.suffix != ".part"}

    run = runs.started(*runs.command(*WORDS), cwd=tmp_path)
    assert soon(cached)
    end = runs.ended(run, name)
    assert name == "SIGKILL" or (end.status == 2 and len(end.lines) == 1 and "interrupted" in end.lines[0])
    assert soon(lambda: not is_left_at_work(temporary))
    known = cached()
    run = runs.compare(*WORDS, cwd=tmp_path)  # nobody has the lock
    assert (run.returncode, run.stderr) == (0, ""), run.stdout
    assert {path: when for path, when in cached().items() if path in known} == known  # not computed again
    assert len(cached()) == 2 > len(known)
    assert name == "SIGKILL" or not list(temporary.iterdir())
