"""Ctrl-C, SIGTERM and SIGHUP end a run with status 2 within a second.

A Python signal handler waits until C code returns, for seconds in a compilation or a run in MuJoCo. So signals
are blocked, in workers too, and a thread waits for them; where they cannot be (Windows), a handler has to do.
Only `python -m compare` uses this.
"""

import os
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from multiprocessing import resource_tracker
from typing import NoReturn

from ..core.errors import how_ended

undo: list[Callable[[], object]] = []  # functions to call before the process ends, last first
postponed = threading.RLock()  # held while an interrupt has to wait, and while the run ends
PARENT = int(os.environ.pop("COMPARE_PARENT", 0))  # the process that waits for this one, see status_of_child
FINISHED = 200  # added to the exit status of such a child: no status that a user's own code ends with


class Now:
    listening = False  # an interrupt raises no KeyboardInterrupt
    settled = False  # the exit status is decided
    line = "interrupted; an earlier report is unchanged"


def listen() -> None:
    """From now on an interrupt ends the process. Ignored signals (nohup, background) stay ignored."""
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    numbers = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    Now.listening = True
    if PARENT:
        threading.Thread(target=end_with_parent, daemon=True).start()
    if not hasattr(signal, "pthread_sigmask"):
        for number in numbers:  # a thread: the main one may be in a block that postpones interrupts
            signal.signal(number, lambda *_: threading.Thread(target=end, daemon=True).start())
    elif numbers:
        # the tracker inherits this: it outlives the run
        before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
        resource_tracker.ensure_running()  # unblocks signals where it starts
        signal.signal(signal.SIGHUP, before)
        signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
        threading.Thread(target=end_when_asked, args=(numbers,), daemon=True).start()


def settle() -> None:
    """From now on an interrupt does not change the exit status."""
    with postponed:
        Now.settled = True


def end_when_asked(numbers: list[int]) -> None:
    signal.sigwait(numbers)
    end()


def end() -> None:
    with postponed:
        if not Now.settled:
            clear_up()
            with suppress(OSError):
                os.write(2, ("\r" * os.isatty(2) + Now.line + "\n").encode())  # overwrites ^C on a terminal
            leave(2)


def is_interrupt(error: BaseException) -> bool:
    """Whether an exception is Ctrl-C; else a user's own code raised it."""
    return isinstance(error, KeyboardInterrupt) and not Now.listening


def end_with_parent() -> None:
    while os.getppid() == PARENT:
        time.sleep(0.5)
    end()


def leave(status: int) -> NoReturn:
    """End this process at once; what comes after main could end with another status."""
    os._exit(status + FINISHED * bool(PARENT))


def status_of_child() -> tuple[int, str]:
    """Run this command line in a child process, where a user's own code may end the process without a word.

    The exit status and "", or 2 and how the child ended if not by `leave`. The child answers an interrupt.
    """
    environment = os.environ | {"COMPARE_PARENT": str(os.getpid())}
    child = subprocess.Popen([sys.executable, *sys.orig_argv[1:]], env=environment)
    undo.extend([lambda: leave(2), child.wait, child.terminate])
    code = child.wait()
    return (code - FINISHED, "") if code >= FINISHED else (2, how_ended(code))


def clear_up() -> None:
    for act in reversed(undo):
        with suppress(Exception):
            act()
