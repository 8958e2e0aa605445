"""The command of a fleet, as a user gives it, and as it is ended in the middle."""

import csv
import json
import os
import re
import shutil
import signal
from pathlib import Path

import pytest
import runs
from toy_pieces import soon

from compare.__main__ import main
from compare.fleet.command import FLEET_OPTIONS
from compare.fleet.kept import Kept
from compare.fleet.piece import FleetError
from compare.fleet.row import FLEET_COLUMNS

NAME = "a b#ü.xml"  # of a file that agrees
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
    assert err == "" and "m/part.xml" in lines[0] and "out/index.html (" in lines[-1]
    assert f"m/x/{NAME}: " in said["self-consistent"] and " %" in said["self-consistent"]
    assert "m/heavy.xml: mass of upper arm: stated 1.9 kg, compiled 9 kg" in said["differ"]
    assert "m/broken.xml: " in said["refused"]
    assert "\x1b" not in shown and "\r" not in shown  # nothing moves in a pipe
    with (folder / "out" / "fleet.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [row["verdict"] for row in rows] == ["differ", "refused", "self-consistent"]
    assert all(tuple(row) == FLEET_COLUMNS for row in rows)
    differs, refused, agrees = rows
    assert float(differs["worst_ratio"]) > 1.0 > float(agrees["worst_ratio"]) > 0.0
    assert (agrees["joints"], agrees["file_integrator"], agrees["file_dt_s"]) == ("2", "RK4", "0.002")
    assert all(refused[name] == "" for name in ("joints", "worst_ratio", "file_integrator", "file_dt_s", "limit_s"))
    assert all(len(row["sha256"]) == 64 and float(row["seconds"]) >= 0.0 for row in rows)


@pytest.mark.slow
def test_a_file_has_the_report_that_it_has_alone(folder):
    assert main(["mass", "--quick", "--mjcf", f"m/x/{NAME}", "--out", "alone"]) == 0
    assert main(["fleet", "m/x", "--only", "mass", "--out", "out", "--workers", "1"]) == 0
    one, many = folder / "alone", folder / "out" / "files" / "m" / "x" / NAME
    alone, of_fleet = (json.loads((place / "results.json").read_text()) for place in (one, many))
    assert all(alone[name] == of_fleet[name] for name in ("checks", "causes", "reference", "passed"))
    assert (one / "tables" / "mass.csv").read_bytes() == (many / "tables" / "mass.csv").read_bytes()
    assert {path.name for path in one.iterdir()} <= {path.name for path in many.iterdir()}
    assert of_fleet["provenance"]["command"] == f"python -m compare fleet 'm/x/{NAME}' --only mass"


@pytest.mark.parametrize("arguments, word", [
    (["fleet"], "fleet models"), (["fleet", ""], "empty"), (["fleet", "m", "--onyl=mass"], "did you mean --only?"),
    (["fleet", "m", "--xyz"], " ".join(FLEET_OPTIONS)), (["fleet", "m", "--only", "mas"], "did you mean mass?"),
    (["fleet", "m", "--only", ","], "--only"), (["fleet", "m", "--workers", "0"], "--workers: '0'"),
    (["fleet", "m", "--reference", "my.py:"], "FILE.xml"), (["fleet", "m", "--limit", "nan"], "--limit: 'nan'"),
    (["fleet", "m", "--dask", "tcp://x:1", "--workers", "2"], "--workers"),
    (["--quick", "fleet", "m"], "fleet is the first word"),
])  # fmt: skip
def test_what_is_mistyped_gets_status_2_and_one_line(arguments, word, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    out, err = capsys.readouterr()
    assert (stop.value.code, out, len(err.splitlines())) == (2, "", 1) and word in err


@pytest.mark.parametrize("arguments, word", [
    (["nowhere"], "nowhere"), (["m", "--reference", "no.xml"], "no.xml"),
    (["m", "--since", "nowhere"], "nowhere/fleet.csv"), (["m", "--out", "m/part.xml"], "m/part.xml"),
])  # fmt: skip
def test_what_cannot_be_carried_out_gets_status_2_and_one_line(arguments, word, folder, capsys):
    assert main(["fleet", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and word in err and len(err.splitlines()) == 1 and not (folder / "reports").exists()


@pytest.mark.parametrize("words, asked", [
    (["--workers", "3", "--limit", "7"], ("pool", 3, 7.0, True)),
    (["--dask", "tcp://x:1", "--full"], ("cluster", "tcp://x:1", 600.0, False)),
])  # fmt: skip
def test_what_is_asked_for_is_what_is_run(words, asked, folder, monkeypatch, capsys):
    seen = []

    class Door:
        def __init__(self, where, limit):
            seen.extend((self.kind, where, limit))

        def close(self):
            pass

    def run(models, given, *_):
        seen.append(given.is_quick)
        assert given.names == ("mass", "gravity")
        raise FleetError("seen")

    monkeypatch.setattr("compare.fleet.pool.Pool", type("Pool", (Door,), {"kind": "pool"}))
    monkeypatch.setattr("compare.fleet.cluster.Cluster", type("Cluster", (Door,), {"kind": "cluster"}))
    monkeypatch.setattr("compare.fleet.run.Run", run)
    assert main(["fleet", "m", "--only", "gravity,mass", "--out", "asked", *words]) == 2
    assert tuple(seen) == asked and "seen" in capsys.readouterr().err


def test_the_status_is_1_where_a_file_differs_or_broke_off_and_what_has_changed_is_said(folder, monkeypatch, capsys):
    said = []

    def carry_out(self, progress):
        for task in self.tasks:
            self.ended(task, said[-1], "no reason")

    monkeypatch.setattr("compare.fleet.run.Run.carry_out", carry_out)
    statuses = {"agree": 0, "self-consistent": 0, "refused": 0, "unconfirmed": 1, "broke": 1, "differ": 1}
    for verdict, status in statuses.items():
        said.append(verdict)
        assert main(["fleet", "m/x", "--only", "mass", "--out", "out", "--workers", "1"]) == status
    said.append("agree")
    assert "changed" not in capsys.readouterr().out
    assert main(["fleet", "m/x", "--only", "mass", "--out", "out", "--workers", "1", "--since", "out"]) == 0
    assert re.search(rf"changed: m/x/{NAME}: .*differ.*agree", capsys.readouterr().out)


# ended in the middle: a line, nothing left behind, and the same command goes on from there

FILES = [str(MODELS / f"{name}.xml") for name in ("pendulum_ball", "free_body")]
WORDS = ("fleet", *FILES, "--only", "parameters", "--out", "out", "--workers", "1")  # one file after the other
WHOLE = 6  # of each file: what was read, an experiment, the report


@pytest.fixture
def place(tmp_path, monkeypatch):
    """Where a fleet is run; its temporary files are in a folder of their own."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setitem(runs.ENVIRONMENT, "TMPDIR", str(tmp_path / "temporary"))
    return tmp_path


def kept(place):
    """What is kept, with the times at which it was written."""
    return {path: path.stat().st_mtime_ns for path in (place / "out" / "kept").glob("*/[!.]*")}


def at_work(place):
    """Processes in a folder of the temporary files."""
    found = []
    for cwd in Path("/proc").glob("[0-9]*/cwd"):
        try:
            found += [cwd] if str(place / "temporary") in os.readlink(cwd) else []
        except OSError:  # it has ended meanwhile
            continue
    return found


def nothing_left(place):
    return soon(lambda: not at_work(place) and not list((place / "temporary").iterdir()))


def test_the_key_ctrl_c(place):
    run = runs.on_terminal(WORDS, 100, "xterm", place, interrupt_at=b"self-consistent")
    lines = [line for line in runs.readable_lines(run) if line]
    assert run.status == 2 and "interrupted" in lines[-1] and nothing_left(place) and "of 2 files, " in run.output


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_signal_and_the_same_command_again(place, number):
    run = runs.started(*runs.command(*WORDS), cwd=place)
    assert soon(lambda: kept(place))
    end = runs.ended(run, number)
    if number == signal.SIGTERM:
        assert end.status == 2 and len(end.lines) == 1 and "interrupted" in end.lines[0]
        assert nothing_left(place)
    assert soon(lambda: not at_work(place))  # a folder may be left of a worker that begins when its owner is killed
    Kept(place / "out").close()  # nobody has its lock
    known = kept(place)
    run = runs.compare(*WORDS, cwd=place)
    assert (run.returncode, run.stderr) == (0, ""), run.stdout
    assert {path: when for path, when in kept(place).items() if path in known} == known  # not computed again
    assert len(kept(place)) == WHOLE > len(known)
