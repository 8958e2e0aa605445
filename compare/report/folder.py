"""The output folder: a new report replaces the old one only when it is complete, however the run ends.

A run writes to a folder `.new-XXXXXXXX` inside the output folder, and locks it; an unlocked one is left from
a run that was killed. The report is written to `new` in that folder. The exchange moves the old report to
`old`, renames `new` to `moving`, moves the new report out, and renames `moving` to `done`. From these names
the old report can be restored at any moment.
"""

import json
import os
import re
import shutil
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import ModuleType

from ..core.errors import Refused
from ..process import interrupt

fcntl: ModuleType | None
try:
    import fcntl
except ImportError:  # Windows: what a killed run leaves stays there
    fcntl = None

OWN = ("report.md", "index.html", "results.json", "tables", "figures")
STAGES = ("new", "old", "moving", "done")
TRIES = 20


@contextmanager
def new_report(out: str | Path) -> Iterator[Path]:
    """An empty folder inside `out`; its files replace the old report at the end of the block.

    All other files in `out` stay. If the block raises, `out` is unchanged. Refused if `out` cannot be
    written, or has files under a report's names that are not the old report's.
    """
    work = Work(Path(out))
    interrupt.undo.append(work.remove)
    try:
        work.make()
        yield work.new
        work.exchange()
    except OSError as error:
        path = Path(str(error.filename))
        if not path.is_relative_to(work.new):
            raise
        path = work.out / path.relative_to(work.new)  # as the reader knows it
        raise Refused(f"cannot write {path}: {error.strerror}; an earlier report is unchanged") from None
    finally:
        work.remove()
        interrupt.undo.remove(work.remove)


class Work:
    def __init__(self, out: Path):
        self.out, self.path = out, out / ".new-"  # the path of the folder as soon as it is made
        self.lock = ExitStack()
        self.made = [path for path in (out, *out.parents) if not os.path.lexists(path)]  # the innermost first

    @property
    def new(self) -> Path:
        return self.path / "new"

    def make(self) -> None:
        """Make and lock the folder; restore and delete what killed runs have left."""
        try:
            self.out.mkdir(parents=True, exist_ok=True)
            with locked(self.out):
                with interrupt.postponed:
                    self.path = Path(tempfile.mkdtemp(prefix=".new-", dir=self.out))
                    self.lock.enter_context(locked(self.path))
                self.new.mkdir()
                clear_away(self.out)
                refuse_foreign(self.out)
        except OSError as error:
            why = f"{what_is_wrong(self.out, error)}; expected a writable folder"
            raise Refused(f"cannot write to {self.out}: {why}") from None

    def exchange(self) -> None:
        """Move the old report away and the new one in; on an error put everything back."""
        with locked(self.out), interrupt.postponed:
            clear_away(self.out)
            refuse_foreign(self.out)
            try:
                (self.path / "old").mkdir()
                move(self.out, self.path / "old")
                self.new.rename(self.path / "moving")
                move(self.path / "moving", self.out)
                (self.path / "moving").rename(self.path / "done")
            except BaseException as error:
                put_back(self.path, self.out)
                if not isinstance(error, OSError):
                    raise
                text = f"cannot replace the report in {self.out}: {error.strerror}; the old one is unchanged"
                raise Refused(text) from None
            interrupt.settle()

    def remove(self) -> None:
        """Delete the files of this run, except the report, and the folders that it made and left empty."""
        if is_of_a_run(self.path):
            delete(self.path)
        self.lock.close()
        with suppress(OSError):  # not empty
            for path in self.made:
                path.rmdir()


def move(source: Path, target: Path) -> None:
    """Move the files of a report that the target does not have."""
    for name in OWN:
        if os.path.lexists(source / name) and not os.path.lexists(target / name):
            (source / name).rename(target / name)


def put_back(work: Path, out: Path) -> None:
    """Restore the old report after an exchange that was cut off."""
    if (work / "moving").exists():
        move(out, work / "moving")  # what the new report lacks is what had been moved
        (work / "moving").rename(work / "new")
    if (work / "new").exists() and (work / "old").exists():
        move(work / "old", out)


def clear_away(out: Path) -> None:
    """Restore and delete what killed runs have left; the folder of a running process is locked, and stays."""
    for work in sorted(out.glob(".new-*")):
        if is_of_a_run(work):
            with locked(work, wait=False) as is_left:
                if is_left:
                    put_back(work, out)
                    delete(work)


def is_of_a_run(path: Path) -> bool:
    if not re.fullmatch(r"\.new-[a-z0-9_]{8}", path.name) or path.is_symlink() or not path.is_dir():
        return False
    return {child.name for child in path.iterdir()} <= {*STAGES, *OWN}


def delete(work: Path) -> None:
    """Delete a run's folder, unless an old report that could not be put back is in it."""
    unfinished = (work / "new").exists() or (work / "moving").exists()
    if unfinished and (work / "old").exists() and any((work / "old").iterdir()):
        return
    for _ in range(TRIES):
        shutil.rmtree(work, ignore_errors=True)
        if not work.exists():
            return
        time.sleep(0.01)  # a process that is about to end still wrote


@contextmanager
def locked(folder: Path, wait: bool = True) -> Iterator[bool]:
    """Hold the lock of a folder in this block, at most until the process ends; whether it is held."""
    if fcntl is None:
        yield wait
        return
    number = os.open(folder, os.O_RDONLY)
    try:
        with suppress(OSError):
            fcntl.flock(number, fcntl.LOCK_EX | (0 if wait else fcntl.LOCK_NB))
            wait = True
        yield wait
    finally:
        os.close(number)


def what_is_wrong(out: Path, error: OSError) -> str:
    for path in (*reversed(out.parents), out):
        name = "it" if path == out else str(path)
        if os.path.islink(path) and not os.path.exists(path):
            return f"{name} is a symbolic link to {os.readlink(path)}, which does not exist"
        if os.path.exists(path) and not os.path.isdir(path):
            return f"{name} is a file"
    return error.strerror or str(error)


@contextmanager
def writing(path: Path) -> Iterator[None]:
    """Errors of the disk in this block name the file; those of Python do not."""
    try:
        yield
    except OSError as error:
        raise OSError(error.errno, error.strerror or str(error), str(path)) from None


def save(path: Path, text: str) -> None:
    with writing(path):
        path.write_text(text, encoding="utf-8", errors="backslashreplace")


def files(folder: Path) -> list[str]:
    paths = [path for name in OWN for path in [folder / name, *(folder / name).rglob("*")]]
    of_files = [path for path in paths if path.is_file() or path.is_symlink()]
    return sorted(path.relative_to(folder).as_posix() for path in of_files)


def refuse_foreign(out: Path) -> None:
    """Refused for a file under a report's names that the report in `out` does not list as its own."""
    own: Sequence[str] = ()
    with suppress(OSError, ValueError, KeyError, TypeError):
        own = json.loads((out / "results.json").read_text(encoding="utf-8"))["provenance"]["files"]
    for name in files(out):
        if name not in own:
            why = "which no earlier report has written; use another folder (--out)"
            raise Refused(f"{out} has {name}, {why}")
