"""A process that makes calls for another one. If it crashes, hangs or exits, that is the outcome of the call.

A worker of a cluster starts such a process too, because a Python thread cannot be killed. It ends with its owner.
"""

import os
import pickle
import platform
import queue
import shutil
import signal
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import BinaryIO, NamedTuple

from .crash import described
from .workers import deaf

try:
    import resource
except ImportError:  # Windows: no memory limit
    resource = None

QUIET = {"MUJOCO_GL": "disabled", "OPENBLAS_NUM_THREADS": "1"}
SHARE = 0.9  # of the machine's memory, for all its processes together
REPLACED_ABOVE = 0.5  # share of its memory limit: compiled code stays in a process, so it is replaced
MAX_FILE = 2**30  # bytes, of a file that a call writes, stderr included
OUT_OF_MEMORY = "out of memory"
POLLING = 0.5  # s between checks whether the outcome is still wanted
MAX_LINE = 200  # characters of the last line on stderr


class Outcome(NamedTuple):
    """The outcome of a call."""

    value: bytes = b""  # the returned value, pickled; see `returned`
    error: str = ""  # the exception, in one line
    ended: str = ""  # how the process ended during the call: "killed by SIGKILL"
    is_late: bool = False  # it exceeded the time limit
    seconds: float = 0.0  # processor time
    wall: float = 0.0  # s, of the function alone
    memory: int = 0  # bytes, maximum of the process so far
    machine: str = ""  # name of the machine

    @property
    def broke(self) -> str:
        """Why there is no value; "" if there is one."""
        return self.error or self.ended

    @property
    def returned(self) -> object:
        """The value that the function returned. RuntimeError if there is none."""
        if self.broke:
            raise RuntimeError(self.broke)
        return pickle.loads(self.value)

    def tried(self, times: int) -> "Outcome":
        return self._replace(ended=f"{self.ended}, {times} times") if self.ended and times > 1 else self


def memory_of_machine() -> int | None:
    """Memory of the machine or its container, bytes; None if unknown."""
    sizes = []
    with suppress(OSError, ValueError, AttributeError):
        sizes.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):
            sizes.append(int(Path(file).read_text(encoding="ascii")))
    return min(sizes, default=None)


