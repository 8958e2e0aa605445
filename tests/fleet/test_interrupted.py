"""A fleet that is ended in the middle, in any way: a line, nothing left behind, and the same command goes on from there."""

import os
import signal
from pathlib import Path

import pytest
import runs
from processes import soon

from compare.fleet.kept import INTERRUPTED, Kept

FILES = [str(runs.ROOT / "tests" / "models" / f"{name}.xml") for name in ("pendulum_ball", "free_body")]
WORDS = ("fleet", *FILES, "--only", "mass", "--out", "out")
HERE = (*WORDS, "--workers", "1")  # one file after the other

WHOLE = 6  # of each file: what was read, an experiment, the report


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """Where a fleet is run; its temporary files are in a folder of their own."""
    (tmp_path / "temporary").mkdir()
    monkeypatch.setitem(runs.ENVIRONMENT, "TMPDIR", str(tmp_path / "temporary"))
    return tmp_path


def kept(folder):
    """What is kept, with the times at which it was written."""
    return {path: path.stat().st_mtime_ns for path in (folder / "out" / "kept").glob("*/[!.]*")}


def at_work(folder):
    """Processes in a folder of the temporary files."""
    found = []
    for cwd in Path("/proc").glob("[0-9]*/cwd"):
        try:
            found += [cwd] if str(folder / "temporary") in os.readlink(cwd) else []
        except OSError:  # it has ended meanwhile
            continue
    return found


def nothing_left(folder):
    return soon(lambda: not at_work(folder) and not list((folder / "temporary").iterdir()))


def goes_on(folder):
    """The same command, to its end: what was kept is not computed again."""
    before = kept(folder)
    run = runs.compare(*HERE, cwd=folder)
    assert (run.returncode, run.stderr) == (0, ""), run.stdout
    assert before and {path: when for path, when in kept(folder).items() if path in before} == before
    assert len(kept(folder)) == WHOLE > len(before)
    assert nothing_left(folder)


def test_the_key_ctrl_c(folder):
    run = runs.on_terminal(HERE, 100, "xterm", folder, interrupt_at=b"self-consistent")
    assert run.status == 2 and run.seconds < runs.SECOND
    lines = runs.readable_lines(run)
    assert [line for line in lines if line][-1].split() == INTERRUPTED.split()
    assert nothing_left(folder)
    # what is damaged is computed again with the rest
    damaged = sorted(kept(folder))[0]
    damaged.write_bytes(damaged.read_bytes()[:-1])
    os.utime(damaged, ns=(0, 0))
    whole = {path: when for path, when in kept(folder).items() if path != damaged}
    run = runs.compare(*HERE, cwd=folder)
    assert (run.returncode, run.stderr) == (0, "")
    assert {path: when for path, when in kept(folder).items() if path in whole} == whole
    assert len(kept(folder)) == WHOLE


def test_another_fleet_in_its_folder_and_a_signal(folder):
    run = runs.started(*runs.command(*HERE), cwd=folder)
    assert soon(lambda: (folder / "out" / "kept").exists())
    second = runs.compare(*HERE, cwd=folder)
    assert second.returncode == 2 and run.poll() is None
    expected = "another fleet is writing to out; another folder (--out) is expected, or wait until it has ended"
    assert second.stderr == f"python -m compare: {expected}\n"
    assert soon(lambda: len(kept(folder)) >= 2)
    end = runs.ended(run, signal.SIGTERM)
    assert (end.status, end.lines) == (2, [INTERRUPTED]) and end.seconds < runs.SECOND
    assert nothing_left(folder)


def test_a_fleet_that_is_killed(folder):
    run = runs.started(*runs.command(*HERE), cwd=folder)
    assert soon(lambda: len(kept(folder)) >= 2)
    assert runs.ended(run, signal.SIGKILL).lines == []
    assert nothing_left(folder)
    Kept(folder / "out").close()  # nobody has its lock


def test_a_scheduler_that_is_killed(folder):
    pytest.importorskip("distributed")
    from dask_cluster import machines

    with machines(folder) as made:
        for _ in range(2):
            made.worker()
        run = runs.started(*runs.command(*WORDS, "--dask", made.address), cwd=folder)
        assert soon(lambda: len(kept(folder)) >= 2)
        made.kill(made.scheduler)
        output, errors = run.communicate(timeout=60)
    gone = f"the scheduler {made.address} is gone; what is done is kept, and the same command goes on from there"
    assert (run.returncode, errors) == (2, f"python -m compare: {gone}\n"), output
    goes_on(folder)
