"""Files of what was computed once: $TMT_CACHE, else $XDG_CACHE_HOME/tmt, else ~/.cache/tmt.

The name of a file is the hash of all that its content depends on: tmt's sources as imported, the versions of
llvmlite and LLVM, the processor, the tree and what is computed for it. With a file that is not what was
written under this name, without a folder or on a full disk, it is computed anew: that only costs time. To
clear the folder is to delete it.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from contextlib import suppress
from dataclasses import is_dataclass
from pathlib import Path

from tmt.methods.stepping import Method
from tmt.model.tree import Tree, stated

from .machine import Library, object_code, versions
from .sources import OWN_SOURCES

DIGEST = 32  # bytes of a SHA-256, before the content


def library(source: Callable[[], str], *what: object) -> Library:
    """The compiled module of a source; what: all that it follows from."""
    return Library(code=stored(lambda: object_code(source()), ".o", *what))


def stored(make: Callable[[], bytes], ending: str, *what: object) -> bytes:
    """What `make` returns, from the folder if it lies there; what: all that it follows from.

    Of what is the user's own (a class of trees, a method) nothing is stored.
    """
    words, folder = [OWN_SOURCES, versions(), *map(word_of, what)], cache_folder()
    parts = [word for word in words if word is not None]
    if len(parts) < len(words) or folder is None:
        return make()
    name = hashlib.sha256("\n".join(parts).encode()).hexdigest()[:32]
    path = folder / f"{name}{ending}"
    with suppress(OSError):
        content = path.read_bytes()
        if content[:DIGEST] == digest(path, content[DIGEST:]):
            return content[DIGEST:]
    content = make()
    with suppress(OSError):
        write_aside(path, digest(path, content) + content)
    return content


def word_of(value: object) -> str | None:
    """What stands for a value in the name of a file; None if it may mean something else another time."""
    if isinstance(value, (str, int, tuple)):
        return repr(value)
    is_of_tmt = type(value).__module__.split(".")[0] == __name__.split(".")[0]
    if is_of_tmt and isinstance(value, Tree | Method) and is_dataclass(value):
        return f"{type(value).__qualname__}({stated(value)})"
    return None


def digest(path: Path, content: bytes) -> bytes:
    return hashlib.sha256(path.name.encode() + content).digest()


def cache_folder() -> Path | None:
    if os.environ.get("TMT_CACHE"):
        return Path(os.environ["TMT_CACHE"])
    with suppress(RuntimeError):
        return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tmt"
    return None


def write_aside(path: Path, content: bytes) -> None:
    """Write a file aside and move it, so that a process that reads meanwhile sees all of it or nothing."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile("wb", dir=path.parent, suffix=".new", delete=False) as file:
        try:
            file.write(content)
            file.close()
            os.replace(file.name, path)
        except OSError:
            Path(file.name).unlink(missing_ok=True)
            raise
