"""Calls that return, raise, crash or hang; for test_executors."""

import multiprocessing
import os
import signal
import time
from pathlib import Path

LIMIT = 5.0  # s, of a call
SOON = 60.0  # s, far more than anything here takes


def waits(folder, opened):
    (Path(folder) / f"{time.time_ns()}").write_text("")
    soon(Path(opened).exists)
    return 4


def is_killed(counted, times):
    """4, after its process was killed several times. counted: a folder with a file for each call."""
    (Path(counted) / f"{time.time_ns()}").write_text("")
    if len(os.listdir(counted)) <= times:
        signal.raise_signal(signal.SIGKILL)
    return 4


def kills_its_worker():
    os.kill(multiprocessing.parent_process().pid, signal.SIGKILL)


def soon(question):
    until = time.monotonic() + SOON
    while not (answer := question()) and time.monotonic() < until:
        time.sleep(0.01)
    return answer


# function, arguments, its value, words of the reason why there is none
FAULTS = {
    "hangs": (time.sleep, (600,), None, "5 s"), "raises": (divmod, (1, 0), None, "ZeroDivisionError"),
    "exits": (os._exit, (3,), None, "status 3"), "crashes": (os.abort, (), None, "SIGABRT"), "returns": (abs, (-4,), 4, ""),
    "reads elsewhere": (signal.raise_signal, (signal.SIGSEGV,), None, "SIGSEGV"),
    "eats": (bytearray, (4 * 10**12,), None, "out of memory"), "prints": (print, ("no answer",), None, ""),
}  # fmt: skip


def check_all(executor):
    futures = {name: executor.submit(function, *given) for name, (function, given, *_) in FAULTS.items()}
    for name, future in futures.items():
        future.exception()  # wait
        value, why = executor.outcome(future)
        *_, expected, words = FAULTS[name]
        assert value == expected and words in why and bool(words) == bool(why), f"{name}: {why}"
