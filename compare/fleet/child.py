"""A process that carries out pieces, one after the other: an early end of it, whatever the reason, is told and not suffered.

It is a process of its own also on a worker of a cluster, for a thread of Python cannot be ended. It ends with the process that
started it.
"""

import os
import pickle
import platform
import queue
import resource
import signal
import subprocess
import sys
import tempfile
import threading
import time
from contextlib import suppress
from pathlib import Path

from ..process.crash import described
from ..process.workers import deaf
from .piece import Outcome, Piece

QUIET = {"MUJOCO_GL": "disabled", "OPENBLAS_NUM_THREADS": "1"}
SHARE = 0.9  # of the machine's memory, for all its processes together
PERMANENT = 0.5  # of its memory, above which a process is replaced by a new one: what it has compiled stays in it
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
        self.folder = Path(tempfile.mkdtemp(dir=scratch))
        self.said = (self.folder / "stderr").open("w+b")
        paths = [os.path.abspath(path) for path in sys.path]  # it works in a folder of its own
        environment = os.environ | QUIET | {"PYTHONPATH": os.pathsep.join(paths)}
        with deaf():
            self.process = subprocess.Popen(
                [sys.executable, "-m", f"{__package__}.child", str(memory or 0)], cwd=self.folder, env=environment,
                stdin=subprocess.PIPE, stdout=subprocess.PIPE, stderr=self.said,
            )  # fmt: skip

    def ask(self, piece: Piece, limit: float) -> Outcome:
        """What becomes of a piece that may take so many seconds. It is the last one if `alive` is false then."""
        timer = threading.Timer(limit, self.end_late)
        timer.daemon = True
        timer.start()
        try:
            pickle.dump(
                (piece.function, (*piece.arguments, *([piece.shared] if piece.shared else []))), self.process.stdin
            )
            self.process.stdin.flush()
            outcome = pickle.load(self.process.stdout)
        except (EOFError, OSError, pickle.UnpicklingError):
            outcome = Outcome(ended=self.how_it_ended(limit), is_late=self.late, machine=platform.node())
        except Exception as error:  # a piece that cannot be sent
            self.kill()
            outcome = Outcome(error=described(error))
        finally:
            timer.cancel()
        return outcome

    @property
    def alive(self) -> bool:
        return self.process.poll() is None

    def is_full(self, outcome: Outcome) -> bool:
        """Whether what it has compiled takes too much of its memory."""
        return bool(self.memory) and outcome.memory > PERMANENT * self.memory

    def end_late(self) -> None:
        self.late = True
        self.kill()

    def how_it_ended(self, limit: float) -> str:
        """In a sentence, how a process ended that should not have."""
        status = self.process.wait()
        if self.late:
            return f"took longer than {limit:g} s"
        if status < 0:
            return f"ended by {signal.Signals(-status).name}"
        self.said.seek(0)
        lines = self.said.read().decode("utf-8", "replace").split("\n")
        last = next((" ".join(line.split()) for line in reversed(lines) if line.strip()), "")[:LONGEST_LINE]
        return f"ended with status {status}" + (f", {last}" if last else "")

    def kill(self) -> None:
        """End it, and what it has started."""
        for number in descendants(self.process.pid):
            with suppress(ProcessLookupError, PermissionError):
                os.kill(number, signal.SIGKILL)
        with suppress(OSError):
            self.process.kill()

    def close(self) -> None:
        self.kill()
        self.process.wait()
        for stream in (self.process.stdin, self.process.stdout, self.said):
            with suppress(OSError):
                stream.close()


def descendants(pid: int) -> list[int]:
    """Children, their children, ...; none where there is no /proc."""
    parents = {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        with suppress(OSError, ValueError):  # it has ended meanwhile
            parents[int(stat.parent.name)] = int(stat.read_text().rpartition(")")[2].split()[1])
    found = [pid]
    for parent in found:
        found += [child for child, of in parents.items() if of == parent]
    return found[1:]


# in the process itself


def serve(memory: int) -> None:
    """Carry out what comes in on stdin; what becomes of it goes out on stdout."""
    calls, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what is printed is no answer
    if memory:
        with suppress(OSError, ValueError, AttributeError):
            resource.setrlimit(resource.RLIMIT_DATA, (memory, memory))
    came = queue.SimpleQueue()
    threading.Thread(target=take_calls, args=(calls, came), daemon=True).start()
    while True:
        outcome = carried_out(*came.get(), memory)
        pickle.dump(outcome, answers)
        answers.flush()


def take_calls(calls, came) -> None:
    """Read calls, and end when there is nobody any more who could send one."""
    while True:
        try:
            came.put((pickle.load(calls), None))
        except EOFError:
            os._exit(0)
        except Exception as error:  # a function that is not there
            came.put((None, described(error)))


def carried_out(call, error, memory) -> Outcome:
    """What becomes of a call; error: why it could not be read."""
    began, at, value = time.process_time(), time.perf_counter(), b""
    try:
        if call:
            function, arguments = call
            value, error = pickle.dumps(function(*arguments)), ""
    except MemoryError:
        error = (
            f"out of memory: more than the {memory / 1e9:.2g} GB that a piece may have" if memory else "out of memory"
        )
    except Exception as raised:
        error = described(raised)
    most = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * (1 if sys.platform == "darwin" else 1024)
    seconds, wall = time.process_time() - began, time.perf_counter() - at
    return Outcome(value, error or "", seconds=seconds, wall=wall, memory=most, machine=platform.node())


if __name__ == "__main__":
    serve(int(sys.argv[1]))
