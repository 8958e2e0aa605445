"""A report takes the old one's place when it is complete, and nothing else is touched."""

import json
import os
import signal
import subprocess
import sys
from inspect import getsource
from types import SimpleNamespace

import pytest
from helpers.runs import ENVIRONMENT, posix
from matplotlib.figure import Figure

from compare.core.errors import Refused
from compare.report.folder import new_report
from compare.robots.arm import ARM
from compare.run.drawing import draw

OLD = {"tables/mass.csv": "old", "results.json": "old"}


def fill(work, text):
    (work / "tables").mkdir()
    (work / "tables" / "mass.csv").write_text(text)
    listed = ["report.md", "results.json", "tables/mass.csv"]
    (work / "results.json").write_text(json.dumps({"provenance": {"files": listed}, "text": text}))


def files(folder):
    """What is in a folder; of results.json only the text of `fill`."""
    found = {p.relative_to(folder).as_posix(): p.read_text() for p in folder.rglob("*") if p.is_file()}
    return found | {"results.json": json.loads(found["results.json"])["text"]}


def old_report(out):
    with new_report(out) as work:
        fill(work, "old")


def names_in(folder):
    return {path.name for path in folder.iterdir()}


def test_a_new_report_replaces_the_old_one_and_keeps_other_files(tmp_path):
    out = tmp_path / "deep" / "report"
    with new_report(out) as work:
        fill(work, "old")
        (work / "report.md").write_text("only in the old one")
    (out / "my notes.txt").write_text("mine")
    with new_report(out) as work:
        fill(work, "new")
    assert files(out) == {"tables/mass.csv": "new", "results.json": "new", "my notes.txt": "mine"}
    assert names_in(out) == {"my notes.txt", "results.json", "tables"}


@pytest.mark.parametrize("at", range(4))  # two are moved away, two moved in
def test_an_exchange_that_fails_puts_everything_back(tmp_path, monkeypatch, at):
    old_report(tmp_path)
    replace, moved = os.replace, []

    def stubborn(source, target):
        if len(moved) == at:
            moved.append(None)
            raise PermissionError(13, "Permission denied")
        moved.append(source)
        return replace(source, target)

    with pytest.raises(Refused, match="the earlier report is unchanged"), new_report(tmp_path) as work:
        fill(work, "new")
        monkeypatch.setattr(os, "replace", stubborn)
    monkeypatch.undo()
    assert files(tmp_path) == OLD and names_in(tmp_path) == {"results.json", "tables"}


def test_without_an_earlier_report_none_is_said_to_be_there(tmp_path):
    with pytest.raises(Refused) as error, new_report(tmp_path / "out") as work:
        raise OSError(28, "No space left", str(work / "report.md"))
    assert str(error.value) == f"cannot write to {tmp_path / 'out'}: No space left"
    assert names_in(tmp_path) == set()


RUN = f"""
import json, os, signal, sys
from compare.report.folder import new_report

{getsource(fill)}
with new_report(sys.argv[1]) as work:
    fill(work, "new")
    os.kill(os.getpid(), signal.SIGKILL)
"""


@posix
def test_after_kill_9_the_old_report_is_whole_and_the_next_run_clears_up(tmp_path):
    old_report(tmp_path)
    run = subprocess.run([sys.executable, "-c", RUN, str(tmp_path)], env=ENVIRONMENT)
    assert run.returncode == -signal.SIGKILL and len(names_in(tmp_path)) == 3
    with pytest.raises(RuntimeError), new_report(tmp_path) as other:
        with new_report(tmp_path) as work:  # of a run at the same time, which clears nothing of this one
            fill(work, "new")
        assert other.is_dir()
        raise RuntimeError
    assert files(tmp_path) == OLD | {"tables/mass.csv": "new", "results.json": "new"}
    assert names_in(tmp_path) == {"results.json", "tables"}


def test_only_what_a_run_has_left_is_cleared(tmp_path):
    names = ".new-a1b2c3_d", ".new-a1b2c3_e/mine", ".new-ideas/report.md"
    left, *kept = (tmp_path / name for name in names)
    (left / "tables").mkdir(parents=True)
    for path in kept:
        path.mkdir(parents=True)
    old_report(tmp_path)
    assert not left.exists() and all(path.exists() for path in kept)


@pytest.mark.parametrize("name", ["tables/precious.csv", "results.json"])
def test_files_of_somebody_elses_are_not_replaced(tmp_path, name):
    old_report(tmp_path)
    (tmp_path / name).write_text("[]")
    with pytest.raises(Refused, match=r"precious\.csv|results\.json|mass\.csv"), new_report(tmp_path):
        pass
    assert (tmp_path / name).read_text() == "[]"


@pytest.mark.parametrize("name, word", [
    ("file", "it is a file"), ("file/below", "is a file"), ("link/below", "nowhere"),
])  # fmt: skip
def test_what_stands_in_a_folders_place_is_named_and_stays(tmp_path, name, word):
    (tmp_path / "file").write_text("")
    (tmp_path / "link").symlink_to("nowhere")
    with pytest.raises(Refused) as error, new_report(tmp_path / name):
        pass
    assert str(tmp_path / name) in str(error.value) and word in str(error.value)
    assert names_in(tmp_path) == {"file", "link"}


def test_a_full_disk_while_a_figure_is_drawn_is_said(tmp_path, monkeypatch):
    module = SimpleNamespace(rows=None, figures=lambda result, robot: iter([lambda: ("plot", Figure(), "")]))
    monkeypatch.setitem(sys.modules, "compare.experiments.plain", module)
    resource = pytest.importorskip("resource")
    before = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (1000, before[1]))  # bytes of a file, as on a disk that is full
    try:
        with pytest.raises(Refused) as error, new_report(tmp_path / "out") as work:
            draw("plain", None, ARM, work, {})
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, before)
    assert f"cannot write to {tmp_path / 'out'}: File too large" in str(error.value)
    assert names_in(tmp_path) == set()
