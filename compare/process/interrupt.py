"""Ctrl-C, SIGTERM and SIGHUP end a run with status 2 within a second.

A Python signal handler waits until C code returns, for seconds in a compilation or a run in MuJoCo. So the wakeup fd of the
signal module is a socket, and a thread that reads from it ends the process. Only `python -m compare` uses this.
"""

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

NUMBERS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]

undo = []  # functions to call before an interrupt ends the process, last first
turn = threading.RLock()  # held while a thread decides how the run ends


class Now:
    requested = False  # an interrupt has come
    held = 0  # number of `postponed` blocks of the main thread
    settled = False  # the exit status is decided
    line = "interrupted; the earlier report is unchanged"


def listen() -> None:
    """From now on an interrupt ends the process. Ignored signals (nohup, background of a script) stay ignored."""
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    signal.set_wakeup_fd(sender.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=end_when_asked, args=(receiver, sender), daemon=True).start()
    for number in NUMBERS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stay)


@contextmanager
def postponed() -> Iterator[None]:
    """An interrupt in this block takes effect at its end."""
    Now.held += 1
    try:
        with turn:
            yield
    finally:
        Now.held -= 1
        if Now.requested:
            stay()


def settle() -> None:
    """From now on an interrupt does not change the exit status."""
    with postponed():
        Now.settled = True


def stay(*_) -> None:
    """Suspend the main thread while the other thread ends the process."""
    Now.requested = True
    while not (Now.held or Now.settled):
        time.sleep(1)


def end_when_asked(receiver, _sender) -> None:
    while True:
        number = receiver.recv(1)[0]
        with turn:
            if number in NUMBERS and not Now.settled:
                end()


def end() -> None:
    """End the process, whatever the main thread does."""
    for act in reversed(undo):
        with suppress(Exception):
            act()
    with suppress(OSError):
        os.write(2, ("\r" * os.isatty(2) + Now.line + "\n").encode())  # overwrites ^C on a terminal
    os._exit(2)
