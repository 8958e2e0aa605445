"""Results of a fleet on disk, by a hash of everything that they depend on: a later run computes what is missing."""

import hashlib
import os
import pickle
import shutil
import tempfile
from contextlib import suppress
from functools import cache
from pathlib import Path

from ..process import interrupt
from ..process.crash import ROOT
from ..report.folder import lock, what_is_wrong
from ..report.provenance import installed
from .tasks import FleetError

FOLDER = "cache"
DIGEST = 32  # bytes: hash of the content, at the beginning of a file
COMPUTED_WITH = ("mujoco", "numpy", "scipy", "llvmlite", "mpmath")  # results depend on their versions
RESUME = "results are saved, the same command continues"
INTERRUPTED = f"interrupted; {RESUME}"


@cache
def program() -> str:
    """Hash of the sources of this program and of the versions of the packages that it computes with."""
    digest = hashlib.sha256()
    for name in ("compare", "mjcf", "tmt"):
        for path in sorted((ROOT / name).rglob("*")):
            if path.is_file() and path.suffix in (".py", ".xml", ".html", ".js", ".jinja"):
                digest.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    digest.update(repr([(name, installed(name)) for name in COMPUTED_WITH]).encode())
    return digest.hexdigest()


class Cache:
    """Values by key, one file each. FleetError: the folder is not writable, or another fleet uses it."""

    def __init__(self, out: Path):
        self.out, self.folder, self.lock = out, out / FOLDER / program()[:16], None
        try:
            self.folder.mkdir(parents=True, exist_ok=True)
            self.lock = lock(out / FOLDER, wait=False)
            with tempfile.TemporaryFile(dir=self.folder):
                pass
        except OSError as error:
            raise FleetError(
                f"cannot write to {out}: {what_is_wrong(out, error)}; expected a writable folder"
            ) from None
        if self.lock is None and os.name == "posix":
            raise FleetError(
                f"another fleet is writing to {out}; use another folder (--out), or wait until it has ended"
            )
        interrupt.Now.line = INTERRUPTED

    def key(self, *inputs: object) -> str:
        """The key of a value that depends on these inputs and on the program."""
        return hashlib.sha256(
            "\0".join([program(), *map(repr, inputs)]).encode("utf-8", "backslashreplace")
        ).hexdigest()

    def get(self, key: str) -> object | None:
        """A value, or None if there is none or it is damaged."""
        with suppress(Exception):
            content = (self.folder / key).read_bytes()
            if content[:DIGEST] == hashlib.sha256(content[DIGEST:]).digest():
                return pickle.loads(content[DIGEST:])
        return None

    def put(self, key: str, value: object) -> None:
        content = pickle.dumps(value)
        write_whole(self.folder / key, hashlib.sha256(content).digest() + content)

    def remove_other_versions(self) -> None:
        for folder in (self.out / FOLDER).iterdir():
            if folder != self.folder:
                shutil.rmtree(folder, ignore_errors=True)

    def close(self) -> None:
        if self.lock is not None:
            os.close(self.lock)
            self.lock = None


def write_whole(path: Path, content: bytes) -> None:
    """Write a file in one step. FleetError if that fails."""
    part = path.with_name(f".{path.name}.part")
    try:
        with interrupt.postponed():
            part.write_bytes(content)
            os.replace(part, path)
    except OSError as error:
        with suppress(OSError):
            part.unlink()
        raise FleetError(f"cannot write {path}: {error.strerror}; {RESUME}") from None


def write_report(place: Path, written: dict[str, bytes]) -> None:
    """Replace the report in a folder. FleetError if that fails."""
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
        raise FleetError(f"cannot write {place}: {error.strerror}; {RESUME}") from None
