"""The output folder: a new report is written beside the old one, and takes its place when it is complete."""

import json
import os
import shutil
import tempfile
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from pathlib import Path
from types import ModuleType

from ..core.errors import Refused
from ..process import interrupt
from ..process.files import remove_empty

fcntl: ModuleType | None
try:
    import fcntl
except ImportError:  # Windows: what a killed run leaves stays there
    fcntl = None

OWN = ("report.md", "index.html", "results.json", "reproduce.py", "tolerances.html", "tables", "figures")
UNCHANGED = "the earlier report is unchanged"


@contextmanager
def new_report(out: str | Path, shown: str | Path = "") -> Iterator[Path]:
    """An empty folder beside the report in `out`, which it replaces at the end of the block.

    All other files in `out` stay. If the block raises, `out` is unchanged. Refused if `out` cannot be
    written, or has files under a report's names that are not the old report's. shown: `out` as it was given.
    """
    out, shown = Path(out), Path(shown or out)
    made = [path for path in (out, *out.parents) if not os.path.lexists(path)]  # the innermost first
    with ExitStack() as stack:
        stack.callback(remove_empty, made)
        try:
            out.mkdir(parents=True, exist_ok=True)
            clear_away(out)
            refuse_foreign(out, shown)
            work = Path(tempfile.mkdtemp(prefix=".new-", dir=out))
            stack.callback(shutil.rmtree, work, ignore_errors=True)
            stack.enter_context(locked(work))
        except OSError as error:
            why = f"{what_is_wrong(out, error)}; expected a writable folder"
            raise Refused(f"cannot write to {shown}: {why}") from None
        is_old = has_report(out)
        interrupt.on_interrupt(UNCHANGED if is_old else "no report was written")
        interrupt.tell("folder", (work, made))
        try:
            yield work
            exchange(work, out, shown)
        except OSError as error:
            state = f"; {UNCHANGED}" if is_old else ""
            raise Refused(f"cannot write to {shown}: {error.strerror or error}{state}") from None


def has_report(out: Path) -> bool:
    return (out / "results.json").exists()


def exchange(work: Path, out: Path, shown: Path) -> None:
    """Move the old report away and the new one in; on an error put everything back."""
    out.mkdir(exist_ok=True)
    with locked(out), ExitStack() as back:
        refuse_foreign(out, shown)
        interrupt.settle()
        old = Path(tempfile.mkdtemp(prefix="old-", dir=work))
        for name in OWN:
            for source, target in ((out / name, old / name), (work / name, out / name)):
                if os.path.lexists(source):
                    os.replace(source, target)
                    back.callback(os.replace, target, source)
        back.pop_all()


def clear_away(out: Path) -> None:
    """Delete what killed runs have left; the folder of a run that goes on is locked, and stays."""
    for work in sorted(out.glob(".new-????????")):
        is_of_a_run = work.is_dir() and not work.is_symlink()
        if is_of_a_run and {child.name for child in work.iterdir()} <= {*OWN}:
            with locked(work, wait=False) as is_left:
                if is_left:
                    shutil.rmtree(work, ignore_errors=True)


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


def files(folder: Path) -> list[str]:
    paths = [path for name in OWN for path in [folder / name, *(folder / name).rglob("*")]]
    of_files = [path for path in paths if path.is_file() or path.is_symlink()]
    return sorted(path.relative_to(folder).as_posix() for path in of_files)


def refuse_foreign(out: Path, shown: Path) -> None:
    """Refused for a file under a report's names that the report in `out` does not list as its own."""
    own: Sequence[str] = ()
    with suppress(OSError, ValueError, KeyError, TypeError):
        own = json.loads((out / "results.json").read_text(encoding="utf-8"))["provenance"]["files"]
    for name in files(out):
        if name not in own:
            why = "which no earlier report has written; use another folder (--out)"
            raise Refused(f"{shown} has {name}, {why}")
