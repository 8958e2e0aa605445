"""The command of a fleet, as a user gives it."""

import csv
import json
import os
import re
import shutil
from pathlib import Path
from types import SimpleNamespace

import pytest
from runs import compare, on_terminal, readable_lines, words

from compare.__main__ import main
from compare.fleet.command import FLEET_OPTIONS, MOST_SAID, say_some
from compare.fleet.piece import FleetError
from compare.fleet.row import FLEET_COLUMNS
from compare.report.terminal import Terminal

ROOT = Path(__file__).resolve().parents[2]
ARM, BALL = ROOT / "mjcf" / "arm.xml", ROOT / "tests" / "models" / "pendulum_ball.xml"
PENDULUM = ("<mujoco><worldbody><body><joint name='j' axis='0 1 0'/><inertial pos='0 0 0.1' mass='1' "
            "diaginertia='1 1 1'/></body></worldbody></mujoco>")  # fmt: skip
NAME = "a b#ü.xml"  # of a file that agrees


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with four files, of which one agrees, one differs, one is refused and one is a part."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "m" / "x").mkdir(parents=True)
    shutil.copy(BALL, folder / "m" / "x" / NAME)
    (folder / "m" / "heavy.xml").write_text(ARM.read_text().replace('mass="1.9"', 'mass="9"', 1))
    (folder / "m" / "broken.xml").write_text("<mujoco><worldbody>")
    (folder / "m" / "part.xml").write_text("<mujocoinclude/>")
    return folder


@pytest.fixture(scope="module")
def first(folder):
    """The fleet of all of them."""
    run = compare("fleet", "m/**", "--only", "mass", "--out", "out", "--workers", "2", cwd=folder)
    return SimpleNamespace(run=run, rows=rows_of(folder / "out"), out=folder / "out")


