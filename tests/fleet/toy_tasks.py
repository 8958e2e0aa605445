"""Tasks that return, raise, crash or hang, with the outcome of each; for test_pool, test_cluster, test_fleet_command."""

import math
import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path
from typing import NamedTuple

from compare.fleet.tasks import Task, outcomes

LIMIT = 3.0  # s, of a task
MEMORY = 10**9  # bytes, limit of a task
SOON = 60.0  # s, far more than anything here takes


def noted(folder, what=""):
    """Note in a folder that a task began; the number of notes."""
    place = Path(folder)
    (place / f"{time.time_ns()}-{os.getpid()}").write_text(what)
    return len(list(place.iterdir()))


def killed(times, folder):
    """Ends by a signal, the first times."""
    if noted(folder) <= times:
        os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(60)
    return "at last"


def exits(status):
    print("\nno hope\n", file=sys.stderr, flush=True)
    os._exit(status)


def for_ever(folder):
    """Starts a process that would live long, says which they are, and never returns."""
    started = subprocess.Popen(["sleep", "600"])
    noted(folder, f"{os.getpid()} {started.pid}")
    time.sleep(600)


def prints():
    print("this is no answer")
    os.write(1, b"nor this\n")
    subprocess.run(["echo", "nor this"], check=True)
    return sys.stdin.read()


def in_time(folder, seconds):
    """Says when it began and when it ended."""
    began = time.time_ns()
    time.sleep(seconds)
    noted(folder, f"{began} {time.time_ns()}")


def waits(folder, opened, shared=b""):
    """Waits until a file is there; who waits is noted."""
    noted(folder, f"{os.getpid()} {os.getppid()}")
    soon(Path(opened).exists)
    return len(shared)


class Fault(NamedTuple):
    """A task and its outcome."""

    function: object
    arguments: tuple = ()
    value: object = None  # what it returns; None: it breaks
    words: tuple = ()  # of the reason why it breaks
    tries: int = 0  # how many times it begins, where it takes notes of that: its last argument is a folder
    shared: bytes = b""


FAULTS = {
    "for ever": Fault(for_ever, words=("3 s",), tries=1),
    "raises": Fault(math.sqrt, (-1.0,), words=("ValueError",)),
    "killed": Fault(killed, (9,), words=("SIGKILL", "4 times"), tries=4),
    "killed once": Fault(killed, (1,), "at last", tries=2),
    "exits": Fault(exits, (3,), words=("status 3", "no hope", "4 times")),
    "eats": Fault(bytearray, (4 * MEMORY,), words=("memory", "1 GB")),
    "prints": Fault(prints, value=""),
    "asked with a lock": Fault(abs, (threading.Lock(),), words=("TypeError", "lock")),
    "shares": Fault(len, value=3 * 10**7, shared=b"x" * 3 * 10**7),
}


def check_all(executor, folder):
    """Run all FAULTS and check their outcomes. folder: for the notes of the tasks."""
    tasks = []
    for name, fault in FAULTS.items():
        (folder / name).mkdir()
        arguments = (*fault.arguments, str(folder / name)) if fault.tries else fault.arguments
        tasks.append(Task(name, fault.function, arguments, shared=fault.shared))
    for (name, fault), found in zip(FAULTS.items(), outcomes(executor, tasks), strict=True):
        if fault.value is None:
            assert all(word in found.broke for word in fault.words), f"{name}: {found.broke}"
        else:
            assert (found.broke, found.returned) == ("", fault.value), name
        assert (len(list((folder / name).iterdir())), found.is_late) == (fault.tries, name == "for ever"), name
    (pids,) = notes(folder / "for ever")
    assert len(pids) == 2 and gone_soon(*pids)  # with all that it has started


def is_there(pid):
    """Whether a process lives, or a thread of it: only without any can its parent know that it ended."""
    try:
        ended = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] == "Z"
        return not ended or len(list(Path(f"/proc/{pid}/task").iterdir())) > 1
    except OSError:
        return False


def soon(question):
    """Whether something holds before long."""
    until = time.monotonic() + SOON
    while not (answer := question()) and time.monotonic() < until:
        time.sleep(0.01)
    return answer


def gone_soon(*pids):
    return soon(lambda: not any(map(is_there, pids)))


def notes(folder, count=1):
    """The notes of tasks, as soon as there are this many."""
    assert soon(lambda: sum(bool(note.read_text()) for note in Path(folder).iterdir()) >= count)
    return [note.read_text().split() for note in sorted(Path(folder).iterdir())]
