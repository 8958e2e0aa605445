"""Which program runs: what it finds of a file is kept as long as nothing of it has changed."""

import hashlib
from functools import cache

from ..process.crash import ROOT
from ..report.version import installed

COMPUTE_WITH = ("mujoco", "numpy", "scipy", "llvmlite", "mpmath")  # whose versions may change what is found


@cache
def program() -> str:
    """A hash of the sources of the program and of the versions of what it computes with."""
    found = hashlib.sha256()
    for name in ("compare", "mjcf", "tmt"):
        for path in sorted((ROOT / name).rglob("*")):
            if path.is_file() and path.suffix in (".py", ".xml", ".html", ".js"):
                found.update(path.relative_to(ROOT).as_posix().encode() + b"\0" + path.read_bytes() + b"\0")
    found.update(repr([(name, installed(name)) for name in COMPUTE_WITH]).encode())
    return found.hexdigest()
