"""The tests, run on a copy of the project with one edit, in the process that does it, on whatever machine.

The text of this module is sent with the edits, so it imports nothing of this folder; what its functions take and return are plain
values. The process has a folder of its own, the one it is in: its copy and what is compiled are kept there from edit to edit.
"""

import io
import os
import pickle
import re
import shutil
import signal
import subprocess
import sys
import tarfile
import tempfile
import time
from contextlib import suppress
from functools import lru_cache
from importlib.metadata import PackageNotFoundError, version
from importlib.util import cache_from_source
from pathlib import Path

from compare.fleet.child import descendants
from tmt.cache import cache_folder

OF_TESTS = (
    "pytest",
    "hypothesis",
    "sympy",
    "gymnasium",
)  # without them, or with others, tests fail that have noticed nothing
# the process that starts it hears no signal of the terminal, and the tests are to hear theirs; it ends with that process
PYTEST = """
import ctypes, signal, sys
try:
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)
except (OSError, AttributeError, TypeError):  # there is no such call on this system
    pass
signal.pthread_sigmask(signal.SIG_SETMASK, ())
import pytest
sys.exit(pytest.main())
"""


def versions() -> dict[str, str | None]:
    """What the tests need besides what the program does, as it is installed here."""
    found = dict.fromkeys(OF_TESTS)
    for name in OF_TESTS:
        with suppress(PackageNotFoundError):
            found[name] = version(name)
    return found


def unedited(expected, stages, allowed, bundle) -> tuple[list[float], str, bytes]:
    """The seconds of each stage on the copy as it is, what failed, and what was compiled, for the cache of the others.

    expected: see `versions`; stages: (files, further arguments of pytest) each; allowed: seconds of each; bundle: see `copy_of`.
    """
    check_versions(expected)
    folder, seconds = copy_of(bundle), []
    before = stamps(folder / "cache")
    for stage, limit in zip(stages, allowed):
        started = time.perf_counter()
        failed, output = run(folder, folder / "cache", *stage, limit)
        seconds.append(time.perf_counter() - started)
        if failed:
            return seconds, f"{failed}\n{output}", b""
    new = [name for name, stamp in stamps(folder / "cache").items() if before.get(name) != stamp]
    return seconds, "", packed({f"cache/{name}": folder / "cache" / name for name in new})


def edited(expected, stages, allowed, name, text, bundle) -> tuple[str, float]:
    """What caught an edit, empty if nothing did, and its seconds. name, text: of the file that has the edit."""
    check_versions(expected)
    folder, started, caught = copy_of(bundle), time.perf_counter(), ""
    file, cache = folder / "project" / name, folder / "cache of the edit"
    before = file.read_text(encoding="utf-8")
    # machine code of an edited source must not reach the next edit
    shutil.copytree(folder / "cache", cache, copy_function=os.link)
    try:
        write(file, text)
        for stage, limit in zip(stages, allowed):
            caught = caught or run(folder, cache, *stage, limit)[0]
    finally:
        write(file, before)
        shutil.rmtree(cache, ignore_errors=True)
    return caught, time.perf_counter() - started


def check_versions(expected) -> None:
    if expected != versions():
        raise RuntimeError(f"other packages for tests are installed: {versions()}; {expected} are expected")


@lru_cache(1)
def copy_of(bundle) -> Path:
    """A copy of the project and a cache of compiled code. bundle: two tar files, of the project and for the cache."""
    project, compiled = pickle.loads(bundle)
    folder = new_copy(project)
    if compiled:
        unpack(compiled, folder)
    return folder


@lru_cache(1)
def new_copy(project) -> Path:
    """A folder with a copy of the project, and what this machine has compiled: without it the first run takes a minute longer."""
    for old in Path.cwd().glob("copy-*"):
        shutil.rmtree(old, ignore_errors=True)
    folder = Path(tempfile.mkdtemp(prefix="copy-", dir=Path.cwd()))
    with suppress(OSError):
        shutil.copytree(cache_folder(), folder / "cache")
    for name in ("cache", "project", "scratch"):
        (folder / name).mkdir(mode=0o700, exist_ok=True)
    unpack(project, folder)
    return folder


def unpack(content, folder) -> None:
    """What `packed` has made, into a folder."""
    with tarfile.open(fileobj=io.BytesIO(content)) as tar:
        tar.extractall(folder, filter="data")


def packed(files) -> bytes:
    """{name in it: path} as a tar file."""
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w") as tar:
        for name, path in files.items():
            with suppress(FileNotFoundError):  # written aside by somebody, and gone
                tar.add(path, name, recursive=False)
    return made.getvalue()


def stamps(folder) -> dict[str, tuple]:
    """Of each file below a folder, what changes when it is written anew."""
    found = {}
    for path in folder.rglob("*"):
        with suppress(OSError):
            about = path.stat()
            if path.is_file():
                found[path.relative_to(folder).as_posix()] = about.st_mtime_ns, about.st_size, about.st_ino
    return found


def run(folder, cache, files, options, limit) -> tuple[str, str]:
    """What failed first, empty if nothing did, and the end of the output."""
    command = [sys.executable, "-c", PYTEST, "-x", "-q", "-rfE", f"--basetemp={folder / 'tests'}", *options, *files]
    project = folder / "project"
    environment = os.environ | {"TMT_CACHE": str(cache), "TMPDIR": str(folder / "scratch"), "COLUMNS": "200"}
    others = (entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry)
    others = [
        entry for entry in others if not Path(entry, "compare").is_dir()
    ]  # nothing is taken from the unedited one
    environment["PYTHONPATH"] = os.pathsep.join([str(project), *others])
    environment.pop("PYTEST_ADDOPTS", None)
    process = subprocess.Popen(
        command, cwd=project, env=environment, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
    )  # fmt: skip
    try:
        output, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        return f"no end after {limit:.0f} s", ""
    finally:
        end(process.pid)  # what a failed test has left, too
        process.communicate()
    return failure(process.returncode, output), "\n".join(output.splitlines()[-30:])


def failure(status, output) -> str:
    """The test that failed first in a run of pytest, or what else ended it; empty if all pass."""
    if status == 0:
        return ""
    named = re.search(r"^(?:FAILED|ERROR) (.*?)(?: - .*)?$", output, re.MULTILINE)
    last = (output.strip().splitlines() or ["no output"])[-1]
    return named[1] if named else f"status {status}: {last}"


def write(file, text) -> None:
    """Write a source, and forget its byte code: of the same size within a second it would pass for the new one."""
    file.write_text(text, encoding="utf-8")
    Path(cache_from_source(file)).unlink(missing_ok=True)


def end(pid) -> None:
    """End a process, its group, and its descendants in other groups."""
    for number in descendants(pid):
        ended(os.kill, number)
    ended(os.killpg, pid)


def ended(kill, pid) -> None:
    with suppress(ProcessLookupError, PermissionError):
        kill(pid, signal.SIGKILL)
