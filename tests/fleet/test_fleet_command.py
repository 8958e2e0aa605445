"""The command of a fleet, as a user gives it."""

import csv
import json
import re
import shutil
from types import SimpleNamespace

import pytest
from inside import PENDULUM
from runs import ROOT, compare, on_terminal, readable_lines, words

from compare.__main__ import main
from compare.fleet.command import FLEET_OPTIONS
from compare.fleet.piece import FleetError
from compare.fleet.row import FLEET_COLUMNS

NAME = "a b#ü.xml"  # of a file that agrees


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A folder with four files, of which one agrees, one differs, one is refused and one is a part."""
    folder = tmp_path_factory.mktemp("fleet")
    (folder / "m" / "x").mkdir(parents=True)
    shutil.copy(ROOT / "tests" / "models" / "pendulum_ball.xml", folder / "m" / "x" / NAME)
    text = (ROOT / "mjcf" / "arm.xml").read_text(encoding="utf-8").replace('mass="1.9"', 'mass="9"', 1)
    (folder / "m" / "heavy.xml").write_text(text, encoding="utf-8")
    (folder / "m" / "broken.xml").write_text("<mujoco><worldbody>")
    (folder / "m" / "part.xml").write_text("<mujocoinclude/>")
    return folder


@pytest.fixture(scope="module")
def first(folder):
    """The fleet of all of them."""
    run = compare("fleet", "m/**", "--only", "mass", "--out", "out", "--workers", "1", cwd=folder)
    return SimpleNamespace(run=run, rows=rows_of(folder / "out"), out=folder / "out")


def rows_of(out):
    with (out / "fleet.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def test_a_fleet_says_which_file_differs_and_why(first):
    assert (first.run.returncode, first.run.stderr) == (1, "")
    lines = first.run.stdout.splitlines()
    said = {line.split()[0]: line for line in lines if line.split()[:1] and ".xml:" in line}
    assert "m/part.xml" in lines[0] and "out/index.html (" in lines[-1]
    assert f"m/x/{NAME}: " in said["self-consistent"] and " %" in said["self-consistent"]
    assert "m/heavy.xml: mass of upper arm: stated 1.9 kg, compiled 9 kg" in said["differ"]
    assert "m/broken.xml: " in said["refused"]
    assert sum(int(part) for part in re.findall(r"(\d+) %", lines[-2])) == 100  # where the time of the workers went
    assert "\x1b" not in first.run.stdout and "\r" not in first.run.stdout  # nothing moves in a pipe


def test_the_table_has_what_needs_a_look_first_in_tidy_columns(first):
    assert [row["verdict"] for row in first.rows] == ["differ", "refused", "self-consistent"]
    assert all(tuple(row) == FLEET_COLUMNS for row in first.rows)
    differs, refused, agrees = first.rows
    assert float(differs["worst_ratio"]) > 1.0 > float(agrees["worst_ratio"]) > 0.0
    assert (agrees["joints"], agrees["file_integrator"], agrees["file_dt_s"]) == ("2", "RK4", "0.002")
    assert [agrees[name] for name in ("stable_at_file_dt", "limit_s")] == ["", ""] and "alpha" in agrees["reason"]
    assert all(refused[name] == "" for name in ("joints", "worst_ratio", "file_integrator", "file_dt_s", "limit_s"))
    assert all(len(row["sha256"]) == 64 and float(row["seconds"]) >= 0.0 for row in first.rows)


@pytest.mark.slow
def test_a_file_has_the_report_that_it_has_alone(first, folder):
    assert compare("mass", "--quick", "--mjcf", f"m/x/{NAME}", "--out", "alone", cwd=folder).returncode == 0
    one, many = folder / "alone", first.out / "files" / "m" / "x" / NAME
    alone, of_fleet = (json.loads((place / "results.json").read_text()) for place in (one, many))
    assert all(alone[name] == of_fleet[name] for name in ("checks", "causes", "reference", "passed"))
    assert (one / "tables" / "mass.csv").read_bytes() == (many / "tables" / "mass.csv").read_bytes()
    assert {path.name for path in one.iterdir()} <= {path.name for path in many.iterdir()}
    assert alone["provenance"]["model"] == of_fleet["provenance"]["model"] == f"m/x/{NAME}"
    assert of_fleet["provenance"]["command"] == f"python -m compare fleet 'm/x/{NAME}' --only mass"


@pytest.mark.slow
def test_the_same_command_goes_on_and_says_what_has_changed(first, folder):
    shutil.copytree(first.out, folder / "n" / "later")
    shutil.copytree(folder / "m", folder / "n" / "m")
    command = ("fleet", "m", "--only", "mass", "--out", "later", "--since", "later")
    again = compare(*command, cwd=folder / "n")
    assert again.returncode == 1 and "2 files" in again.stdout and rows_of(folder / "n" / "later") == first.rows
    (folder / "n" / "m" / "heavy.xml").unlink()
    (folder / "n" / "m" / "broken.xml").write_text(PENDULUM.format(0.1))
    changed = compare(*command, cwd=folder / "n")
    lines = [line for line in changed.stdout.splitlines() if line.startswith("changed: ")]
    assert changed.returncode == 0 and ["m/broken.xml" in line for line in lines] == [True, False]
    assert "refused" in lines[0] and "self-consistent" in lines[0] and "m/heavy.xml" in lines[1]


@pytest.mark.slow
@pytest.mark.parametrize("columns, term", [(30, "xterm"), (100, "dumb")])
def test_a_terminal_shows_how_far_it_is_and_then_what_has_come_out(columns, term, first, tmp_path):
    (tmp_path / "a.xml").write_text(PENDULUM.format(0.1))
    run = on_terminal(["fleet", "a.xml", "--only", "mass", "--out", "out", "--workers", "1"], columns, term, tmp_path)
    shown = words(readable_lines(run))
    assert run.status == 0 and "self-consistent" in shown and "pieces" not in shown
    assert ("of 1 files, " in run.output) == (term != "dumb")


@pytest.mark.parametrize("arguments, word", [
    (["fleet"], "fleet models"), (["fleet", "--only", "mass"], "no file"), (["fleet", ""], "empty"),
    (["fleet", "m", "--onyl=mass"], "did you mean --only?"), (["fleet", "m", "--xyz"], " ".join(FLEET_OPTIONS)),
    (["fleet", "m", "--only", "mas,gravity"], "did you mean mass?"), (["fleet", "m", "--only", ","], "--only"),
    (["fleet", "m", "--workers", "0"], "--workers: '0'"), (["fleet", "m", "--workers", "two"], "--workers: 'two'"),
    (["fleet", "m", "--reference", "my.py:"], "FILE.xml"), (["fleet", "m", "--limit", "nan"], "--limit: 'nan'"),
    (["fleet", "m", "--limit", "-1"], "'-1'"), (["fleet", "m", "--limit"], "--limit"),
    (["fleet", "m", "--dask", "tcp://x:1", "--workers", "2"], "--workers"),
    (["--quick", "fleet", "m"], "fleet is the first word"), (["flet", "m"], "did you mean fleet?"),
])  # fmt: skip
def test_what_is_mistyped_gets_status_2_and_one_line(arguments, word, capsys):
    with pytest.raises(SystemExit) as stop:
        main(arguments)
    out, err = capsys.readouterr()
    assert (stop.value.code, out, len(err.splitlines())) == (2, "", 1) and word in err


@pytest.mark.parametrize("arguments, word", [
    (["nowhere"], "nowhere"), (["@nowhere"], "list nowhere"), (["m", "--reference", "no.xml"], "no.xml"),
    (["m", "--since", "nowhere"], "nowhere/fleet.csv"), (["m", "--out", "m/part.xml"], "m/part.xml"),
])  # fmt: skip
def test_what_cannot_be_carried_out_gets_status_2_and_one_line(arguments, word, folder, capsys, monkeypatch):
    monkeypatch.chdir(folder)
    assert main(["fleet", *arguments]) == 2
    out, err = capsys.readouterr()
    assert out == "" and word in err and len(err.splitlines()) == 1 and not (folder / "reports").exists()


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


@pytest.mark.parametrize("verdict, status", [
    ("agree", 0), ("self-consistent", 0), ("refused", 0), ("unconfirmed", 1), ("broke", 1), ("differ", 1),
])  # fmt: skip
def test_the_status_is_1_where_a_file_differs_or_broke_off(verdict, status, folder, monkeypatch, capsys):
    def carry_out(self, progress):
        for task in self.tasks:
            self.ended(task, verdict, "no reason")
        self.parts.append(("late.xml", "why"))

    monkeypatch.chdir(folder)
    monkeypatch.setattr("compare.fleet.run.Run.carry_out", carry_out)
    assert main(["fleet", "m/x", "--only", "mass", "--out", "status", "--workers", "1"]) == status
    assert "late.xml, why\n" in capsys.readouterr().out
