"""What a fleet has computed is kept in its folder, by a hash of all that it follows from: a later run computes the rest."""

import hashlib
import os
import pickle
import shutil
import tempfile
from contextlib import suppress
from pathlib import Path

from ..process import interrupt
from ..report.folder import lock, what_is_wrong
from .piece import FleetError
from .program import program

KEPT_IN = "kept"
DIGEST = 32  # bytes at the beginning of a file, by which it is known to be whole
INTERRUPTED = "interrupted; what is done is kept, and the same command goes on from there"


class Kept:
    """Values by key, each in a file of its own. FleetError: the folder cannot be written, or another fleet is there."""

    def __init__(self, out: Path):
        self.out, self.folder, self.number = out, out / KEPT_IN / program()[:16], None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self.number = lock(out / KEPT_IN, wait=False)
            with tempfile.TemporaryFile(dir=self.folder):
                pass
        except OSError as error:
            text = f"cannot write to {out}: {what_is_wrong(out, error)}"
            raise FleetError(f"{text}; a folder that can be written is expected") from None
        if self.number is None and os.name == "posix":
            raise FleetError(
                f"another fleet is writing to {out}; another folder (--out) is expected, or wait until it has ended"
            )
        interrupt.Now.line = INTERRUPTED

    def key(self, *what: object) -> str:
        """Of what a value follows from, besides the program."""
        return hashlib.sha256("\0".join([program(), *map(repr, what)]).encode("utf-8", "backslashreplace")).hexdigest()

    def get(self, key: str) -> object | None:
        """A value, or None: there is none that can be read."""
        with suppress(Exception):
            content = (self.folder / key).read_bytes()
            if content[:DIGEST] == hashlib.sha256(content[DIGEST:]).digest():
                return pickle.loads(content[DIGEST:])
        return None

    def put(self, key: str, value: object) -> None:
        content = pickle.dumps(value)
        write_whole(self.folder / key, hashlib.sha256(content).digest() + content)

    def forget_others(self) -> None:
        """Delete what other versions of the program have left."""
        for folder in (self.out / KEPT_IN).iterdir():
            if folder != self.folder:
                shutil.rmtree(folder, ignore_errors=True)

    def close(self) -> None:
        if self.number is not None:
            os.close(self.number)
            self.number = None


def write_whole(path: Path, content: bytes) -> None:
    """A file that is whole or not there. FleetError if it cannot be written."""
    part = path.with_name(f".{path.name}.part")
    try:
        with interrupt.postponed():
            part.write_bytes(content)
            os.replace(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise FleetError(f"cannot write {path}: {error.strerror}; what is done is kept") from None


def write_report(place: Path, written: dict[str, bytes]) -> None:
    """A report in a folder, in place of the one that was there. FleetError if it cannot be written."""
    part = place.with_name(f".{place.name}.part")
    try:
        shutil.rmtree(part, ignore_errors=True)
        for name, content in written.items():
            (part / name).parent.mkdir(parents=True, exist_ok=True)
            (part / name).write_bytes(content)
        with interrupt.postponed():
            shutil.rmtree(place, ignore_errors=True)
            part.rename(place)
    except OSError as error:
        shutil.rmtree(part, ignore_errors=True)
        raise FleetError(f"cannot write {place}: {error.strerror}; what is done is kept") from None
