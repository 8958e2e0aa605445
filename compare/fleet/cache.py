"""The folder of a fleet: a report for each file, beside it its row and the key of all that they depend on."""

import hashlib
import json
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from pathlib import Path
from typing import Any

from ..core.errors import ROOT, Refused
from ..process import interrupt
from ..report import folder
from ..report.provenance import installed

FILES = "files"
MARK = ".fleet"  # file in a report: key and row
COMPUTED_WITH = ("mujoco", "numpy", "scipy", "llvmlite", "mpmath")  # results depend on their versions
RESUME = "results are saved, the same command continues"


@cache
def program() -> str:
    """Hash of the sources of this program and of the versions of the packages that it computes with."""
    digest = hashlib.sha256()
    for name in ("compare", "mjcf", "tmt"):
        for path in sorted((ROOT / name).rglob("*")):
            if path.is_file() and path.suffix in (".py", ".xml", ".jinja"):
                digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    digest.update(repr([(name, installed(name)) for name in COMPUTED_WITH]).encode())
    return digest.hexdigest()


@contextmanager
def locked(out: Path) -> Iterator[None]:
    """Hold the folder of a fleet. Refused: it cannot be made, or another fleet uses it."""
    with ExitStack() as stack:
        try:
            (out / FILES).mkdir(parents=True, exist_ok=True)
            is_held = stack.enter_context(folder.locked(out / FILES, wait=False))
        except OSError as error:
            why = folder.what_is_wrong(out, error)
            raise Refused(f"cannot write to {out}: {why}; expected a writable folder") from None
        if not is_held and folder.fcntl:
            advice = "use another folder (--out), or wait until it has ended"
            raise Refused(f"another fleet is writing to {out}; {advice}")
        interrupt.on_interrupt(RESUME)
        interrupt.at_end.callback(clear_up, out / FILES)
        yield


def clear_up(files: Path) -> None:
    """Delete what calls that were killed have left of reports."""
    for work in sorted(files.rglob(".new-*")):
        folder.clear_away(work.parent)
        with suppress(OSError):  # there is an earlier report
            work.parent.rmdir()


def saved(place: Path, key: str) -> dict[str, Any] | None:
    """What was saved as the row of a report, if it depends on the same things and the report is whole."""
    with suppress(OSError, ValueError, TypeError):
        saved_key, files, row = json.loads((place / MARK).read_bytes())
        return row if saved_key == key and files == hashes(place) else None
    return None


def save(place: Path, key: str, row: dict[str, Any]) -> None:
    place.mkdir(parents=True, exist_ok=True)
    write_whole(place / MARK, json.dumps((key, hashes(place), row)))


def hashes(place: Path) -> dict[str, str]:
    """The files of a report, each with a hash of its content."""
    return {name: hashlib.sha256((place / name).read_bytes()).hexdigest() for name in folder.files(place)}


def write_whole(path: Path, text: str) -> None:
    """Replace a file in one step. Refused if that fails."""
    part = path.with_name(f".{path.name}.part")
    try:
        part.write_text(text, encoding="utf-8", errors="backslashreplace")
        part.replace(path)
    except OSError as error:
        part.unlink(missing_ok=True)
        raise Refused(f"cannot write {path}: {error.strerror}; {RESUME}") from None
