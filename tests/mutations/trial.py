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

from tmt.compiled.store import cache_folder

# what tests need besides the program: without it, or with other versions, they fail and have noticed nothing
OF_TESTS = ("pytest", "hypothesis", "sympy", "gymnasium")
# a process that starts pytest, with the arguments that it is given, and ends it with all that it has started when its stdin is
# closed, as it is when the process that started this one ends: tests may have put theirs in other groups
GUARD = """
import os, signal, subprocess, sys, threading
from pathlib import Path


def descendants():
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
        except OSError:  # it has ended meanwhile
            pass
    found = [os.getpid()]
    for parent in found:
        found += [child for child, of in parents.items() if of == parent]
    return found[1:]


def end_with_stdin():
    os.read(0, 1)
    for number in descendants():
        try:
            os.kill(number, signal.SIGKILL)
        except OSError:
            pass
    os.killpg(0, signal.SIGKILL)


signal.pthread_sigmask(signal.SIG_SETMASK, ())  # who starts this hears no signal of the terminal; tests are to hear theirs
run = subprocess.Popen([sys.executable, "-m", "pytest", *sys.argv[1:]], stdin=subprocess.DEVNULL)
threading.Thread(target=end_with_stdin, daemon=True).start()
status = run.wait()
os._exit(status if status >= 0 else 128 - status)
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
    command = [sys.executable, "-c", GUARD, "-x", "-q", "-rfE", f"--basetemp={folder / 'tests'}", *options, *files]
    project = folder / "project"
    environment = os.environ | {"TMT_CACHE": str(cache), "TMPDIR": str(folder / "scratch"), "COLUMNS": "200"}
    others = (entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry)
    others = [
        entry for entry in others if not Path(entry, "compare").is_dir()
    ]  # nothing is taken from the unedited one
    environment["PYTHONPATH"] = os.pathsep.join([str(project), *others])
    environment.pop("PYTEST_ADDOPTS", None)
    reading, writing = os.pipe()
    process = subprocess.Popen(
        command, cwd=project, env=environment, stdin=reading, stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT, text=True, errors="replace", start_new_session=True,
    )  # fmt: skip
    os.close(reading)
    try:
        output, _ = process.communicate(timeout=limit)
    except subprocess.TimeoutExpired:
        return f"no end after {limit:.0f} s", ""
    finally:
        os.close(writing)
        if process.poll() is not None:  # what a failed test has left, too
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
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
