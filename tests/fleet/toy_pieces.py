"""Pieces that do what a piece can do, in a module that any process can import; for test_pool.py and test_cluster.py."""

import os
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from compare.fleet.piece import Outcome


def twice(x):
    return 2 * x


def length(*arguments):
    return len(arguments[-1])


def raises(text):
    return Outcome(error=text).returned  # an error of this project


def noted(folder, what=""):
    """A mark in a folder that a piece began; how many there are."""
    place = Path(folder)
    (place / f"{time.time_ns()}-{os.getpid()}").write_text(what)
    return len(list(place.iterdir()))


def killed(number, times, folder):
    """Ends by a signal, the first times."""
    if noted(folder) <= times:
        os.kill(os.getpid(), number)
        time.sleep(60)
    return "at last"


def exits(status):
    print("\nno hope\n", file=sys.stderr, flush=True)
    os._exit(status)


def leaves():
    sys.exit(3)


def for_ever(folder):
    """Starts a process that would live long, says which they are, and never returns."""
    started = subprocess.Popen(["sleep", "600"])
    noted(folder, f"{os.getpid()} {started.pid}")
    time.sleep(600)


def eats(size):
    return len(bytearray(size))


def prints():
    print("this is no answer")
    os.write(1, b"nor this\n")
    subprocess.run(["echo", "nor this"], check=True)
    return sys.stdin.read()


def unsendable():
    return threading.Lock()


def in_time(folder, seconds):
    """Says when it began and when it ended."""
    began = time.time_ns()
    time.sleep(seconds)
    noted(folder, f"{began} {time.time_ns()}")


def own_process():
    return os.getpid()


def takes_worker_down(folder):
    """Ends the process that started its own, a worker of a cluster."""
    noted(folder)
    os.kill(os.getppid(), signal.SIGKILL)
    time.sleep(60)


def waits(folder, opened, shared=b""):
    """Waits until a file is there; who waits is noted."""
    noted(folder, f"{os.getpid()} {os.getppid()}")
    while not Path(opened).exists():
        time.sleep(0.02)
    return len(shared)
