"""Ctrl-C, SIGTERM and SIGHUP end a run with status 2 within a second.

A Python signal handler waits until C code returns, for seconds in a compilation or a run in MuJoCo. So the signals are blocked,
in worker processes too, and a thread waits for them; where signals cannot be blocked (Windows), a handler has to do. Only
`python -m compare` uses this.
"""

import os
import signal
import threading
from contextlib import suppress
from multiprocessing import resource_tracker

CAN_BLOCK = hasattr(signal, "pthread_sigmask")
undo = []  # functions to call before the process ends, last first
turn = threading.RLock()  # held while a thread decides how the run ends


class Now:
    settled = False  # the exit status is decided
    line = "interrupted; the earlier report is unchanged"


def listen() -> None:
    """From now on an interrupt ends the process. Ignored signals (nohup, background of a script) stay ignored."""
    numbers = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]
    numbers = [number for number in numbers if signal.getsignal(number) is not signal.SIG_IGN]
    if not CAN_BLOCK:
        for number in numbers:  # a thread: the main one may be in a block that postpones interrupts
            signal.signal(number, lambda *_: threading.Thread(target=end, daemon=True).start())
    elif numbers:
        before = signal.signal(signal.SIGHUP, signal.SIG_IGN)  # the tracker inherits this: it ends after the run
        resource_tracker.ensure_running()  # unblocks signals where it starts
        signal.signal(signal.SIGHUP, before)
        signal.pthread_sigmask(signal.SIG_BLOCK, numbers)
        threading.Thread(target=end_when_asked, args=(numbers,), daemon=True).start()


def postponed() -> threading.RLock:
    """For `with`: an interrupt in the block takes effect at its end."""
    return turn


def settle() -> None:
    """From now on an interrupt does not change the exit status."""
    with turn:
        Now.settled = True


def end_when_asked(numbers: list[int]) -> None:
    signal.sigwait(numbers)
    end()


def end() -> None:
    with turn:
        if not Now.settled:
            clear_up()
            with suppress(OSError):
                os.write(2, ("\r" * os.isatty(2) + Now.line + "\n").encode())  # overwrites ^C on a terminal
            os._exit(2)


def clear_up() -> None:
    for act in reversed(undo):
        with suppress(Exception):
            act()
