"""The tests, run on copies of the project with one edit each."""

import difflib
import os
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from importlib.util import cache_from_source
from pathlib import Path
from typing import NamedTuple

from tmt.cache import cache_folder

from .edit import Edit, Place

ASIDE = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "venv", "build", "latest")  # not part of a copy
PATIENCE = 60.0, 3.0  # seconds and times the time of the unedited copy: then a run counts as endless


class Stage(NamedTuple):
    """Tests that run together."""

    files: list[str]
    options: tuple = ()


class Tried(NamedTuple):
    """What became of an edit."""

    edit: Edit
    caught: str  # by which test, or how; empty: it survived
    seconds: float
    diff: str


class Stopped(Exception):
    """The campaign is over before this run."""


class CannotStart(Exception):
    """The unedited copy does not pass."""


class Campaign:
    """Copies of a project in one temporary folder, and the runs in them; a context, which leaves nothing.

    stages: files of tests and further arguments for pytest; an edit that survives one stage meets the next.
    """

    def __init__(self, project: Path, stages: list[Stage], jobs: int):
        self.project, self.stages, self.jobs = project, stages, jobs
        self.running, self.lock, self.stopped = set(), threading.Lock(), False
        self.allowed = [PATIENCE[0] * 20] * len(stages)

    def __enter__(self):
        self.folder = Path(tempfile.mkdtemp(prefix="mutations-"))
        self.free = []
        return self

    def __exit__(self, *_):
        self.stop()
        shutil.rmtree(self.folder, ignore_errors=True)

    def stop(self):
        """End every run at once."""
        with self.lock:
            self.stopped = True
            for process in self.running:
                end(process.pid)

    def tried(self, places: dict[Edit, Place]):
        """Each edit with its outcome, as they end; first the unedited copy must pass."""
        self.copies()
        with ThreadPoolExecutor(self.jobs) as pool:
            try:
                for stage, seconds, failed in pool.map(self.unedited, range(len(self.stages))):
                    self.allowed[stage] = PATIENCE[0] + PATIENCE[1] * seconds
                    if failed:
                        raise CannotStart(failed)
                for done in as_completed([pool.submit(self.one, *pair) for pair in places.items()]):
                    yield done.result()
            except BaseException:
                self.stop()
                pool.shutdown(cancel_futures=True)
                raise

    def copies(self):
        """One copy for each run side by side."""
        for k in range(self.jobs):
            shutil.copytree(self.project, self.folder / str(k) / "project", ignore=ASIDE, dirs_exist_ok=True)
            (self.folder / str(k) / "scratch").mkdir()
            self.free.append(self.folder / str(k))
        with suppress(OSError):  # what the user has compiled already; without it the first run takes a minute longer
            shutil.copytree(cache_folder(), self.folder / "cache")
        (self.folder / "cache").mkdir(mode=0o700, exist_ok=True)

    def unedited(self, stage) -> tuple[int, float, str]:
        """Stage, seconds, what failed in the copy as it is. Compiled code that it leaves is what the edits start from."""
        copy, started = self.free.pop(), time.perf_counter()
        try:
            failed, output = self.run(copy, self.folder / "cache", stage, self.stages[stage].files)
            return stage, time.perf_counter() - started, failed and f"{failed}\n{output}"
        finally:
            self.free.append(copy)

    def one(self, edit, place) -> Tried:
        """The edit in a copy, stage by stage until a test fails."""
        if self.stopped:
            raise Stopped
        copy, started, caught = self.free.pop(), time.perf_counter(), ""
        name = place.path.relative_to(self.project)
        file = copy / "project" / name
        cache = copy / "cache"
        # machine code of an edited source must not reach the next edit
        shutil.copytree(self.folder / "cache", cache, copy_function=os.link)
        try:
            write(file, place.after)
            for stage in range(len(self.stages)):
                caught = caught or self.run(copy, cache, stage, self.nearest(stage, edit))[0]
        finally:
            write(file, place.before)
            shutil.rmtree(cache, ignore_errors=True)
            self.free.append(copy)
        return Tried(edit, caught, time.perf_counter() - started, difference(name, place))

    def nearest(self, stage, edit) -> list[str]:
        """The files of a stage, those first that name what is edited: most edits are caught by one of these."""
        words = {*edit.module.split("."), *edit.where.split(".")}

        def named(file):
            text = (self.project / file).read_text(encoding="utf-8")
            return sum(word in text for word in words) + (edit.module in Path(file).stem)

        return sorted(self.stages[stage].files, key=named, reverse=True)

    def run(self, copy, cache, stage, files) -> tuple[str, str]:
        """What failed first, empty if nothing did, and the end of the output."""
        command = [sys.executable, "-m", "pytest", "-x", "-q", "-rfE", f"--basetemp={copy / 'tests'}"]
        command += [*self.stages[stage].options, *files]
        project = copy / "project"
        environment = os.environ | {"TMT_CACHE": str(cache), "TMPDIR": str(copy / "scratch"), "COLUMNS": "200"}
        environment["PYTHONPATH"] = os.pathsep.join(filter(None, [str(project), os.environ.get("PYTHONPATH")]))
        environment.pop("PYTEST_ADDOPTS", None)
        with self.lock:
            if self.stopped:
                raise Stopped
            process = subprocess.Popen(
                command, cwd=project, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
            )  # fmt: skip
            self.running.add(process)
        try:
            output, _ = process.communicate(timeout=self.allowed[stage])
        except subprocess.TimeoutExpired:
            return f"no end after {self.allowed[stage]:.0f} s", ""
        finally:
            end(process.pid)  # what a failed test has left, too
            process.communicate()
            with self.lock:
                self.running.discard(process)
        if self.stopped:
            raise Stopped
        return failure(process.returncode, output), "\n".join(output.splitlines()[-30:])


def failure(status, output) -> str:
    """The test that failed first in a run of pytest, or what else ended it; empty if all pass."""
    if status == 0:
        return ""
    named = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", output, re.MULTILINE)
    last = (output.strip().splitlines() or ["no output"])[-1]
    return named[1] if named else f"status {status}: {last}"


def write(file, text):
    """Write a source, and forget its byte code: of the same size within a second it would pass for the new one."""
    file.write_text(text, encoding="utf-8")
    Path(cache_from_source(file)).unlink(missing_ok=True)


def difference(name, place) -> str:
    """An edit as a diff."""
    texts = (text.splitlines() for text in (place.before, place.after))
    return "\n".join(difflib.unified_diff(*texts, f"a/{name}", f"b/{name}", n=1, lineterm=""))


def end(pid):
    """End a process, its group, and its descendants in other groups."""
    for number in descendants(pid):
        ended(os.kill, number)
    ended(os.killpg, pid)


def ended(kill, pid):
    with suppress(ProcessLookupError, PermissionError):
        kill(pid, signal.SIGKILL)


def descendants(pid) -> list[int]:
    """Children, their children, ...; none where there is no /proc."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError):  # it has ended meanwhile
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
    found = [pid]
    for parent in found:
        found += [child for child, of in parents.items() if of == parent]
    return found[1:]