def rows_of(out):
    with (out / "fleet.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_fleet_says_which_file_differs_and_why(first):
    assert (first.run.returncode, first.run.stderr) == (1, "")
    lines = first.run.stdout.splitlines()
    assert lines[0] == "left out: m/part.xml, it is a part, to be included by a model"
    said = {
        line.split()[0]: line for line in lines if line.split()[:1] in (["self-consistent"], ["differ"], ["refused"])
    }
    assert f"m/x/{NAME}: " in said["self-consistent"] and "% of tolerance" in said["self-consistent"]
    assert "m/heavy.xml: mass of upper arm: stated 1.9 kg, compiled 9 kg" in said["differ"]
    assert "m/broken.xml: MuJoCo cannot compile it: XML" in said["refused"]
    assert "3 files: 1 differs, 1 was refused, 1 is self-consistent." in lines and lines[-1].startswith(
        "Fleet: out/index.html ("
    )
    assert re.fullmatch(r"Of 2 x \d+ s (\d+ % were [a-z ]+(, |\.))+", lines[-2])
    assert "\x1b" not in first.run.stdout and "\r" not in first.run.stdout  # nothing moves in a pipe


def test_the_table_has_what_needs_a_look_first_in_tidy_columns(first):
    assert [row["verdict"] for row in first.rows] == ["differ", "refused", "self-consistent"]
    assert all(list(row) == list(FLEET_COLUMNS) for row in first.rows)
    differs, refused, agrees = first.rows
    assert float(differs["worst_ratio"]) > 1.0 > float(agrees["worst_ratio"]) > 0.0
    assert (agrees["joints"], agrees["file_integrator"], agrees["file_dt_s"]) == ("2", "RK4", "0.002")
    assert [agrees[name] for name in ("stable_at_file_dt", "limit_s")] == ["", ""]
    assert agrees["reason"].endswith("are not the arm's alpha, beta, gamma: compared with its own compiled model only")
    assert all(refused[name] == "" for name in ("joints", "worst_ratio", "file_integrator", "file_dt_s", "limit_s"))
    assert all(len(row["sha256"]) == 64 and float(row["seconds"]) >= 0.0 for row in first.rows)


def test_a_file_has_the_report_that_it_has_alone(first, folder):
    alone = compare("mass", "--quick", "--mjcf", f"m/x/{NAME}", "--out", "alone", cwd=folder)
    assert alone.returncode == 0
    one, many = folder / "alone", first.out / "files" / "m" / "x" / NAME
    results = [json.loads((place / "results.json").read_text()) for place in (one, many)]
    for name in ("checks", "causes", "reference", "passed"):
        assert results[0][name] == results[1][name], name
    assert (one / "tables" / "mass.csv").read_bytes() == (many / "tables" / "mass.csv").read_bytes()
    assert {path.name for path in one.iterdir()} <= {path.name for path in many.iterdir()}
    assert results[1]["provenance"]["model"] == f"m/x/{NAME}" == results[0]["provenance"]["model"]
    assert results[1]["provenance"]["command"] == f"python -m compare fleet 'm/x/{NAME}' --only mass"


def test_the_same_command_goes_on_and_says_what_has_changed(first, folder):
    shutil.copytree(first.out, folder / "later")
    command = ("fleet", "m", "--only", "mass", "--out", "later", "--since", "later")
    again = compare(*command, cwd=folder)
    assert again.returncode == 1 and "Known from before: 2 files." in again.stdout
    assert (
        "nothing has changed since later" in again.stdout
        and "<li>Nothing.</li>" in (folder / "later" / "index.html").read_text()
    )
    assert rows_of(folder / "later") == first.rows
    shutil.copytree(folder / "m", folder / "n" / "m")
    (folder / "n" / "m" / "heavy.xml").unlink()
    (folder / "n" / "m" / "broken.xml").write_text(PENDULUM)
    shutil.move(folder / "later", folder / "n" / "later")
    changed = compare(*command, cwd=folder / "n")
    assert changed.returncode == 0 and "2 files: 2 are self-consistent." in changed.stdout
    lines = [line for line in changed.stdout.splitlines() if line.startswith("changed: ")]
    assert lines == [
        "changed: m/broken.xml: refused before, now self-consistent (the file has changed)",
        "changed: m/heavy.xml: gone, differ before",
    ]


@pytest.mark.parametrize("columns, term", [(30, "xterm"), (100, "dumb")])
def test_a_terminal_shows_how_far_it_is_and_then_what_has_come_out(columns, term, folder, first, tmp_path):
    (tmp_path / "a.xml").write_text(PENDULUM)
    shutil.copytree(first.out, tmp_path / "out")
    run = on_terminal(["fleet", "a.xml", "--only", "mass", "--out", "out", "--workers", "1"], columns, term, tmp_path)
    assert run.status == 0
    shown = words(readable_lines(run))
    assert "1 file: 1 is self-consistent." in shown and "pieces" not in shown
    assert ("of 1 files, " in run.output) == (term != "dumb")


@pytest.mark.parametrize("arguments, says", [
    (["fleet"], "python -m compare fleet: no file is named; a file, a folder, a pattern or @LIST is expected, "),
    (["fleet", "--only", "mass"], "no file is named"),
    (["fleet", "m", "--onyl", "mass"], "'--onyl' is no option; did you mean --only?"),
    (["fleet", "m", "--onyl=mass"], "'--onyl=mass' is no option; did you mean --only?"),
    (["fleet", "m", "--xyz"], f"'--xyz' is no option; one of {' '.join(FLEET_OPTIONS)} is expected"),
    (["fleet", "m", "--only", "mas,gravity"], "--only: 'mas' is no experiment; did you mean mass?"),
    (["fleet", "m", "--only", ","], "--only names no experiment"),
    (["fleet", "m", "--only", ""], "argument --only: it is empty"),
    (["fleet", "m", "--workers", "0"], "argument --workers: '0' is no number of processes; 1 or more are expected"),
    (["fleet", "m", "--workers", "two"], "argument --workers: 'two' is no number of processes"),
    (["fleet", "m", "--reference", "my.py:"], "'my.py:' is no reference of a fleet; arm or FILE.xml is expected"),
    (["fleet", "m", "--limit", "nan"], "argument --limit: 'nan' is no time; seconds above 0 are expected"),
    (["fleet", "m", "--limit", "-1"], "'-1' is no time"),
    (["fleet", "m", "--limit"], "argument --limit: expected one argument"),
    (["fleet", "m", "--dask", "tcp://x:1", "--workers", "2"], "--workers is for processes on this machine; a cluster"),
    (["fleet", ""], "it is empty; a name is expected"),
    (["--quick", "fleet", "m"], "fleet is the first word, before its options, as in python -m compare fleet models"),
    (["flet", "m"], "'flet' is no experiment; did you mean fleet?"),
])  # fmt: skip
def test_what_is_mistyped_gets_status_2_and_one_line(arguments, says, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    out, err = capsys.readouterr()
    assert (stop.value.code, out, len(err.splitlines())) == (2, "", 1) and says in err


@pytest.mark.parametrize("arguments, says", [
    (["nowhere"], "there is no nowhere; a file, a folder, a pattern or @LIST is expected"),
    (["@nowhere"], "cannot read the list nowhere: No such file or directory"),
    (["m", "--reference", "no.xml"], "--reference: cannot read no.xml: No such file or directory; an MJCF file is expected"),
    (["m", "--since", "nowhere"], "cannot read nowhere/fleet.csv: No such file or directory; the folder of an earlier fleet"),
    (["m", "--out", "m/part.xml"], "cannot write to m/part.xml: it is a file; a folder that can be written is expected"),
])  # fmt: skip
def test_what_cannot_be_carried_out_gets_status_2_and_one_line(arguments, says, folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert main(["fleet", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and err.startswith(f"python -m compare: {says}") and len(err.splitlines()) == 1
    assert not os.path.exists("reports")


@pytest.mark.parametrize("words, asked", [
    (["--workers", "3", "--limit", "7"], ("pool", 3, 7.0, True)),
    (["--limit", "0.5", "--workers", "1", "--full"], ("pool", 1, 0.5, False)),
    (["--dask", "tcp://x:1", "--limit", "9", "--full"], ("cluster", "tcp://x:1", 9.0, False)),
    (["--dask", "tcp://x:1"], ("cluster", "tcp://x:1", 600.0, True)),
])  # fmt: skip
def test_what_is_asked_for_is_what_is_run(words, asked, folder, monkeypatch, capsys):
    seen = []

    def door(kind):
        return lambda where, limit: seen.extend((kind, where, limit)) or SimpleNamespace(close=lambda: None)

    def run(models, given, *_):
        seen.append(given.is_quick)
        assert given.names == ("mass", "gravity")
        raise FleetError("seen")

    monkeypatch.chdir(folder)
    for name, made in (("pool.Pool", door("pool")), ("cluster.Cluster", door("cluster")), ("run.Run", run)):
        monkeypatch.setattr(f"compare.fleet.{name}", made)
    assert main(["fleet", "m", "--only", "gravity,mass", "--out", "asked", *words]) == 2
    assert tuple(seen) == asked and "seen" in capsys.readouterr().err


@pytest.mark.parametrize(
    "verdict, status",
    [("agree", 0), ("self-consistent", 0), ("refused", 0), ("unconfirmed", 1), ("broke", 1), ("differ", 1)],
)
def test_the_status_is_1_where_a_file_differs_or_broke_off(verdict, status, folder, monkeypatch, capsys):
    def carry_out(self, progress):
        for task in self.tasks:
            self.ended(task, verdict, "no reason")
        self.parts.append(("late.xml", "no model of its own"))

    monkeypatch.chdir(folder)
    monkeypatch.setattr("compare.fleet.run.Run.carry_out", carry_out)
    assert main(["fleet", "m/x", "--only", "mass", "--out", "status", "--workers", "1"]) == status
    assert "left out: late.xml, no model of its own\n" in capsys.readouterr().out


@pytest.mark.parametrize("count", [1, MOST_SAID, MOST_SAID + 1, MOST_SAID + 300])
def test_of_many_lines_of_a_kind_the_first_are_said(count, capsys):
    say_some(Terminal(), [f"line {k}" for k in range(count)])
    lines = capsys.readouterr().out.splitlines()
    assert lines[:MOST_SAID] == [f"line {k}" for k in range(min(count, MOST_SAID))]
    assert lines[MOST_SAID:] == [f"and {count - MOST_SAID} more, in index.html"] * (count > MOST_SAID)


def test_the_help_names_every_option(capsys):
    with pytest.raises(SystemExit) as stop:
        main(["fleet", "--help"])
    text = capsys.readouterr().out
    assert stop.value.code == 0 and all(f"  {name} " in text for name in FLEET_OPTIONS)
    assert max(map(len, text.splitlines())) <= 80 and "exit status" in text
