"""A process that carries out pieces, one after the other: an early end of it, whatever the reason, is told and not suffered.

It is a process of its own also on a worker of a cluster, for a thread of Python cannot be ended. It ends with the process that
started it.
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
from typing import BinaryIO

from ..process.crash import described
from ..process.workers import deaf
from .piece import Outcome

try:
    import resource
except ImportError:  # Windows: a piece may have what the machine has
    resource = None

QUIET = {"MUJOCO_GL": "disabled", "OPENBLAS_NUM_THREADS": "1"}
SHARE = 0.9  # of the machine's memory, for all its processes together
PERMANENT = 0.5  # of its memory, above which a process is replaced by a new one: what it has compiled stays in it
LARGEST_FILE = 2**30  # bytes, of a file that a piece writes, what it says on stderr among them
OUT_OF_MEMORY = "out of memory"
LOOK = 0.5  # s after which it is looked whether a piece is still wanted
LONGEST_LINE = 200  # characters of what a process wrote last


def memory_of_machine() -> int | None:
    """Bytes that the machine has, or its container; None where that cannot be known."""
    found = []
    with suppress(OSError, ValueError, AttributeError):
        found.append(os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES"))
    for file in ("/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"):
        with suppress(OSError, ValueError):
            found.append(int(Path(file).read_text(encoding="ascii")))
    return min(found, default=None)


class Child:
    """The process as its owner sees it. scratch: a folder for what it leaves; memory: bytes that it may have."""

    def __init__(self, scratch: Path, memory: int | None):
        self.memory, self.late, self.killed = memory, False, False
        self.folder = Path(tempfile.mkdtemp(prefix="piece-", dir=scratch))
        self.said = (self.folder / "stderr").open("a+b")
        paths = [os.path.abspath(path) for path in sys.path]  # it works in a folder of its own
        environment = os.environ | QUIET | {"PYTHONPATH": os.pathsep.join(paths)}
        with deaf():
            self.process = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.child", str(memory or 0)], cwd=self.folder, env=environment,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.said,
                process_group=0 if os.name == "posix" else None,
            )  # fmt: skip

    def ask(self, call: bytes, shared: bytes, limit: float, wanted: Callable[[], bool] = lambda: True) -> Outcome:
        """What becomes of a call, see Piece.call, that may take so many seconds. It is the last one if `alive` is false then.

        wanted: asked now and then whether anybody waits for it still; if not, the process is ended.
        """
        over, began = threading.Event(), time.perf_counter()
        watch = threading.Thread(target=self.watch, args=(over, limit, wanted), daemon=True)
        watch.start()
        try:
            self.said.truncate(0)
            pickle.dump((call, shared), self.process.stdin)
            self.process.stdin.flush()
            return pickle.load(self.process.stdout)
        except Exception:  # nobody is there, or no longer
            why = self.how_it_ended(limit)
            return Outcome(ended=why, is_late=self.late, wall=time.perf_counter() - began, machine=platform.node())
        finally:
            over.set()
            watch.join()

    def watch(self, over: threading.Event, limit: float, wanted: Callable[[], bool]) -> None:
        """End the process if it takes too long, if nobody waits for it, or if only what it has started is left of it."""
        until = time.monotonic() + limit
        while not over.wait(max(0.0, min(LOOK, until - time.monotonic()))):
            self.late = time.monotonic() >= until
            if self.late or self.process.poll() is not None or not wanted():
                return self.kill()

    @property
    def alive(self) -> bool:
        return not self.killed and self.process.poll() is None

    def is_spent(self, outcome: Outcome) -> bool:
        """Whether the next piece needs another process: it has ended, or what it has compiled takes too much memory."""
        is_full = bool(self.memory) and outcome.memory > PERMANENT * self.memory
        return not self.alive or is_full or outcome.error.startswith(OUT_OF_MEMORY)

    def how_it_ended(self, limit: float) -> str:
        """In a sentence, how a process ended that should not have."""
        status = self.process.wait()
        self.kill()
        if self.late:
            return f"took longer than {limit:g} s"
        if status < 0:
            return f"ended by {name_of_signal(-status)}"
        self.said.seek(max(0, self.said.seek(0, os.SEEK_END) - 8 * LONGEST_LINE))
        lines = self.said.read().decode("utf-8", "replace").split("\n")
        last = next((" ".join(line.split()) for line in reversed(lines) if line.strip()), "")[:LONGEST_LINE]
        return f"ended with status {status}" + (f", {last}" if last else "")

    def kill(self) -> None:
        """End it, and what it has started."""
        self.killed = True
        with suppress(OSError):
            if os.name == "posix":
                os.killpg(self.process.pid, signal.SIGKILL)
            else:
                self.process.kill()

    def close(self) -> None:
        self.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.said):
            with suppress(OSError):
                stream.close()
        shutil.rmtree(self.folder, ignore_errors=True)


def name_of_signal(number: int) -> str:
    try:
        return signal.Signals(number).name
    except ValueError:  # one without a name
        return f"signal {number}"


# in the process itself


def carry_out_calls(memory: int) -> None:
    """Carry out what comes in on stdin; what becomes of it goes out on stdout."""
    calls, answers = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_RDONLY), 0)  # nor does a piece read the calls of others
    os.dup2(2, 1)  # what is printed is no answer
    if resource:
        for what, most in (("RLIMIT_DATA", memory), ("RLIMIT_FSIZE", LARGEST_FILE)):
            with suppress(OSError, ValueError, AttributeError):
                if most:
                    resource.setrlimit(getattr(resource, what), (most, most))
    came = queue.SimpleQueue()
    threading.Thread(target=take_calls, args=(calls, came, Path.cwd()), daemon=True).start()
    while True:
        outcome = carried_out(*came.get(), memory)
        pickle.dump(outcome, answers)
        answers.flush()


def take_calls(calls: BinaryIO, came: queue.SimpleQueue, folder: Path) -> None:
    """Read calls; when there is nobody any more who could send one, end with all that was started, and leave nothing."""
    with suppress(EOFError, OSError, pickle.UnpicklingError):
        while True:
            came.put(pickle.load(calls))
    shutil.rmtree(folder, ignore_errors=True)
    with suppress(OSError):
        folder.parent.rmdir()  # if this was the last one
    if os.name == "posix":
        os.killpg(0, signal.SIGKILL)
    os._exit(0)


def carried_out(call: bytes, shared: bytes, memory: int) -> Outcome:
    """What becomes of a call."""
    began, at, value, error = time.process_time(), time.perf_counter(), b"", ""
    try:
        function, arguments = pickle.loads(call)
        began, at = time.process_time(), time.perf_counter()
        value = pickle.dumps(function(*arguments, *([shared] if shared else [])))
    except MemoryError:
        error = OUT_OF_MEMORY + (f": more than the {memory / 1e9:.2g} GB that a piece may have" if memory else "")
    except BaseException as raised:  # it must not end the process either
        error = described(raised)
    seconds, wall = time.process_time() - began, time.perf_counter() - at
    return Outcome(value, error, seconds=seconds, wall=wall, memory=most_memory(), machine=platform.node())


def most_memory() -> int:
    """Bytes, the most that this process ever had; 0 where that cannot be known."""
    with suppress(OSError, ValueError, StopIteration):  # to `resource`, what its parent had is its own
        lines = Path("/proc/self/status").read_text(encoding="ascii").splitlines()
        return 1024 * int(next(line for line in lines if line.startswith("VmHWM:")).split()[1])
    if not resource:
        return 0
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)


if __name__ == "__main__":
    carry_out_calls(int(sys.argv[1]))
