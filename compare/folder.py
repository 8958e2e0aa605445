"""The output folder: a new report takes the place of the old one only when it is complete."""

import shutil
import signal
import tempfile
import threading
from contextlib import contextmanager
from pathlib import Path

OWN = ("report.md", "index.html", "results.json", "tables", "figures")


class FolderError(ValueError):
    """A folder that cannot take a report; the message is one line."""


@contextmanager
def new_report(out):
    """A fresh folder inside `out`; what is in it takes the old report's place when the block ends well.

    Whatever else is in `out` stays. If the block raises, `out` is as it was. FolderError if `out` cannot be
    written, or has files with a report's names that are not a report's.
    """
    out = Path(out)
    existed = out.exists()
    try:
        out.mkdir(parents=True, exist_ok=True)
        work = Path(tempfile.mkdtemp(prefix=".new-", dir=out))
    except OSError as error:
        raise FolderError(
            f"cannot write to {out}: {error.strerror}; a folder that can be written is expected"
        ) from None
    try:
        foreign = [name for name in OWN if (out / name).exists()]
        if foreign and not (out / "results.json").exists():
            raise FolderError(
                f"{out} has {', '.join(foreign)} but no results.json, so this is not a report to be replaced; "
                "another folder is expected"
            )
        yield work
        with uninterrupted():
            exchange(work, out)
    finally:
        shutil.rmtree(work, ignore_errors=True)
        if not existed and not any(out.iterdir()):
            out.rmdir()


def exchange(work, out):
    """Move the old report away and the new one in; on an error put everything back."""
    old = Path(tempfile.mkdtemp(prefix=".old-", dir=out))
    moved = []
    try:
        for source, target in ((out, old), (work, out)):
            for name in OWN:
                if (source / name).exists():
                    (source / name).rename(target / name)
                    moved.append((source / name, target / name))
    except OSError as error:
        for source, target in reversed(moved):
            target.rename(source)
        raise FolderError(f"cannot replace the report in {out}: {error.strerror}; the old one is unchanged") from None
    finally:
        shutil.rmtree(old, ignore_errors=True)


@contextmanager
def uninterrupted():
    """Ctrl-C waits for the end of the block."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    previous = signal.signal(signal.SIGINT, signal.SIG_IGN)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