class Child:
    """The process, seen from its owner. scratch: folder for its files; memory: limit, bytes."""

    def __init__(self, scratch: Path, memory: int | None):
        self.memory, self.late, self.killed = memory, False, False
        self.folder = Path(tempfile.mkdtemp(prefix="task-", dir=scratch))
        self.stderr = (self.folder / "stderr").open("a+b")
        paths = [os.path.abspath(path) for path in sys.path]  # its working directory differs
        environment = os.environ | QUIET | {"PYTHONPATH": os.pathsep.join(paths)}
        with deaf():
            self.process = subprocess.Popen(
                [sys.executable, "-c", f"from {__name__} import serve_calls; serve_calls({memory or 0})"],
                cwd=self.folder, env=environment,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.stderr,
                process_group=0 if os.name == "posix" else None,
            )  # fmt: skip

    def call(self, call: bytes, shared: bytes, limit: float, wanted: Callable[[], bool] = lambda: True) -> Outcome:
        """The outcome of a pickled (function, arguments). shared: a further argument; limit: s. See `is_spent`.

        wanted: called every POLLING s; if it returns False, the process is killed.
        """
        over, began = threading.Event(), time.perf_counter()
        watch = threading.Thread(target=self.watch, args=(over, limit, wanted), daemon=True)
        watch.start()
        try:
            self.stderr.truncate(0)
            pickle.dump((call, shared), self.process.stdin)
            self.process.stdin.flush()
            return pickle.load(self.process.stdout)
        except Exception:  # the process has ended
            why = self.how_it_ended(limit)
            return Outcome(ended=why, is_late=self.late, wall=time.perf_counter() - began, machine=platform.node())
        finally:
            over.set()
            watch.join()

    def watch(self, over: threading.Event, limit: float, wanted: Callable[[], bool]) -> None:
        """Kill the process and its children if it is too slow, no longer wanted, or has ended."""
        until = time.monotonic() + limit
        while not over.wait(max(0.0, min(POLLING, until - time.monotonic()))):
            self.late = time.monotonic() >= until
            if self.late or self.process.poll() is not None or not wanted():
                return self.kill()

    @property
    def alive(self) -> bool:
        return not self.killed and self.process.poll() is None

    def is_spent(self, outcome: Outcome) -> bool:
        """Whether the next call needs a new process: this one has ended or uses too much memory."""
        is_full = bool(self.memory) and outcome.memory > REPLACED_ABOVE * self.memory
        return not self.alive or is_full or outcome.error.startswith(OUT_OF_MEMORY)

    def how_it_ended(self, limit: float) -> str:
        status = self.process.wait()
        self.kill()
        if self.late:
            return f"time limit of {limit:g} s exceeded"
        if status < 0:
            return f"killed by {name_of_signal(-status)}"
        self.stderr.seek(max(0, self.stderr.seek(0, os.SEEK_END) - 8 * MAX_LINE))
        lines = self.stderr.read().decode("utf-8", "replace").split("\n")
        last = next((" ".join(line.split()) for line in reversed(lines) if line.strip()), "")[:MAX_LINE]
        return f"exit status {status}" + (f", {last}" if last else "")

    def kill(self) -> None:
        self.killed = True
        with suppress(OSError):
            if os.name == "posix":
                os.killpg(self.process.pid, signal.SIGKILL)
            else:
                self.process.kill()

    def close(self) -> None:
        self.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.stderr):
            with suppress(OSError):
                stream.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def name_of_signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # without a name
        return f"signal {number}"


# in the process itself


def serve_calls(memory: int) -> None:
    """Read calls from stdin, write outcomes to stdout."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # a call must not read the next one
    os.dup2(2, 1)  # printed text is not an outcome
    if resource:
        for kind, limit in (("RLIMIT_DATA", memory), ("RLIMIT_FSIZE", MAX_FILE)):
            with suppress(OSError, ValueError, AttributeError):
                if limit:
                    resource.setrlimit(getattr(resource, kind), (limit, limit))
    received = queue.SimpleQueue()
    threading.Thread(target=take_calls, args=(calls, received, Path.cwd()), daemon=True).start()
    while True:
        outcome = outcome_of(*received.get(), memory)
        pickle.dump(outcome, answers)
        answers.flush()


def take_calls(calls: BinaryIO, received: queue.SimpleQueue, folder: Path) -> None:
    """Read calls until the owner has ended; then delete the folder and kill this process and its children."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            received.put(pickle.load(calls))
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        folder.parent.rmdir()  # fails unless this was the last one
    if os.name == "posix":
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


def outcome_of(call: bytes, shared: bytes, memory: int) -> Outcome:
    began, at, value, error = time.process_time(), time.perf_counter(), b"", ""
    try:
        function, arguments = pickle.loads(call)
        began, at = time.process_time(), time.perf_counter()
        value = pickle.dumps(function(*arguments, *([shared] if shared else [])))
    except MemoryError:
        error = OUT_OF_MEMORY + (f": limit {memory / 1e9:.2g} GB" if memory else "")
    except BaseException as raised:  # also SystemExit must not end the process
        error = described(raised)
    seconds, wall = time.process_time() - began, time.perf_counter() - at
    return Outcome(value, error, seconds=seconds, wall=wall, memory=max_memory(), machine=platform.node())


def max_memory() -> int:
    """Maximum memory of this process so far, bytes; 0 if unknown."""
    with suppress(OSError, ValueError, StopIteration):  # `resource` counts the parent's memory too
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024 * int(next(line for line in lines if line.startswith("VmHWM:")).split()[1])
    if not resource:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
