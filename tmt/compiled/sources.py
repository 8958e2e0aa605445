"""Tmt's own files as they were at its import, from which follows what is compiled."""

import hashlib
import os
import sys
from collections.abc import Iterable
from functools import lru_cache
from importlib.machinery import SourceFileLoader
from pathlib import Path


def stamps(files: Iterable[str]) -> dict[str, tuple[int, int]]:
    stats = {file: os.stat(file) for file in files}
    return {file: (stat.st_mtime_ns, stat.st_size) for file, stat in stats.items()}


IMPORTED = stamps(sorted(map(str, Path(__file__).parents[1].rglob("*.py"))))


@lru_cache(maxsize=1)
def contents() -> str:
    digest = hashlib.sha256()
    for file in IMPORTED:
        digest.update(Path(file).read_bytes())
    return digest.hexdigest()


def own_sources() -> str | None:
    """A name for the contents of tmt's files; None if one has changed, or a module is not from a file."""
    modules = [module for name, module in list(sys.modules.items()) if name.startswith("tmt.")]
    if not all(type(module.__loader__) is SourceFileLoader for module in modules):
        return None
    if not IMPORTED.keys() >= {module.__file__ for module in modules}:
        return None
    try:
        name = contents()
        return name if stamps(IMPORTED) == IMPORTED else None
    except OSError:  # one is gone
        return None
