"""Calls that return, raise, crash or hang; for test_executors."""

import os
import signal
import time
from pathlib import Path

MEMORY, LIMIT = 10**9, 5.0  # bytes, s: limits of a call
SOON = 60.0  # s, far more than anything here takes


def killed(times, folder):
    """Ends by a signal, the first times."""
    (Path(folder) / f"{time.time_ns()}").write_text("")
    if len(list(Path(folder).iterdir())) <= times:
        os.kill(os.getpid(), signal.SIGKILL)
        time.sleep(60)
    return "at last"


def waits(folder, opened):
    """Waits until a file is there."""
    (Path(folder) / f"{time.time_ns()}").write_text("")
    soon(Path(opened).exists)
    return 4


def soon(question):
    """Whether something holds before long."""
    until = time.monotonic() + SOON
    while not (answer := question()) and time.monotonic() < until:
        time.sleep(0.01)
    return answer


# function, arguments, its value, words of the reason why there is none
FAULTS = {
    "hangs": (time.sleep, (600,), None, "5 s"),
    "raises": (divmod, (1, 0), None, "ZeroDivisionError"),
    "exits": (os._exit, (3,), None, "status 3, 4 times"),
    "crashes": (os.abort, (), None, "SIGABRT"),
    "eats": (bytearray, (4 * 10**12,), None, "out of memory"),
    "prints": (print, ("no answer",), None, ""),
    "returns": (abs, (-4,), 4, ""),
}


def check_all(executor, folder):
    """Make all calls and check their outcomes."""
    for times in (1, 9):
        (folder / f"{times}").mkdir()
    calls = FAULTS | {
        "killed once": (killed, (1, str(folder / "1")), "at last", ""),
        "killed": (killed, (9, str(folder / "9")), None, "SIGKILL, 4 times"),
    }
    futures = {name: executor.submit(function, *given) for name, (function, given, *_) in calls.items()}
    for name, future in futures.items():
        future.exception()  # wait
        value, why = executor.outcome(future)
        assert value == calls[name][2] and calls[name][3] in why and bool(calls[name][3]) == bool(why), f"{name}: {why}"
    assert [len(list((folder / name).iterdir())) for name in "19"] == [2, 4]
