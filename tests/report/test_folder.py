"""A report takes the old one's place when it is complete, and nothing else is touched."""

import json
import signal
import subprocess
import sys
from inspect import getsource
from types import SimpleNamespace

import pytest
from matplotlib.figure import Figure
from runs import ENVIRONMENT, posix

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


def test_an_exchange_that_fails_puts_everything_back(tmp_path, monkeypatch):
    old_report(tmp_path)
    rename = type(tmp_path).rename

    def stubborn(source, target):
        if source.parent.name == "moving" and source.name == "tables":
            raise PermissionError(13, "Permission denied")
        return rename(source, target)

    with pytest.raises(Refused), new_report(tmp_path) as work:
        fill(work, "new")
        monkeypatch.setattr(type(tmp_path), "rename", stubborn)
    monkeypatch.undo()
    assert files(tmp_path) == OLD and names_in(tmp_path) == {"results.json", "tables"}


RUN = f"""
import json, os, sys
from compare.process import interrupt
from compare.core.errors import Refused
from compare.report.folder import new_report

{getsource(fill)}
out, number, at = sys.argv[1], int(sys.argv[2]), int(sys.argv[3])
renamed = 0


def hook(event, _):
    global renamed
    if event == "os.rename":
        if renamed == at:
            os.kill(os.getpid(), number)
        renamed += 1


interrupt.listen()
with new_report(out) as work:
    fill(work, "new")
    (work / "report.md").write_text("new")
    sys.addaudithook(hook)
print(renamed)
"""
NEW = {"tables/mass.csv": "new", "results.json": "new", "report.md": "new"}


def run(out, number=0, at=-1):
    command = [sys.executable, "-c", RUN, str(out), str(int(number)), str(at)]
    return subprocess.run(command, env=ENVIRONMENT, capture_output=True, text=True)


@posix
def test_after_kill_9_in_the_exchange_the_next_run_finds_the_old_report_whole(tmp_path):
    for at in range(20):
        out = tmp_path / str(at)
        old_report(out)
        if run(out, signal.SIGKILL, at).returncode == 0:  # after its last rename
            assert files(out) == NEW
            break
        with pytest.raises(RuntimeError), new_report(out):
            raise RuntimeError  # a run that does not end well: what changes is what the killed one has left
        assert files(out) == OLD and names_in(out) == {"results.json", "tables"}
        with new_report(out) as work:
            fill(work, "third")
        assert files(out) == {"tables/mass.csv": "third", "results.json": "third"}
    assert at == 7  # three moved in, two names of a folder changed, and what was moved away


def test_only_what_a_run_has_left_is_cleared(tmp_path):
    names = ".new-a1b2c3_d", ".new-a1b2c3_e/mine", ".new-ideas/report.md"
    left, *kept = (tmp_path / name for name in names)
    (left / "new" / "tables").mkdir(parents=True)
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


def test_a_full_disk_while_a_figure_is_drawn_is_said_with_the_name_of_the_file(tmp_path, monkeypatch):
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
    assert f"{tmp_path / 'out' / 'plot.png'}: File too large" in str(error.value)
    assert names_in(tmp_path) == set()
