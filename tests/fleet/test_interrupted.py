"""A fleet that is ended in the middle, in any way: a line, nothing left behind, and the same command goes on from there."""

import os
import signal
from pathlib import Path

import pytest
import runs
from processes import soon

from compare.fleet.kept import Kept

FILES = [str(runs.ROOT / "tests" / "models" / f"{name}.xml") for name in ("pendulum_ball", "free_body")]
WORDS = ("fleet", *FILES, "--only", "parameters", "--out", "out")
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


def goes_on(folder, known):
    """The same command, to its end: what was kept is not computed again."""
    run = runs.compare(*HERE, cwd=folder)
    assert (run.returncode, run.stderr) == (0, ""), run.stdout
    assert known and {path: when for path, when in kept(folder).items() if path in known} == known
    assert len(kept(folder)) == WHOLE > len(known) and nothing_left(folder)


def test_the_key_ctrl_c(folder):
    run = runs.on_terminal(HERE, 100, "xterm", folder, interrupt_at=b"self-consistent")
    lines = [line for line in runs.readable_lines(run) if line]
    assert run.status == 2 and "interrupted" in lines[-1] and nothing_left(folder)
    damaged, *whole = sorted(kept(folder))  # what is damaged is computed again with the rest
    damaged.write_bytes(damaged.read_bytes()[:-1])
    goes_on(folder, {path: kept(folder)[path] for path in whole})


@pytest.mark.slow
@pytest.mark.parametrize("number", [signal.SIGTERM, signal.SIGKILL])
def test_a_signal(folder, number):
    run = runs.started(*runs.command(*HERE), cwd=folder)
    assert soon(lambda: kept(folder))
    end = runs.ended(run, number)
    if number == signal.SIGTERM:
        assert end.status == 2 and len(end.lines) == 1 and "interrupted" in end.lines[0]
        assert nothing_left(folder)
    assert soon(lambda: not at_work(folder))  # a folder may be left of a worker that begins when its owner is killed
    Kept(folder / "out").close()  # nobody has its lock


@pytest.mark.slow
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
    assert run.returncode == 2 and len(errors.splitlines()) == 1 and made.address in errors, output
    goes_on(folder, kept(folder))
