"""The edits, one after another in copies of the project, each with the tests that may notice it."""

import difflib
import os
import shutil
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor, as_completed
from contextlib import suppress
from importlib.util import cache_from_source
from pathlib import Path
from queue import SimpleQueue
from tempfile import TemporaryDirectory
from typing import NamedTuple

from tmt.compiled.store import cache_folder

from .edit import Edit, Place
from .trial import Runs, Stage

ASIDE = shutil.ignore_patterns(".*", "__pycache__", "*.egg-info", "venv", "build", "latest")  # not part of a copy
PATIENCE = 60.0, 3.0  # seconds and times the time of the unedited copy: then a run counts as endless
UNEDITED = 1200.0  # s that the unedited copy may take in a stage


class Tried(NamedTuple):
    """What became of an edit."""

    edit: Edit
    caught: str  # by which test, or how; empty: it survived
    seconds: float
    diff: str


class CannotStart(Exception):
    """The unedited copy does not pass."""


def tried_edits(project: Path, stages: list[Stage], places: dict[Edit, Place], jobs: int) -> Iterator[Tried]:
    """Each edit with its outcome, as they end; an edit that survives one stage meets the next.

    CannotStart: the unedited copy does not pass, which comes first.
    """
    runs, copies = Runs(), SimpleQueue()
    with TemporaryDirectory(prefix="edits-") as place:
        first, cache = Path(place, "0", "project"), Path(place, "cache")
        shutil.copytree(project, first, ignore=ASIDE)
        cache.mkdir(mode=0o700)
        with suppress(OSError):  # without what is compiled the first run takes a minute longer
            shutil.copytree(cache_folder(), cache, dirs_exist_ok=True)
        pool = ThreadPoolExecutor(jobs)
        try:
            limits = []
            for stage in stages:
                started = time.perf_counter()
                failed, output = pool.submit(runs.failed, first, cache, stage, UNEDITED).result()
                if failed:
                    raise CannotStart(f"{failed}\n{output}")
                limits.append(PATIENCE[0] + PATIENCE[1] * (time.perf_counter() - started))
            for k in range(jobs):
                copies.put(shutil.copytree(first, Path(place, str(k + 1), "project"), ignore=ASIDE))

            def tried(edit, changed):
                name, started, copy = changed.path.relative_to(project), time.perf_counter(), copies.get()
                ordered = [stage._replace(files=nearest(project, stage, edit)) for stage in stages]
                caught = caught_by(runs, copy, cache, name, changed.after, list(zip(ordered, limits)))
                copies.put(copy)
                return Tried(edit, caught, time.perf_counter() - started, difference(name, changed))

            for done in as_completed([pool.submit(tried, *item) for item in places.items()]):
                yield done.result()
        finally:
            runs.end()
            pool.shutdown(cancel_futures=True)


def caught_by(runs, copy, cache, name, text, stages) -> str:
    """What notices a changed text of a file of a copy. stages: with the time that each may take."""
    file, own_cache = copy / name, copy.parent / "cache"
    before = file.read_text(encoding="utf-8")
    shutil.copytree(
        cache, own_cache, copy_function=os.link
    )  # machine code of an edited source must not reach the next edit
    try:
        write(file, text)
        return next(
            (caught for stage, limit in stages if (caught := runs.failed(copy, own_cache, stage, limit)[0])), ""
        )
    finally:
        write(file, before)
        shutil.rmtree(own_cache, ignore_errors=True)


def write(file, text) -> None:
    """Write a source, and forget its byte code: of the same size within a second it would pass for the new one."""
    file.write_text(text, encoding="utf-8")
    Path(cache_from_source(file)).unlink(missing_ok=True)


def nearest(project: Path, stage: Stage, edit: Edit) -> list[str]:
    """The files of a stage, those first that name what is edited: most edits are caught by one of these."""
    words = {*edit.module.split("."), *edit.where.split(".")}

    def named(file):
        text = (project / file).read_text(encoding="utf-8")
        return sum(word in text for word in words) + (edit.module in Path(file).stem)

    return sorted(stage.files, key=named, reverse=True)


def difference(name: Path, place: Place) -> str:
    """An edit as a diff."""
    texts = (text.splitlines() for text in (place.before, place.after))
    return "\n".join(difflib.unified_diff(*texts, f"a/{name}", f"b/{name}", n=1, lineterm=""))
