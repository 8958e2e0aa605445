"""python -m tests.mutations: make the program wrong in some 570 ways, and list those that no test notices.

Each edit is made in a copy of the project, and meets the tests of the default stage, those first that name what is edited.
"""

import argparse
import os
import re
import shutil
import signal
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor
from contextlib import suppress
from functools import partial
from importlib.util import cache_from_source
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from .edit import DoesNotApply, Edit, Place, applied
from .edits import EDITS

PROJECT = Path(__file__).resolve().parents[2]
NOT_COPIED = shutil.ignore_patterns(
    ".git", ".venv*", "*_cache", "__pycache__", "*.egg-info", "build", "latest"
)
BLIND = ("test_mutations.py", "test_structure.py", "test_interrupt.py")  # they see any edit, or none
SLICES = 0, 4, 16, 1000  # parts of the list of test files: most edits are caught by the first
PATIENCE, PATIENCE_WITH_FILE = 90.0, 20.0  # s of a part, and for each of its files: then a run has no end
STATUS = (
    "exit status: 0 no edit survives; 1 some do; 2 an edit does not apply, or a test fails without it too"
)


def main(arguments: list[str] | None = None) -> int:
    """Run the command line; the exit status."""
    parser = argparse.ArgumentParser("python -m tests.mutations", description=__doc__, epilog=STATUS)
    parser.add_argument("words", nargs="*", metavar="WORD", help="only edits with one of these in their name")
    parser.add_argument("--list", action="store_true", help="list the edits, run nothing")
    parser.add_argument("--jobs", type=int, default=2, metavar="N", help="runs side by side (%(default)s)")
    options = parser.parse_args(arguments)
    chosen = [edit for edit in EDITS if not options.words or any(word in edit.name for word in options.words)]
    try:
        places = [applied(PROJECT, edit) for edit in chosen]
    except DoesNotApply as error:
        print(f"does not apply: {error}")
        return 2
    if options.list:
        print("\n".join(edit.name for edit in chosen))
        return 0
    signal.signal(signal.SIGTERM, signal.default_int_handler)
    caught_by = set()
    with TemporaryDirectory(prefix="edits-") as folder, ThreadPoolExecutor(options.jobs) as pool:
        idle = [Path(folder, str(number)) for number in range(options.jobs)]
        for copy in idle:
            shutil.copytree(PROJECT, copy, ignore=NOT_COPIED)
        for edit, caught in zip(chosen, pool.map(partial(tried, idle), chosen, places)):
            print(f"{edit.name}: {f'caught by {caught}' if caught else 'SURVIVED'}", flush=True)
            caught_by.add(caught.split("[")[0])
        print(f"{len(chosen)} edits{', some survived' if '' in caught_by else ''}")
        again = sorted(test for test in caught_by if test.startswith("tests"))
        if again and (failed := first_failed(idle[0], again)):
            print(f"fails without an edit: {failed}")
            return 2
    return int("" in caught_by)


def tried(idle: list[Path], edit: Edit, place: Place) -> str:
    """Which test catches an edit, in one of the copies that are idle; empty if it survives."""
    copy, name = idle.pop(), place.path.relative_to(PROJECT)
    files = nearest(edit, name)
    write(copy / name, place.after)
    parts = [files[start:end] for start, end in pairwise(SLICES) if files[start:end]]
    caught = next(filter(None, (first_failed(copy, part) for part in parts)), "")
    write(copy / name, place.before)
    idle.append(copy)
    return caught


def write(file: Path, text: str) -> None:
    """Write a source; byte code of another one of the same size would pass for its own."""
    file.write_text(text, encoding="utf-8")
    Path(cache_from_source(file)).unlink(missing_ok=True)


def first_failed(copy: Path, tests: list[str]) -> str:
    """The first of these tests (files or names) that fails in a copy of the project, empty if none does."""
    command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "-rfE", *tests]
    own = {"PYTHONPATH": copy, "TMT_CACHE": copy.parent / "store", "TMPDIR": copy.parent, "COLUMNS": "200"}
    own["PYTHONDONTWRITEBYTECODE"] = ""  # else each run compiles all sources
    limit, log = PATIENCE + PATIENCE_WITH_FILE * len(tests), copy.with_suffix(".log")
    with log.open("w") as output:
        streams = {"stdin": subprocess.DEVNULL, "stdout": output, "stderr": output}
        process = subprocess.Popen(command, cwd=copy, env=os.environ | own, start_new_session=True, **streams)
        try:
            process.wait(limit)
        except subprocess.TimeoutExpired:
            return f"no end after {limit:.0f} s"
        finally:
            end_children(process.pid)
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()
    lines = log.read_text(errors="replace").splitlines()[-30:]
    named = [found[1] for line in lines if (found := re.match(r"(?:FAILED|ERROR) (.*?)(?: - .*)?$", line))]
    if named or not process.returncode:
        return named[0] if named else ""
    return f"status {process.returncode}: {lines[-1] if lines else 'no output'}"


def end_children(pid: int) -> None:
    """Kill what a process has started, in whatever group."""
    with suppress(psutil.NoSuchProcess):
        for child in psutil.Process(pid).children(recursive=True):
            with suppress(psutil.NoSuchProcess):
                child.kill()


def nearest(edit: Edit, name: Path) -> list[str]:
    """The files of tests, those first that import the edited file, or are named like it, or name what is edited."""
    parts = edit.module.split(".")
    words = {*parts, *edit.where.split(".")}
    *_, folder, stem = (part for part in name.with_suffix("").parts if part != "__init__")
    imported = re.compile(rf"\b{folder}( import [\w\s,(]*|\.)\b{stem}\b")

    def named(file):
        text = file.read_text(encoding="utf-8")
        in_name = sum(part in str(file) for part in parts)
        score = sum(word in text for word in words) + 2 * in_name + 4 * bool(imported.search(text))
        return score, -len(text)  # of two, the smaller file

    files = [path for path in sorted(PROJECT.joinpath("tests").rglob("test_*.py")) if path.name not in BLIND]
    return [str(file.relative_to(PROJECT)) for file in sorted(files, key=named, reverse=True)]


if __name__ == "__main__":
    try:
        sys.exit(main())
    except KeyboardInterrupt:
        sys.exit("interrupted")
