"""The edits, one after another in copies of the project, each with the tests that may notice it."""

import difflib
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from importlib.util import cache_from_source
from itertools import pairwise
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from typing import NamedTuple

import psutil

from tmt.compiled.store import cache_folder

from .edit import Edit, Place

NOT_COPIED = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "build", "latest")
BLIND = ("test_mutations.py", "test_structure.py", "test_interrupt.py")  # they see any edit, or no edit of a judge
SLICES = (0, 4, 16, 1000)  # the files of tests run in parts, the nearest first: most edits are caught by the first
PATIENCE = 90.0, 20.0  # s that a part may take, and for each of its files: then an edit counts as an endless run


class Tried(NamedTuple):
    """What became of an edit."""

    edit: Edit
    caught: str  # by which test, or how; empty: it survived
    seconds: float
    diff: str


class Copy(NamedTuple):
    """A copy of the project with a store of machine code, both in a folder of their own."""

    project: Path
    store: Path

    @classmethod
    def of(cls, project: Path, folder: Path) -> "Copy":
        copy = cls(folder / "project", folder / "store")
        shutil.copytree(project, copy.project, ignore=NOT_COPIED)
        copy.store.mkdir(mode=0o700)
        with suppress(OSError):  # without what is compiled the first tests take longer
            shutil.copytree(cache_folder(), copy.store, dirs_exist_ok=True)
        return copy

    def failed(self, tests: list[str]) -> str:
        """The first of these tests (files or names) that fails, empty if none does."""
        scratch = self.project.parent / "scratch"
        scratch.mkdir(exist_ok=True)
        own = {"PYTHONPATH": self.project, "TMT_CACHE": self.store, "TMPDIR": scratch, "COLUMNS": "200"}
        own["PYTHONDONTWRITEBYTECODE"] = ""  # or each run would compile all sources again
        command = [sys.executable, "-m", "pytest", "-n", "0", "-x", "-q", "-rfE", *tests]
        limit = PATIENCE[0] + PATIENCE[1] * len(tests)
        with (self.project.parent / "output").open("w+", errors="replace") as output:
            streams = {"stdin": subprocess.DEVNULL, "stdout": output, "stderr": output}
            process = subprocess.Popen(
                command, cwd=self.project, env=os.environ | own, start_new_session=True, **streams
            )
            try:
                process.wait(limit)
            except subprocess.TimeoutExpired:
                return f"no end after {limit:.0f} s"
            finally:
                end_children(process.pid)
                with suppress(ProcessLookupError, PermissionError):
                    os.killpg(process.pid, signal.SIGKILL)
                process.wait()
            output.seek(0)
            lines = output.read().splitlines()[-30:]
        named = [found[1] for line in lines if (found := re.match(r"(?:FAILED|ERROR) (.*?)(?: - .*)?$", line))]
        otherwise = [f"status {process.returncode}: {(lines or ['no output'])[-1]}"] * bool(process.returncode)
        return [*named, *otherwise, ""][0]

    def caught(self, name: Path, text: str, files: list[str]) -> str:
        """Which test notices a changed text of a file. files: of tests, the likeliest first."""
        file, edited = self.project / name, self._replace(store=self.store.with_name("store of an edit"))
        before = file.read_text(encoding="utf-8")
        # machine code of an edited source must not reach the next edit
        shutil.copytree(self.store, edited.store, copy_function=os.link)
        try:
            file.write_text(text, encoding="utf-8")
            # byte code of a source of the same size would pass for the new one
            Path(cache_from_source(file)).unlink(missing_ok=True)
            parts = [files[start:end] for start, end in pairwise(SLICES) if files[start:end]]
            return next((caught for part in parts if (caught := edited.failed(part))), "")
        finally:
            file.write_text(before, encoding="utf-8")
            Path(cache_from_source(file)).unlink(missing_ok=True)
            shutil.rmtree(edited.store, ignore_errors=True)


def tried_edits(project: Path, places: dict[Edit, Place], jobs: int) -> Iterator[Tried]:
    """Each edit with its outcome, as they end."""
    with TemporaryDirectory(prefix="edits-") as folder:
        copies = SimpleQueue()
        for k in range(jobs):
            copies.put(Copy.of(project, Path(folder, str(k))))

        def tried(edit, changed):
            name, copy = changed.path.relative_to(project), copies.get()
            started = time.perf_counter()
            caught = copy.caught(name, changed.after, nearest(project, edit, name))
            copies.put(copy)
            texts = (text.splitlines() for text in (changed.before, changed.after))
            diff = difflib.unified_diff(*texts, f"a/{name}", f"b/{name}", n=1, lineterm="")
            return Tried(edit, caught, time.perf_counter() - started, "\n".join(diff))

        with ThreadPoolExecutor(jobs) as pool:
            under_way = [pool.submit(tried, *place) for place in places.items()]
            try:
                for done in as_completed(under_way):
                    yield done.result()
            finally:
                pool.shutdown(wait=False, cancel_futures=True)
                while not all(one.done() for one in under_way):  # interrupted
                    end_children(os.getpid())
                    time.sleep(0.05)


def fail_without_an_edit(project: Path, tests: list[str]) -> str:
    """The first of these tests that fails in a copy of the project as it is, empty if none does."""
    with TemporaryDirectory(prefix="edits-") as folder:
        return Copy.of(project, Path(folder, "0")).failed(tests) if tests else ""


def end_children(pid: int) -> None:
    """Kill what a process has started, in whatever group; the process too, unless it is this one."""
    with suppress(psutil.NoSuchProcess):
        parent = psutil.Process(pid)
        for one in [*parent.children(recursive=True), *[parent] * (pid != os.getpid())]:
            with suppress(psutil.NoSuchProcess):
                one.kill()


def nearest(project: Path, edit: Edit, name: Path) -> list[str]:
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

    files = [path for path in sorted(project.joinpath("tests").rglob("test_*.py")) if path.name not in BLIND]
    return [str(file.relative_to(project)) for file in sorted(files, key=named, reverse=True)]
