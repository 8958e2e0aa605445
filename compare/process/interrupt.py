"""Ctrl-C, SIGTERM and SIGHUP end a run with status 2 within a second, whatever it is doing.

A handler in Python waits until C code returns, which a compilation or a run in MuJoCo does after seconds. So the part of it that
is in C writes a byte to a socket, and a thread that waits for it ends the process. Only `python -m compare` asks for that.
"""

import os
import signal
import socket
import threading
import time
from collections.abc import Iterator
from contextlib import contextmanager, suppress

NUMBERS = [getattr(signal, name) for name in ("SIGINT", "SIGTERM", "SIGHUP") if hasattr(signal, name)]

undo = []  # what is to be done before an early end, the last first: each a function without arguments
turn = threading.RLock()  # who has it decides how the run ends


class Now:
    """How far the run is."""

    asked = False  # an interrupt has come
    held = 0  # the main thread is in so many blocks of `held`
    settled = False  # how the run ends is decided
    line = "interrupted; a report that was there is unchanged"


def listen() -> None:
    """From now on an interrupt ends the process. What is ignored (behind nohup, in a script's background) stays so."""
    receiver, sender = socket.socketpair()
    sender.setblocking(False)
    signal.set_wakeup_fd(sender.fileno(), warn_on_full_buffer=False)
    threading.Thread(target=end_when_asked, args=(receiver, sender), daemon=True).start()
    for number in NUMBERS:
        if signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, stay)


@contextmanager
def postponed() -> Iterator[None]:
    """An interrupt that comes in this block is answered at its end."""
    Now.held += 1
    try:
        with turn:
            yield
    finally:
        Now.held -= 1
        if Now.asked:
            stay()


def settle() -> None:
    """How the run ends is decided: an interrupt no longer changes it."""
    with postponed():
        Now.settled = True


def stay(*_) -> None:
    """The main thread's part of an interrupt: to do nothing more, and not to be in the other thread's way."""
    Now.asked = True
    while not (Now.held or Now.settled):
        time.sleep(1)


def end_when_asked(receiver, _sender) -> None:
    """The other thread's part: to wait, and to end the process."""
    while True:
        number = receiver.recv(1)[0]
        with turn:
            if number in NUMBERS and not Now.settled:
                end()


def end() -> None:
    """End the process without another look at the main thread."""
    for act in reversed(undo):
        with suppress(Exception):
            act()
    with suppress(OSError):
        os.write(2, ("\r" * os.isatty(2) + Now.line + "\n").encode())  # over what a terminal shows of Ctrl-C
    os._exit(2)
