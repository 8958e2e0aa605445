"""Generated code on disk: $TMT_CACHE, else $XDG_CACHE_HOME/tmt, else ~/.cache/tmt.

A module's name is the hash of its text, of the compiled code that it takes from `sine`, and of numba's version; numba keeps
the machine code beside it. Where that folder cannot be written the code is compiled anew in each process: it only costs time.
"""

import hashlib
import importlib.util
import linecache
import os
import sys
import tempfile
from importlib.metadata import version
from pathlib import Path
from types import ModuleType

SINE = Path(__file__).with_name("sine.py")  # by its path: importing it would load numba


def cache_folder() -> Path:
    """Where generated code is kept."""
    if os.environ.get("TMT_CACHE"):
        return Path(os.environ["TMT_CACHE"])
    return Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "tmt"


def load(text):
    """The module with this source, from the cache folder if that can be used, else from memory.

    numba unpickles what it finds there: the folder must be the user's own.
    """
    # numba versions do not read each other's machine code: each keeps its own
    key = "\n".join([version("numba"), SINE.read_text(encoding="utf-8"), text])
    name = "kernel_" + hashlib.sha256(key.encode()).hexdigest()[:16]
    try:
        return from_disk(name, text.replace("CACHE", "True"), cache_folder())
    except Exception:  # whatever is wrong with the folder or with a file in it: compile without them
        module = ModuleType(name)
        text = text.replace("CACHE", "False")
        linecache.cache[name] = (len(text), None, text.splitlines(keepends=True), name)
        exec(compile(text, name, "exec"), module.__dict__)
        return module


def from_disk(name, text, folder):
    """The module from its file in the folder, written if it is not there; a damaged cache is cleared away."""
    path = folder / f"{name}.py"
    if not path.exists() or path.read_text() != text:
        folder.mkdir(parents=True, exist_ok=True)
        # written aside and moved, so that a process that reads meanwhile sees all of it or nothing
        with tempfile.NamedTemporaryFile("w", dir=folder, suffix=".new", delete=False) as file:
            file.write(text)
        os.replace(file.name, path)
    spec = importlib.util.spec_from_file_location(name, path)
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module  # numba looks it up there when it reads machine code back
    try:
        spec.loader.exec_module(module)
    except Exception:
        for file in folder.glob(f"__pycache__/{name}.*"):
            file.unlink()
        raise
    return module
