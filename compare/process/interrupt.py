"""Ctrl-C, SIGTERM and SIGHUP end a run with status 2, whatever it is doing.

Python hears a signal in the main thread, between two of its own instructions: not in a compilation or in a run
of MuJoCo. So `python -m compare` runs in a second thread, while the main one waits.
"""

import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import ExitStack, contextmanager, nullcontext, suppress
from multiprocessing import parent_process, resource_tracker
from multiprocessing.connection import Connection

from .streams import Stream, say_error

POLL = 0.1  # s
PATIENCE = 10.0  # s in a user's own function after which a log names it; a terminal shows it sooner
at_end = ExitStack()  # what ends and clears up a run; last first


class Now:
    lock = threading.RLock()
    is_listening = False  # an interrupt raises no KeyboardInterrupt in the run
    is_interrupted = False
    is_settled = False  # an interrupt is too late
    outcome = "nothing was written"
    waits: tuple[str, float] | None = None  # a user's own function that is running, and since when
    parent: Connection | None = None


def listen() -> None:
    """From now on the main thread has a KeyboardInterrupt. Ignored signals (nohup, background) stay ignored."""
    for name in ("SIGINT", "SIGTERM", "SIGHUP"):
        number = getattr(signal, name, None)
        if number and signal.getsignal(number) is not signal.SIG_IGN:
            signal.signal(number, signal.default_int_handler)
    Now.is_listening = True


def shield(is_on: bool = True) -> None:
    """Whether this thread, and what it starts, is deaf to what a terminal sends to all processes of a run."""
    if hasattr(signal, "pthread_sigmask"):
        resource_tracker.ensure_running()  # unblocks signals where it starts
        how = signal.SIG_BLOCK if is_on else signal.SIG_UNBLOCK
        signal.pthread_sigmask(how, (signal.SIGINT, signal.SIGHUP))


def answered(run: Callable[[], int]) -> int:
    """The exit status of a run; 2 after an interrupt."""
    status: Future[int] = Future()

    def carry_out() -> None:
        shield()
        try:
            status.set_result(run())
        except BaseException as error:
            status.set_exception(error)

    told = ""
    try:
        threading.Thread(target=carry_out, daemon=True).start()
        while not wait([status], POLL).done:
            name, seconds = waited_for()
            if seconds > PATIENCE and name != told and not os.isatty(2):
                say_error(f"waiting for {name}, {seconds:.0f} s")
                told = name
    except KeyboardInterrupt:
        with Now.lock:
            Now.is_interrupted = not Now.is_settled
    return end() if Now.is_interrupted else status.result()


def end() -> int:
    """Clear up after an interrupt; a further one cuts that off. The exit status."""
    name, seconds = waited_for()
    where = f" while waiting for {name}, {seconds:.0f} s" if name else ""
    tell("ending")
    Stream.silent = True  # the thread of the run goes on
    with suppress(BaseException):
        at_end.close()
    with suppress(BaseException):
        overwritten = "\r" * os.isatty(2)  # ^C
        os.write(2, f"{overwritten}interrupted{where}; {Now.outcome}\n".encode())
    return 2


def waited_for() -> tuple[str, float]:
    """A user's own function that is running, and for how long, s."""
    waits = Now.waits
    return (waits[0], time.monotonic() - waits[1]) if waits else ("", 0.0)


@contextmanager
def ends_with(stack: ExitStack) -> Iterator[None]:
    """Close a stack after this block, or after an interrupt."""
    at_end.callback(stack.close)
    with stack:
        try:
            yield
        finally:
            stay()


@contextmanager
def undivided() -> Iterator[None]:
    """A block that an interrupt waits for."""
    with nullcontext() if Now.is_interrupted else Now.lock:
        stay()
        yield


def stay() -> None:
    """Go no further after an interrupt, except in the main thread, which ends the run."""
    if Now.is_interrupted and threading.current_thread() is not threading.main_thread():
        threading.Event().wait()


def settle() -> None:
    """From now on an interrupt does not change the exit status."""
    with undivided():
        Now.is_settled = True


def tell(kind: str, what: object = None) -> None:
    """Tell the process that waits for this one; see `apart`."""
    if Now.parent:
        with suppress(OSError):
            Now.parent.send((kind, what))


def on_interrupt(outcome: str) -> None:
    """What an interrupt will say of the results."""
    Now.outcome = outcome
    tell("outcome", outcome)


def is_interrupt(error: BaseException) -> bool:
    """Whether an exception is Ctrl-C; else a user's own code raised it."""
    return isinstance(error, KeyboardInterrupt) and not Now.is_listening


def end_with_parent(act: Callable[[], object] | None = None) -> None:
    """From now on this process ends when its parent has, after a last act."""

    def watch() -> None:
        parent = parent_process()
        if parent:
            parent.join()
        if act:
            act()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def leave(status: int) -> None:
    """End this process at once; what comes after main could end with another status."""
    for stream in (sys.stdout, sys.stderr):
        Stream(stream).flush()
    os._exit(status)
